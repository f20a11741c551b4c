"""Another set-up of a fleet over the wire: the launcher ends the world and the robots, and starts them again."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from swarm.cli import main
from swarm.errors import PeerError
from swarm.messages import MAP, SETUP, Phase, Setup
from tests.launch.actors import Fleet, await_clock, await_phase, await_status

pytestmark = pytest.mark.processes

DRAWN = """\
########
#......#
#......#
#......#
########
"""


@pytest.mark.long("two missions")
def test_a_fleet_is_set_up_driven_paused_and_set_up_again(
    small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (drawing := tmp_runtime / "drawing.txt").write_text(DRAWN)
    with Fleet(small, "--pace", "3", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_phase(bus, Phase.WAITING)
        assert main(["setup"]) == 0
        told = json.loads(capsys.readouterr().out)
        assert (told["scenario"], told["robots"], told["speed"], told["starts"][1]) == (
            "small",
            2,
            0.4,
            [2.5, 4.0, 0.0],
        )
        assert main(["go"]) == 0
        await_phase(bus, Phase.RUNNING)
        assert main(["setup", "--robots", "3"]) == 2
        assert (
            "expected a run that waits or is paused, got one that is running; pause it first" in capsys.readouterr().err
        )
        assert main(["pause"]) == 0
        await_phase(bus, Phase.PAUSED)
        assert main(["setup", "--robots", "9"]) == 2
        assert "start.poses: expected at least 9 poses, got 3" in capsys.readouterr().err
        assert main(["setup", "--target", "0.5,0.5"]) == 2
        assert "expected free floor, got a wall or obstacle" in capsys.readouterr().err
        before = await_phase(bus, Phase.PAUSED)
        assert before.robots == ["r1", "r2"], "what is refused changes nothing"

        spots = ["--start", "1.5,1.5", "--start", "1.5,3.5", "--start", "4.5,1.5", "--target", "6.5,2.5"]
        asked = ["--map", str(drawing), "--cell", "1.0", "--speed", "0.5", *spots]
        assert main(["setup", *asked]) == 0
        assert capsys.readouterr().out.strip() == "small with 3 robots is set up; it waits for go"
        fresh = await_clock(bus, lambda clock: clock.run > before.run and len(clock.present) == 3)
        assert (fresh.phase, fresh.tick, fresh.robots) == (Phase.WAITING, 0, ["r1", "r2", "r3"])
        floor = bus.fetch(MAP)[0]
        assert (floor.packed.rows, floor.packed.columns) == (5, 8)
        assert floor.scenario.settings.robot.speed_scale == 0.5
        assert main(["go"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"], report["reason"]
    assert list(report["per_robot"]) == ["r1", "r2", "r3"]
    assert all(row["targets"] == 2 for row in report["per_robot"].values()), "one target, then home"
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert "started again" not in fleet.text


@pytest.mark.long("a whole mission; other kills of a world are in make test")
def test_a_world_that_is_killed_after_a_set_up_goes_on_with_it(
    small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Fleet(small, "--pace", "5", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_phase(bus, Phase.WAITING)
        with pytest.raises(
            PeerError, match=r"setup: scenario: expected one that comes with the project, got 'nowhere'; known: .*paper"
        ):
            bus.ask(SETUP, Setup(scenario="nowhere"))
        with pytest.raises(PeerError, match="setup: cell: expected a map with it"):
            bus.ask(SETUP, Setup(scenario=None, cell=0.7))
        with ThreadPoolExecutor() as two:
            short = Setup(scenario="paper", robots=1, targets=[(2.5, 11.5)])
            asked = [two.submit(bus.ask, SETUP, short, 30.0) for _ in range(2)]
        faults = [str(one.exception()) for one in asked if one.exception() is not None]
        said = [one.result().text for one in asked if one.exception() is None]
        assert said == ["paper with 1 robot is set up; it waits for go"]
        assert faults == ["setup: expected no other set-up in progress, got one; ask again once the fleet waits for go"]
        await_clock(bus, lambda clock: clock.run == 1 and clock.present == ["r1"])
        world = fleet.member("world")
        assert main(["go"]) == 0
        await_status(bus, lambda status: status.time > 1.0)
        world.kill()
        fleet.await_line("world was ended by signal 9; started again")
        (told,) = bus.fetch(SETUP)
        assert (told.scenario, told.robots) == ("paper", 1)
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert (report["scenario"], report["robots"], report["complete"]) == ("paper", 1, True)
    assert report["per_robot"]["r1"]["targets"] == 2, "one target, then home"
