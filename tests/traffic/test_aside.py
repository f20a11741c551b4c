"""Moving aside: for a mute robot that stands beside and wants to go on, for a while, and to another place each time."""

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


def goals(mute: tuple[float, float], ticks: int, *, rests: bool = False, stands: bool = False) -> list[Point | None]:
    """Return the goal in each tick of a robot that stands at ``HERE`` and has none of its own."""
    mutes, aside, found = Mutes(TrafficSettings()), Aside(), list[Point | None]()
    for tick in range(ticks):
        mutes.hear(tick, [Spoken("f1", tick, Pose(*mute, 0.0), rests)], {})
        inputs = TrafficInputs(tick, Pose(*HERE, 0.0), None, stands=stands)
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
    ("mute", "fields"), [(FAR, {}), (BESIDE, {"rests": True}), (BESIDE, {"stands": True})],
    ids=["it is far away", "it wants to go nowhere", "this robot was told to stop"],
)  # fmt: skip
def test_otherwise_it_stays(mute: tuple[float, float], fields: dict[str, bool]) -> None:
    assert goals(mute, 2 * SAYS, **fields) == [None] * (2 * SAYS)
