"""Which call for a joint plan a robot follows, and for how long: one transition at a time."""

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Collect, Epoch, JointPlan, Record
from swarm.traffic.joint.member import abandon_call, receive_plan, take_call
from swarm.traffic.joint.states import Call, Free, Frozen, PlanningMemory, TransitionResult
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

SETTINGS = TrafficConstants()
NOW = 1000
MINE, OLDER, OTHER = Epoch(990, "r2"), Epoch(980, "r2"), Epoch(990, "r4")


def part(*spent: Epoch) -> PlanningMemory:
    return PlanningMemory("r3", SETTINGS, spent={epoch.leader: epoch.tick for epoch in spent})


def calls(epoch: Epoch, *members: str, by: str | None = None) -> Record:
    """Return the record of a robot that calls these members, of which I am one if none is named."""
    said = Collect(epoch, members or ("r3", epoch.leader))
    return Record(robot=by or epoch.leader, stamp=NOW, x=0.0, y=0.0, goal=0, collect=said)


def situation(*fresh: Record, tick: int = NOW, others: tuple[Record, ...] = ()) -> Situation:
    heard, silent = ({record.robot: record for record in records} for records in (fresh, others))
    return Situation(tick=tick, cells=Drawn("ab").cells, head=0, goal=1, others=heard | silent, fresh=heard)


SILENT = Record(robot="r9", stamp=NOW, x=0.0, y=0.0, goal=0)
# fmt: off
CALLED: dict[str, tuple[Call, tuple[Record, ...], Epoch | None]] = {  # my call, what is heard: the call I stand for now
    "nobody calls":                        (Free(),              (SILENT,),                        None),
    "one calls me":                        (Free(),              (SILENT, calls(MINE)),            MINE),
    "one calls others":                    (Free(),              (calls(MINE, "r2", "r4"),),       None),
    "one tells of another's call":         (Free(),              (calls(MINE, by="r5"),),          None),
    "of two the lower id":                 (Free(),              (calls(OTHER), calls(MINE)),      MINE),
    "the call I stand for":                (Frozen(MINE, 995),   (calls(MINE),),                   None),
    "its leader calls anew":               (Frozen(OLDER, 985),  (calls(MINE),),                   MINE),
    "a lower leader calls too":            (Frozen(OTHER, 995),  (calls(OTHER), calls(MINE)),      MINE),
    "a higher leader calls too":           (Frozen(MINE, 995),   (calls(OTHER), calls(MINE)),      None),
    "a higher leader alone":               (Frozen(MINE, 995),   (calls(OTHER),),                  None),
}
# fmt: on


@pytest.mark.parametrize("name", CALLED)
def test_whose_call_a_robot_stands_for(name: str) -> None:
    mine, heard, epoch = CALLED[name]
    assert take_call(part(), mine, situation(*heard)) == (
        None if epoch is None else TransitionResult(Frozen(epoch, NOW))
    )


def test_a_call_that_was_left_is_followed_no_more() -> None:
    assert take_call(part(MINE), Free(), situation(calls(MINE))) is None
    assert take_call(part(MINE), Free(), situation(calls(MINE), calls(OTHER))) == TransitionResult(Frozen(OTHER, NOW))


def test_only_the_plan_that_a_robot_stands_for_is_taken_over() -> None:
    plan, other = (JointPlan(epoch=epoch, ways={}, after={}) for epoch in (MINE, OLDER))
    mine, leader = Frozen(MINE, 995), calls(MINE)
    assert receive_plan(part(), mine, situation()) is None
    assert receive_plan(part(), mine, situation(leader)) is None
    assert receive_plan(part(), mine, situation(replace(leader, plan=other))) is None
    assert receive_plan(part(), mine, situation(replace(leader, plan=plan))) == TransitionResult(Free(), plan)
    assert receive_plan(part(), mine, situation(others=(replace(leader, plan=plan),))) == TransitionResult(
        Free(), plan
    ), "relayed"


# fmt: off
STOOD: dict[str, tuple[tuple[Record, ...], int, bool]] = {  # what is heard, since when it stands: does it stop standing?
    "the call goes on":                 ((calls(MINE),),                     10,                   False),
    "as long as it may":                ((calls(MINE),),                     SETTINGS.freeze,      False),
    "too long":                         ((calls(MINE),),                     SETTINGS.freeze + 1,  True),
    "the leader calls anew":            ((calls(Epoch(999, "r2")),),         10,                   True),
    "the leader has given it up":       ((replace(SILENT, robot="r2"),),     10,                   True),
    "the leader is silent":             ((SILENT,),                          10,                   True),
}
# fmt: on


@pytest.mark.parametrize("name", STOOD)
def test_a_robot_stands_as_long_as_its_leader_calls_but_not_for_ever(name: str) -> None:
    heard, ticks, stops = STOOD[name]
    got = abandon_call(part(), Frozen(MINE, NOW - ticks), situation(*heard, others=(calls(MINE),)))
    assert got == (TransitionResult(Free()) if stops else None)
