"""More places while a fleet stays: robots come by request, over real processes, also across a killed world."""

from pathlib import Path

import msgspec
import pytest

from swarm.cli import main
from swarm.messages import CLOCK
from tests.launch.actors import Fleet
from tests.launch.test_serve import await_done
from tests.shared import mostly_long

pytestmark = pytest.mark.processes


@pytest.mark.long("a fleet, a world that is killed, a mission")
@pytest.mark.parametrize("pace", mostly_long("a whole mission with kills", ["max", "5"], "max"))
def test_a_robot_is_added_drives_and_outlives_the_world(
    pace: str, waiting: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Fleet(waiting, "--pace", pace, "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        for name in ("r1", "r2"):
            await_done(bus, name, 0)
        assert main(["add-robots", "2", "--at", "8.5,4.0", "--id", "more"]) == 0
        await_done(bus, "r3", 1)
        await_done(bus, "r4", 2)
        forged = bus.fetch(CLOCK)[0]
        bus.send(CLOCK, msgspec.structs.replace(forged, robots=[*forged.robots, "r77"]))
        assert main(["add-robots", "2", "--at", "8.5,4.0", "--id", "more"]) == 0, "the same again changes nothing"
        assert capsys.readouterr().out.splitlines() == ["r3, r4: the places are open"] * 2
        assert main(["order", "r3", "9.5,2.0", "2.5,6.0", "--home", "--id", "a"]) == 0
        assert not list(tmp_runtime.rglob("r77.log")), "the world knows no r77: it has no process"
        fleet.member("world").kill()
        fleet.await_line("world was ended by signal 9; started again")
        done = await_done(bus, "r3", 3)
        assert [one.robot for one in done.robots] == ["r1", "r2", "r3", "r4"]
        assert main(["stop"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"], report["reason"]
    assert report["robots"] == 4
    assert report["per_robot"]["r3"]["path_length"] > 10.0
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["overlaps"] == 0
