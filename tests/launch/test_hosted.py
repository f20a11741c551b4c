"""Several robots in one process: the same run, one restart for all of them, and a report that says so."""

import signal
from pathlib import Path

import pytest

from swarm.bus import Endpoint
from swarm.messages import EVENT, Phase
from swarm.scenario.load import load
from tests.conftest import MakeBus
from tests.launch.actors import SMALL, Command, Fleet, await_event, await_phase, await_presence
from world.simulate import Simulation


@pytest.fixture
def noisy(tmp_runtime: Path) -> Path:
    """Write a scenario in which robots hear each other from other zones, and not always."""
    path = tmp_runtime / "noisy.yaml"
    path.write_text(SMALL.replace("limit: 1500", "limit: 1500\nsensors: {noise: 0.02}\nradio: {loss: 0.3, range: 5.0}"))
    return path


@pytest.mark.long("a whole mission")
@pytest.mark.processes
@pytest.mark.parametrize("size", [2, 1000])
def test_robots_that_share_processes_drive_the_very_run_that_objects_drive(
    size: int, noisy: Path, tmp_runtime: Path
) -> None:
    arguments = ("--pace", "max", "--robots-per-process", str(size))
    with Fleet(noisy, *arguments, robots=3, runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0, fleet.text
    report = fleet.report()
    assert report["digest"] == Simulation.of(load(noisy), 3, 1).run()["digest"]
    assert report["robots_per_process"] == min(size, 3)
    assert ("robots per process: up to" in fleet.text) == (size > 1)


@pytest.mark.long("a whole mission")
@pytest.mark.processes
def test_a_process_of_three_robots_that_is_killed_is_started_again_and_all_go_on(
    small: Path, tmp_runtime: Path
) -> None:
    with (
        Fleet(small, "--pace", "10", "--robots-per-process", "3", robots=3, runtime=tmp_runtime) as fleet,
        fleet.bus() as bus,
    ):
        bus.listen(EVENT)
        fleet.await_all(bus)
        victim = fleet.member("r1-r3")
        await_event(bus, lambda event: event.kind == "reached")
        victim.kill()
        assert {await_event(bus, lambda event: event.kind == "gone").robot for _ in range(3)} == {"r1", "r2", "r3"}
        assert fleet.end() == 0, fleet.text
        assert "r1-r3 was ended by signal 9; started again" in fleet.text
        assert fleet.report()["complete"]
        fleet.assert_nobody_is_left()


@pytest.mark.long("two worlds, each process started by hand")
@pytest.mark.processes
def test_one_command_joins_with_several_robots_leaves_with_all_and_finds_the_next_world(
    noisy: Path, make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    wire = ("--connect", str(endpoint), "--fleet", "hosted")
    world = ("world", str(noisy), "--robots", "3", "--pace", "1", *wire)
    bus = make_bus(fleet="hosted")
    bus.watch_presence()
    with Command("robot", "--count", "3", *wire, runtime=tmp_runtime) as robots:
        for _ in range(2):
            with Command(*world, runtime=tmp_runtime) as first:
                await_phase(bus, Phase.RUNNING)
                with Command("robot", "--count", "2", *wire, runtime=tmp_runtime) as others:
                    others.await_line("all 3 places are taken")  # it asks again until it is told to stop
                    others.process.send_signal(signal.SIGINT)
                    assert others.end() == 0
                first.process.send_signal(signal.SIGTERM)
                assert first.end() == 1
                await_presence(bus, "world", alive=False)  # no clock of it comes after this
        with Command(*world, runtime=tmp_runtime):
            await_phase(bus, Phase.RUNNING)
            robots.process.send_signal(signal.SIGINT)
            await_presence(bus, "r3", alive=False)
            assert robots.end() == 0
            assert "Traceback" not in robots.text
