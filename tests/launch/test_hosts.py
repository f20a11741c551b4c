"""Processes started one by one, as on many hosts: joining, refusal, leaving, and foreign messages on the wire."""

import json
import signal
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from time import monotonic

import msgpack
import pytest
import zenoh

from swarm.bus import Endpoint
from swarm.bus.codec import encode
from swarm.bus.settings import client
from swarm.cli import main
from swarm.messages import CLOCK, Broadcast, Phase
from swarm.scenario.load import load
from tests.conftest import MakeBus
from tests.launch.actors import Command, Fleet, await_clock, await_phase, await_presence
from world.simulate import Simulation

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


@pytest.mark.long("two worlds, each process started by hand")
def test_a_robot_waits_for_its_world_and_finds_the_next_one(
    small: Path, make_bus: MakeBus, endpoint: Endpoint, tmp_runtime: Path
) -> None:
    wire = ("--connect", str(endpoint), "--fleet", "again")
    bus = make_bus(fleet="again")
    bus.watch_presence()
    with Command("robot", *wire, runtime=tmp_runtime):
        for _ in range(2):
            with Command("world", str(small), "--robots", "1", "--pace", "max", *wire, runtime=tmp_runtime) as world:
                assert world.end() == 0, world.text


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


# --- strangers ---

# fmt: off
VALID_ELSEWHERE = encode(Broadcast(
    robot="stranger", run=0, tick=1, x=2.5, y=2.0, yaw=0.0, activity="drive", target=0, distance=0.0,  # type: ignore[arg-type]
    reached=[False],
))
RUBBISH = {
    "noise":             b"\xff\x00\xc1rubbish",
    "nothing":           b"",
    "not a map":         msgpack.packb([1, 2, 3]),
    "another version":   msgpack.packb({"v": 2, "run": 0, "tick": 1}),
    "not a number":      msgpack.packb({
        "v": 1, "run": 0, "tick": 10**6, "left": float("nan"), "right": 0.0, "heading": 0.0,
        "activity": "drive", "reached": [], "unreachable": [], "sent": False, "replans": 0}),
    "missing fields":    msgpack.packb({"v": 1}),
    "deep":              b"\x91" * 2000 + b"\x90",
    "oversized":         bytes(1_000_000),
    "another's word":    VALID_ELSEWHERE,
}
KEYS = (
    "robot/r1/sense", "robot/r1/cmd", "robot/r1/state", "robot/r1/plan", "robot/r7/cmd", "robot/r2/cmd",
    "radio/0/0/r1", "radio/0/0/stranger", "radio/-1/0/r2", "world/clock", "world/event", "world/action", "world/join",
    "alive/robot/r1/odd", "alive/robot/r1",
)
# fmt: on


def test_rubbish_on_every_key_changes_nothing_of_a_lockstep_run(small: Path, tmp_runtime: Path) -> None:
    expected = Simulation.of(load(small), 2, 1).run()
    over = threading.Event()
    sent = 0
    with Fleet(small, "--pace", "max", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with zenoh.open(client(fleet.endpoint)) as session:
            token = session.liveliness().declare_token(f"swarm/v1/{fleet.name}/alive/robot/r1")

            def flood() -> None:
                nonlocal sent
                while not over.is_set():
                    for key in KEYS:
                        for payload in RUBBISH.values():
                            session.put(f"swarm/v1/{fleet.name}/{key}", payload)
                            sent += 1
                    over.wait(0.05)

            for key in ("world/action", "world/join"):
                for reply in session.get(f"swarm/v1/{fleet.name}/{key}", payload=b"\xff", timeout=5.0):
                    assert reply.ok is None, "rubbish is answered with a refusal"
            thread = threading.Thread(target=flood)
            thread.start()
            try:
                assert main(["go"]) == 0
                assert fleet.end() == 0, fleet.text
            finally:
                over.set()
                thread.join()
            token.undeclare()  # type: ignore[no-untyped-call]
    assert sent >= len(KEYS) * len(RUBBISH)
    report = fleet.report()
    assert report["complete"]
    assert report["digest"] == expected["digest"]


@pytest.mark.long("seconds of rubbish")
def test_rubbish_is_logged_once_a_second_at_the_most(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    with Command(
        "world", str(small), "--robots", "1", "--connect", str(endpoint), "--fleet", "loud", "--wait",
        runtime=tmp_runtime,
    ) as world, zenoh.open(client(endpoint)) as session:  # fmt: skip
        _await_world(endpoint)
        began = monotonic()
        for _ in range(2000):
            session.put("swarm/v1/loud/robot/r1/cmd", b"\xff")
        told = [world.await_line("bad message")]
        assert told[0].startswith("dropped 1 bad message; the last one: command: expected a MessagePack map")
        while sum(int(line.split()[1]) for line in told) < 2000:
            world.lines.clear()
            told.append(world.await_line("bad message"))
        assert sum(int(line.split()[1]) for line in told) == 2000
        assert len(told) <= monotonic() - began + 2, "the first at once, the others a second apart"
        world.process.send_signal(signal.SIGTERM)
        assert world.end() == 1


def _await_world(endpoint: Endpoint) -> None:
    from swarm.bus import Bus

    with Bus(endpoint, "loud", lambda line: None) as bus:
        bus.watch_presence("world")
        await_presence(bus, "world", alive=True)
        assert bus.fetch(CLOCK)
