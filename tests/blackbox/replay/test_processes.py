"""Runs over processes are replayed from their tapes: every answer and the digest, whatever happened to them."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest
from msgspec.structs import replace

from swarm.blackbox.replay.answer_values import ReplayedTick
from swarm.blackbox.replay.judge import Watch
from swarm.blackbox.replay.replay import Replay, replay_tape
from swarm.bus import Bus, Endpoint
from swarm.cli import main
from swarm.tape.reader import TapeFile
from tests.blackbox.replay.shared import assert_replayed
from tests.launch.actors import FAREWELL, SMALL, Command, Fleet, await_clock, await_tick
from tests.launch.test_examples import read_to, started_at
from tests.launch.test_foreign_robot import FOREIGN
from tests.secure.shared import fleet_keys
from tests.shared import PAPER, ROOT, mostly_long
from world.world import World

pytestmark = pytest.mark.processes

HARD: Final = SMALL.replace("limit: 1500", "limit: 1500\nsensors: {noise: 0.02}\nradio: {loss: 0.3}")
UNKNOWN: Final = SMALL.replace("map:\n", "map:\n  known: false\n")
NO_STOPS: Final = SMALL.replace("targets: [[9.5, 2.0], [9.5, 6.0]]\n", "")
Work = Callable[[Fleet, Bus], None]


def at(tick: int, bus: Bus) -> None:
    """Wait for a tick of the run that goes on."""
    await_clock(bus, lambda clock: clock.tick >= tick)


def nothing(fleet: Fleet, bus: Bus) -> None:
    """Leave the run alone."""


def stalls_and_kills(fleet: Fleet, bus: Bus) -> None:
    """Stop a robot's process for a while, and kill two."""
    at(20, bus)
    stopped = fleet.member("r2").pid
    os.kill(stopped, signal.SIGSTOP)
    await_tick(bus, 60)
    os.kill(stopped, signal.SIGCONT)
    fleet.member("r1").kill()
    at(100, bus)
    fleet.await_member("r3").kill()


def kills_the_world(fleet: Fleet, bus: Bus) -> None:
    """Kill the world twice, and a robot in between."""
    for tick in (30, 110):
        at(tick, bus)
        fleet.await_member("world").kill()
        if tick == 30:
            fleet.await_member("r2").kill()
        fleet.await_line("world was ended by signal 9; started again")


def kills_the_router(fleet: Fleet, bus: Bus) -> None:
    """Kill the router twice: what is on its way is lost."""
    for tick in (30, 90):
        at(tick, bus)
        fleet.await_member("router").kill()
        fleet.await_line("router was ended by signal 9; started again")


def steers(fleet: Fleet, bus: Bus) -> None:
    """Edit the floor, give an order and an action, pause, and restart."""
    at(20, bus)
    assert main(["edit", "wall", "6.1,1.1", "6.9,1.9"]) == 0
    assert main(["order", "r2", "2.5,6.0", "--id", "a"]) == 0
    assert main(["pause"]) == 0
    assert main(["resume"]) == 0
    assert main(["cancel", "r3"]) == 0
    at(60, bus)
    assert main(["restart"]) == 0
    await_clock(bus, lambda clock: clock.run == 1 and clock.tick >= 20)
    fleet.member("r3").kill()


def adds(fleet: Fleet, bus: Bus) -> None:
    """Add robots, fill the pool, and end the run later."""
    at(10, bus)
    assert main(["add-robots", "1", "--at", "8.5,4.0"]) == 0
    assert main(["pool", "9.5,2.0", "9.5,6.0", "2.5,2.0"]) == 0
    at(160, bus)
    assert main(["stop"]) == 0


class Case(NamedTuple):
    """A run: its scenario, options, what happens in it, and if `make test` has it."""

    scenario: str | Path
    options: tuple[str, ...]
    work: Work = nothing
    robots: int = 3


CASES: Final = {
    "loss, stalls, kills": Case(HARD, ("--limit", "8"), stalls_and_kills),
    "killed world": Case(HARD, ("--limit", "8"), kills_the_world),
    "killed router": Case(HARD, ("--limit", "8"), kills_the_router),
    "edit, order, pause, restart": Case(HARD, ("--limit", "6"), steers),
    "late answers": Case(SMALL, ("--limit", "8", "--delay", "55")),
    "lockstep": Case(HARD, ("--pace", "max", "--limit", "20"), stalls_and_kills),
    "lockstep, killed world": Case(HARD, ("--pace", "max", "--limit", "20"), kills_the_world),
    "unknown floor, killed world": Case(ROOT / "scenarios" / "unknown.yaml", ("--limit", "8"), kills_the_world, 4),
    "places, pool": Case(NO_STOPS, ("--serve",), adds, 2),
    "sharing processes": Case(HARD, ("--limit", "8", "--robots-per-process", "2"), steers, 3),
}
QUICK: Final = ("killed world",)


