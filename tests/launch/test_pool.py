"""The pool over real processes: errands given by command, kept when a robot and the world are killed."""

from pathlib import Path

import pytest

from swarm.cli import main
from swarm.messages import EVENT
from swarm.scenario.load import load
from tests.launch.actors import (
    SMALL,
    Fleet,
    assert_the_same_run,
    await_clock,
    await_event,
    in_process,
    run_with_world_killed_at,
)

pytestmark = pytest.mark.processes
ROBOTS = 3
POOL = "pool: [[9.5, 2.0], [9.5, 6.0], [2.5, 6.0], [9.5, 4.0]]"


@pytest.fixture
def pooled(tmp_runtime: Path) -> Path:
    path = tmp_runtime / "pooled.yaml"
    path.write_text(SMALL.replace("targets: [[9.5, 2.0], [9.5, 6.0]]", POOL))
    return path


def test_a_pool_gives_the_same_run_over_processes_also_if_the_world_is_killed(pooled: Path, tmp_runtime: Path) -> None:
    expected = in_process(load(pooled), ROBOTS, 1)
    assert expected["pool"]["done"] == 4
    assert_the_same_run(run_with_world_killed_at(60, pooled, ROBOTS, tmp_runtime), expected)


@pytest.mark.long("a whole mission with kills")
def test_errands_outlive_a_robot_and_the_world(
    pooled: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("--pace", "3", "--wait")
    with Fleet(pooled, *arguments, robots=ROBOTS, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        bus.listen(EVENT)
        for _ in range(2):
            assert main(["pool", "5.5,1.5", "2.5,2.0", "--id", "more"]) == 0
            assert capsys.readouterr().out == "pool more: 2 targets for any robot\n"
        assert main(["pool", "5.5,3.5"]) == 2
        assert "expected free floor, got a wall or obstacle" in capsys.readouterr().err
        assert main(["go"]) == 0
        await_event(bus, lambda event: event.kind == "errand" and event.robot == "r1")
        told = await_clock(bus, lambda clock: clock.pool is not None and clock.pool.given == 6)
        assert told.pool is not None
        assert told.pool.done + told.pool.taken + told.pool.waiting == 6
        fleet.member("r1").kill()
        fleet.await_line("r1 was ended by signal 9; started again")
        fleet.member("world").kill()
        fleet.await_line("world was ended by signal 9; started again")
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"]
    assert (report["pool"]["given"], report["pool"]["done"], report["pool"]["left"]) == (6, 6, [])
    assert "pool: 6 of 6 targets done" in fleet.text
    assert sum(report["contacts"].values()) == 0
