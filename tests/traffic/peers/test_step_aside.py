"""Moving aside: for a mute robot that stands beside and wants to go on, for a while, and to another place each time."""

from itertools import groupby
from typing import Any

import pytest

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.peers.uncooperative import CLEAR, LASTS, SAYS, Mutes, Spoken, StepAside
from swarm.traffic.settings import TrafficConstants
from swarm.traffic.step import Traffic
from tests.traffic.maps import Drawn

ROOM = Drawn("######", "#abcd#", "#efgh#", "#ijkl#", "######")
CELLS = ROOM.cells
HERE, BESIDE, FAR = (CELLS.centre(cell) for cell in ROOM.at("abd"))
HEAD = ROOM.at("a")[0]


def goals(
    mute: tuple[float, float], ticks: int, *, rests: bool = False, stands: bool = False, moves: float = 0.0
) -> list[Point | None]:
    """Return the place aside in each tick of a robot at ``HERE``; it ``moves`` [m] now and then."""
    mutes, aside, found = Mutes(TrafficConstants()), StepAside(), list[Point | None]()
    for tick in range(ticks):
        mutes.hear(tick, [Spoken("f1", tick, Pose(*mute, 0.0), rests)], {})
        there = HERE[0] + moves * (tick // (SAYS // 2) % 2)
        found.append(aside.decide(tick, Pose(there, HERE[1], 0.0), mutes, HEAD, (), CELLS, stands=stands))
    return found


def test_after_long_it_goes_to_a_place_clear_of_the_mute_robot_and_comes_back() -> None:
    found = goals(BESIDE, 3 * (SAYS + LASTS))
    asides = [goal for goal in dict.fromkeys(found) if goal is not None]
    first = next(tick for tick, goal in enumerate(found) if goal is not None)
    assert first > SAYS
    assert None in found[first : first + LASTS + 1], "it comes back"
    assert len(asides) >= 2, "another place each time"
    assert all(distance(goal, BESIDE) >= CLEAR * CELLS.side for goal in asides)


@pytest.mark.parametrize(
    ("mute", "fields"), [(FAR, {}), (BESIDE, {"rests": True}), (BESIDE, {"stands": True}), (BESIDE, {"moves": 0.31})],
    ids=["it is far away", "it wants to go nowhere", "this robot was told to stop", "this robot gets on"],
)  # fmt: skip
def test_otherwise_it_stays(mute: tuple[float, float], fields: dict[str, Any]) -> None:
    assert goals(mute, 2 * SAYS, **fields) == [None] * (2 * SAYS)


def test_it_moves_aside_until_it_is_told_to_stop() -> None:
    mutes, aside, pose = Mutes(TrafficConstants()), StepAside(), Pose(*HERE, 0.0)
    for tick in range(2 * SAYS):
        mutes.hear(tick, [Spoken("f1", tick, Pose(*BESIDE, 0.0))], {})
        if aside.decide(tick, pose, mutes, HEAD, (), CELLS, stands=False) is not None:
            break
    else:
        raise AssertionError("it does not move aside")
    assert aside.decide(tick + 1, pose, mutes, HEAD, (), CELLS, stands=True) is None
    assert aside.decide(tick + 2, pose, mutes, HEAD, (), CELLS, stands=False) is None, "it has to wait again"


def test_aside_it_drives_by_any_way_and_is_not_done() -> None:
    """Its planner's path leads elsewhere; its record says where it goes now."""
    traffic, pose, said = Traffic("r1", CELLS, TrafficConstants()), Pose(*HERE, 0.0), set[tuple[bool, bool]]()
    for tick in range(2 * SAYS):
        mute = [Spoken("f1", tick, Pose(*BESIDE, 0.0))]
        inputs = TrafficInputs(tick, pose, HERE, done=True, mute=mute, path=(HERE, BESIDE))
        broadcast = traffic.step(inputs, CELLS).broadcast
        if broadcast is not None:
            said.add((broadcast.own.done, broadcast.own.goal == HEAD))
    assert said == {(True, True), (False, False)}


# fmt: off
PLACES: dict[str, tuple[str, str, str, str, str]] = {  # the cells of a hall, where mute robots stand, the head, cells taken: the places in turn
    "the four nearest":          ("abcdefghij", "b",  "c", "",  "efgde"),
    "its own cell is no wall":   ("abcdefghij", "b",  "c", "c", "efgde"),
    "not through what is taken": ("abcdefghij", "b",  "c", "e", "dd"),
    "nowhere":                   ("abcdefghij", "b",  "c", "d", "--"),
    "not too far":               ("abcdefghij", "c",  "a", "",  "fgefg"),
    "clear of both":             ("abcdefghij", "bd", "c", "",  "ghif"),
    "nothing is clear":          ("abc",        "b",  "c", "",  "--"),
}
# fmt: on


@pytest.mark.parametrize("name", PLACES)
def test_the_place_aside_is_near_free_and_clear_of_all(name: str) -> None:
    cells, mute, head, taken, expected = PLACES[name]
    hall, mutes, aside = Drawn(cells), Mutes(TrafficConstants()), StepAside()
    x, y = hall.points(head)[0]
    pose, found = Pose(x + 0.6 * hall.cells.side * (head == "a"), y, 0.0), ""
    centres = {point: one for one in cells for point in hall.points(one)}
    near = [Pose(x - 0.1, y, 0.0) for x, y in hall.points(mute)]  # so that no distance is just the least
    for tick in range(len(expected) * (SAYS + LASTS + 2)):
        mutes.hear(tick, [Spoken(f"f{number}", tick, at) for number, at in enumerate(near)], {})
        got = aside.decide(tick, pose, mutes, hall.at(head)[0], hall.at(taken), hall.cells, stands=False)
        found += "-" if got is None else centres[got]
    turns = [one for one, _ in groupby(found) if one != "-"]
    assert "".join(turns) == expected.replace("-", "")
