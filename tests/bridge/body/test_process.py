"""A fleet one of whose robots is a robot of ROS: over real processes, with ROS's router apart from the fleet's."""

from pathlib import Path

import pytest

from swarm.bus import Endpoint
from tests.bridge.body.robots import floor_of, foreign_robot
from tests.launch.actors import Command, Fleet
from tests.shared import PAPER

pytestmark = pytest.mark.processes


@pytest.mark.long("the paper's mission in real time")
def test_one_of_four_robots_is_outside_and_the_papers_mission_is_complete(
    tmp_runtime: Path, endpoint: Endpoint
) -> None:
    with (
        Fleet(PAPER, "--pace", "1", "--body", "r2", runtime=tmp_runtime, robots=4) as fleet,
        fleet.bus() as bus,
        foreign_robot(endpoint, **floor_of(bus, "r2")) as robot,
    ):
        words = ("--body", "r2", "--pose", "/r2/amcl_pose", "--scan", "/r2/scan")
        with Command("bridge", "ros2", "--ros", str(endpoint), *words, runtime=tmp_runtime) as body:
            fleet.await_all(bus)
            body.await_line("r2 goes on")
            assert fleet.end() == 0, fleet.text
            assert body.end() == 0
            print(body.text)
        collisions, path = robot.end()
        print(fleet.text)
    summary = fleet.report()
    print(summary)
    assert summary["complete"]
    assert sum(summary["contacts"].values()) == 0
    assert collisions == 0
    assert path > 30.0
