"""Moving aside: for a mute robot that stands beside and wants to go on, for a while, and to another place each time."""

from typing import Any

import pytest

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.traffic.aside import CLEAR, LASTS, Aside
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.mute import SAYS, Mutes, Spoken
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
        if got.goal != HERE and got is not given and aside._since < tick:
            assert (got.path, got.done) == ((), False)
            break
    else:
        raise AssertionError("it does not move aside")
    told = given._replace(tick=tick + 1, stands=True)
    assert aside.look(told, mutes, HEAD, (), CELLS) == told
    assert aside.look(given._replace(tick=tick + 2), mutes, HEAD, (), CELLS).goal == HERE, "it has to wait again"


HALL = Drawn("abcdefghij")

# fmt: off
PLACES: dict[str, tuple[str, str, str, str]] = {  # where mute robots stand, the head, cells taken: the places in turn
    "the four nearest":          ("b",  "c", "",  "efgde"),
    "its own cell is no wall":   ("b",  "c", "c", "efgde"),
    "not through what is taken": ("b",  "c", "e", "dd"),
    "nowhere":                   ("b",  "c", "d", "--"),
    "not too far":               ("c",  "a", "",  "fgefg"),
    "clear of both":             ("bf", "c", "",  "ihi"),
    "nothing is clear of all":   ("behj", "c", "", "--"),
}
# fmt: on


@pytest.mark.parametrize("name", PLACES)
def test_the_place_aside_is_near_free_and_clear_of_all(name: str) -> None:
    mute, head, taken, expected = PLACES[name]
    near = [Pose(x - 0.1, y, 0.0) for x, y in HALL.points(mute)]  # so that no distance is just the least
    aside, (start,) = Aside(), HALL.at(head)
    found = [aside._place(near, start, HALL.at(taken), HALL.cells) for _ in expected]
    centres = {HALL.cells.centre(cell): one for one in HALL.names for cell in HALL.at(one)}
    assert "".join("-" if at is None else centres[at] for at in found) == expected
