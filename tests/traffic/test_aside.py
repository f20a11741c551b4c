"""Moving aside: for a mute robot that stands beside and wants to go on, for a while, and to another place each time."""

from itertools import groupby
from typing import Any

import pytest

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.peers.step_aside import CLEAR, LASTS, Aside
from swarm.traffic.peers.uncooperative import SAYS, Mutes, Spoken
from swarm.traffic.settings import TrafficSettings
from tests.traffic.maps import Drawn

ROOM = Drawn("######", "#abcd#", "#efgh#", "#ijkl#", "######")
CELLS = ROOM.cells
HERE, BESIDE, FAR = (CELLS.centre(cell) for cell in ROOM.at("abd"))
HEAD = ROOM.at("a")[0]


def goals(
    mute: tuple[float, float], ticks: int, *, rests: bool = False, stands: bool = False, moves: float = 0.0
) -> list[Point | None]:
    """Return the goal in each tick of a robot at ``HERE`` that has none of its own; it ``moves`` [m] now and then."""
    mutes, aside, found = Mutes(TrafficSettings()), Aside(), list[Point | None]()
    for tick in range(ticks):
        mutes.hear(tick, [Spoken("f1", tick, Pose(*mute, 0.0), rests)], {})
        there = HERE[0] + moves * (tick // (SAYS // 2) % 2)
        inputs = TrafficInputs(tick, Pose(there, HERE[1], 0.0), None, stands=stands)
        found.append(aside.look(inputs, mutes, HEAD, (), CELLS).goal)
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


def test_aside_it_drives_there_by_any_way_and_is_not_done_until_it_is_told_to_stop() -> None:
    mutes, aside = Mutes(TrafficSettings()), Aside()
    inputs = TrafficInputs(0, Pose(*HERE, 0.0), HERE, done=True, path=(HERE, BESIDE))
    for tick in range(2 * SAYS):
        mutes.hear(tick, [Spoken("f1", tick, Pose(*BESIDE, 0.0))], {})
        given = inputs._replace(tick=tick)
        got = aside.look(given, mutes, HEAD, (), CELLS)
        if got.goal != HERE:
            assert (got.path, got.done) == ((), False)
            break
    else:
        raise AssertionError("it does not move aside")
    told = given._replace(tick=tick + 1, stands=True)
    assert aside.look(told, mutes, HEAD, (), CELLS) == told
    assert aside.look(given._replace(tick=tick + 2), mutes, HEAD, (), CELLS).goal == HERE, "it has to wait again"


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
    hall, mutes, aside = Drawn(cells), Mutes(TrafficSettings()), Aside()
    x, y = hall.points(head)[0]
    pose, found = Pose(x + 0.6 * hall.cells.side * (head == "a"), y, 0.0), ""
    centres = {point: one for one in cells for point in hall.points(one)}
    near = [Pose(x - 0.1, y, 0.0) for x, y in hall.points(mute)]  # so that no distance is just the least
    for tick in range(len(expected) * (SAYS + LASTS + 2)):
        mutes.hear(tick, [Spoken(f"f{number}", tick, at) for number, at in enumerate(near)], {})
        got = aside.look(TrafficInputs(tick, pose, None), mutes, hall.at(head)[0], hall.at(taken), hall.cells).goal
        found += "-" if got is None else centres[got]
    turns = [one for one, _ in groupby(found) if one != "-"]
    assert "".join(turns) == expected.replace("-", "")
