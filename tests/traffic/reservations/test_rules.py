"""The rules of holds one by one, and who must acknowledge; each case is a row, since the model needs only one side."""

from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Notice, Record, TrafficBroadcast
from swarm.traffic.interface import TrafficInputs, TrafficOutputs
from swarm.traffic.reservations.rules import (
    ASK,
    GRANT,
    TAKE,
    ClaimCase,
    Reservations,
    acknowledgements,
    find_violated_rule,
)
from swarm.traffic.settings import TrafficConstants
from swarm.traffic.step import Traffic
from tests.traffic.maps import SIDE, Drawn

CELL, OTHER = 5, 6
THEIRS = Claim(CELL, 9, 20)  # of r2, at tick 20
MINE = Claim(CELL, 3, 20)  # of r1


def notice(
    robot: str = "r2", held: tuple[int, ...] = (), *claims: Claim, acks: tuple[tuple[str, int], ...] = ()
) -> Notice:
    return Notice(robot=robot, stamp=0, held=held, claims=claims, acks=acks)


# --- I acknowledge ---

HOLD, OLDER = "I hold the cell", "I have an older claim"

# fmt: off
GRANTS: dict[str, tuple[str, Reservations, str | None]] = {  # who claims: r0 or r2; what r1 has; what is against it
    "it is nothing to me":                ("r2", Reservations(),                                             None),
    "I hold another":                     ("r2", Reservations((OTHER,)),                                     None),
    "I hold it":                          ("r2", Reservations((CELL,)),                                      HOLD),
    "I hold it among others":             ("r2", Reservations((OTHER, CELL, OTHER + 1)),                     HOLD),
    "I claim another, older":             ("r2", Reservations((), (Claim(OTHER, 1, 1),)),                    None),
    "I claim it, older":                  ("r2", Reservations((), (Claim(CELL, 1, 19),)),                    OLDER),
    "I claim it, younger":                ("r2", Reservations((), (Claim(CELL, 1, 21),)),                    None),
    "at the same tick, the id decides":   ("r2", Reservations((), (Claim(CELL, 1, 20),)),                    OLDER),
    "and for the other one":              ("r0", Reservations((), (Claim(CELL, 1, 20),)),                    None),
    "an older one among several":         ("r2", Reservations((), (Claim(OTHER, 1, 1), Claim(CELL, 2, 9))),  OLDER),
}
# fmt: on


@pytest.mark.parametrize("name", GRANTS)
def test_who_holds_a_cell_or_claimed_it_first_does_not_acknowledge(name: str) -> None:
    who, own, against = GRANTS[name]
    assert find_violated_rule(GRANT, ClaimCase(THEIRS, who, "r1", own, {})) == against
    others = {who: notice(who, (), THEIRS, Claim(OTHER + 5, 10, 20))}
    assert acknowledgements("r1", own, others) == (((who, 9),) if against is None else ()) + ((who, 10),)


def test_acknowledgements_are_of_all_others_by_name_and_number() -> None:
    others = {"r9": notice("r9", (), Claim(7, 4, 1)), "r2": notice("r2", (), Claim(8, 2, 1), Claim(9, 3, 1))}
    assert acknowledgements("r1", Reservations(), others) == (("r2", 2), ("r2", 3), ("r9", 4))
    assert acknowledgements("r1", Reservations((8,)), others) == (("r2", 3), ("r9", 4))
    assert acknowledgements("r1", Reservations(), {}) == ()


# --- I claim, and I take ---

CLAIMED, HELD = "somebody claims it", "somebody holds it"
YOUNG, UNASKED, LATER = "it is too young", "not all have acknowledged", "I have acknowledged an older claim"
CLEAR = frozenset({("r2", CELL)})

# fmt: off
ASKS: dict[str, tuple[Notice, frozenset[tuple[str, int]], str | None]] = {
    "nobody there":                      (notice(),                                    frozenset(),             None),
    "another cell":                      (notice("r2", (OTHER,), Claim(OTHER, 1, 1)),  frozenset(),             None),
    "held":                              (notice("r2", (OTHER, CELL)),                 frozenset(),             HELD),
    "claimed, older":                    (notice("r2", (), Claim(CELL, 1, 1)),         frozenset(),             CLAIMED),
    "claimed, younger":                  (notice("r2", (), Claim(CELL, 1, 99)),        frozenset(),             CLAIMED),
    "held, but seen to be empty":        (notice("r2", (CELL,)),                       CLEAR,                   None),
    "claimed, but seen to be empty":     (notice("r2", (), Claim(CELL, 1, 1)),         CLEAR,                   None),
    "another robot's was seen":          (notice("r2", (CELL,)),                       frozenset({("r3", CELL)}), HELD),
    "another cell was seen":             (notice("r2", (CELL,)),                       frozenset({("r2", OTHER)}), HELD),
    "claimed, another cell was seen":    (notice("r2", (), Claim(CELL, 1, 1)),         frozenset({("r2", OTHER)}), CLAIMED),
}
# fmt: on


