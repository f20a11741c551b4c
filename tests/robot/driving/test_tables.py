"""The tables' inputs, in their own units."""

from math import pi
from typing import cast

import pytest

from swarm.fuzzy import Controller
from swarm.messages import Sense
from swarm.robot.driving.tables import fuzzy_speeds
from tests.shared import scenario_of


class Listening:
    """Tables that note what they are asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[float, ...]] = []

    def wheel_speeds(self, *inputs: float) -> tuple[float, float]:
        self.asked.append(inputs)
        return 1.0, 2.0


@pytest.mark.parametrize(
    ("speed", "distance", "scale"), [(1.0, 1.0, 1.0), (0.4, 1.0, 1.0), (0.4, 0.5, 1.0), (0.25, 2.0, 0.5)]
)
def test_the_tables_are_asked_in_their_own_units_and_answer_in_theirs(
    speed: float, distance: float, scale: float
) -> None:
    """Distances divided by both scales, degrees with right positive; rim speeds times theirs."""
    robot = scenario_of(robot={"speed_scale": speed, "distance_scale": distance}).settings.robot
    sense = Sense(
        world="local",
        run=0, tick=0, time=0.0, lockstep=True, x=0.0, y=0.0, yaw=0.0, linear=0.0, angular=0.0,
        left=1.0, front=0.5, right=0.25, bearings=[], hears=[], rays=[],
    )  # fmt: skip
    tables = Listening()
    assert fuzzy_speeds(cast(Controller, tables), robot, sense, pi / 6, scale) == pytest.approx((speed, 2.0 * speed))
    unit = distance * scale
    assert tables.asked == [pytest.approx((1.0 / unit, 0.5 / unit, 0.25 / unit, -30.0))]
