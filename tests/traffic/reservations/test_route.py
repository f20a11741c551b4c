"""Route progress: each move on named cases, and invariants of all moves."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.messages.traffic import Claim
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.reservations.route import ALONE, BESIDE, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from tests.traffic.maps import Drawn

CLAIM = Claim(9, 4, 70)


def progress(held: tuple[int, ...], steps: tuple[int, ...], *route: int, following: bool = False) -> RouteProgress:
    return RouteProgress(Reservations(held, (CLAIM,), 5), steps, route, following)


PLAN = progress((1, 2, 3), (4, 5, 6), 8, 9, following=True)
MINE = progress((1, 2, 3), (ALONE,) * 3, 8, 9)
WIDE = progress((7, 1, 2), (BESIDE, ALONE, ALONE), 8)


def test_where_it_is_on_its_way() -> None:
    assert (PLAN.head, PLAN.steps_left_behind, PLAN.next_step) == (3, 4, 7)
    assert (MINE.head, MINE.steps_left_behind) == (3, 0)
    assert WIDE.steps_left_behind == 0
    assert [way.way_cell_count for way in (PLAN, MINE, WIDE)] == [3, 3, 2]
    assert [PLAN.body_index(body) for body in (1, 2, 3, 99)] == [0, 1, 2, 0]
    assert progress((1, 2, 1), (ALONE,) * 3).body_index(1) == 2, "the latest"
    assert [WIDE.has_strayed(body) for body in (7, 1, 2)] == [True, False, False]
    assert WIDE.has_strayed(99), "taken to be in the first of the cells held"
    assert not PLAN.has_strayed(99)


def test_at_first_there_is_no_way() -> None:
    first = RouteProgress(Reservations((1,)), (ALONE,))
    assert (first.route, first.following, first.sought) == ((), False, False)
    assert progress((7,), (BESIDE,)).steps_left_behind == 0


def test_it_takes_up_a_plan_at_its_head() -> None:
    taken = WIDE.on_joint_way((2, 5, 6))
    assert (taken.steps, taken.route, taken.following) == ((BESIDE, ALONE, 0), (5, 6), True)
    assert PLAN.on_joint_way((3, 5)).steps == (ALONE, ALONE, 0), "steps of the plan before mean nothing now"
    assert taken.reservations == WIDE.reservations


def test_it_goes_its_own_way() -> None:
    alone = PLAN.on_own_way((5,))
    assert (alone.steps, alone.route, alone.following) == ((ALONE,) * 3, (5,), False)
    assert WIDE.on_own_way(()).steps == (BESIDE, ALONE, ALONE)


def test_it_grows_by_the_first_cell_of_its_route() -> None:
    grown = PLAN.advance_head(PLAN.reservations.keep_only((1, 2, 3, 8)))
    assert (grown.reservations.held, grown.steps, grown.route) == ((1, 2, 3, 8), (4, 5, 6, 7), (9,))
    assert MINE.advance_head(MINE.reservations.keep_only((1, 2, 3, 8))).steps == (ALONE,) * 4


def test_what_the_body_is_in_is_held_beside_the_way() -> None:
    wide = MINE.hold_beside((3, 9, 8))
    assert (wide.reservations.held, wide.steps) == ((8, 9, 1, 2, 3), (BESIDE, BESIDE, ALONE, ALONE, ALONE))
    assert wide.reservations.claims == MINE.reservations.claims
    assert MINE.hold_beside((1, 3)) is MINE


# fmt: off
STALE = {  # cells claimed, route: cells still claimed
    "all fit":                     ((8, 9), (8, 9, 6), (8, 9)),
    "the second does not":         ((8, 6), (8, 9),    (8,)),
    "not even the first":          ((6, 9), (8, 9),    ()),
    "the right ones, out of turn": ((9, 8), (8, 9),    ()),
    "more than the route":         ((8, 9), (8,),      (8,)),
    "no route":                    ((8,),   (),        ()),
    "none":                        ((),     (8,),      ()),
}
# fmt: on


@pytest.mark.parametrize("name", STALE)
def test_claims_stand_as_far_as_they_are_the_next_cells_of_the_route(name: str) -> None:
    claimed, route, still = STALE[name]
    claims = tuple(Claim(cell, number, 70) for number, cell in enumerate(claimed))
    before = RouteProgress(Reservations((1,), claims, 5), (ALONE,), route)
    after = before.without_stale_claims()
    assert tuple(claim.cell for claim in after.reservations.claims) == still
    assert (after.route, after.reservations.number) == (route, 5)


def test_no_claim_is_left_when_all_are_withdrawn() -> None:
    beside = Claim(6, 3, 60)
    both = PLAN._replace(reservations=PLAN.reservations._replace(beside=(beside,)))
    assert both.without_claims() == PLAN._replace(reservations=Reservations((1, 2, 3), (), 5))
    assert WIDE.without_claims().without_claims().reservations.all_claims == ()


def test_room_that_was_granted_is_held_beside_the_way_as_long_as_it_is_asked_for() -> None:
    beside = Claim(6, 3, 60)
    asked = MINE._replace(reservations=MINE.reservations._replace(beside=(beside,)))
    wide = asked.with_room(beside)
    assert (wide.reservations, wide.steps) == (Reservations((6, 1, 2, 3), (CLAIM,), 5), (BESIDE, *MINE.steps))
    assert wide.release_behind({2}, 2, room=(6,)).reservations.held == (6, 2, 3)
    assert wide.release_behind({2}, 2, room=(1,)).reservations.held == (2, 3), (
        "only cells beside the way are kept as room"
    )
    assert wide.release_behind({2}, 2).reservations.held == (2, 3)
    past = wide.release_behind({1}, 3, docking=(9,))
    assert (past.reservations.held, past.steps[0]) == ((1, 3), BESIDE), "no held way leads on from 1"
    docking = wide.release_behind({2}, 2, docking=(1,))
    assert (docking.reservations.held, docking.steps) == ((1, 2, 3), (BESIDE, *wide.steps[-2:])), (
        "at its place it needs 1"
    )


def test_a_cell_is_beside_the_way_if_it_is_next_to_a_held_cell_of_it() -> None:
    floor = Drawn("abc", "def")
    a, b, c, d, e, f = floor.at("abcdef")
    wide = progress((f, a), (BESIDE, ALONE))
    beside = {cell: wide.is_beside(cell, floor.cells) for cell in (a, b, c, d, e, f, OUTSIDE)}
    assert beside == {a: False, b: True, c: False, d: True, e: False, f: False, OUTSIDE: False}


def test_only_a_way_that_a_search_found_counts_as_sought() -> None:
    alone = PLAN.on_own_way(())
    assert (PLAN.sought, alone.sought, alone.on_joint_way((3, 5)).sought, alone.without_way().sought) == (
        False,
        True,
        False,
        False,
    )
    nowhere = PLAN.without_way()
    assert (nowhere.steps, nowhere.route, nowhere.following) == ((ALONE,) * 3, (), False)


# fmt: off
RELEASES: dict[str, tuple[tuple[int, ...], set[int], int, tuple[int, ...]]] = {  # held, touched, body: still held
    "nothing lies behind":                    ((1, 2, 3),    {1},       1,  (1, 2, 3)),
    "the body left one":                      ((1, 2, 3),    {2},       2,  (2, 3)),
    "but it still reaches into it":           ((1, 2, 3),    {1, 2},    2,  (1, 2, 3)),
    "it left two":                            ((1, 2, 3),    {3},       3,  (3,)),
    "held again further on":                  ((1, 2, 1, 3), {1, 2},    2,  (2, 1, 3)),
    "what lies ahead is kept untouched":      ((1, 2, 3),    set(),     2,  (2, 3)),
}
# fmt: on


@pytest.mark.parametrize("name", RELEASES)
def test_what_lies_behind_is_let_go_of_once_the_brake_is_clear_of_it(name: str) -> None:
    held, touched, body, still = RELEASES[name]
    before = progress(held, tuple(range(len(held))), 8, following=True)
    after = before.release_behind(touched, body)
    assert after.reservations.held == still
    assert [held[step] for step in after.steps] == list(still), "each keeps its step"
    assert (after is before) is (still == held)
    assert (after.route, after.following, after.reservations.claims) == ((8,), True, (CLAIM,))


# fmt: off
WIDE_RELEASES = {  # held, their steps, touched, body: still held
    "it is in the first":         ((7, 9, 1),    (BESIDE, BESIDE, ALONE),        {7},    7,  (7, 9, 1)),
    "it is in none of them":      ((7, 9, 1),    (BESIDE, BESIDE, ALONE),        {1},    99, (7, 9, 1)),
    "it is in one beside":        ((7, 9, 1),    (BESIDE, BESIDE, ALONE),        set(),  9,  (9, 1)),
    "one beside lies further on": ((1, 2, 7, 3), (ALONE, ALONE, BESIDE, ALONE),  {2},    2,  (2, 3)),
    "and is touched":             ((1, 2, 7, 3), (ALONE, ALONE, BESIDE, ALONE),  {2, 7}, 2,  (2, 7, 3)),
    "held twice":                 ((1, 1, 2),    (ALONE, ALONE, ALONE),          {1, 2}, 2,  (1, 2)),
}
# fmt: on


@pytest.mark.parametrize("name", WIDE_RELEASES)
def test_cells_beside_the_way_are_let_go_of_too(name: str) -> None:
    held, steps, touched, body, still = WIDE_RELEASES[name]
    assert progress(held, steps).release_behind(touched, body).reservations.held == still


# fmt: off
VISITS = {  # held, their steps, body: what is still held, which is the first to drive to, if it has to visit 4
    "it has not been there":               ((3, 4, 5),    (1, 2, 3),        5, (4, 5),    0),
    "it is there":                         ((3, 4, 5),    (1, 2, 3),        4, (4, 5),    0),
    "it comes to it":                      ((2, 3, 4),    (1, 2, 3),        3, (3, 4),    0),
    "its body only touched it":            ((4, 2, 3),    (BESIDE, 1, 2),   3, (3,),      0),
    "a way of its own leads back from it": ((4, 3, 2),    (ALONE,) * 3,     2, (2,),      0),
    "in and out by the same cell":         ((3, 4, 3),    (1, 2, 3),        3, (4, 3),    0),
    "it has to visit none of them":        ((2, 3, 5),    (1, 2, 3),        5, (5,),      0),
}
# fmt: on


@pytest.mark.parametrize("name", VISITS)
def test_the_cell_to_visit_stays_until_it_was_visited(name: str) -> None:
    held, steps, body, still, first = VISITS[name]
    after = progress(held, steps, 8, following=True).release_behind({body}, body, visits=4)
    assert after.reservations.held == still
    assert after.body_index_before_visit(body, 4) == first
    assert (
        progress(held, steps).release_behind({body}, body).reservations.held
        == held[after.body_index(body) - len(still) :]
    )


def test_who_wakes_keeps_what_it_is_in_and_has_to_ask_again_for_the_rest() -> None:
    awake = PLAN.after_waking({1, 2})
    assert (awake.reservations, awake.steps) == (Reservations((1, 2), (), 5), (4, 5))
    assert (awake.route, awake.following) == ((3, 8, 9), True)
    assert PLAN.after_waking({3}).reservations.held == (1, 2, 3)


def test_who_gives_back_turns_round() -> None:
    back = PLAN.turn_round({1, 2})
    assert (back.reservations, back.steps) == (Reservations((2, 1), (), 5), (ALONE, ALONE))
    assert (back.route, back.following) == ((), False)
    assert PLAN.turn_round({1}).reservations.held == (1,)
    assert PLAN.turn_round(set()).reservations.held == (1,), "never nothing"
    assert progress((1, 2, 1), (ALONE,) * 3).turn_round({1}).reservations.held == (2, 1), "each once"


LINE = Drawn("abcdef", "######")
A, B, C, D, E, F = LINE.at("abcdef")
SHUT = Drawn("abc#ef", "######")


def test_on_another_floor_what_no_longer_connects_is_given_up() -> None:
    before = progress((A, B, C, D), (0, 1, 2, 3), E, following=True)
    same = before.on_new_floor(LINE.cells, {A}, A)
    assert (same.reservations, same.steps) == (Reservations((A, B, C, D), (), 5), (ALONE,) * 4)
    assert (same.route, same.following) == ((), False)
    shut = before.on_new_floor(SHUT.cells, {A}, A)
    assert (shut.reservations.held, shut.steps) == ((A, B, C), (ALONE,) * 3)
    touching = before.on_new_floor(SHUT.cells, {C, D}, C)
    assert (touching.reservations.held, touching.steps) == ((A, B, D, C), (ALONE, ALONE, BESIDE, ALONE))


@pytest.mark.parametrize(
    ("held", "kept", "steps"),
    [((B, C, D), (B, D, C), (ALONE, BESIDE, ALONE)), ((C, D, E), (D, C), (BESIDE, ALONE)), ((D,), (D,), (ALONE,))],
)
def test_whose_cell_becomes_a_wall_goes_back_to_the_last_one_where_it_can_stand(
    held: tuple[int, ...], kept: tuple[int, ...], steps: tuple[int, ...]
) -> None:
    after = progress(held, tuple(range(len(held))), F, following=True).on_new_floor(SHUT.cells, {C, D} & set(held), D)
    assert (after.reservations.held, after.steps) == (kept, steps)


# fmt: off
BROKEN = {  # held, route, body: what is shut ahead, and of that between held cells
    "all before the wall":      ((A, B),       (C,),         A, (),               ()),
    "the route":                ((A, B),       (C, D, E),    A, ((C, D), (D, E)), ()),
    "a cell held":              ((A, B, C, D), (),           A, ((C, D),),        ((C, D),)),
    "what lies behind":         ((C, D, E),    (F,),         E, (),               ()),
    "nothing":                  ((A,),         (),           A, (),               ()),
}
# fmt: on


@pytest.mark.parametrize("name", BROKEN)
def test_what_another_floor_breaks_is_listed(name: str) -> None:
    held, route, body, shut, of_held = BROKEN[name]
    before = progress(held, (ALONE,) * len(held), *route)
    assert before.joins_shut_ahead(SHUT.cells, body) == shut
    assert before.joins_shut_ahead(SHUT.cells, body, route=False) == of_held
    assert before.joins_shut_ahead(LINE.cells, body) == ()


cells = st.integers(0, 6)


@given(st.lists(cells, min_size=1, max_size=6), st.sets(cells), cells, st.integers(0, 5))
def test_no_move_but_growing_and_widening_adds_a_cell(
    held: list[int], touched: set[int], body: int, first: int
) -> None:
    """And the numbers of claims are never used again, and there is a step for each cell held."""
    before = RouteProgress(Reservations(tuple(held), (CLAIM,), 5), tuple(range(first, first + len(held))), (8,), True)
    mine = {cell for cell in touched if cell in held} | {held[0]}
    moved = [
        before.release_behind(touched, body),
        before.after_waking(mine),
        before.turn_round(touched),
        before.on_new_floor(LINE.cells, mine, held[0]) if max(held) < len(LINE.cells) else before,
    ]
    for after in moved:
        assert set(after.reservations.held) <= set(held)
        assert len(after.steps) == len(after.reservations.held) >= 1
        assert after.reservations.number == before.reservations.number
    assert set(before.hold_beside(touched).reservations.held) == set(held) | touched
    kept = set(moved[0].reservations.held)
    assert (touched & set(held)) <= kept, "what the brake needs is never let go of"
    assert (touched & set(held)) <= set(before.after_waking(mine | (touched & set(held))).reservations.held)
