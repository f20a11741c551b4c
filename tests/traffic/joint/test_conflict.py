"""When a robot asks for a joint plan: each reason alone, on both sides of its limit."""

from collections.abc import Mapping

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Entry, Epoch, JointPlan, Record
from swarm.traffic.joint.member import name_leader, reason_to_ask
from swarm.traffic.joint.states import BroadcastTurn, FollowedPlan, Free, PlanningMemory
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

LINE = Drawn("abcdef")
A, B, C, D, E, F = LINE.at("abcdef")
SETTINGS = TrafficConstants()
NOW = 1000
PLAN, OTHER = Epoch(5, "r1"), Epoch(6, "r1")


def record(robot: str, *held: int, ahead: tuple[int, ...] = (), **fields: object) -> Record:
    x, y = LINE.cells.centre(held[-1])
    plain = Record(robot=robot, stamp=NOW, x=x, y=y, goal=F, held=held, ahead=ahead, moved=NOW - 1)
    return replace(plain, **fields)


def why(own: Record, *fresh: Record) -> str | None:
    others: Mapping[str, Record] = {one.robot: one for one in fresh}
    situation = Situation(
        tick=NOW, cells=LINE.cells, head=own.held[-1], goal=F, moved=own.moved, others=others, fresh=others
    )  # fmt: skip
    speaks = BroadcastTurn(own.robot, own.held, own.ahead, own.waits, own.epoch, own.moved, situation)
    return reason_to_ask(speaks, SETTINGS)


MINE = record("r1", A, ahead=(B, C), waits=("r2",))
RESTS = record("r2", B, moved=NOW - 21, done=True)
HEAD_ON = record("r2", B, ahead=(A,))
PASSING = record("r2", B, ahead=(C, D))
WAITS_BACK = record("r2", B, ahead=(C,), waits=("r1",))
COMING = record("r1", A, ahead=(B, C, D))
LONG = NOW - SETTINGS.stuck - 1
LOOKED = LONG - SETTINGS.surmise  # who waits for the silent has had the time to look

