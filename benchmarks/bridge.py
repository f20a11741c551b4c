"""What the bridges cost: CPU of each, and its memory, by who listens.

    python -m benchmarks.bridge [--seconds 20] [--robots 64] [--only TEXT]

A run of real robots is recorded in one process, then played through a real router at real rates, senses too, so that
the robots themselves cost nothing meanwhile. Listeners and the router are processes of their own. The first seconds, in
which Python starts, are not counted. `grown` is how much own memory came while it was measured.

The second table is of a real fleet in real time: how long a client of Nav2's action waits until its goal is accepted.
"""

import argparse
import json
import multiprocessing
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Event as Flag
from time import perf_counter
from typing import Any, Final, NamedTuple

import psutil
import zenoh
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from benchmarks.box import FLEET, Played, busy
from benchmarks.dashboard import WARM_UP, router
from benchmarks.measure import machine, printed
from swarm.bus import Bus, Endpoint
from swarm.messages import SENSE, Message, Topic
from swarm.scenario.starts import robot_names
from tests.bridge.ros2.foreign import Client, client_session, placed, uuid
from tests.launch.actors import Fleet
from world.simulate import Tick

ROS2, FOXGLOVE = "ROS 2", "Foxglove"
BARS: Final = {ROS2: 15, FOXGLOVE: 10}  # % of a core
PROTOCOL: Final = Subprotocol("foxglove.sdk.v1")
ACCEPTED: Final = 50  # ms, of 99 goals in 100
PAUSE: Final = 0.05  # s between two goals
STARTS: Final = 6.0  # s more for a bridge and who listens to it: in ROS each robot has many nodes and services

Sent = tuple[Topic[Any], Message, dict[str, Any]]


class Sensed(Played):
    """A recorded run with what each robot senses."""

    def besides(self, tick: Tick) -> list[Sent]:
        """Return what the world tells each robot."""
        return [(SENSE, sense, {"robot": name}) for name, sense in tick.senses.items()]