@pytest.mark.parametrize("name", ASKS)
def test_what_is_claimed_is_nobodys(name: str) -> None:
    other, cleared, against = ASKS[name]
    case = ClaimCase(MINE, "r1", "r1", Reservations(), {"r0": notice("r0"), "r2": other}, cleared=cleared)
    assert find_violated_rule(ASK, case) == against


ACK = (("r1", MINE.number),)

# fmt: off
TAKES: dict[str, tuple[Notice, str | None]] = {
    "acknowledged":                         (notice(acks=ACK),                                   None),
    "among other acknowledgements":         (notice(acks=(("r3", 1), *ACK, ("r1", 4))),          None),
    "not acknowledged":                     (notice(),                                           UNASKED),
    "an older number acknowledged":         (notice(acks=(("r1", MINE.number - 1),)),            UNASKED),
    "somebody else's number":               (notice(acks=(("r3", MINE.number),)),                UNASKED),
    "acknowledged and held":                (notice("r2", (CELL,), acks=ACK),                    HELD),
    "acknowledged, an older claim":         (notice("r2", (), Claim(CELL, 1, 19), acks=ACK),     LATER),
    "acknowledged, a younger claim":        (notice("r2", (), Claim(CELL, 1, 21), acks=ACK),     None),
    "acknowledged, at the same tick":       (notice("r2", (), Claim(CELL, 1, 20), acks=ACK),     None),
    "acknowledged, an older one elsewhere": (notice("r2", (), Claim(OTHER, 1, 1), acks=ACK),     None),
}
# fmt: on


@pytest.mark.parametrize("name", TAKES)
def test_what_is_taken_all_near_have_acknowledged(name: str) -> None:
    other, against = TAKES[name]
    case = ClaimCase(MINE, "r1", "r1", Reservations(), {"r2": other}, near=frozenset({"r2"}), age=8, ripe=8)
    assert find_violated_rule(TAKE, case) == against
    assert find_violated_rule(TAKE, case._replace(age=7)) == YOUNG
    assert find_violated_rule(TAKE, case._replace(near=frozenset())) == (None if against == UNASKED else against)
    if against in {HELD, LATER}:
        assert find_violated_rule(TAKE, case._replace(cleared=CLEAR)) is None
        assert find_violated_rule(TAKE, case._replace(cleared=frozenset({("r2", OTHER)}))) == against


def test_at_the_same_tick_the_lower_id_is_older() -> None:
    for other, against in (("r0", LATER), ("r2", None)):
        others = {other: notice(other, (), Claim(CELL, 1, 20), acks=ACK)}
        assert (
            find_violated_rule(TAKE, ClaimCase(MINE, "r1", "r1", Reservations(), others, near=frozenset(others)))
            == against
        )


def test_all_near_are_asked_and_not_just_one() -> None:
    others = {"r2": notice("r2", acks=ACK), "r3": notice("r3")}
    case = ClaimCase(MINE, "r1", "r1", Reservations(), others, near=frozenset({"r2"}))
    assert find_violated_rule(TAKE, case) is None
    assert find_violated_rule(TAKE, case._replace(near=frozenset(others))) == UNASKED


# --- the reservations ---


@given(st.lists(st.sampled_from(["claim", "withdraw", "take", "keep"]), max_size=12))
def test_each_number_is_used_once_and_only_a_claim_becomes_a_hold(moves: list[str]) -> None:
    reservations, used = Reservations((0,)), []
    for cell, move in enumerate(moves, 1):
        before = reservations
        if move == "claim":
            reservations = reservations.claim(cell, cell)
            used.append(reservations.claims[-1].number)
            assert reservations.claims == (*before.claims, Claim(cell, before.number, cell))
            assert reservations.held == before.held
        elif move == "keep":
            reservations = reservations.keep_only(reservations.held[1:])
            assert (reservations.held, reservations.claims, reservations.number) == (
                before.held[1:],
                before.claims,
                before.number,
            )
        elif reservations.claims:
            claim = reservations.claims[0]
            reservations = reservations.hold_claimed(claim) if move == "take" else reservations.withdraw([claim])
            assert reservations.held == (before.held if move == "withdraw" else (*before.held, claim.cell))
            assert reservations.claims == before.claims[1:]
            assert reservations.number == before.number
    assert len(set(used)) == len(used)


