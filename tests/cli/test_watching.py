"""`swarm ls`, `topics`, `echo`, `hz` and `watch` on fleets that run, over real Zenoh."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from msgspec import structs

from swarm.bus import Endpoint
from swarm.bus.foreign import Stranger
from swarm.cli import main
from swarm.launch.fleet_registry import default_fleet_name
from swarm.messages import CLOCK, MAP, STATE, Map, Phase
from swarm.scenario.load import Scenario
from tests.cli.saying import Capture, refused, said
from tests.conftest import MakeBus
from tests.launch.actors import Command, Fleet, await_phase
from tests.messages.made import clock, state
from tests.secure.shared import fleet_keys

pytestmark = pytest.mark.processes


@pytest.fixture
def driving(small: Path, tmp_runtime: Path) -> Iterator[Fleet]:
    """Run a fleet in real time; it drives."""
    with Fleet(small, "--pace", "0.5", runtime=tmp_runtime) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
            await_phase(bus, Phase.RUNNING)
        yield fleet


def test_the_tools_find_the_fleet_and_show_it(driving: Fleet, tmp_runtime: Path, capsys: Capture) -> None:
    (row,) = json.loads(said(capsys, "ls", "--json"))
    assert (row["fleet"], row["router"], row["robots"], row["phase"]) == (
        driving.name, str(driving.endpoint), 2, "running",
    )  # fmt: skip
    assert driving.name in said(capsys, "ls")
    assert driving.name in said(capsys, "ls", "--connect", str(driving.endpoint))

    rows = {row["key"]: row for row in json.loads(said(capsys, "topics", "--seconds", "1.5", "--json"))}
    assert {"robot/r1/sense", "robot/r1/cmd", "robot/r2/cmd", "world/truth"} <= set(rows)
    assert (rows["robot/r1/cmd"]["who"], rows["robot/r1/sense"]["who"]) == ("r1", "world")
    assert all((row["rate"] > 0) is (row["age"] is not None) and row["size"] > 0 for row in rows.values())
    shown = said(capsys, "topics", "--seconds", "1")
    assert "robot/r1/sense" in shown
    assert max(map(len, shown.splitlines())) <= 80

    state = json.loads(said(capsys, "echo", "robot/r1/state", "--once", "--json"))
    assert (state["key"], state["message"]["robot"]) == ("robot/r1/state", "r1")
    assert "  tick: " in said(capsys, "echo", "robot/*/sense", "--once")
    pace = json.loads(said(capsys, "hz", "robot/r1/sense", "--seconds", "1.5", "--json").splitlines()[-1])
    assert pace["rate"] > 0

    status = json.loads(said(capsys, "status", "--json"))
    assert [row["robot"] for row in status["robots"]] == ["r1", "r2"]
    assert "such as robot/r1/state" in refused(capsys, "echo", "robot//state")
    assert f"running on this machine: {driving.name}" in refused(capsys, "hz", "x", "--fleet", "nope")
    assert driving.name in refused(capsys, "hz", "x", "--fleet", "nope", "--connect", str(driving.endpoint))

    with Command("watch", runtime=tmp_runtime) as watch:
        watch.await_line("running")
        assert main(["stop"]) == 0
        assert watch.end() == 0, watch.text
    assert driving.end() == 1


def test_processes_have_the_names_of_what_they_are(driving: Fleet) -> None:
    names = {psutil.Process(one.pid).name() for one in driving.family if one.is_running()}
    assert {"swarm run", "swarm router", "swarm world", "swarm r1", "swarm r2"} <= names


@pytest.mark.long("a fleet of its own, with keys")
def test_tools_may_watch_a_fleet_with_keys(tmp_runtime: Path, small: Path, capsys: Capture) -> None:
    keys = tmp_runtime / "keys"
    fleet_keys(keys)
    secure = ("--secure", str(keys))
    with Fleet(small, "--pace", "0.5", runtime=tmp_runtime, keys=keys) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
            await_phase(bus, Phase.RUNNING)
        assert json.loads(said(capsys, "ls", "--json"))[0]["phase"] == "needs --secure"
        assert json.loads(said(capsys, "ls", "--json", *secure))[0]["phase"] == "running"
        wire = ("--connect", str(fleet.endpoint), *secure)
        assert fleet.name in said(capsys, "ls", *wire)
        tables = (said(capsys, "topics", "--seconds", "1", *wire) for _ in range(20))  # a busy machine may be silent
        assert any("robot/r1/sense" in table for table in tables)
        assert "world/clock" in said(capsys, "echo", "world/clock", "--once", *secure)
        assert " Hz " in said(capsys, "hz", "robot/r1/cmd", "--seconds", "1.5", *secure)
        assert "needs keys: add --secure DIR" in refused(capsys, "topics")
        with Command("watch", *secure, runtime=tmp_runtime) as watch:
            watch.await_line("running")
            assert main(["stop", *secure]) == 0
            assert watch.end() == 0, watch.text


def test_of_several_fleets_on_a_router_one_has_to_be_named(
    make_bus: MakeBus, endpoint: Endpoint, capsys: Capture
) -> None:
    place = str(endpoint)
    assert f"expected a fleet running on {place}, found none" in refused(capsys, "topics", "--connect", place)
    one, other = make_bus(fleet="one"), make_bus(fleet="other")
    for bus in (one, other):
        bus.announce("world", "world")
    for command in (["topics"], ["status"], ["go"], ["echo", "world/clock"], ["hz", "world/clock"], ["watch"]):
        line = refused(capsys, *command, "--connect", place)
        assert f"expected one running fleet on {place}, found one, other; name one with --fleet" in line
    assert "found one, other; name one" in refused(capsys, "robot", "--connect", place)


@pytest.mark.long("a fleet of its own, each process started by hand")
def test_a_world_and_a_robot_that_are_told_no_fleet_meet_and_the_world_has_its_user_in_its_name(
    small: Path, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    wire = ("--connect", str(endpoint))
    with (
        Command("robot", *wire, runtime=tmp_runtime) as robot,
        Command("world", str(small), "--robots", "1", "--pace", "max", *wire, runtime=tmp_runtime) as world,
    ):
        assert robot.await_line("fleet ").split()[1] == default_fleet_name("small")
        assert world.end() == 0, world.text


def test_a_message_that_is_not_what_its_key_says_is_told_and_passed_over(
    make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    bus = make_bus(fleet="forged")
    bus.announce("world", "world")
    with (
        Stranger(endpoint, "forged") as stranger,
        Command("echo", "**", "--once", "--connect", str(endpoint), runtime=tmp_runtime) as echo,
    ):
        while "elsewhere: " not in echo.text or "world/clock: " not in echo.text:
            stranger.send_bytes("world/clock", b"nonsense")
            stranger.send_bytes("elsewhere", b"nonsense")
            assert echo.process.poll() is None, echo.text
            assert bus.receive(0.05) is None
        bus.send(CLOCK, clock(1))
        assert echo.end() == 0, echo.text
    assert "world/clock: clock: expected a MessagePack map" in echo.text
    assert "elsewhere: expected a key of the table of topics, got 8 bytes" in echo.text
    assert "phase: running" in echo.text


@pytest.mark.parametrize(("return_home", "lane"), [(True, "r1 home"), (False, "r1 to 2")])
def test_a_watcher_asks_the_world_whether_the_last_stop_is_home(
    make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path, paper: Scenario, return_home: bool, lane: str
) -> None:
    scenario, packed = replace(paper, settings=structs.replace(paper.settings, return_home=return_home)).to_wire()
    runs, drives = clock(1, robots=("r1",)), state(1, "r1", target=1, reached=[True, False])
    bus = make_bus(fleet="last")
    bus.announce("world", "world")
    bus.keep(CLOCK, lambda: {CLOCK.key: runs})
    bus.keep(MAP, lambda: {MAP.key: Map(scenario=scenario, packed=packed)})
    bus.keep(STATE, lambda: {"robot/r1/state": drives})
    with Command("watch", "--connect", str(endpoint), runtime=tmp_runtime) as watch:
        assert watch.await_line("of the way").endswith(f": {lane}")
        while watch.process.poll() is None:
            bus.send(CLOCK, structs.replace(runs, tick=2, phase=Phase.OVER))
            assert bus.receive(0.05) is None
        assert watch.end() == 0, watch.text


def test_a_watcher_says_that_the_world_has_gone_and_goes_on(
    make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    bus = make_bus(fleet="left")
    bus.announce("world", "world")
    runs = clock(1)
    bus.keep(CLOCK, lambda: {CLOCK.key: runs})
    with Command("watch", "--connect", str(endpoint), runtime=tmp_runtime) as watch:
        watch.await_line("running")
        bus.withdraw("world", "world")
        watch.await_line("the world has gone; Ctrl-C ends this")
        bus.announce("world", "world")
        while watch.process.poll() is None:
            bus.send(CLOCK, structs.replace(runs, tick=2, phase=Phase.OVER))
            assert bus.receive(0.05) is None
        assert watch.end() == 0, watch.text
    assert watch.text.count("the world has gone") == 1


def test_no_router_is_told_without_a_path_of_the_library(capsys: Capture) -> None:
    free = Endpoint("127.0.0.1", 0).claim()
    line = refused(capsys, "ls", "--connect", str(free))
    assert f"endpoint {free}: expected a running router, got" in line
    assert ".rs" not in line