def hear_all(endpoint: str) -> None:
    """Be a program of ROS that subscribes to everything."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{endpoint}"]')
    with zenoh.open(config) as session:
        subscribed = session.declare_subscriber("0/**", zenoh.handlers.RingChannel(1))
        Flag().wait()
        subscribed.undeclare()


def view(url: str, reads: bool) -> None:
    """Be a viewer of Foxglove that wants everything, and reads it, or nothing of it."""
    with connect(url, subprotocols=[PROTOCOL], max_size=None, ping_interval=None) as socket:
        wanted = False
        for came in socket:
            if isinstance(came, str) and (said := json.loads(came))["op"] == "advertise":
                asked = [{"id": one["id"], "channelId": one["id"]} for one in said["channels"]]
                socket.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
                wanted = len(asked) > 10  # those of robots: the fleet's come before
            if wanted and not reads:
                Flag().wait()


class Case(NamedTuple):
    """A bridge, and who listens to it."""

    bridge: str
    listeners: str
    arguments: Callable[[Endpoint, int, Path], list[str]]
    listen: tuple[tuple[Callable[..., None], bool | None], ...] = ()


def ros2(endpoint: Endpoint, port: int, folder: Path) -> list[str]:
    return ["ros2"]


def foxglove(endpoint: Endpoint, port: int, folder: Path) -> list[str]:
    return ["foxglove", "--port", str(port)]


def recorded(endpoint: Endpoint, port: int, folder: Path) -> list[str]:
    return ["foxglove", "--port", str(port), "--record", str(folder / "run.mcap")]


CASES: Final = (
    Case(ROS2, "nobody", ros2),
    Case(ROS2, "one that wants all", ros2, ((hear_all, None),)),
    Case(FOXGLOVE, "nobody", foxglove),
    Case(FOXGLOVE, "one that wants all", foxglove, ((view, True),)),
    Case(FOXGLOVE, "one that never reads", foxglove, ((view, False),)),
    Case(FOXGLOVE, "a bag", recorded),
)


@contextmanager
def bridge(case: Case, endpoint: Endpoint, folder: Path) -> Iterator[psutil.Process]:
    """Run a bridge, and who listens to it, inside the block."""
    port = Endpoint("127.0.0.1", 0).claim().port
    command = [
        sys.executable, "-m", "swarm.cli", "bridge", *case.arguments(endpoint, port, folder),
        "--connect", str(endpoint), "--fleet", FLEET,
    ]  # fmt: skip
    with ExitStack() as closing:
        running = closing.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        closing.callback(running.terminate)
        assert running.stdout is not None
        assert FLEET in running.stdout.readline(), "it says where it is"
        for run, reads in case.listen:
            place: tuple[Any, ...] = (str(endpoint),) if reads is None else (f"ws://127.0.0.1:{port}", reads)
            other = multiprocessing.get_context("spawn").Process(target=run, args=place)
            other.start()
            closing.callback(other.join)
            closing.callback(other.terminate)
        yield psutil.Process(running.pid)


def measured(case: Case, played: Played, seconds: float) -> Sequence[str]:
    """Return the cells of a case."""
    with tempfile.TemporaryDirectory() as folder, router() as endpoint, Bus(endpoint, FLEET, lambda line: None) as bus:
        bus.announce("world", "world")
        played.serve(bus)
        with bridge(case, endpoint, Path(folder)) as process:
            used, memory = [], []
            for _ in played.play(bus, seconds, WARM_UP + STARTS):
                used.append(busy(process))
                memory.append(process.memory_full_info().uss / 1e6)
    share = 100 * (used[1] - used[0]) / seconds
    return [f"{share:.1f}", f"{BARS[case.bridge]}", f"{memory[1]:.0f}", f"{memory[1] - memory[0]:.1f}"]


def accepted(robots: int, goals: int) -> Sequence[str]:
    """Return the cells on goals of ROS to one robot of a fleet of processes."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Fleet(Path("office"), "--serve", "--bridge", "ros2", runtime=Path(folder), robots=robots) as fleet,
        fleet.bus(),  # its router listens
        client_session(fleet.endpoint) as session,
    ):
        fleet.await_line("running")
        client = Client(session, 0, robot_names(robots)[0])
        waits = []
        for number in range(goals):
            start = perf_counter()
            assert client.send(uuid(), placed(4.0 + number % 5 * 0.5, 3.0))
            waits.append(1e3 * (perf_counter() - start))
            Flag().wait(PAUSE)
    waits.sort()
    return [f"{waits[goals // 2]:.1f}", f"{waits[round(0.99 * (goals - 1))]:.1f}", f"{ACCEPTED}"]


def main() -> None:
    parser = argparse.ArgumentParser(description="What the bridges cost.")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--robots", type=int, default=64)
    parser.add_argument("--goals", type=int, default=200, help="of each fleet")
    parser.add_argument("--only", default="", help="measure only rows with this text")
    given = parser.parse_args()
    print(machine())
    played = Sensed(given.robots, given.seconds + WARM_UP + STARTS + 1.0)
    print(f"{given.robots} robots at 20 Hz")
    head = ("bridge, and who listens", "CPU [% of a core]", "needed", "own memory [MB]", "grown [MB]")
    named = {f"{case.bridge}: {case.listeners}": case for case in CASES}
    printed(head, [
        (name, lambda case=case: measured(case, played, given.seconds))  # type: ignore[misc]
        for name, case in named.items() if given.only in name
    ])  # fmt: skip
    fleets = {f"{robots} robots": robots for robots in (4, 16)}
    printed(("goal to accepted", "median [ms]", "99 of 100 [ms]", "needed"), [
        (name, lambda robots=robots: accepted(robots, given.goals))  # type: ignore[misc]
        for name, robots in fleets.items() if given.only in name
    ])  # fmt: skip


if __name__ == "__main__":
    main()