# fmt: off
REASONS: dict[str, tuple[Record, tuple[Record, ...], str | None]] = {
    "somebody rests on the way":              (MINE, (RESTS,),                                             "rest"),
    "it has not stood there long enough":     (MINE, (replace(RESTS, moved=NOW - 20),),               None),
    "it may go on by itself soon":            (MINE, (replace(RESTS, done=False),),                        None),
    "it does not":                            (MINE, (replace(RESTS, done=False, moved=LONG),),            "rest"),
    "who is idle goes nowhere by itself":     (MINE, (replace(RESTS, done=False, idle=True),),             "rest"),
    "it rests, but claims a cell":            (MINE, (replace(RESTS, claims=(Claim(C, 1, 1),)),),          None),
    "it rests elsewhere":                     (MINE, (record("r2", C, moved=0),),                          None),
    "it stands for a plan already":           (MINE, (replace(RESTS, frozen=PLAN),),                       None),
    "somebody comes the other way":           (MINE, (HEAD_ON,),                                           "head-on"),
    "it goes the same way":                   (MINE, (PASSING,),                                           None),
    "it goes elsewhere":                      (MINE, (record("r2", B, ahead=(D,)),),                       None),
    "it comes from farther on":               (MINE, (record("r2", C, ahead=(A,)),),                       None),
    "two wait for each other":                (MINE, (WAITS_BACK,),                                        "circle"),
    "three in a ring":                        (MINE, (replace(PASSING, waits=("r3",)),
                                                      record("r3", D, ahead=(E,), waits=("r4", "r1"))),    "circle"),
    "a chain that ends":                      (MINE, (replace(PASSING, waits=("r3",)),
                                                      record("r3", D, ahead=(E,), waits=("r2", "r9"))),    None),
    "a ring without me":                      (MINE, (replace(PASSING, waits=("r3",)),
                                                      record("r3", D, ahead=(E,), waits=("r2",))),         None),
    "a ring farther on":                      (MINE, (replace(PASSING, waits=("r3",)),
                                                      record("r3", D, ahead=(E,), waits=("r4",)),
                                                      record("r4", E, ahead=(F,), waits=("r3",))),         None),
    "I wait for nobody":                      (replace(MINE, waits=()), (RESTS,),                          None),
    "who I wait for is silent":               (MINE, (),                                                   None),
    "I have no way to go":                    (replace(MINE, ahead=()), (RESTS,),                          None),
    "of two I wait for, the second rests":    (replace(MINE, waits=("r3", "r2")), (record("r3", D), RESTS), "rest"),
    "two will meet":                          (COMING, (record("r2", E, ahead=(D, C, B)),),                "will meet"),
    "the other comes a step sooner":          (COMING, (record("r2", D, ahead=(C, B)),),                   "will meet"),
    "only the head counts":                   (record("r1", A, B, ahead=(C, D)), (record("r2", E, ahead=(D, C)),), "will meet"),
    "and of the other too":                   (record("r1", E, ahead=(D, C)), (record("r2", A, B, ahead=(C, D)),), "will meet"),
    "two steps sooner":                       (replace(COMING, ahead=(B, C, D, E)), (record("r2", E, ahead=(D, C)),), None),
    "the other is long gone by then":         (COMING, (record("r2", D, ahead=(C,)),),                     None),
    "it follows a plan":                      (COMING, (record("r2", E, ahead=(D, C, B), epoch=PLAN),),    None),
    "stuck for long":                         (replace(MINE, moved=LONG), (PASSING,),                      "stuck"),
    "not so long":                            (replace(MINE, moved=LONG + 1), (PASSING,),                  None),
    "long, but not for anybody":              (replace(MINE, moved=0, waits=()), (PASSING,),               None),
    "long, for somebody silent":              (replace(MINE, moved=LOOKED), (),                            "stuck"),
    "not until it has looked":                (replace(MINE, moved=LOOKED + 1), (),                        None),
    "one of them is not silent":              (replace(MINE, moved=LONG, waits=("r9", "r2")), (PASSING,),  "stuck"),
}
# fmt: on


@pytest.mark.parametrize("name", REASONS)
def test_a_robot_on_its_own_asks_for_a_reason(name: str) -> None:
    own, fresh, expected = REASONS[name]
    assert why(own, *fresh) == expected


STOOD = NOW - SETTINGS.plan_stuck - 1
WITHIN = replace(MINE, epoch=PLAN, moved=STOOD)

# fmt: off
PLANS: dict[str, tuple[Record, tuple[Record, ...], str | None]] = {
    "one of the plan rests: its turn comes":  (replace(WITHIN, moved=NOW), (replace(RESTS, epoch=PLAN),),        None),
    "one of another plan rests":              (replace(WITHIN, moved=NOW), (replace(RESTS, epoch=OTHER),),       "rest"),
    "one without a plan rests":               (replace(WITHIN, moved=NOW), (RESTS,),                             "rest"),
    "nobody of the plan gets on":             (WITHIN, (replace(RESTS, epoch=PLAN, moved=STOOD),),               "plan stuck"),
    "one of the plan got on":                 (WITHIN, (replace(RESTS, epoch=PLAN, moved=STOOD + 1),),           None),
    "I got on":                               (replace(WITHIN, moved=STOOD + 1),
                                               (replace(RESTS, epoch=PLAN, moved=STOOD),),                       None),
    "who gets on has no part in it":          (WITHIN, (replace(PASSING, epoch=OTHER),),                         "plan stuck"),
}
# fmt: on


@pytest.mark.parametrize("name", PLANS)
def test_a_robot_that_follows_a_plan_lets_it_take_its_time(name: str) -> None:
    own, fresh, expected = PLANS[name]
    assert why(own, *fresh) == expected


# --- whose turn it is within a plan ---


