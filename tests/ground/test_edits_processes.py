"""Edits of the map with real processes, requested over the wire and by the command."""

from pathlib import Path

import pytest

from swarm.cli import main
from swarm.errors import SwarmError
from swarm.messages import EDIT, EVENT, Kind
from swarm.scenario.load import load
from tests.ground.floors import LOWER, TWO_DOORS, UPPER, edit
from tests.launch.actors import Fleet, await_event
from world.simulate import Simulation

pytestmark = pytest.mark.processes
Capture = pytest.CaptureFixture[str]

SCENARIO = """\
name: doors
map:
  cell: 1.0
  text: |
{text}
start:
  poses: [[2.5, 6.5, 0.0], [2.5, 4.5, 0.0]]
targets: [[9.5, 6.5], [2.5, 2.5]]
robot: {{distance_scale: 0.5}}
limit: 1500
"""


@pytest.fixture
def doors(tmp_runtime: Path) -> Path:
    path = tmp_runtime / "doors.yaml"
    text = "".join(f"    {line}\n" for line in TWO_DOORS.splitlines()).rstrip("\n")
    path.write_text(SCENARIO.format(text=text))
    return path


def test_an_edit_over_the_wire_makes_the_very_run_that_it_makes_in_one_process(doors: Path, tmp_runtime: Path) -> None:
    wall = edit(Kind.WALL, UPPER)
    simulation = Simulation.of(load(doors), 2, 1)
    simulation.world.edit(wall)
    expected = simulation.run()
    with Fleet(doors, "--pace", "max", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        assert bus.ask(EDIT, wall).text.startswith("wall from")
        with pytest.raises(SwarmError, match="r1 stands there"):
            bus.ask(EDIT, edit(Kind.WALL, ((2.0, 6.0), (3.0, 7.0))))
        assert main(["go"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["digest"] == expected["digest"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["per_robot"] == expected["per_robot"]


@pytest.mark.long("a whole mission with a kill")
def test_the_command_edits_a_running_fleet_and_a_restarted_robot_knows_of_it(
    doors: Path, tmp_runtime: Path, capsys: Capture
) -> None:
    """Both doors are closed: every robot gives its first target up, one of them in a process that came later."""
    with Fleet(doors, "--pace", "3", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        bus.listen(EVENT)
        fleet.await_all(bus)
        for (x0, y0), (x1, y1) in (UPPER, LOWER):
            assert main(["edit", "wall", f"{x0},{y0}", f"{x1},{y1}"]) == 0
        assert "wall from" in capsys.readouterr().out
        assert main(["edit", "obstacle", "-9,-9", "-8,-8"]) == 2
        assert "expected a rectangle on the map" in capsys.readouterr().err
        fleet.member("r1").kill()
        fleet.await_line("r1 was ended by signal 9; started again")
        while main(["go"]) != 0:  # refused until r1 is back
            bus.receive(1.0)
        given_up = {await_event(bus, lambda event: event.kind == "unreachable").robot for _ in range(2)}
        assert given_up == {"r1", "r2"}
        assert fleet.end() == 1, fleet.text
        report = fleet.report()
    assert report["reason"] == "not reached: r1 target 1 (no path); r2 target 1 (no path)"
    for row in report["per_robot"].values():
        assert row["unreachable"] == [0]
        assert [time is not None for time in row["reached"]] == [False, True, True]
    assert report["contacts"]["wall"] == 0
