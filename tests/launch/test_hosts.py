"""Processes started one by one, as on many hosts: joining, refusal, leaving, and foreign messages on the wire."""

import json
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarm.bus import Endpoint, connect
from swarm.cli import main
from swarm.messages import Phase
from tests.conftest import MakeBus
from tests.launch.actors import Command, await_clock, await_phase, await_presence
from world.host.process import LEFT

pytestmark = pytest.mark.processes


@pytest.fixture
def world(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> Iterator[Command]:
    """Run a world for two robots at a calm pace, on the router of this process, until it is told to stop."""
    arguments = ("--robots", "2", "--pace", "1", "--serve", "--connect", str(endpoint), "--fleet", "hosts")
    with Command("world", str(small), *arguments, runtime=tmp_runtime) as command:
        yield command


@pytest.mark.long("a whole mission, each process started by hand")
def test_robots_join_late_one_by_one_and_a_third_finds_no_place(
    world: Command, make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wire = ("--connect", str(endpoint), "--fleet", "hosts")
    bus = make_bus(fleet="hosts")
    bus.watch_presence()
    await_presence(bus, "world", alive=True)
    with Command("robot", *wire, runtime=tmp_runtime), Command("robot", *wire, runtime=tmp_runtime) as second:
        await_phase(bus, Phase.RUNNING)
        for name, reason in (
            ([], "a robot: join: all 2 places are taken; start the world with more robots"),
            (["--id", "r1"], "robot 'r1' is here already; stop that one first, or join without a name"),
            (["--id", "r9"], "expected one of r1, r2, got 'r9'"),
        ):
            with Command("robot", *name, *wire, runtime=tmp_runtime) as third:
                assert third.await_line(reason).endswith("; it asks again and again")
                third.process.send_signal(signal.SIGTERM)
                assert third.end() == 0
                assert third.text.count(reason) == 1, "each reason is told once"

        assert main(["status", "--json", *wire]) == 0
        status = json.loads(capsys.readouterr().out)
        assert status["phase"] == "running"
        assert [(one["robot"], one["liveness"]) for one in status["robots"]] == [("r1", "alive"), ("r2", "alive")]
        assert len(status["robots"][1]["state"]["reached"]) == 3

        second.process.kill()
        second.process.wait()
        await_clock(bus, lambda clock: len(clock.present) == 1)
        with Command("robot", *wire, runtime=tmp_runtime):
            await_clock(bus, lambda clock: clock.present == ["r1", "r2"])


def test_who_is_told_to_stop_leaves_no_token(
    world: Command, make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    wire = ("--connect", str(endpoint), "--fleet", "hosts")
    bus = make_bus(fleet="hosts")
    bus.watch_presence()
    await_presence(bus, "world", alive=True)
    with Command("robot", "--id", "r2", *wire, runtime=tmp_runtime) as robot:
        await_presence(bus, "r2", alive=True)
        robot.process.send_signal(signal.SIGINT)
        await_presence(bus, "r2", alive=False)
        assert robot.end() == 0
        assert "Traceback" not in robot.text
    world.process.send_signal(signal.SIGTERM)
    await_presence(bus, "world", alive=False)
    assert world.end() == 1
    assert "Traceback" not in world.text


@pytest.mark.long("a whole mission, each process started by hand")
def test_who_is_told_to_stop_makes_room_for_another_process(
    world: Command, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    """As in a cluster, where a new pod takes the place of an old one, and neither has a name."""
    wire = ("--connect", str(endpoint), "--fleet", "hosts")
    for _ in range(2):
        with Command("robot", *wire, runtime=tmp_runtime) as robot:
            robot.await_line("joined as r1")
            robot.process.send_signal(signal.SIGTERM)
            assert robot.end() == 0


def test_a_world_of_another_wire_is_a_sentence(endpoint: Endpoint, tmp_runtime: Path) -> None:
    with connect(endpoint) as session:
        token = session.liveliness().declare_token("swarm/v9/hosts/alive/world/world/abc")
        with Command("robot", "--connect", str(endpoint), "--fleet", "hosts", runtime=tmp_runtime) as robot:
            robot.await_line("expected a world of wire v1, got one of v9; install the zenoh-swarm that it has")
            robot.process.send_signal(signal.SIGTERM)
            assert robot.end() == 0
        token.undeclare()  # type: ignore[no-untyped-call]


@pytest.mark.long("two worlds and a whole mission")
def test_a_world_with_a_snapshot_that_is_told_to_stop_leaves_its_run_to_the_next_one(
    small: Path, endpoint: Endpoint, tmp_runtime: Path, tmp_path: Path
) -> None:
    file, report = tmp_path / "run.snapshot", tmp_path / "report.json"
    wire = ("--connect", str(endpoint), "--fleet", "hosts")
    words = ("world", str(small), "--robots", "1", "--pace", "4", "--snapshot", str(file), "--report", str(report))
    with Command("robot", *wire, runtime=tmp_runtime) as robot:
        with Command(*words, *wire, runtime=tmp_runtime) as world:
            world.await_line("r1 is at target 1")
            world.process.send_signal(signal.SIGTERM)
            assert world.end() == LEFT
            assert f"in {file}; the same command goes on with it" in world.text
            assert not report.exists(), "the run is not over"
        with Command(*words, *wire, runtime=tmp_runtime) as world:
            world.await_line("the run goes on at")
            assert world.end() == 0
        assert robot.text.count("joined as") == 2
    assert not list(tmp_path.glob("*run.snapshot*")), "there is nothing to go on with"
    found = json.loads(report.read_text(encoding="utf-8"))
    assert (found["passed"], found["complete"]) == (True, True)


def test_status_of_no_fleet_is_a_sentence(
    make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["status"]) == 2
    assert "expected a fleet running on this machine, found none" in capsys.readouterr().err
    assert main(["status", "--connect", str(endpoint), "--fleet", "nobody"]) == 2
    assert "expected a running fleet, got 'nobody'; " in capsys.readouterr().err
    make_bus(fleet="no-world").announce("robot", "r1")
    assert main(["status", "--connect", str(endpoint), "--fleet", "no-world"]) == 2
    assert "expected a world in that fleet, found none" in capsys.readouterr().err
    assert main(["go", "--connect", str(endpoint), "--fleet", "no-world"]) == 2
    assert "expected an answer, got none" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["router", "--listen", "tcp/127.0.0.1:{}"], ["run", "{scenario}", "--port", "{}"]])
def test_a_port_in_use_is_a_sentence(
    command: list[str], small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        status = main([part.format(port, scenario=small) for part in command])
    assert status == 2
    said = capsys.readouterr().err
    assert f"swarm: port {port} on 127.0.0.1: expected a free port, got" in said
    assert len(said.splitlines()) == 1
