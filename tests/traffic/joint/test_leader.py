"""What a leader does with requests, refusals and answers: each step of its own, with figures."""

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Collect, Entry, Epoch, JointPlan, Record, Refusal
from swarm.traffic.joint import leader as leading
from swarm.traffic.joint.problem import Problem
from swarm.traffic.joint.states import Collecting, Free, PlanningMemory, PublishedPlan, Searching, TransitionResult
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.mapf.planner import SearchOutcome, SearchResult
from swarm.traffic.mapf.precedence import EntryConstraint, Precedence
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

FLOOR = Drawn("abcd", "efgh")
A, B, C, D, E = FLOOR.at("abcde")
NOW = 1000
CALL = Epoch(990, "r1")
COLLECT = Collect(CALL, ("r1", "r2"))


def part(**fields: object) -> PlanningMemory:
    return PlanningMemory("r1", TrafficConstants(), **fields)  # type: ignore[arg-type]


def record(robot: str = "r2", **fields: object) -> Record:
    x, y = FLOOR.cells.centre(C)
    return replace(Record(robot=robot, stamp=NOW, x=x, y=y, goal=D, held=(C,)), **fields)


def situation(*fresh: Record, tick: int = NOW) -> Situation:
    heard = {one.robot: one for one in fresh}
    return Situation(tick=tick, cells=FLOOR.cells, head=A, goal=B, others=heard, fresh=heard)


# --- being named ---

PLAN = JointPlan(epoch=CALL, ways={"r1": (A, B), "r2": (C, D), "r3": (E,)}, after={})
MADE = PublishedPlan(PLAN, NOW - 10)
REFUSES = record(refusal=Refusal(CALL, ((A, B),)))

# fmt: off
NAMED: dict[str, tuple[PlanningMemory, Free, tuple[Record, ...], bool]] = {  # its memory and state, who is heard: does it call?
    "it names itself":                   (part(),                  Free("r1"), (record(),),                    True),
    "another names it":                  (part(),                  Free(),     (record(need="r1"),),           True),
    "another is named":                  (part(),                  Free("r2"), (record(need="r2"),),           False),
    "it may not lead yet":               (part(leads_from=NOW + 1), Free("r1"), (record(),),                   False),
    "it may again":                      (part(leads_from=NOW),    Free("r1"), (record(),),                    True),
    "its plan is refused":               (part(published=MADE),    Free(),     (REFUSES,),                     True),
    "nobody has refused it":             (part(published=MADE),    Free(),     (record(),),                    False),
    "an older plan was refused":         (part(published=MADE),    Free(),     (record(refusal=Refusal(Epoch(1, "r1"), ())),), False),
    "it has made no plan":               (part(),                  Free(),     (REFUSES,),                     False),
}
# fmt: on


@pytest.mark.parametrize("name", NAMED)
def test_a_robot_calls_all_in_hearing_if_it_is_asked_to_or_refused(name: str) -> None:
    memory, call, fresh, calls = NAMED[name]
    collect = Collect(Epoch(NOW, "r1"), ("r1", "r2"))
    assert leading.begin_call(memory, call, situation(*fresh)) == (
        TransitionResult(Collecting(collect)) if calls else None
    )


def test_a_refused_join_counts_as_shut_for_400_ticks() -> None:
    memory = part(published=MADE, shut={(B, C): NOW, (C, D): NOW + 1})
    leading.begin_call(memory, Free(), situation(REFUSES))
    assert memory.shut == {(C, D): NOW + 1, (A, B): NOW + 400}


# --- collecting ---

# fmt: off
STANDS: dict[str, tuple[tuple[Record, ...], int, bool]] = {  # who is heard, ticks since the call: does it search?
    "all stand":                   ((record(frozen=CALL),),           1,  True),
    "one does not":                ((record(),),                      19, False),
    "one is silent":               ((),                               19, False),
    "one stands for another call": ((record(frozen=Epoch(1, "r0")),), 19, False),
    "it is too late":              ((record(),),                      20, True),
}
# fmt: on


@pytest.mark.parametrize("name", STANDS)
def test_the_search_begins_when_all_stand_or_after_20_ticks(name: str) -> None:
    fresh, late, begins = STANDS[name]
    move = leading.begin_search(part(), Collecting(COLLECT), situation(*fresh, tick=CALL.tick + late))
    assert (move is not None) is begins
    if move is not None:
        assert isinstance(move.to, Searching)
        assert move.to.problem.relaxation == 0
        assert move.to.asked == {move.to.problem.identity}
        assert move.to.problem.members == (("r1", "r2") if fresh and fresh[0].frozen == CALL else ("r1",))


