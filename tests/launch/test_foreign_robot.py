"""The robot of another make drives among three of ours: it is written from the docs, and knows zenoh and msgpack only."""

import json
import subprocess
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest

from benchmarks.floor import mission_to_places
from swarm.bus import Endpoint
from swarm.scenario.load import Scenario
from tests.launch.actors import FAREWELL, SMALL, Command
from tests.launch.foreign import with_foreign
from tests.shared import PAPER, ROOT, with_settings

FOREIGN: Final = ROOT / "examples" / "foreign_robot.py"


def assert_it_keeps_the_contract(report: dict[str, Any], name: str) -> None:
    """Check that all arrive, nobody is touched, and the foreign robot waits no longer than the others do."""
    assert report["complete"]
    assert sum(report["contacts"].values()) == 0
    traffic, robots = report["traffic"], report["per_robot"]
    assert (traffic["overlaps"], traffic["outside"], traffic["deadlocks"], traffic["stalled"]) == (0, 0, 0, 0)
    for by in ("waiting", "standing"):  # what they say, and what the world saw
        assert robots[name][by] <= max(one[by] for other, one in robots.items() if other != name)


@pytest.mark.long("a whole mission in plain Python")
@pytest.mark.processes
def test_it_completes_the_papers_mission_among_three_of_ours(endpoint: Endpoint, tmp_runtime: Path) -> None:
    """With the lowest id it is the first to be asked for joint plans, which it does not make."""
    name, fleet, file = "r1", "foreign-r1", tmp_runtime / "report.json"
    wire = ("--connect", str(endpoint), "--fleet", fleet)
    arguments = (str(PAPER), "--robots", "4", "--pace", "max", "--report", str(file))
    with (
        Command("world", *arguments, *wire, runtime=tmp_runtime) as world,
        subprocess.Popen(
            [sys.executable, str(FOREIGN), str(endpoint), fleet, name], stdout=subprocess.PIPE, text=True
        ) as foreign,
    ):
        assert foreign.stdout is not None
        while (line := foreign.stdout.readline()) != f"{name} has joined\n":
            assert line.startswith("world/join: "), line
        with Command("robot", "--count", "3", *wire, runtime=tmp_runtime):
            assert world.end() == 0, world.text
        assert foreign.wait(FAREWELL) == 0
    assert_it_keeps_the_contract(json.loads(file.read_text()), name)


@pytest.mark.processes
@pytest.mark.long("a mission, and a router that starts again")
def test_it_comes_back_when_the_router_was_away(tmp_runtime: Path) -> None:
    place, file = Endpoint("127.0.0.1", 0).claim(), tmp_runtime / "report.json"
    wire = ("--connect", str(place), "--fleet", "foreign-again")
    (longer := tmp_runtime / "longer.yaml").write_text(
        SMALL.replace("targets: [", f"targets: [{6 * '[2.5, 6.0], [9.5, 4.0], '}")
    )
    arguments = (str(longer), "--robots", "3", "--pace", "max", "--report", str(file))
    router = ("router", "--listen", str(place))
    with ExitStack() as stack:
        start = partial(Command, runtime=tmp_runtime)
        first = stack.enter_context(start(*router))
        first.await_line("listening")
        # what the router had not delivered when it was killed is lost
        world = stack.enter_context(start("world", *arguments, *wire, breaks=("broadcasts are heard",)))
        foreign = stack.enter_context(
            subprocess.Popen([sys.executable, str(FOREIGN), str(place), "foreign-again", "r3"], stdout=subprocess.PIPE)
        )
        stack.enter_context(start("robot", "--count", "2", *wire))
        world.await_line("at target 1")
        first.process.kill()
        world.await_line("the router is gone")
        stack.enter_context(start(*router))
        assert world.end() == 0, world.text
        assert foreign.wait(FAREWELL) == 0
    assert_it_keeps_the_contract(json.loads(file.read_text()), "r3")


def test_it_comes_to_places_that_lie_between_cells(paper: Scenario) -> None:
    run = with_foreign(mission_to_places(paper, 2, 3, 0.1, seed=1), 2, seed=1, number=1)
    report = run.run(limit=300.0)
    assert report["complete"], report["reason"]
    assert sum(report["contacts"].values()) == 0
    assert (report["traffic"]["overlaps"], report["traffic"]["outside"]) == (0, 0)


@pytest.mark.long("a whole mission; make test drives it over processes")
def test_a_lossy_radio_costs_it_time_only(paper: Scenario) -> None:
    run = with_foreign(with_settings(paper, radio={"loss": 0.3}), 4, seed=2, number=1)
    report = run.run()
    assert report["complete"]
    assert sum(report["contacts"].values()) == 0
    assert (report["traffic"]["overlaps"], report["traffic"]["outside"]) == (0, 0)


@pytest.mark.long("a whole mission; make test drives it over processes")
def test_it_tells_the_error_of_its_pose_and_drives_on_when_the_world_has_counted(paper: Scenario) -> None:
    run = with_foreign(with_settings(paper, localisation={"error": 0.03, "yaw_error_deg": 1.5}), 4, seed=3, number=1)
    report = run.run()
    assert report["complete"]
    assert sum(report["contacts"].values()) == 0
    assert (report["traffic"]["overlaps"], report["traffic"]["outside"]) == (0, 0)
