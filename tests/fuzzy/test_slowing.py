"""A profile with `slowing`: the same tables, slower near obstacles, for every caller."""

import json
from dataclasses import replace
from math import nextafter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.fuzzy import Controller, load_profile
from swarm.fuzzy.explain import explain
from swarm.fuzzy.kernel import slowing_factor
from swarm.geometry import Pose
from swarm.messages import Sense
from swarm.robot.driving.safety import DriveState
from swarm.robot.driving.tables import Rollout
from tests.shared import scenario_of

PAPER, CAREFUL = Controller(load_profile("paper")), Controller(load_profile("careful"))
distances = st.floats(0.0, 2.0)
headings = st.floats(-180.0, 180.0)


def test_careful_has_the_papers_tables() -> None:
    assert replace(CAREFUL.profile, name="paper", description=PAPER.profile.description, slowing=None) == PAPER.profile


# fmt: off
FACTORS = [  # nearest, near, far [m], least: the factor
    (0.0, 0.6, 1.4, 0.3, 0.3),
    (0.6, 0.6, 1.4, 0.3, 0.3),
    (0.8, 0.6, 1.4, 0.3, 0.475),
    (1.0, 0.6, 1.4, 0.3, 0.65),
    (1.4, 0.6, 1.4, 0.3, 1.0),
    (9.0, 0.6, 1.4, 0.3, 1.0),
    (0.5, 0.0, 1.0, 0.5, 0.75),
    (0.0, 0.0, 1.0, 0.5, 0.5),
    (0.0, 0.0, 0.0, 1.0, 1.0),  # a profile without slowing
    (5.0, 0.0, 0.0, 1.0, 1.0),
]
# fmt: on


@pytest.mark.parametrize(("nearest", "near", "far", "least", "factor"), FACTORS)
def test_the_factor(nearest: float, near: float, far: float, least: float, factor: float) -> None:
    assert slowing_factor(nearest, near, far, least) == pytest.approx(factor, abs=1e-15)


@given(st.lists(st.floats(0.0, 2.0), min_size=2, max_size=2).map(sorted), st.floats(0.001, 0.999))
def test_the_factor_never_falls_as_the_nearest_distance_grows(nearest: list[float], least: float) -> None:
    smaller, larger = (slowing_factor(one, 0.6, 1.4, least) for one in nearest)
    assert least <= smaller <= larger <= 1.0
    at_the_end = slowing_factor(nextafter(1.4, 0.0), 0.6, 1.4, least)
    assert at_the_end == pytest.approx(1.0, abs=1e-12), "no step"


@given(distances, distances, distances, headings)
def test_careful_drives_the_papers_arc_and_never_faster(
    left: float, front: float, right: float, heading: float
) -> None:
    fast, slow = (controller.wheel_speeds(left, front, right, heading) for controller in (PAPER, CAREFUL))
    nearest = min(left, front, right)
    factor = float(np.interp(nearest, [0.6, 1.4], [0.3, 1.0]))
    assert slow == pytest.approx((factor * fast[0], factor * fast[1]), rel=1e-12)
    assert all(0.0 < one <= other for one, other in zip(slow, fast, strict=True))
    if nearest >= 1.4:
        assert slow == fast, "bit for bit"
    (many,) = CAREFUL.wheel_speeds_many([(left, front, right, heading)]).tolist()
    assert tuple(many) == slow


@pytest.mark.parametrize("place", [0, 1, 2])
def test_each_of_the_three_distances_slows(place: int) -> None:
    left, front, right = (0.9 if k == place else 1.6 for k in range(3))
    fast, slow = (controller.wheel_speeds(left, front, right, 20.0) for controller in (PAPER, CAREFUL))
    assert slow == pytest.approx((0.5625 * fast[0], 0.5625 * fast[1]), rel=1e-12)


def test_head_on_careful_slows_where_the_paper_hastens() -> None:
    rows = [(1.6, front, 1.6, 0.0) for front in np.linspace(0.6, 1.4, 81)]
    fast, slow = (controller.wheel_speeds_many(rows).mean(axis=1) for controller in (PAPER, CAREFUL))
    assert fast[0] > fast[-1] + 0.4
    assert np.all(np.diff(slow) > 0.0)


def test_the_seconds_ahead_are_worked_out_with_the_same_speeds() -> None:
    """The compiled rollout: all far the same way bit for bit, beside a wall the same way from the start, but slower."""
    settings = scenario_of().settings
    body = DriveState(Pose(0.0, 0.0, 0.0), 0.0, 0.0)
    lengths = []
    for right in (1.6, 0.6):
        sense = Sense(
        world="local",
            run=0, tick=0, time=0.0, lockstep=True, x=0.0, y=0.0, yaw=0.0, linear=0.0, angular=0.0,
            left=1.6, front=1.6, right=right, bearings=[], hears=[], rays=[],
        )  # fmt: skip
        ways = [Rollout(controller, settings)(sense, body, (9.0, 0.0), 1.0) for controller in (PAPER, CAREFUL)]
        lengths.append([float(np.hypot(*np.diff(way, axis=0).T).sum()) for way in ways])
    assert lengths[0][0] == lengths[0][1]
    assert lengths[1][1] < 0.5 * lengths[1][0]


def test_an_explanation_says_how_much_it_was_slowed() -> None:
    assert "slowed to 0.562 of the tables' speeds by the nearest distance" in explain(1.6, 0.9, 1.6, 0.0, "careful")
    assert "slowed" not in explain(1.6, 1.6, 1.6, 0.0, "careful")
    assert "slowed" not in explain(1.6, 0.9, 1.6, 0.0, "paper")
    told = json.loads(explain(1.6, 0.9, 1.6, 0.0, "careful", as_json=True))
    assert told["slowing"] == pytest.approx(0.5625)
    assert (told["left_v"], told["right_v"]) == CAREFUL.wheel_speeds(1.6, 0.9, 1.6, 0.0)
    assert json.loads(explain(1.6, 0.9, 1.6, 0.0, as_json=True))["slowing"] == 1.0
