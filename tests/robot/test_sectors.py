"""The three proximity sectors: the body angles of their rays."""

from itertools import pairwise
from math import pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.robot.sectors import ray_angles, sectors
from swarm.settings import SensorSettings


def test_the_papers_sectors_are_left_front_and_right() -> None:
    left, front, right = sectors(SensorSettings())
    assert [angle for angle in left if angle <= 0] == []
    assert [angle for angle in right if angle >= 0] == []
    assert front[len(front) // 2] == pytest.approx(0.0)
    assert (min(left), max(left)) == pytest.approx((radians(35), radians(85)))
    assert (min(front), max(front)) == pytest.approx((radians(-25), radians(25)))


@given(
    st.floats(1, 179), st.floats(0, 90), st.floats(0, 90), st.integers(1, 99).filter(lambda rays: rays % 2)
)  # fmt: skip
def test_left_and_right_are_mirror_images(side: float, side_half: float, front_half: float, rays: int) -> None:
    settings = SensorSettings(
        side_deg=side, side_half_width_deg=side_half, front_half_width_deg=front_half, rays=rays
    )  # fmt: skip
    left, front, right = sectors(settings)
    assert len(left) == len(front) == len(right) == rays
    for a, b in zip(left, reversed(right), strict=True):
        assert abs(abs(a + b) - 2 * pi) < 1e-9 or a + b == pytest.approx(0.0, abs=1e-9)
    for a, b in zip(front, reversed(front), strict=True):
        assert a + b == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-3, 3), st.floats(0, 0.1), st.integers(2, 20))
def test_a_fan_is_even_and_reaches_both_ends(middle: float, half: float, rays: int) -> None:
    angles = ray_angles(middle, half, rays)
    assert (angles[0], angles[-1]) == pytest.approx((middle - half, middle + half))
    steps = [b - a for a, b in pairwise(angles)]
    assert steps == pytest.approx([2 * half / (rays - 1)] * (rays - 1))
    assert ray_angles(middle, half, 1) == (middle,)
