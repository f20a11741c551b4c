"""The judge of the other generator's worlds sees the contacts that are planted, and only those that a robot makes."""

import numpy as np
import pytest

from benchmarks.other_worlds import Drawn, judge, touched
from swarm.storm.free_space import label_spaces
from world.faults import Faults

SOLID = np.pad(np.zeros((4, 6), np.bool_), 1, constant_values=True)  # a hall of 6 m by 4 m, walls of 1 m around it
HALL = Drawn({}, SOLID, 1.0, label_spaces(SOLID, 1.0, 0.2), Faults())
MID, WALL, BESIDE = (3.0, 3.0), (1.1, 3.0), (1.45, 3.0)
FAR = (6.0, 4.0)

# fmt: off
CASES = {  # places of two robots and of a mover in the last of five ticks: what is seen
    "all apart":                     ((MID, (5.0, 2.0)),  FAR,        set()),
    "into a wall":                   ((WALL, (5.0, 2.0)), FAR,        {"wall"}),
    "pushed into a wall":            ((WALL, (5.0, 2.0)), BESIDE,     set()),
    "another one is pushed":         ((WALL, (5.0, 2.0)), (5.3, 2.0), {"wall"}),
    "robots":                        ((MID, (3.3, 3.0)),  FAR,        {"robot"}),
    "pushed into a robot":           ((MID, (3.3, 3.0)),  (3.7, 3.0), set()),
    "robots, and a mover near":      ((MID, (3.3, 3.0)),  (3.8, 3.0), {"robot"}),
    "a mover comes to who stands":   ((MID, (5.0, 2.0)),  (3.3, 3.0), set()),
}
# fmt: on


@pytest.mark.parametrize("name", CASES)
def test_a_planted_contact_is_seen(name: str) -> None:
    robots, mover, seen = CASES[name]
    poses = np.tile(np.array([MID, (5.0, 2.0)]), (5, 1, 1))
    movers = np.tile(np.array([FAR]), (5, 1, 1))
    poses[4], movers[4] = robots, mover
    assert set(touched(HALL, poses, movers)) == seen


@pytest.mark.parametrize(("by_itself", "seen"), [(False, set()), (True, {"wall"})])
def test_who_was_pushed_into_a_wall_may_be_in_it_when_the_mover_has_gone(by_itself: bool, seen: set[str]) -> None:
    poses = np.tile(np.array([WALL, (5.0, 2.0)]), (5, 1, 1))
    movers = np.tile(np.array([FAR]), (5, 1, 1))
    poses[0, 0], movers[1 + by_itself] = MID, BESIDE
    assert set(touched(HALL, poses, movers)) == seen


def test_who_drives_into_a_mover_touches_it() -> None:
    poses = np.array([[(2.0 + 0.05 * tick, 3.0)] for tick in range(20)])
    assert set(touched(HALL, poses, np.tile(np.array([MID]), (20, 1, 1)))) == {"mover"}


# fmt: off
KEPT = {  # worlds that were broken once: by what
    22013: "robots fled from walls that noise showed as obstacles, and stood",
    50517: "a robot drove into a pocket behind a wall beside its way, and stood",
    70096: "two robots started in one cell, and one held the cell beyond the other",
    60117: "a robot in a lane half a cell wide beside its way asked for one of the two cells that lead back",
    50746: "a robot whose answers came 0.2 s late touched a wall",
    51133: "a robot drove past a mover where it had once stood",
    50346: "a robot whose answers came 0.2 s late drove into a mover",
    80217: "eight robots on sixteen cells moved for minutes until all stood at their goals at once",
    100024: "a robot gave up the cell between it and its way, and another one took it",
    120769: "a robot alone began its way again in a cell that joins no other",
    120742: "a robot went round a loop before it had left the first cell of it, and gave up the cells between",
}
# fmt: on


@pytest.mark.long("whole missions, some 10 s each")
@pytest.mark.parametrize("seed", KEPT)
def test_what_was_broken_once_is_not_again(seed: int) -> None:
    judged = judge(seed)
    assert judged is not None
    assert (judged.driven, judged.broken) == (True, ()), judged.why