def test_numbers_go_up_by_one_on_the_way_and_beside_it() -> None:
    both = Reservations((0,)).claim(7, 3).claim_beside(8, 4)
    way, beside = Claim(7, 1, 3), Claim(8, 2, 4)
    assert both == Reservations((0,), (way,), 3, (beside,))
    assert both.all_claims == (way, beside)
    assert both.withdraw([beside]) == Reservations((0,), (way,), 3)
    assert both.withdraw([way]) == Reservations((0,), (), 3, (beside,))
    assert both.withdraw([]) is both


def test_a_claim_has_to_ripen_only_where_it_is_said() -> None:
    assert find_violated_rule(TAKE, ClaimCase(MINE, "r1", "r1", Reservations(), {}, age=0)) is None


# --- who has to acknowledge, as one robot's whole traffic does it ---

HALL = Drawn("." * 40, "a" + "." * 38 + "b", "." * 40)
START, GOAL = HALL.at("ab")
TICKS = 100


def alone_with(away: float, settings: TrafficConstants, *, acks_from: int) -> Iterator[tuple[int, TrafficOutputs]]:
    """Step r1, which wants along the hall, with r2 standing so far behind it [m], which acknowledges from a tick on."""
    traffic = Traffic("r1", HALL.cells, settings)
    x, y = HALL.cells.centre(START + 16)
    body = HALL.cells.cell_of(x - away, y)
    claims: tuple[Claim, ...] = ()
    for tick in range(TICKS):
        acks = tuple(("r1", claim.number) for claim in claims) if tick >= acks_from else ()
        record = Record(robot="r2", stamp=tick, x=x - away, y=y, goal=body, held=(body,), acks=acks)
        granted = traffic.step(
            TrafficInputs(tick, HALL.pose(START + 16), HALL.cells.centre(GOAL), heard=[TrafficBroadcast(own=record)]),
            HALL.cells,
        )
        if granted.broadcast is not None:
            claims = granted.broadcast.own.claims
        yield tick, granted


# a claim reaches `claim_radius` or the horizon and one cell, whichever is less; two of them, and 1.5 m, is who is asked,
# but nobody whom the radio does not reach
# fmt: off
ASKED = [  # radio range, horizon, and how far off r2 stands [m]: just who has to acknowledge, just who need not
    (8.0,  3,  7.9,                         8.1),
    (20.0, 3,  2 * 4 * SIDE + 1.4,          2 * 4 * SIDE + 1.6),
    (20.0, 1,  2 * 2 * SIDE + 1.4,          2 * 2 * SIDE + 1.6),
    (12.0, 9,  11.9,                        12.1),
]
# fmt: on


@pytest.mark.parametrize(("reach", "horizon", "asked", "not_asked"), ASKED)
def test_no_cell_is_taken_before_each_robot_that_could_claim_it_has_acknowledged(
    reach: float, horizon: int, asked: float, not_asked: float
) -> None:
    settings = TrafficConstants(radio_range=reach, horizon=horizon)
    for away in (2 * SIDE, 0.6 * asked, asked):
        grown = [tick for tick, granted in alone_with(away, settings, acks_from=TICKS) if len(granted.held) > 1]
        assert grown == [], f"{away} m off, not acknowledged"
        grown = [tick for tick, granted in alone_with(away, settings, acks_from=60) if len(granted.held) > 1]
        assert grown, f"{away} m off, acknowledged"
        assert grown[0] >= 60
    for away in (not_asked, 1.3 * not_asked):
        assert any(len(granted.held) > 1 for _, granted in alone_with(away, settings, acks_from=TICKS)), away


def test_an_acknowledgement_is_said_of_what_is_not_held_and_not_of_what_is() -> None:
    traffic = Traffic("r1", HALL.cells, TrafficConstants())
    x, y = HALL.cells.centre(START + 4)
    record = Record(robot="r2", stamp=0, x=x, y=y, goal=START, held=(START + 4,))
    said: dict[int, tuple[tuple[str, int], ...]] = {}
    for tick in range(12):
        claims = (Claim(START + 2, 7, 0), Claim(START + 1, 8, 0))
        told = TrafficBroadcast(own=replace(record, stamp=tick, claims=claims))
        granted = traffic.step(
            TrafficInputs(tick, HALL.pose(START + 1), HALL.cells.centre(GOAL), heard=[told]), HALL.cells
        )
        if granted.broadcast is not None:
            assert granted.broadcast.own.held == (START + 1,)
            said[tick] = granted.broadcast.own.acks
    assert set(said.values()) == {(("r2", 7),)}