def test_a_leader_whose_members_stood_too_late_waits_longer_next_time() -> None:
    """20, 40, 60 and 60 ticks; 20 again once all have stood in time."""
    memory, settings = part(), TrafficConstants()
    stands = record(frozen=CALL)
    for expected in (20, 40, 60, 60):
        assert memory.gather == expected
        for fresh, tick, begins in (((record(),), expected - 1, False), ((record(),), expected, True)):
            move = leading.begin_search(memory, Collecting(COLLECT), situation(*fresh, tick=CALL.tick + tick))
            assert (move is not None) is begins
    assert settings.gather_longest == 60
    assert leading.begin_search(memory, Collecting(COLLECT), situation(stands, tick=CALL.tick + 1)) is not None
    assert memory.gather == settings.gather


# --- the answer ---


def searching(
    answer: SearchResult | None = None, *, exact: bool = True, until: tuple[str, ...] = (), vias: tuple[int, ...] = ()
) -> Searching:
    """Return the search of the first question, in which r3 rests."""
    problem = Problem(
        relaxation=0, members=("r1", "r2"), starts=(A, C), goals=(B, D), blocked=frozenset(), eager=(0, 1), exact=exact,
        at_rest={"r3": E}, until=until, vias=vias,
    )  # fmt: skip
    return Searching(COLLECT, problem, None, frozenset({problem.identity}), answer)  # type: ignore[arg-type]


def result(outcome: SearchOutcome, *ways: tuple[int, ...], who: tuple[int, ...] = ()) -> SearchResult:
    after: tuple[dict[int, EntryConstraint], ...] = ({}, {1: EntryConstraint(0, 1)})
    return SearchResult(outcome, [], Precedence(ways, after) if ways else None, who)


def test_a_plan_is_published_with_all_that_stand() -> None:
    memory = part()
    move = leading.publish_plan(memory, searching(result(SearchOutcome.SOLVED, (A, B), (C,))), situation())
    plan = JointPlan(
        epoch=CALL, ways={"r1": (A, B), "r2": (C,), "r3": (E,)}, after={"r2": (Entry(1, "r1", 1),)}, until=()
    )
    assert move is not None
    assert (move.to, move.plan) == (Free(), plan)
    assert [event.text for event in move.events] == ["made a joint plan for 2 robots in 10 ticks"]
    assert memory.published == memory.unconfirmed == PublishedPlan(plan, NOW)
    assert memory.leads_from == NOW + 10


def test_room_is_made_for_those_for_whom_the_plan_is() -> None:
    for outcome, who, until in ((SearchOutcome.SOLVED, (), ("r1", "r2")), (SearchOutcome.FOR_ONE, (1,), ("r2",))):
        move = leading.publish_plan(
            part(), searching(result(outcome, (A, B), (C,), who=who), until=("r1", "r2")), situation()
        )
        assert move is not None
        assert move.plan is not None
        assert move.plan.until == until


@pytest.mark.parametrize("vias", [(), (B, -1)])
def test_a_plan_says_if_its_ways_lead_on_through_targets(vias: tuple[int, ...]) -> None:
    move = leading.publish_plan(part(), searching(result(SearchOutcome.SOLVED, (A, B), (C,)), vias=vias), situation())
    assert move is not None
    assert move.plan is not None
    assert move.plan.through is bool(vias)


@pytest.mark.parametrize("answer", [None, result(SearchOutcome.NOT_FOUND), result(SearchOutcome.SOLVED, (A,), (C,))])
def test_no_plan_is_published_where_there_is_none_or_nobody_moves(answer: SearchResult | None) -> None:
    memory = part()
    assert leading.publish_plan(memory, searching(answer), situation()) is None
    assert memory.published is None


STANDING = situation(record(frozen=CALL))


def test_the_next_question_follows_unless_there_is_proof() -> None:
    none = searching(result(SearchOutcome.NOT_FOUND))
    assert leading.relax_problem(part(), none, STANDING) is None, "all others would ask the same again"
    fresh = frozenset[object]()
    move = leading.relax_problem(part(), none._replace(asked=fresh), STANDING)
    assert move is not None
    assert isinstance(move.to, Searching)
    assert move.to.problem.relaxation == 1
    assert move.to.asked == {move.to.problem.identity}
    assert leading.relax_problem(part(), searching()._replace(asked=fresh), STANDING) is None, "no answer yet"
    proof = result(SearchOutcome.UNSOLVABLE, who=(0, 1))
    for exact in (True, False):
        move = leading.relax_problem(part(), searching(proof, exact=exact)._replace(asked=fresh), STANDING)
        assert (move is None) is exact


