"""How long a robot stays in a joint plan: a table for each question, on both sides of each limit."""

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Epoch, JointPlan, Record
from swarm.traffic.joint.states import FollowedPlan
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import RouteProgress
from swarm.traffic.reservations.rules import Reservations
from tests.traffic.maps import Drawn

FLOOR = Drawn("abcdef")
A, B, C, D, E, F = FLOOR.at("abcdef")
ADOPTED = 1000  # tick
PLAN, NEWER, OLDER = Epoch(990, "r1"), Epoch(991, "r1"), Epoch(989, "r1")
WAYS = {"r1": (A, B, C), "r2": (D, E, F), "r3": (F, E)}


def following(*until: str, through: bool = False) -> FollowedPlan:
    plan = JointPlan(epoch=PLAN, ways=WAYS, after={}, until=until, through=through)
    return FollowedPlan("r2", plan, ("r1", "r2", "r3"), ADOPTED, 140, {})


def record(robot: str = "r1", *, goal: int = C, late: int = 0, **fields: object) -> Record:
    """Return what a robot that follows the plan says so many ticks after r2 has adopted it."""
    plain = Record(robot=robot, stamp=ADOPTED + late, x=0.0, y=0.0, goal=goal, held=(B,), epoch=PLAN, left=1)
    return replace(plain, **fields)


def situation(*fresh: Record, goal: int = -1) -> Situation:
    heard = {one.robot: one for one in fresh}
    return Situation(tick=ADOPTED + 50, cells=FLOOR.cells, head=F, goal=goal, others=heard, fresh=heard)


# fmt: off
FIRST: dict[str, tuple[Record, int, str | None]] = {  # what r1 says; in which cell: who has the first turn there
    "its way ends there":                  (record(),                                     C, "r1"),
    "its way ends elsewhere":              (record(goal=B),                               B, None),
    "it was only sent there":              (record(goal=A),                               C, None),
    "it has nothing to do there":          (record(idle=True),                            C, None),
    "it may be about to follow":           (record(epoch=None, late=20),                  C, "r1"),
    "it does not follow":                  (record(epoch=None, late=21),                  C, None),
    "it still stands for the plan":        (record(epoch=None, late=21, frozen=PLAN),     C, "r1"),
    "it stands for another":               (record(epoch=None, late=21, frozen=NEWER),    C, None),
    "it may be about to leave another":    (record(epoch=OLDER, late=20),                 C, "r1"),
    "it has gone on to a newer one":       (record(epoch=NEWER, late=20, frozen=PLAN),    C, None),
    "long after, it follows":              (record(late=49),                              C, "r1"),
    "it is done, and on its way there":    (record(done=True),                            C, "r1"),
    "it is done, and there":               (record(done=True, left=2),                    C, None),
    "it has a stop there":                 (record(left=2),                               C, "r1"),
}
# fmt: on


@pytest.mark.parametrize("name", FIRST)
def test_the_first_turn_in_a_cell_has_the_member_whose_way_and_goal_are_there(name: str) -> None:
    said, cell, first = FIRST[name]
    assert following().first_at(cell, {"r1": said}) == first
    assert following().first_at(cell, {}) is None


def test_the_first_turn_is_never_my_own() -> None:
    assert following().first_at(F, {"r2": record("r2", goal=F)}) is None


# fmt: off
ROOM: dict[str, tuple[tuple[str, ...], tuple[Record, ...], bool, bool]] = {  # for whom; who is heard; under way: or not
    "for nobody":                        ((),           (record(),),                          False, False),
    "for who has a cell to go":          (("r1",),      (record(left=1),),                    True,  True),
    "who has arrived":                   (("r1",),      (record(left=2),),                    False, True),
    "who is silent":                     (("r1",),      (),                                   False, True),
    "who may be about to follow":        (("r1",),      (record(epoch=None, late=20),),       True,  True),
    "who does not follow":               (("r1",),      (record(epoch=None, late=21),),       False, True),
    "the second of two":                 (("r1", "r3"), (record("r3", left=0),),              True,  True),
    "the second of two has arrived":     (("r1", "r3"), (record("r3", left=1),),              False, True),
    "me alone":                          (("r2",),      (record("r2", left=0),),              False, True),
}
# fmt: on


@pytest.mark.parametrize("name", ROOM)
def test_room_is_made_while_somebody_for_whom_it_is_made_has_not_arrived(name: str) -> None:
    until, fresh, standing, under_way = ROOM[name]
    assert following(*until).makes_room(situation(*fresh), under_way=False) is standing
    assert following(*until).makes_room(situation(*fresh), under_way=True) is under_way


BEHIND, AHEAD = Claim(E, 1, ADOPTED), Claim(F, 1, ADOPTED)

# fmt: off
KEEPS: dict[str, tuple[tuple[int, ...], tuple[int, ...], int, tuple[str, ...], tuple[Record, ...], bool]] = {
    # held; route; goal; for whom it makes room; who is heard
    "it has a way to go":                 ((E,),      (F,), C, (),      (),                         True),
    "it is at its goal":                  ((F,),      (),   F, (),      (),                         True),
    "it was sent aside, and is there":    ((F,),      (),   A, (),      (record(),),                False),
    "it makes room for who comes":        ((F,),      (),   A, ("r1",), (record(),),                True),
    "it makes room, under way":           ((E, F),    (),   A, ("r1",), (),                         True),
    "it has made room":                   ((F,),      (),   A, ("r1",), (),                         False),
    "another comes first at its goal":    ((F,),      (),   C, (),      (record(),),                True),
    "a cell it leaves is waited for":     ((D, E, F), (),   A, (),      (record(claims=(BEHIND,)),), True),
    "the cell it is in is":               ((D, E, F), (),   A, (),      (record(claims=(AHEAD,)),), False),
}
# fmt: on


@pytest.mark.parametrize("name", KEEPS)
def test_a_robot_stays_in_its_plan_while_it_or_another_needs_it(name: str) -> None:
    held, route, goal, until, fresh, keeps = KEEPS[name]
    progress = RouteProgress(Reservations(held), tuple(range(len(held))), route, following=True)
    assert following(*until).keeps(progress, situation(*fresh, goal=goal)) is keeps


@pytest.mark.parametrize("name", KEEPS)
def test_nobody_waits_at_the_end_of_a_way_that_leads_on_through_a_target(name: str) -> None:
    held, route, goal, until, fresh, keeps = KEEPS[name]
    progress = RouteProgress(Reservations(held), tuple(range(len(held))), route, following=True)
    on_its_way = bool(route) or held[-1] == goal
    assert following(*until, through=True).keeps(progress, situation(*fresh, goal=goal)) is (keeps and on_its_way)
