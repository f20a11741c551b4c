"""The square and what it shows, with robots whose latency, accelerations and errors are known."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import pi

import pytest

from swarm.bridge.body.readings import Odometry
from swarm.bridge.body.square import OdometrySample, Square, format_square_result, measure_square
from swarm.errors import PeerError
from swarm.geometry import Pose, Twist, integrate
from swarm.motion.drive import ramp

STEP = 0.02  # s, between two odometries
WIDTH = 0.4  # m


@dataclass
class Plant:
    late: float = 0.1  # s
    acceleration: float = 0.5  # m/s2
    turning: float = 1.0
    share: float = 1.0
    pose: Pose = field(default_factory=lambda: Pose(3.0, 4.0, 1.0))
    twist: Twist = field(default_factory=lambda: Twist(0.0, 0.0))

    def drives(self, square: Square, most: float = 120.0) -> Iterator[Twist]:
        """Drive the square; yield what it commands."""
        waiting = deque([Twist(0.0, 0.0)] * round(self.late / STEP))
        gain = self.acceleration * STEP
        for tick in range(round(most / STEP)):
            command = square.add_sample(
                OdometrySample(tick * STEP, Odometry(tick * STEP, self.pose, self.twist), self.pose)
            )
            yield command
            if square.is_done:
                return
            waiting.append(command)
            now = waiting.popleft()
            self.twist = Twist(
                ramp(self.twist.linear, now.linear * self.share, gain),
                ramp(self.twist.angular, now.angular * self.turning * self.share, gain * 2 / WIDTH),
            )
            self.pose = integrate(self.pose, self.twist, STEP)


@pytest.mark.parametrize("late", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("acceleration", [0.3, 1.0])
@pytest.mark.parametrize("turning", [0.8, 1.0, 1.1])
def test_a_square_shows_how_late_quick_and_wide_a_robot_is(late: float, acceleration: float, turning: float) -> None:
    square = Square(1.0, 0.3, 1.0)
    plant = Plant(late, acceleration, turning)
    commands = list(plant.drives(square))
    assert square.is_done
    assert commands[-1] == Twist(0.0, 0.0)
    found = measure_square(square, WIDTH)
    assert found.rate == pytest.approx(50.0)
    assert found.latency[1] == pytest.approx(late + 0.3 * 0.1 / acceleration, abs=2.5 * STEP)
    assert found.acceleration == pytest.approx(acceleration, rel=0.2)
    assert found.braking == pytest.approx(acceleration, rel=0.2)
    assert found.top_speed == pytest.approx(0.3)
    assert found.driven == pytest.approx(1.0, abs=0.01)
    assert found.turned == pytest.approx(turning, rel=0.02)


def test_the_robot_stands_between_two_moves_and_the_moves_alternate() -> None:
    square = Square(1.0, 0.3, 1.0)
    commands = list(Plant().drives(square))
    changes = [after for before, after in pairwise(commands) if after != before]
    stands, forward, left = Twist(0.0, 0.0), Twist(0.3, 0.0), Twist(0.0, 1.0)
    assert changes == [forward, stands, left, stands] * 4


def test_what_is_told_are_lines_for_a_scenario() -> None:
    square = Square(1.0, 0.3, 1.0)
    list(Plant(turning=0.8).drives(square))
    lines = list(format_square_result(measure_square(square, WIDTH), WIDTH, 0.3, "/pose"))
    assert any(line.startswith("turning             0.800 of what was commanded, by /pose") for line in lines)
    assert "  track_width: 0.500" in lines
    assert "  speed_scale: 0.075  # wheels of at most 0.30 m/s" in lines


@pytest.mark.parametrize("share", [0.0, 0.2])
def test_a_robot_that_does_not_do_what_it_is_told_is_given_up(share: float) -> None:
    with pytest.raises(PeerError, match=r"expected a side in 3.3 s, got .* m and 0.00 rad in 12.\d s; does the robot"):
        list(Plant(share=share).drives(Square(1.0, 0.3, 1.0)))


def test_a_turn_is_a_quarter() -> None:
    square = Square(1.0, 0.3, 1.0)
    list(Plant(late=0.0, acceleration=50.0).drives(square))
    assert [move.told for move in square.moves if move.is_turn] == pytest.approx([pi / 2] * 4, abs=2 * STEP)
