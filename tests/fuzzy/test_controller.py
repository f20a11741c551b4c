from math import inf, nan

import numpy as np
import pytest

from swarm.robot.fuzzy import ControlInputError, Controller, load_profile

PAPER = Controller(load_profile("paper"))

# left, front, right [m], head_ang [degrees, right positive] -> left_v, right_v [m/s]; the project's reference values
REFERENCE = [
    (1.60, 1.60, 1.60, 0.0, 1.5000, 1.5000),
    (1.60, 1.60, 1.60, -90.0, 1.5000, 3.0000),
    (1.60, 1.60, 1.60, 45.0, 3.0000, 1.5000),
    (1.60, 1.60, 1.60, 10.0, 2.1111, 1.5000),
    (0.30, 0.30, 0.30, 0.0, 1.0000, 3.0000),
    (0.30, 1.60, 1.60, 20.0, 3.0000, 1.5000),
    (1.60, 0.70, 1.60, -40.0, 2.6250, 1.5108),
    (0.90, 1.20, 0.75, 15.0, 1.9800, 1.8547),
    (0.65, 1.00, 1.30, -25.0, 1.3287, 1.1875),
    (1.00, 0.85, 0.95, 170.0, 2.5612, 1.4739),
    (1.10, 1.10, 1.10, -5.0, 1.5000, 1.8812),
]


@pytest.mark.parametrize("row", REFERENCE)
def test_reference_values(row: tuple[float, ...]) -> None:
    left, front, right, heading, *expected = row
    assert PAPER.wheel_speeds(left, front, right, heading) == pytest.approx(expected, abs=5e-5)


def test_many_rows_are_the_single_ones_bit_for_bit() -> None:
    rows = np.random.default_rng(1).uniform([0, 0, 0, -180], [2, 2, 2, 180], (500, 4))
    assert [tuple(row) for row in PAPER.wheel_speeds_many(rows).tolist()] == [PAPER.wheel_speeds(*row) for row in rows]


@pytest.mark.parametrize("bad", [nan, inf, -inf])
@pytest.mark.parametrize("name", ["left_obs", "front_obs", "right_obs", "head_ang"])
def test_what_is_not_finite_is_refused_by_name(name: str, bad: float) -> None:
    inputs = {"left_obs": 1.0, "front_obs": 1.0, "right_obs": 1.0, "head_ang": 0.0} | {name: bad}
    with pytest.raises(ControlInputError, match=f"^{name}: expected a finite number, got {bad}"):
        PAPER.wheel_speeds(*inputs.values())
    with pytest.raises(ControlInputError, match=f"^row 1: {name}: "):
        PAPER.wheel_speeds_many(np.array([[1, 1, 1, 0], list(inputs.values())]))
