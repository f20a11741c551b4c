"""Robots as real processes: if one is suspended, or killed while it leads, others lose time but nobody is touched."""

from pathlib import Path

import pytest

from swarm.messages import EVENT
from tests.launch.actors import Fleet, await_clock, await_event
from tests.shared import ROOT

pytestmark = pytest.mark.processes
DOORWAY = ROOT / "scenarios" / "doorway.yaml"
ASLEEP = 100  # ticks, 5 s


@pytest.mark.long("a whole mission")
def test_a_suspended_robot_is_waited_for_or_driven_round(tmp_runtime: Path) -> None:
    with (
        Fleet(DOORWAY, "--pace", "3", robots=8, runtime=tmp_runtime) as fleet,
        fleet.bus() as bus,
    ):
        bus.listen(EVENT)
        fleet.await_all(bus)
        await_event(bus, lambda event: event.kind == "joint_plan")
        sleeper = fleet.member("r2")
        sleeper.suspend()
        asleep_at = await_clock(bus, lambda clock: True).tick
        await_clock(bus, lambda clock: clock.tick > asleep_at + ASLEEP)
        sleeper.resume()
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"]
    assert report["contacts"]["robot"] == 0


@pytest.mark.long("a whole mission; `make test` has it in one process")
def test_a_leader_that_dies_with_its_plan_just_made_is_replaced(tmp_runtime: Path) -> None:
    with (
        Fleet(DOORWAY, "--pace", "3", robots=8, runtime=tmp_runtime) as fleet,
        fleet.bus() as bus,
    ):
        bus.listen(EVENT)
        fleet.await_all(bus)
        leader = await_event(bus, lambda event: event.kind == "joint_plan").robot
        assert leader is not None
        fleet.member(leader).kill()
        await_event(bus, lambda event: event.kind == "gone" and event.robot == leader)
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"], "its new process goes on where the old one was"
    assert report["contacts"]["robot"] == 0
