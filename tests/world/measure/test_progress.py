"""Detection of robots without progress, and of the time it began; robots are moved by hand over the floor."""

from math import inf

import pytest

from swarm.geometry import Pose
from world.measure.progress import SQUARE, STALLED, ProgressWatch

DT = 1.0  # s
FULL = round(STALLED / DT)


def progress(*rows: list[tuple[float, int | None]]) -> tuple[ProgressWatch, list[tuple[int, int]]]:
    """Look at robots at these x [m] and on the way to these stops, tick by tick; say who stalled when."""
    watch = ProgressWatch(len(rows))
    begun = []
    for tick, states in enumerate(zip(*rows, strict=True)):
        poses = [Pose(x, 0.5, 0.0) for x, _ in states]
        begun += [(tick, number) for number in watch.look(tick * DT, poses, [stop for _, stop in states])]
    return watch, begun


def still(ticks: int, x: float = 0.5, stop: int | None = 0) -> list[tuple[float, int | None]]:
    return [(x, stop)] * ticks


# fmt: off
STALLS: dict[str, tuple[list[tuple[float, int | None]], list[int], float]] = {  # when it stalls, the longest [s]
    "not long enough":                   (still(FULL),                                     [],            STALLED - DT),
    "just long enough":                  (still(FULL + 1),                                 [FULL],        STALLED),
    "for ever, once":                    (still(4 * FULL + 1),                             [FULL],        4 * STALLED),
    "to and fro in two squares":         ([(0.5 + tick % 2, 0) for tick in range(FULL + 2)], [FULL + 1],  STALLED),
    "one new square in time":            (still(FULL) + still(FULL, 1.5),                  [],            STALLED - DT),
    "one new square too late":           (still(FULL + 1) + still(FULL, 1.5),              [FULL],        STALLED),
    "stalls twice":                      (still(FULL + 1) + still(FULL + 1, 1.5),          [FULL, 2 * FULL + 1], STALLED),
    "another stop in time":              (still(FULL) + still(FULL, stop=1),               [],            STALLED - DT),
    "another stop frees the squares":    (still(9) + still(9, 1.5) + still(FULL, 0.5, 1),  [],            STALLED - DT),
    "a place it has been to is no new":  (still(9) + still(9, 1.5) + still(FULL, 0.5),     [9 + FULL],    8.0 + FULL),
    "no stop left":                      (still(4 * FULL, stop=None),                      [],            0.0),
    "no stop left, then one again":      (still(FULL, stop=None) + still(FULL),            [],            STALLED - DT),
    "within one square, however far":    ([(0.01 + 0.98 * (tick % 2), 0) for tick in range(FULL + 1)], [FULL], STALLED),
    "on the other side of nought":       ([(-0.5 + tick % 2, 0) for tick in range(FULL)],  [],            STALLED - 2 * DT),
}
# fmt: on


@pytest.mark.parametrize("name", STALLS)
def test_who_enters_no_new_square_for_long_has_stalled(name: str) -> None:
    states, when, longest = STALLS[name]
    watch, begun = progress(states)
    assert begun == [(tick, 0) for tick in when]
    assert watch.state.times == [len(when)]
    assert watch.state.longest == [pytest.approx(longest)]


def test_each_robot_is_judged_by_itself() -> None:
    moving: list[tuple[float, int | None]] = [(SQUARE * tick, 0) for tick in range(FULL + 1)]
    watch, begun = progress(moving, still(FULL + 1), still(FULL + 1, stop=None))
    assert begun == [(FULL, 1)]
    assert watch.state.times == [0, 1, 0]
    assert watch.standing(FULL * DT) == [0.0, STALLED, inf]


def test_a_step_along_y_is_a_new_square_too() -> None:
    watch = ProgressWatch(1)
    for tick in range(2 * FULL):
        assert watch.look(tick * DT, [Pose(0.5, tick // 30 + 0.5, 0.0)], [0]) == []
