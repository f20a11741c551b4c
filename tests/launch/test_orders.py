"""Orders and a pool over real processes: the run is the same, bit for bit, as that of objects in one process."""

from pathlib import Path
from typing import Final

import pytest

from swarm.cli import main
from swarm.messages import Order, RobotAction, RobotDo
from swarm.scenario.load import load
from tests.launch.actors import (
    SMALL,
    Fleet,
    assert_the_same_run,
    await_tick,
    in_process,
)
from world.simulate import Simulation

pytestmark = pytest.mark.processes
ROBOTS = 3
# fmt: off
REFUSED: Final = {  # by a fleet that waits: the command, and the sentence
    "order r9 9.5,4.0":           "order of r9: expected one of r1, r2, r3, got 'r9'; the fleet has no such robot",
    "stop r9":                    "action of r9: expected one of r1, r2, r3, got 'r9'; the fleet has no such robot",
    "order r1 9.5,4.0 99,4":      "order of r1: target 2 at (99, 4): expected a place on the map, got one outside; the nearest place that it can reach is 10.72,3.72",
    "order r1 9.5,4.0 --update -1": "order of r1: update: expected int >= 0, got -1",
    "order r1 9.5,4.0 --id a/b":  "order of r1: id: expected 1 to 64 letters, digits or _ . : -, got 'a/b'",
    "pool 5.5,3.5":               "pool: r1: target 1 at (5.5, 3.5): expected free floor, got a wall or obstacle; the nearest place that it can reach is 5.50,2.72",
    "add-robots 1 --id more":     "places more: expected a fleet that stays, got one that ends; start it with --serve",
    "edit wall 90,90 91,91":      "edit: expected a rectangle on the map, got (90.0, 90.0) to (91.0, 91.0); move it",
    "edit wall 2,2 3,3":          "edit: expected a free place for a wall, r1 stands there; wait",
    "resume":                     "action: the run is waiting: expected one of (go, restart, stop), got resume",
    "setup --scenario papr":      "setup: scenario: expected one that comes with the project, got 'papr'; did you mean 'paper'?",
}
# fmt: on


@pytest.mark.long("two missions over processes")
def test_orders_given_before_the_start_are_part_of_a_run_that_can_be_repeated(
    small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    simulation = Simulation.of(load(small), ROBOTS, 1)
    simulation.world.request("r2", Order(id="a", update=2, targets=[(9.5, 4.0)], home=True))
    simulation.world.request("r3", RobotAction(do=RobotDo.CANCEL))
    simulation.world.request("r3", Order(id="b", targets=[(9.5, 2.0)]))
    with Fleet(small, "--pace", "max", "--wait", robots=ROBOTS, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        asked = ["order", "r2", "9.5,4.0", "--home", "--id", "a", "--update", "2"]
        for _ in range(2):
            assert main(asked) == 0
            assert capsys.readouterr().out == "r2: order a update 2 is number 1: 1 target, then home\n"
        assert main(["order", "r2", "9.5,4.0", "--id", "a", "--update", "1"]) == 2
        assert "expected update 2 or a newer one" in capsys.readouterr().err
        for command, sentence in REFUSED.items():
            assert main(command.split()) == 2
            assert capsys.readouterr().err == f"swarm: {sentence}\n"
        capsys.readouterr()
        assert main(["cancel", "r3"]) == 0
        stays = "the fleet stays, and takes orders until `swarm stop` ends it"
        assert capsys.readouterr().out == f"r3 has no targets now, number 2; {stays}\n"
        assert main(["order", "r3", "9.5,2.0", "--id", "b"]) == 0
        assert main(["go"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert_the_same_run(report, simulation.run())
    assert report["reproducible"]


POOL = "pool: [[9.5, 2.0], [9.5, 6.0], [2.5, 6.0], [9.5, 4.0]]"


@pytest.mark.long("two whole missions")
def test_a_pool_gives_the_same_run_over_processes_also_if_the_world_is_killed(small: Path, tmp_runtime: Path) -> None:
    small.write_text(SMALL.replace("targets: [[9.5, 2.0], [9.5, 6.0]]", POOL))
    expected = in_process(load(small), ROBOTS, 1)
    assert expected["pool"]["done"] == 4
    with Fleet(small, "--pace", "max", robots=ROBOTS, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_tick(bus, 60)
        fleet.member("world").kill()
        fleet.await_line("world was ended by signal 9; started again")
        assert fleet.end() == 0, fleet.text
        assert_the_same_run(fleet.report(), expected)
