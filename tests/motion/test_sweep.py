"""Clearances along predicted ways, in figures worked out by hand."""

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm.motion.drive import clearance_along, first_clear, line_room, path_room
from swarm.planning.grid import Grid
from swarm.robot.driving.safety import AS_IT_IS, NO_BODIES
from swarm.robot.tuning import SAFETY
from tests.robot.driving.shared import DRIVE, DT, MOST, RADIUS
from tests.shared import scenario_of

HALL = Grid.grown(scenario_of("#" * 9 + "\n" + ("#" + "." * 7 + "#\n") * 7 + "#" * 9 + "\n").map, RADIUS, 0.8, 0.1)
TICKS = 8  # of 0.05 s


def test_rooms_are_distances_to_boxes() -> None:
    boxes = np.array([[1.0, -1.0, 2.0, 1.0]])
    assert line_room(boxes, 0.0, 0.0, 0.5, 0.0) == pytest.approx(0.5)
    stands = path_room(boxes, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, DRIVE.track_width, MOST, DT, TICKS)
    assert stands == pytest.approx(1.0)
    drives = path_room(boxes, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5, DRIVE.track_width, MOST, DT, TICKS)
    assert drives == pytest.approx(1.0 - 8 * 0.05 * 0.5 - (0.4 + 0.3 + 0.2 + 0.1) * 0.05)


def may_drive(speed: float, boxes: NDArray[np.float64], bodies: NDArray[np.float64]) -> bool:
    """Return True if a robot at rest may drive straight at a speed [m/s]."""
    number, *_ = first_clear(
        AS_IT_IS, speed, 0.0, 1.0, SAFETY.creep, RADIUS + SAFETY.gap, boxes, 0.0, 0.0, 0.0,
        HALL.clearance, HALL.resolution, *HALL.origin, bodies, RADIUS, 4.5, 4.5, 0.0,
        0.0, 0.0, DRIVE.track_width, MOST, DT, TICKS,
    )  # fmt: skip
    return number == 0.0


@pytest.mark.parametrize(
    ("gap", "loss", "clear"),
    [
        (40.0, 9.9, True),  # mm; 30 mm have to be left
        (40.0, 10.1, False),
        (20.0, 0.9, True),  # nearer than that it may lose 1 mm
        (20.0, 1.1, False),
        (10.5, 0.4, True),  # but nothing below 10 mm
        (10.5, 0.6, False),
        (9.0, 0.1, False),
        (9.0, -0.1, True),  # it backs out
        (9.0, 0.0, True),
    ],
)
def test_the_nearer_it_is_the_less_clearance_it_may_lose(gap: float, loss: float, clear: bool) -> None:
    """A robot at rest, a box straight ahead; the speed is that which is held for all ticks to lose so much."""
    boxes = np.array([[RADIUS + gap / 1000, -1.0, 2.0, 1.0]])
    speed = loss / 1000 / (TICKS * DT)
    assert may_drive(speed, boxes, NO_BODIES) is clear


@pytest.mark.parametrize(("speed", "clear"), [(0.0, True), (0.1, False), (-0.1, True)])
def test_a_body_that_came_near_takes_nothing_from_what_is_due_to_a_cell(speed: float, clear: bool) -> None:
    """A mover presses from behind; ahead is a cell that is not granted, at the clearance to keep."""
    boxes = np.array([[RADIUS + SAFETY.gap, -1.0, 2.0, 1.0]])
    presses = np.array([[4.5 - 2 * RADIUS + 0.05, 4.5 + 0.5 * RADIUS, RADIUS]])
    near = presses if speed >= 0.0 else presses + np.array([2 * RADIUS, 0.0, 0.0])  # it backs out: the mover is ahead
    assert may_drive(speed, boxes, near) is clear


SLOPE = np.array([[10.0 * row + column for column in range(4)] for row in range(3)], np.float32)


@pytest.mark.parametrize(
    ("along", "up", "room"),
    [
        (0.5, 0.5, 0.0),  # cells from the corner: the middle of the first cell
        (2.5, 1.5, 12.0),
        (2.75, 2.0, 17.25),  # between four middles
        (0.6, 1.5, 10.1),
        (0.4, 1.5, 0.0),  # beyond the outermost middles nothing is known
        (3.4, 1.5, 12.9),
        (3.6, 1.5, 0.0),
        (2.5, 0.6, 3.0),
        (2.5, 0.4, 0.0),
        (2.5, 2.4, 21.0),
        (2.5, 2.6, 0.0),
    ],
)
def test_between_the_middles_of_cells_the_clearance_is_interpolated(along: float, up: float, room: float) -> None:
    x, y = 7.0 + 0.1 * along, -3.0 + 0.1 * up
    got, _ = clearance_along(
        SLOPE, 0.1, 7.0, -3.0, 0.0, NO_BODIES, x, y, 0.0,
        0.0, 0.0, 0.0, 0.0, DRIVE.track_width, MOST, DT, 1,
    )  # fmt: skip
    assert got == pytest.approx(room, abs=1e-6)
