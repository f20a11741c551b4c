"""`swarm run` with real processes: from the command to the report, complete and ended early."""

from pathlib import Path

import pytest

from swarm.cli import main
from swarm.launch.fleet_registry import default_fleet_name
from swarm.messages import EVENT, Phase
from swarm.scenario.load import Scenario, load
from tests.launch.actors import (
    SMALL,
    Fleet,
    assert_the_same_run,
    await_clock,
    await_event,
    await_phase,
    in_process,
)
from tests.shared import PAPER

pytestmark = pytest.mark.processes


def test_processes_over_the_wire_drive_the_very_run_that_objects_in_one_process_drive(
    paper: Scenario, tmp_runtime: Path
) -> None:
    with Fleet(PAPER, "--pace", "max", "--seed", "3", runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0, fleet.text
        assert_the_same_run(fleet.report(), in_process(paper, 2, 3))
        assert "complete" in fleet.text.splitlines()
    assert not list(tmp_runtime.glob("zenoh-swarm-*/*/")), "the fleet's folder is left"


MOVER = """\
movers:
  - radius: {}
    speed: {}
    waypoints: {}
"""
ONE_RAY = "sensors: {rays: 1, front_half_width_deg: 0.0, side_half_width_deg: 0.0}\n"  # it misses what is thin
# fmt: off
TOUCHING = ("no contact", "room to brake")  # laws that those runs break
TOUCHED = {  # what more the scenario has: the exit status
    "a robot that stood":                   (MOVER.format(0.25, 1.2, "[[3.0, 0.6], [3.0, 7.4]]"), 0),
    "a robot that a mover caught up with":  (MOVER.format(0.25, 0.8, "[[1.0, 2.0], [9.9, 2.0]]"), 0),
    "a robot that drove into a slow mover": (ONE_RAY + MOVER.format(0.05, 0.02, "[[6.0, 2.3], [7.0, 2.3]]"), 1),
}
# fmt: on


@pytest.mark.long("three whole missions")
@pytest.mark.parametrize("whom", TOUCHED)
def test_a_contact_that_a_robot_could_have_avoided_is_in_the_exit_status(
    small: Path, tmp_runtime: Path, whom: str
) -> None:
    more, status = TOUCHED[whom]
    small.write_text(SMALL + more)
    with Fleet(small, "--pace", "max", runtime=tmp_runtime, breaks=TOUCHING) as fleet:
        assert fleet.end() == status, fleet.text
        report = fleet.report()
        said = next(line for line in fleet.text.splitlines() if "exit status" in line)
    assert_the_same_run(report, in_process(load(small), 2, 1))
    assert report["complete"]
    assert report["contacts"]["obstacle"] > 0
    assert report["passed"] == (status == 0) == (report["avoidable_contacts"] == 0)
    assert said.strip().startswith(f"exit status {status}: complete, ")


@pytest.mark.long("a whole mission in real time")
def test_a_realtime_run_completes_and_counts_its_late_commands(tmp_runtime: Path) -> None:
    with Fleet(PAPER, "--pace", "10", "--seed", "3", runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"]
    assert report["pace"] == "10"
    assert report["late_commands"] >= 0
    times = list(report["tick_wall"].values())
    assert times == sorted(times)
    assert times[0] > 0.0
    assert report["contacts"]["wall"] == 0


@pytest.mark.long("two fleets at once")
def test_two_fleets_at_once_do_not_meet(small: Path, tmp_runtime: Path) -> None:
    expected = in_process(load(small), 2, 1)
    with (
        Fleet(small, "--pace", "max", "--wait", runtime=tmp_runtime, report="a.json") as one,
        Fleet(small, "--pace", "max", "--wait", runtime=tmp_runtime, report="b.json") as other,
    ):
        for fleet in (one, other):
            with fleet.bus() as bus:
                fleet.await_all(bus)
        assert main(["go"]) == 2, "which of the two has to be said"
        for fleet in (one, other):
            assert main(["go", "--fleet", fleet.name]) == 0
        assert (one.end(), other.end()) == (0, 0), one.text + other.text
        assert {one.name, other.name} == {default_fleet_name("small"), f"{default_fleet_name('small')}-2"}
        assert one.endpoint != other.endpoint
        for fleet in (one, other):
            assert_the_same_run(fleet.report(), expected)


def test_the_buttons_work_on_a_running_fleet(small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture) -> None:  # type: ignore[type-arg]
    with Fleet(small, "--pace", "5", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        assert main(["resume"]) == 2
        assert "the run is waiting: expected one of (go, restart, stop), got resume" in capsys.readouterr().err
        assert main(["go"]) == 0
        await_phase(bus, Phase.RUNNING)
        assert main(["pause"]) == 0
        await_phase(bus, Phase.PAUSED)
        stands = await_phase(bus, Phase.PAUSED)  # the tick under way when the button was pressed is over by now
        assert await_phase(bus, Phase.PAUSED).tick == stands.tick, "the clock goes on while paused"
        capsys.readouterr()
        assert main(["pause"]) == 0
        assert capsys.readouterr().out == "the run is paused already\n"
        assert main(["resume"]) == 0
        await_clock(bus, lambda clock: clock.phase is Phase.RUNNING and clock.tick > stands.tick)
        assert main(["restart"]) == 0
        assert await_clock(bus, lambda clock: clock.run == 1).phase is Phase.RUNNING
        assert main(["stop"]) == 0
        assert fleet.end() == 1, fleet.text
        assert fleet.report()["reason"] == "stopped by command"
        fleet.assert_nobody_is_left()


@pytest.mark.long("two whole missions")
def test_a_restarted_run_is_the_first_one_again(paper: Scenario, tmp_runtime: Path) -> None:
    """Nothing of the run before is left over in any robot, nor lost of the new one's first words."""
    expected = in_process(paper, 3, 3)
    arguments = ("--pace", "max", "--seed", "3", "--robots-per-process", "2")
    with Fleet(PAPER, *arguments, robots=3, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_clock(bus, lambda clock: clock.tick > 100)
        assert main(["restart"]) == 0
        assert await_clock(bus, lambda clock: clock.run == 1)
        assert fleet.end() == 0, fleet.text
        assert_the_same_run(fleet.report(), expected)


@pytest.mark.long("a whole mission")
def test_a_pause_changes_nothing_of_a_lockstep_run(tmp_runtime: Path) -> None:
    path = tmp_runtime / "noisy.yaml"
    path.write_text(SMALL.replace("limit: 1500", "limit: 1500\nsensors: {noise: 0.02}\nradio: {loss: 0.3}"))
    with Fleet(path, "--pace", "max", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        assert main(["go"]) == 0
        for _ in range(3):
            assert main(["pause"]) == 0
            assert main(["resume"]) == 0
        assert fleet.end() == 0, fleet.text
    assert_the_same_run(fleet.report(), in_process(load(path), 2, 1))


@pytest.mark.long("waits for three starts of a router")
def test_a_router_that_is_killed_again_and_again_ends_the_run_with_a_sentence(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--pace", "1", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        for kill in range(4):
            fleet.await_member("router").kill()
            if kill < 3:
                fleet.await_line("router was ended by signal 9; started again")
                fleet.lines.clear()
        assert fleet.end() == 1, fleet.text
        assert fleet.report()["reason"] == "router was ended by signal 9; the run ends"
        assert not list(tmp_runtime.glob("zenoh-swarm-*/*/"))


@pytest.mark.long("two whole missions")
def test_a_killed_fork_server_is_no_end_of_anybody(small: Path, tmp_runtime: Path) -> None:
    """Those that run are watched without it; a new one forks the robot that is killed afterwards."""
    with Fleet(small, "--pace", "max", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        bus.listen(EVENT)
        fleet.await_all(bus)
        await_clock(bus, lambda clock: len(clock.present) == 2)
        victim = fleet.member("r1")
        fleet.fork_server().kill()
        assert main(["go"]) == 0
        await_event(bus, lambda event: event.kind == "reached")
        victim.kill()
        assert fleet.end() == 0, fleet.text
        assert "r1 was ended by signal 9; started again" in fleet.text
        assert fleet.text.count(" was ended by ") == 1
        assert fleet.report()["complete"]
        fleet.assert_nobody_is_left()
    assert not list(tmp_runtime.glob("zenoh-swarm-*/*/"))


@pytest.mark.long("waits for a whole fleet to end")
def test_nobody_outlives_a_killed_launcher(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--pace", "1", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        fleet.process.kill()
        fleet.process.wait()
        fleet.assert_nobody_is_left()
    with Fleet(small, "--pace", "max", runtime=tmp_runtime) as next_one:
        assert next_one.name == default_fleet_name("small"), "the name of a dead fleet is free again"
        assert next_one.end() == 0, next_one.text
