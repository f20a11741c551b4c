"""The questions of a leader: who stands for the plan, who moves, what is avoided, and who must arrive."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Epoch, Record
from swarm.traffic.joint import problem as questions
from swarm.traffic.joint.problem import Member, Problem, members_of, problem_of
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.mapf.planner import Budget
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

FLOOR = Drawn("abcdefgh", "ijklmnop")
A, B, C, D, E, F, G, H = FLOOR.at("abcdefgh")
M, P = FLOOR.at("mp")
SETTINGS = TrafficConstants()  # a radio reaches 8 m
CALL = Epoch(7, "r1")
NOBODY: Mapping[str, Record] = {}


def situation(others: Mapping[str, Record] = NOBODY, **changes: object) -> Situation:
    plain = Situation(
        tick=100, cells=FLOOR.cells, head=A, goal=H, moved=3, others=others, fresh=others, done=True, wants=4
    )  # fmt: skip
    return plain._replace(**changes)  # type: ignore[arg-type]


def record(robot: str, *held: int, **fields: object) -> Record:
    x, y = FLOOR.cells.centre(held[-1] if held else A)
    return replace(Record(robot=robot, stamp=99, x=x, y=y, goal=H, held=held), **fields)


def member(
    head: int,
    goal: int = H,
    *,
    idle: bool = False,
    done: bool = False,
    moved: int = 0,
    wants: int = 0,
    then: int = OUTSIDE,
) -> Member:
    return Member(head, goal, idle, done, moved, wants, then)


def asked(number: int, everybody: Mapping[str, Member], now: Situation | None = None, **settings: Any) -> Problem:  # noqa: ANN401
    return problem_of(number, everybody, now or situation(), FLOOR.cells, TrafficConstants(**settings))


def test_those_stand_that_say_so_each_in_a_cell_of_its_own() -> None:
    stands = record("r2", D, C, B, frozen=CALL, goal=E, then=F, idle=True, done=True, moved=8, wants=9)
    fresh = {
        "r2": stands,
        "r3": record("r3", B, frozen=CALL),
        "r4": record("r4", F),
        "r5": record("r5", G, frozen=Epoch(8, "r1")),
        "r6": record("r6", frozen=CALL),
        "r7": record("r7", A, frozen=CALL),
    }
    assert members_of(CALL, "r1", situation(fresh)) == {
        "r1": Member(A, H, False, True, 3, 4),
        "r2": Member(B, E, True, True, 8, 9, F),
    }


@pytest.mark.parametrize(("number", "moves"), list(enumerate([True, True, False, True, True, False, True, True])))
def test_who_is_at_its_goal_moves_in_some_questions_and_stands_in_the_others(number: int, moves: bool) -> None:
    question = asked(number, {"r1": member(A), "r2": member(E, E)})
    assert question.relaxation == number
    assert question.members == (("r1", "r2") if moves else ("r1",))
    assert question.starts == ((A, E) if moves else (A,))
    assert question.goals == ((H, E) if moves else (H,))
    assert question.at_rest == ({} if moves else {"r2": E})
    assert question.blocked == (frozenset() if moves else {E})
    assert question.until == (() if number < 2 else ("r1",))


@pytest.mark.parametrize("number", [0, 1, 3, 4])
def test_a_plan_that_leads_a_robot_out_of_what_another_needs_at_its_stop_is_useful(number: int) -> None:
    """Nobody reaches its goal by it: r1 is in its cell and needs B besides, which r3 wants too."""
    r2, r3 = member(B, B, idle=True, done=True), member(F, B, wants=9)
    needs = asked(number, {"r1": member(A, A)._replace(docking=(B,)), "r2": r2, "r3": r3})
    assert B not in needs.goals
    assert needs.eager == ()
    assert needs.frees
    assert needs.is_useful
    assert not asked(number, {"r1": member(A, A), "r2": r2, "r3": r3}).frees


@pytest.mark.parametrize("done", [True, False])
def test_nobody_leaves_its_goal_for_robots_that_only_go_back_to_theirs(done: bool) -> None:
    question = asked(0, {"r1": member(A, done=True), "r2": member(E, E, done=done)})
    assert question.members == (("r1",) if done else ("r1", "r2"))
    assert question.exact is not done


STRANGER = record("r9", F, claims=(Claim(G, 1, 1),))
X, Y = FLOOR.cells.centre(A)

# fmt: off
AVOIDED: dict[str, tuple[int, Situation, set[int]]] = {  # number of the question; what is known: cells avoided
    "nothing":                              (0, situation(),                                                     set()),
    "what somebody saw":                    (0, situation(blocked=frozenset({C})),                               {C}),
    "but nothing under a member":           (0, situation(blocked=frozenset({A, C})),                            {C}),
    "cells of a stranger near":             (0, situation({"r9": replace(STRANGER, x=X + 3.9, y=Y)}),            {F, G}),
    "of one farther off":                   (0, situation({"r9": replace(STRANGER, x=X + 4.1, y=Y)}),            set()),
    "unless they were seen to be empty":    (0, situation({"r9": replace(STRANGER, x=X, y=Y)}, cleared=frozenset({("r9", G), ("r8", F)})), {F}),
    "of a member":                          (0, situation({"r1": replace(STRANGER, robot="r1", x=X, y=Y)}),      set()),
    "where bodies are":                     (3, situation({"r9": record("r9", C)}, bodies=lambda: frozenset({C, D})),    {C, D}),
    "but not what they hold":               (3, situation({"r9": record("r9", C)}),                              set()),
    "where their middles are":              (7, situation({"r9": record("r9", C)}, bodies=lambda: frozenset({C, D})),    {C}),
}
# fmt: on


@pytest.mark.parametrize("name", AVOIDED)
def test_a_plan_avoids_the_cells_of_those_that_take_no_part(name: str) -> None:
    number, now, avoided = AVOIDED[name]
    question = asked(number, {"r1": member(A)}, now)
    assert question.blocked == avoided
    assert question.exact is not bool(avoided)


def test_a_question_proves_nothing_about_a_floor_that_is_only_learned() -> None:
    assert asked(0, {"r1": member(A)}).exact
    assert not asked(0, {"r1": member(A)}, learns=True).exact


DONE = member(D, B, done=True, wants=1)

# fmt: off
EAGER: dict[str, tuple[int, dict[str, Member], tuple[int, ...]]] = {  # number of the question; members: who must arrive
    "the longest waiting first":           (0, {"r1": member(A, G, wants=50), "r2": member(C, H, wants=40)}, (1, 0)),
    "who has waited as long, by id":       (0, {"r1": member(A, G, wants=50), "r2": member(C, H, wants=50)}, (0, 1)),
    "nobody who is there":                 (0, {"r1": member(A, A), "r2": member(C, H)},                     (1,)),
    "nobody who has nothing to do":        (0, {"r1": member(A, G, idle=True), "r2": member(C, H)},          (1,)),
    "nobody whose goal another gets":      (0, {"r1": member(A, H), "r2": member(C, H)},                     (1,)),
    "who has stops left":                  (0, {"r1": DONE, "r2": member(C, H, wants=40)},                   (1,)),
    "if nobody has any, who goes back":    (0, {"r1": DONE, "r2": member(F, F)},                             (0,)),
    "but not where it may stay":           (4, {"r1": DONE, "r2": member(F, F)},                             ()),
}
# fmt: on


@pytest.mark.parametrize("name", EAGER)
def test_those_must_arrive_that_still_have_to(name: str) -> None:
    number, everybody, eager = EAGER[name]
    assert asked(number, everybody).eager == eager


@pytest.mark.parametrize(("number", "expansions"), [(0, 20_000), (1, 20_000), (2, 10_000), (3, 10_000)])
def test_a_search_gets_the_whole_budget_for_the_first_question_and_half_for_the_others(
    number: int, expansions: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def search(neighbours: object, tables: object, *ends: object, **options: object) -> SimpleNamespace:
        return SimpleNamespace(neighbours=neighbours, tables=tables, ends=ends, **options)

    monkeypatch.setattr(questions, "JointSearch", search)
    for blocked in ((), (C, D)):
        question = asked(number, {"r1": member(A, B), "r2": member(E, F)}, situation(blocked=frozenset(blocked)))
        begun: Any = question.search(CALL, FLOOR.cells, SETTINGS)
        assert begun.budget == Budget(60, expansions, 25_000)
        assert begun.ends == ((A, E), (B, F))
        assert begun.eager == (0, 1)
        assert begun.vias == []
        near = [[cell for cell in cells if cell not in blocked] for cells in FLOOR.cells.neighbours]
        assert [list(cells) for cells in begun.neighbours] == near
        assert [table[cell] for table, cell in zip(begun.tables, (B, F), strict=True)] == [0, 0]


# fmt: off
VIAS: dict[str, tuple[dict[str, Member], tuple[int, ...], tuple[int, ...]]] = {  # members: where each ends, and via what
    "two share a target and go on":     ({"r1": member(A, E, then=F), "r2": member(C, E, then=G)}, (F, G), (E, E)),
    "to one place: one beside it":      ({"r1": member(A, E, then=H), "r2": member(C, E, then=H)}, (P, H), (E, E)),
    "one of them stays there":          ({"r1": member(A, E, then=F), "r2": member(C, E)},         (F, E), (E, OUTSIDE)),
    "each has its own":                 ({"r1": member(A, E, then=F), "r2": member(C, D, then=G)}, (E, D), ()),
    "the other only stands there":      ({"r1": member(A, E, then=F), "r2": member(E, E, done=True)}, (E, M), ()),
    "and with them those that do not": (
        {"r1": member(A, E, then=F), "r2": member(C, E, then=G), "r3": member(B, D, then=H)}, (F, G, H), (E, E, D),
    ),
    "it comes back to the same place":  ({"r1": member(A, E, then=E), "r2": member(C, E, then=G)}, (E, G), (OUTSIDE, E)),
}
# fmt: on


@pytest.mark.parametrize("name", VIAS)
def test_a_plan_leads_on_through_targets_that_robots_share(name: str) -> None:
    everybody, goals, vias = VIAS[name]
    question = asked(0, everybody)
    assert (sorted(question.goals), question.vias) == (sorted(goals), vias)
    assert question.exact is not bool(vias)
    assert asked(1, everybody).vias == ()
    begun = question.search(CALL, FLOOR.cells, SETTINGS)
    result = None
    while result is None:
        result = begun.advance(100)
    for robot, via in enumerate(vias):
        assert via == OUTSIDE or via in [at[robot] for at in result.steps]


@pytest.mark.parametrize(("shut", "leads"), [("", True), ("b", False), ("e", False), ("g", False)])
def test_no_plan_leads_through_a_target_that_is_cut_off_or_leads_nowhere(shut: str, leads: bool) -> None:
    """From a, the way to the target e, that target, or the way on to h is shut."""
    row = Drawn("abcdefgh")
    a, d, e, h = row.at("adeh")
    now = situation()._replace(cells=row.cells, blocked=frozenset(row.at(shut)))
    everybody = {"r1": member(a, e, then=h), "r2": member(d, e, then=a)}
    vias = problem_of(0, everybody, now, row.cells, SETTINGS).vias
    assert vias[:1] == ((e,) if leads else (OUTSIDE,) if shut == "g" else ())
