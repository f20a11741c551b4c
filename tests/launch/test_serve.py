"""A fleet that stays: who is done waits for orders, also after processes were killed; it ends when it is told to."""

from pathlib import Path

import pytest

from swarm.bus import Bus
from swarm.cli import main
from swarm.messages import Activity, Liveness, Phase, RobotStatus, Status
from tests.launch.actors import Command, Fleet, await_phase, await_status

pytestmark = pytest.mark.processes


def row(status: Status, robot: str) -> RobotStatus:
    return next(row for row in status.robots if row.robot == robot)


def await_done(bus: Bus, robot: str, number: int) -> Status:
    """Wait until a robot is done with the stops of that number."""
    return await_status(
        bus,
        lambda status: (
            (row(status, robot).state.assignment, row(status, robot).state.activity) == (number, Activity.DONE)
        ),
    )


def await_first(bus: Bus, robot: str, number: int) -> None:
    """Wait until a robot has been at the first of the stops of that number."""
    await_status(
        bus,
        lambda status: (row(status, robot).state.assignment, row(status, robot).state.reached[:1]) == (number, [True]),
    )


@pytest.mark.costs("whoever is the first in a process imports all that a fleet needs")
def test_without_serve_a_scenario_without_targets_is_refused(waiting: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(waiting), "--dashboard", "off"]) == 2
    assert "expected either `targets` (for all) or `own_targets`" in capsys.readouterr().err


@pytest.mark.long("a fleet whose world is killed")
def test_robots_wait_for_orders_also_when_a_robot_and_the_world_are_killed(waiting: Path, tmp_runtime: Path) -> None:
    with Fleet(waiting, "--pace", "5", "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        for name in ("r1", "r2"):
            await_done(bus, name, 0)
        assert main(["order", "r1", "9.5,2.0", "--id", "a"]) == 0
        await_done(bus, "r1", 1)
        fleet.member("r1").kill()
        fleet.await_line("r1 was ended by signal 9; started again")
        assert main(["order", "r1", "9.5,6.0", "--home", "--id", "b"]) == 0
        await_first(bus, "r1", 2)
        fleet.member("world").kill()
        fleet.await_line("world was ended by signal 9; started again")
        await_done(bus, "r1", 2)
        assert main(["order", "r2", "9.5,4.0", "--id", "c"]) == 0
        await_done(bus, "r2", 3)
        assert main(["stop"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"], report["reason"]
    assert [one["fate"] for one in report["per_robot"]["r1"]["history"]] == ["done"] * 3
    assert report["lost"] == []
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


@pytest.mark.long("a fleet of its own")
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


@pytest.mark.long("a whole mission with kills")
def test_a_robot_leaves_and_another_process_goes_on_in_its_place(waiting: Path, tmp_runtime: Path) -> None:
    with Fleet(waiting, "--pace", "max", "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_done(bus, "r2", 0)
        assert main(["order", "r2", "9.5,2.0", "9.5,6.0", "--home"]) == 0
        await_first(bus, "r2", 1)
        fleet.member("r2").terminate()
        gone = await_status(bus, lambda status: row(status, "r2").liveness is Liveness.GONE)
        assert "left" in [event.kind for event in gone.events]
        assert main(["order", "r1", "4.5,2.5"]) == 0
        await_done(bus, "r1", 2)
        where = ("--connect", str(fleet.endpoint), "--fleet", fleet.name)
        with Command("robot", "--id", "r2", *where, runtime=tmp_runtime) as other:
            await_status(
                bus, lambda status: row(status, "r2").liveness is Liveness.ALIVE
            )  # it may have been done before
            done = await_done(bus, "r2", 1)
            assert main(["stop"]) == 0
            assert fleet.end() == 0, fleet.text
            other.process.terminate()
            assert other.end() == 0, other.text
        kinds = [event.kind for event in done.events if event.robot == "r2"]
        assert kinds.count("left") == kinds.count("back") == 1
        assert "gone" not in kinds
        report = fleet.report()
    assert report["complete"], report["reason"]
    assert any(reason.startswith("r2 has left") for reason in report["not_reproducible"])
    assert "r2 has left; the run goes on" in fleet.text
    assert "started again" not in fleet.text