# fmt: off
GIVEN_UP = {  # the answer, if the question is exact: what is said, of whom
    "proven":                 (result(SearchOutcome.UNSOLVABLE, who=(1,)), True,  "unsolvable",    ("r2",)),
    "proven of that one":     (result(SearchOutcome.UNSOLVABLE, who=(1,)), False, "no_plan_found", ("r1", "r2")),
    "nothing found":          (result(SearchOutcome.NOT_FOUND),            True,  "no_plan_found", ("r1", "r2")),
}
# fmt: on


@pytest.mark.parametrize("name", GIVEN_UP)
def test_that_there_is_no_plan_is_said_and_the_robot_waits_200_ticks(name: str) -> None:
    answer, exact, kind, who = GIVEN_UP[name]
    memory = part()
    first, second = (
        leading.report_no_plan(memory, searching(answer, exact=exact), situation(tick=NOW + t)) for t in (0, 5)
    )
    assert first is not None
    assert [(event.kind, event.robots) for event in first.events] == [(kind, who)]
    assert second == (first if kind == "unsolvable" else TransitionResult(Free())), "only a proof is worth saying again"
    assert memory.leads_from == NOW + 205
    assert leading.report_no_plan(memory, searching(), situation()) is None


def test_a_proof_over_cells_speaks_of_the_floor_only_if_they_leave_no_floor_out() -> None:
    answer = searching(result(SearchOutcome.UNSOLVABLE, who=(1,)))
    whole = FLOOR.cells
    lossy = CellMap(FLOOR.cells.occupancy, side=1.2, radius=0.25, offset=(-0.3, 0.0))
    texts = [
        event.text
        for one in (whole, lossy)
        for event in (
            leading.report_no_plan(part(), answer, situation()._replace(cells=one)) or TransitionResult(Free())
        ).events
    ]
    assert texts == [
        "no way exists for r2 to reach their targets together",
        "no plan exists for r2: the floor is too narrow there for robots that reserve squares of 1.2 m; "
        "move a target or widen the way",
    ]


# --- who follows the plan ---

FOLLOWS = record(stamp=NOW + 21, epoch=CALL)

# fmt: off
IGNORED: dict[str, tuple[tuple[Record, ...], tuple[str, ...]]] = {  # what is heard 41 ticks after: who is named
    "it follows":                 ((FOLLOWS,),                                        ()),
    "it does not":                ((replace(FOLLOWS, epoch=None),),                   ("r2",)),
    "it still follows another":   ((replace(FOLLOWS, epoch=Epoch(1, "r1")),),         ("r2",)),
    "it follows a newer one":     ((replace(FOLLOWS, epoch=Epoch(NOW, "r1")),),       ()),
    "it stands for a newer one":  ((replace(FOLLOWS, epoch=None, frozen=Epoch(NOW, "r1")),), ()),
    "it has not been heard since": ((replace(FOLLOWS, epoch=None, stamp=NOW + 20),),  ()),
    "it is silent":               ((),                                                ()),
    "it is no member":            ((replace(FOLLOWS, robot="r4", epoch=None),),       ()),
}
# fmt: on


@pytest.mark.parametrize("name", IGNORED)
def test_who_does_not_follow_after_40_ticks_is_named(name: str) -> None:
    fresh, named = IGNORED[name]
    memory = part(unconfirmed=PublishedPlan(PLAN, NOW))
    assert leading.report_ignored(memory, Free(), situation(*fresh, tick=NOW + 40)) is None
    assert memory.unconfirmed is not None
    move = leading.report_ignored(memory, Free(), situation(*fresh, tick=NOW + 41))
    assert move is not None
    assert tuple(event.robots[0] for event in move.events) == named
    assert memory.unconfirmed is None
    assert leading.report_ignored(memory, Free(), situation(*fresh, tick=NOW + 42)) is None


def test_a_plan_is_carried_for_100_ticks() -> None:
    memory = part(published=PublishedPlan(PLAN, NOW))
    assert leading.plan_to_carry(memory, situation(tick=NOW + 100)) == PLAN
    assert leading.plan_to_carry(memory, situation(tick=NOW + 101)) is None
    assert leading.plan_to_carry(part(), situation()) is None
