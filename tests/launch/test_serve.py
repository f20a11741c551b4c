"""A fleet that stays: who is done waits for orders, also after processes were killed; it ends when it is told to."""

from pathlib import Path

import pytest

from swarm.bus import Bus
from swarm.cli import main
from swarm.messages import EVENT, STATUS, Event, Phase
from tests.launch.actors import SMALL, Fleet, await_clock, await_event, await_phase

pytestmark = pytest.mark.processes


@pytest.fixture
def waiting(tmp_runtime: Path) -> Path:
    """Return a scenario without any target."""
    path = tmp_runtime / "waiting.yaml"
    path.write_text(SMALL.replace("targets: [[9.5, 2.0], [9.5, 6.0]]\n", ""))
    return path


@pytest.fixture
def driving(tmp_runtime: Path) -> Path:
    path = tmp_runtime / "driving.yaml"
    path.write_text(SMALL)
    return path


def at(robot: str, stop: str, bus: Bus) -> Event:
    return await_event(bus, lambda event: (event.robot, event.text) == (robot, f"is at {stop}"))


def test_without_serve_a_scenario_without_targets_is_refused(
    waiting: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(waiting), "--dashboard", "off"]) == 2
    assert "expected either `targets` (for all) or `own_targets`" in capsys.readouterr().err


@pytest.mark.parametrize("pace", ["max", "5"])
def test_robots_wait_for_orders_also_when_a_robot_and_the_world_are_killed(
    pace: str, waiting: Path, tmp_runtime: Path
) -> None:
    with Fleet(waiting, "--pace", pace, "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        bus.listen(EVENT)
        fleet.await_all(bus)
        await_phase(bus, Phase.RUNNING)
        for name in ("r1", "r2"):
            at(name, "home", bus)
        assert main(["order", "r1", "9.5,2.0", "--id", "a"]) == 0
        at("r1", "target 1", bus)
        fleet.member("r1").kill()
        fleet.await_line("r1 was ended by signal 9; started again")
        await_event(bus, lambda event: event.kind == "back" and event.robot == "r1")
        assert main(["order", "r1", "9.5,6.0", "--home", "--id", "b"]) == 0
        at("r1", "target 1", bus)
        fleet.member("world").kill()
        fleet.await_line("world was ended by signal 9; started again")
        at("r1", "home", bus)
        await_clock(bus, lambda clock: len(clock.present) == 2)
        assert main(["order", "r2", "9.5,4.0", "--id", "c"]) == 0
        at("r2", "target 1", bus)
        assert main(["stop"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"], report["reason"]
    assert [one["fate"] for one in report["per_robot"]["r1"]["history"]] == ["done"] * 3
    assert report["lost"] == []
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


def test_a_fleet_that_is_stopped_before_it_has_done_what_was_asked_is_not_complete(
    waiting: Path, tmp_runtime: Path
) -> None:
    with Fleet(waiting, "--pace", "1", "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_phase(bus, Phase.RUNNING)
        assert main(["order", "r1", "9.5,2.0"]) == 0
        assert main(["stop"]) == 0
        assert fleet.end() == 1, fleet.text
        report = fleet.report()
    assert (report["complete"], report["reason"]) == (False, "stopped by command")
    assert report["per_robot"]["r1"]["reached"] == [None]


def test_the_targets_of_the_scenario_are_driven_first_and_in_lockstep_the_clock_stands_then(
    driving: Path, tmp_runtime: Path
) -> None:
    with Fleet(driving, "--pace", "max", "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        bus.listen(EVENT)
        fleet.await_all(bus)
        at("r1", "home", bus)
        ticks = [await_clock(bus, lambda clock: clock.time > 10.0).tick for _ in range(8)]  # it is told each second
        assert len(set(ticks[-3:])) == 1
        assert main(["order", "r1", "9.5,4.0"]) == 0
        assert at("r1", "target 1", bus).tick > ticks[-1]
        assert bus.fetch(STATUS)[0].phase is Phase.RUNNING
        assert main(["stop"]) == 0
        assert fleet.end() == 0, fleet.text


def test_a_limit_that_is_given_ends_it(driving: Path, tmp_runtime: Path) -> None:
    with Fleet(driving, "--pace", "max", "--serve", "--limit", "120", runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"]
    assert report["sim_time"] == pytest.approx(120.0)