# It may enter the first cell of its way once r1 has left the second of its own.
FOLLOWER = FollowedPlan(
    "r2",
    JointPlan(epoch=PLAN, ways={"r1": (A, B, C), "r2": (F, E)}, after={"r2": (Entry(1, "r1", 1),)}),
    ("r1", "r2"),
    NOW,
    SETTINGS.absent,
    {1: Entry(1, "r1", 1)},
)


def at(others: dict[str, Record], fresh: dict[str, Record] | None = None, tick: int = NOW) -> Situation:
    return Situation(
        tick=tick, cells=LINE.cells, head=F, goal=E, others=others, fresh=others if fresh is None else fresh
    )  # fmt: skip


# fmt: off
TURNS: dict[str, tuple[Record | None, str | None]] = {
    "it has not left its first cell":        (record("r1", A, epoch=PLAN, left=0),                            "r1"),
    "it is in its second one":               (record("r1", B, epoch=PLAN, left=1),                            "r1"),
    "it has left its second one":            (record("r1", C, epoch=PLAN, left=2),                            None),
    "it was never heard":                    (None,                                                           None),
    "it is silent, but not for long":        (record("r1", A, epoch=PLAN, stamp=NOW - SETTINGS.absent),       "r1"),
    "it has been silent for long":           (record("r1", A, epoch=PLAN, stamp=NOW - SETTINGS.absent - 1),   None),
    "it has yet to take the plan up":        (record("r1", A, stamp=NOW),                                     "r1"),
    "it follows another, newer plan":        (record("r1", A, epoch=OTHER),                                   None),
}
# fmt: on


@pytest.mark.parametrize("name", TURNS)
def test_a_cell_is_entered_after_the_robot_that_comes_first_has_left_it(name: str) -> None:
    first, waits_for = TURNS[name]
    assert FOLLOWER.waits_for(1, at({"r1": first} if first else {})) == waits_for
    assert FOLLOWER.waits_for(0, at({"r1": first} if first else {})) is None, "no other cell is waited for"


# fmt: off
VISITS: dict[str, tuple[Record | None, bool]] = {  # is r1 in the visit that has to be over first?
    "it is on its way there":        (record("r1", A, epoch=PLAN, left=0, entered=0),   False),
    "it is entering":                (record("r1", B, epoch=PLAN, left=0, entered=1),   True),
    "it is there":                   (record("r1", B, epoch=PLAN, left=1, entered=1),   True),
    "it is leaving":                 (record("r1", C, epoch=PLAN, left=1, entered=2),   True),
    "it has left":                   (record("r1", C, epoch=PLAN, left=2, entered=2),   False),
    "it is there in another plan":   (record("r1", B, epoch=OTHER, left=1, entered=1),  False),
    "it is silent":                  (None,                                             False),
}
# fmt: on


@pytest.mark.parametrize("name", VISITS)
def test_nobody_comes_in_between_while_the_robot_waited_for_is_in_that_very_visit(name: str) -> None:
    first, there = VISITS[name]
    assert FOLLOWER.next_after(1, at({"r1": first} if first else {})) is there


def test_a_leader_has_four_requests_without_an_answer_each_time() -> None:
    """It is named a fifth time, and is passed over for 100 ticks then."""
    memory, free = PlanningMemory("r3", SETTINGS), Free()
    near = at({name: record(name, A) for name in ("r1", "r2")})
    named = []
    for tick in (*range(NOW, NOW + 6), *range(NOW + 104, NOW + 111)):
        free = name_leader(memory, free, near._replace(tick=tick))
        named.append(free.need)
    assert named == ["r1"] * 5 + ["r2"] * 2 + ["r1"] * 5 + ["r2"]


def test_nobody_passes_itself_over() -> None:
    memory, free = PlanningMemory("r1", SETTINGS), Free()
    for tick in range(NOW, NOW + 9):
        free = name_leader(memory, free, at({"r2": record("r2", A)}, tick=tick))
        assert free == Free("r1")
    assert not memory.passed_over
