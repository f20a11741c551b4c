"""Moving obstacles: their positions, and that a robot stands still when one runs into it."""

from math import hypot, pi
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.scenario.load import Scenario, load
from swarm.settings import MoverSettings
from tests.shared import ROOT, with_settings
from world.bodies.movers import Patrol
from world.simulate import Simulation

QUICK = (1, 2)
WAY = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0)]


@pytest.fixture(scope="module")
def movers() -> Scenario:
    return load(ROOT / "scenarios" / "movers.yaml")


def assert_every_contact_was_the_movers(report: dict[str, Any]) -> None:
    assert report["complete"], report["reason"]
    assert report["contacts"]["wall"] == 0
    for name, row in report["per_robot"].items():
        assert row["contacts"] == row["struck"], f"{name} ran into something"


@pytest.mark.parametrize("seed", QUICK)
def test_a_robot_alone_runs_into_no_mover(movers: Scenario, seed: int) -> None:
    assert_every_contact_was_the_movers(Simulation.of(movers, 1, seed).run())


@pytest.mark.long("four whole missions; make test drives two")
@pytest.mark.parametrize("seed", [seed for seed in range(1, 7) if seed not in QUICK])
def test_a_robot_alone_runs_into_no_mover_on_more_seeds(movers: Scenario, seed: int) -> None:
    assert_every_contact_was_the_movers(Simulation.of(movers, 1, seed).run())


@pytest.mark.long("a whole mission with four robots")
def test_four_robots_get_out_of_the_way_of_most_movers(movers: Scenario) -> None:
    report = Simulation.of(movers, 4, 2).run()
    assert report["complete"], report["reason"]
    assert report["contacts"]["wall"] == report["contacts"]["robot"] == 0
    assert report["contacts"]["obstacle"] <= 1, "standing still it was 7"


# fmt: off
PLACES = {  # loop, time [s] at 1 m/s -> x, y, yaw
    "at the start":         (False, 0.0,  (0.0, 0.0, 0.0)),
    "on the first leg":     (False, 3.0,  (3.0, 0.0, 0.0)),
    "on the second leg":    (False, 5.0,  (4.0, 1.0, pi / 2)),
    "on the way back":      (False, 8.0,  (4.0, 2.0, -pi / 2)),
    "the second time":      (False, 15.0, (1.0, 0.0, 0.0)),
    "on the leg home":      (True,  9.5,  (2.0, 1.5, None)),
    "round once":           (True,  12.0, (0.0, 0.0, 0.0)),
}
# fmt: on


@pytest.mark.parametrize("name", PLACES)
def test_a_mover_is_where_its_way_and_speed_put_it(name: str) -> None:
    loop, time, (x, y, yaw) = PLACES[name]
    pose = Patrol(MoverSettings(waypoints=WAY, speed=1.0, radius=0.3, loop=loop)).pose_at(time)
    assert (pose.x, pose.y) == pytest.approx((x, y))
    assert yaw is None or pose.yaw == pytest.approx(yaw)


@given(st.floats(0, 1000), st.floats(0.01, 5), st.booleans())
def test_a_mover_never_leaps(time: float, speed: float, loop: bool) -> None:
    patrol = Patrol(MoverSettings(waypoints=WAY, speed=speed, radius=0.3, loop=loop))
    a, b = patrol.pose_at(time), patrol.pose_at(time + 0.05)
    assert hypot(b.x - a.x, b.y - a.y) <= speed * 0.05 + 1e-6


def test_noise_alone_shows_no_robot_an_obstacle() -> None:
    """Four noisy robots pass walls and each other; nothing is there that map and radio do not explain."""
    scenario = with_settings(load(ROOT / "scenarios" / "paper.yaml"), sensors={"noise": 0.03})
    simulation = Simulation.of(scenario, 4, 1)
    said = [broadcast.traffic for _ in range(800) for broadcast in simulation.step().spoken.values()]
    records = [one.own for one in said if one is not None]
    assert len(records) > 400
    assert [(record.moving, record.seen) for record in records if record.moving or record.seen] == []