def driven(case: Case, tape: Path, folder: Path) -> dict[str, Any]:
    """Drive a case, and return its report."""
    file = case.scenario if isinstance(case.scenario, Path) else folder / "case.yaml"
    if isinstance(case.scenario, str):
        file.write_text(case.scenario)
    options = (*case.options, "--record", str(tape))
    with Fleet(file, *options, robots=case.robots, runtime=folder) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
            case.work(fleet, bus)
        assert fleet.end() in {0, 1}
        return fleet.report()


@pytest.mark.parametrize("name", mostly_long("a run of many seconds", CASES, *QUICK))
def test_a_run_is_replayed(name: str, tmp_runtime: Path) -> None:
    tape = tmp_runtime / "run.swarm"
    assert_replayed(tape, driven(CASES[name], tape, tmp_runtime))


def test_the_tape_of_the_last_run_stays(small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Fleet(small, "--pace", "max", "--limit", "3", runtime=tmp_runtime) as fleet:
        assert fleet.end() == 1
        tape = Path(fleet.await_line("tape: ").split()[1])
        report = fleet.report()
    assert_replayed(tape, report)
    assert main(["replay", str(tape), "--laws"]) == 0
    assert capsys.readouterr().out.endswith("laws kept\n")


@pytest.mark.long("a run of many seconds")
def test_robots_that_a_new_world_has_elsewhere_are_known(tmp_runtime: Path) -> None:
    tape = tmp_runtime / "run.swarm"
    driven(CASES["lockstep, killed world"], tape, tmp_runtime)
    watch, worlds = Watch(), list[World]()

    def take(replay: Replay, tick: ReplayedTick) -> None:
        if replay.world not in worlds:
            worlds.append(replay.world)
        moved = {name: replace(one, x=one.x + 0.1 * (len(worlds) - 1)) for name, one in tick.senses.items()}
        watch.take(replay, tick._replace(senses=moved))

    replay_tape(TapeFile(tape), take)
    assert len(worlds) > 1
    assert watch.history is not None
    assert list(watch.history.put_back) == [0, 1, 2]


@pytest.mark.long("a run of many seconds")
def test_a_body_outside_is_replayed(tmp_runtime: Path) -> None:
    file, tape = tmp_runtime / "small.yaml", tmp_runtime / "run.swarm"
    file.write_text(SMALL)
    options = ("--pace", "max", "--body", "r2", "--record", str(tape), "--limit", "30")
    with Fleet(file, *options, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with started_at(fleet.endpoint, fleet.name, "foreign_body.py", "r2") as body:
            read_to(body, "stands at")
            fleet.end()
        report = fleet.report()
    assert_replayed(tape, report)


@pytest.mark.long("a run of many seconds")
@pytest.mark.parametrize("pace", ["max", "2"])
def test_a_foreign_robot_is_replayed(pace: str, endpoint: Endpoint, tmp_runtime: Path) -> None:
    fleet, file, tape = f"foreign-{pace}", tmp_runtime / "report.json", tmp_runtime / "run.swarm"
    wire = ("--connect", str(endpoint), "--fleet", fleet)
    arguments = (str(PAPER), "--robots", "4", "--pace", pace, "--report", str(file), "--record", str(tape))
    with (
        Command("world", *arguments, "--limit", "40", *wire, runtime=tmp_runtime) as world,
        subprocess.Popen(
            [sys.executable, str(FOREIGN), str(endpoint), fleet, "r2"], stdout=subprocess.PIPE, text=True
        ) as foreign,
    ):
        assert foreign.stdout is not None
        while foreign.stdout.readline() != "r2 has joined\n":
            pass
        with Command("robot", "--count", "3", *wire, runtime=tmp_runtime):
            assert world.end() == 1, world.text
        assert foreign.wait(FAREWELL) == 0
    replay = assert_replayed(tape, json.loads(file.read_text()))
    assert replay.broadcasts


@pytest.mark.long("a run of many seconds")
def test_a_fleet_with_keys_is_replayed(tmp_runtime: Path) -> None:
    file, tape, keys = tmp_runtime / "small.yaml", tmp_runtime / "run.swarm", tmp_runtime / "keys"
    file.write_text(SMALL)
    fleet_keys(keys)
    with Fleet(file, "--record", str(tape), "--limit", "10", keys=keys, runtime=tmp_runtime) as fleet:
        assert fleet.end() in {0, 1}
        report = fleet.report()
    assert_replayed(tape, report)
