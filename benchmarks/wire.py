"""What a tool waits for, and what the wire carries: ``python -m benchmarks.wire [--robots 8 32 64] [--requests 1000]``.

Three tables, each of a real fleet in real time on this machine. A late joiner opens a session and asks for everything
that the world keeps, before `go`, in mid-run and in a pause; the target is 0.3 s. Requests are timed from asking to the
answer, all kinds in turn and in a random order, with random pauses of up to a tick between them: half of the answers
are to come within 5 ms, and 99 of 100 within 20 ms. Traffic is counted by a watcher of all topics.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from random import Random
from statistics import quantiles
from time import monotonic, perf_counter, sleep
from typing import Any, Final

import msgspec
import zenoh

from benchmarks.asked import requests
from benchmarks.measure import load, machine, printed
from swarm.bus import Bus, Endpoint, settings
from swarm.errors import ConfigError
from swarm.messages import (
    ACTION,
    CLOCK,
    EVENTS,
    MAP,
    PLAN,
    STATE,
    STATUS,
    TOPICS,
    TRUTH,
    Action,
    Do,
    Liveness,
    Phase,
    Topic,
)
from swarm.messages.topic import key_prefix_of

ROOT: Final = Path(__file__).parents[1]
DEPOT: Final = ROOT / "scenarios" / "depot.yaml"
FLEET: Final = "bench"
ALL: Final[tuple[Topic[Any], ...]] = (CLOCK, TRUTH, STATE, PLAN, MAP, EVENTS, STATUS)
TARGET: Final = 0.3  # s
HALF: Final = 0.005  # s, for the median of the answers
NEARLY_ALL: Final = 0.02  # s, for their p99
PAUSE: Final = 0.05  # s between two requests, at most
JOINED: Final = 16  # robots of the fleet that a tool joins late, or asks
START: Final = 120.0  # s for all robots to be there
START_AREA: Final = [0.8, 0.8, 19.0, 12.0]  # m, nearly the whole floor: it takes many robots


def patrol(folder: Path, robots: int) -> Path:
    """Write a depot in which robots drive for ever, and return its file."""
    scenario = folder / "depot.yaml"
    raw = msgspec.yaml.decode(DEPOT.read_bytes()) | {"patrol": True, "robots": robots}
    raw["start"]["area"] = START_AREA
    raw["map"]["file"] = "depot.map"
    (folder / "depot.map").write_bytes((DEPOT.parent / "maps" / "depot.map").read_bytes())
    scenario.write_bytes(msgspec.yaml.encode(raw))
    return scenario


@contextmanager
def fleet(robots: int) -> Iterator[Endpoint]:
    """Run a fleet in real time inside the block; it waits for `go`."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    with tempfile.TemporaryDirectory() as folder:
        scenario = patrol(Path(folder), robots)
        command = [
            sys.executable, "-m", "swarm.cli", "run", str(scenario), "--robots", str(robots), "--dashboard", "off",
            "--fleet", FLEET, "--port", str(endpoint.port), "--wait", "--report", str(Path(folder) / "r.json"),
        ]  # fmt: skip
        process = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.DEVNULL, env=os.environ | {"XDG_RUNTIME_DIR": folder}
        )
        try:
            yield endpoint
        finally:
            process.terminate()
            process.wait(60.0)


@contextmanager
def joined(endpoint: Endpoint) -> Iterator[Bus]:
    """Open a session of the fleet."""
    with Bus(endpoint, FLEET, lambda line: None) as bus:
        yield bus


def opened(endpoint: Endpoint, robots: int) -> None:
    """Wait until the fleet is complete.

    Raises:
        TimeoutError: it is not, for long.
    """
    until = monotonic() + START
    while monotonic() < until:
        with suppress(ConfigError), joined(endpoint) as bus:
            while monotonic() < until:
                clocks = bus.fetch(CLOCK)
                if clocks and len(clocks[0].present) == robots:
                    return
    raise TimeoutError(f"expected {robots} robots within {START:g} s")


def press(bus: Bus, do: Do) -> None:
    """Press a button."""
    bus.ask(ACTION, Action(do=do))


def late(endpoint: Endpoint, robots: int, phase: Phase) -> float:
    """Return the seconds from opening a session until it has everything.

    Raises:
        ValueError: something is missing.
    """
    began = perf_counter()
    with joined(endpoint) as bus:
        found = {topic.key: bus.fetch(topic) for topic in ALL}
        seconds = perf_counter() - began
    (status,) = found[STATUS.key]
    wanted = {topic.key: 1 for topic in ALL} | {STATE.key: robots, PLAN.key: 0 if phase is Phase.WAITING else robots}
    got = {key: len(messages) for key, messages in found.items()}
    if got != wanted or status.phase is not phase or len(found[TRUTH.key][0].bodies) != robots:
        raise ValueError(f"expected {wanted} while {phase.value}, got {got} while {status.phase.value}")
    if any(one.liveness is not Liveness.ALIVE for one in status.robots):
        raise ValueError(f"expected all alive, got {[one.liveness.value for one in status.robots]}")
    return seconds


def timed(case: Callable[[], object]) -> float:
    """Return the seconds that a call takes."""
    began = perf_counter()
    case()
    return perf_counter() - began


def cells(seconds: list[float]) -> list[str]:
    """Return median, p99 and the longest in ms."""
    cuts = quantiles(seconds, n=100, method="inclusive")
    return [f"{1000 * value:.1f}" for value in (cuts[49], cuts[98], max(seconds))]


def joining(robots: int, times: int) -> None:
    """Print how long a late joiner takes."""
    with fleet(robots) as endpoint:
        opened(endpoint, robots)
        with joined(endpoint) as bus:

            def row(do: Do | None, phase: Phase) -> list[str]:
                if do is not None:
                    press(bus, do)
                    until = monotonic() + START
                    while phase is Phase.RUNNING and len(bus.fetch(PLAN)) < robots and monotonic() < until:
                        pass
                seconds = [late(endpoint, robots, phase) for _ in range(times)]
                return [*cells(seconds), f"{sum(one <= TARGET for one in seconds)} of {times}"]

            head = [
                f"a late joiner has everything, {robots} robots",
                "median [ms]", "p99 [ms]", "longest [ms]", f"within {TARGET:g} s",
            ]  # fmt: skip
            printed(head, [
                ("before go", lambda: row(None, Phase.WAITING)),
                ("in mid-run", lambda: row(Do.GO, Phase.RUNNING)),
                ("in a pause", lambda: row(Do.PAUSE, Phase.PAUSED)),
            ])  # fmt: skip
            print(f"Load {load()}.\n", flush=True)


def asking(robots: int, count: int) -> None:
    """Print how long an answer takes while the fleet drives."""
    chance = Random(1)
    with fleet(robots) as endpoint:
        opened(endpoint, robots)
        with joined(endpoint) as bus:
            cases = requests(bus, robots, chance)
            press(bus, Do.GO)
            seconds: dict[str, list[float]] = {kind: [] for kind in cases}
            for _ in range(count):
                for kind in chance.sample(list(cases), len(cases)):
                    sleep(chance.uniform(0.0, PAUSE))
                    seconds[kind].append(timed(cases[kind]))
        busy = load()
    head = [f"{count} of each, {robots} robots", "median [ms]", "p99 [ms]", "longest [ms]", "on target"]
    printed(head, [(kind, lambda found=found: answered(found)) for kind, found in seconds.items()])
    print(f"Load {busy}.\n", flush=True)


def answered(seconds: list[float]) -> list[str]:
    """Return the cells of a row, with what is on target."""
    cuts = quantiles(seconds, n=100, method="inclusive")
    return [*cells(seconds), "yes" if cuts[49] < HALF and cuts[98] < NEARLY_ALL else "no"]


def traffic(robots: int, seconds: float) -> None:
    """Print messages and bytes a second by topic."""
    with fleet(robots) as endpoint:
        opened(endpoint, robots)
        with joined(endpoint) as bus, zenoh.open(settings.client(endpoint)) as session:
            press(bus, Do.GO)
            prefix = key_prefix_of(FLEET)
            topics = {topic: zenoh.KeyExpr(prefix + _pattern(topic)) for topic in TOPICS}
            count, size = Counter[str](), Counter[str]()
            with session.declare_subscriber(f"{prefix}**", zenoh.handlers.FifoChannel(100_000)) as heard:
                began = monotonic()
                while (left := began + seconds - monotonic()) > 0:
                    sample = heard.handler.try_recv()
                    if sample is None:
                        sleep(min(left, 0.01))
                        continue
                    key = next((topic.key for topic, where in topics.items() if where.includes(sample.key_expr)), "?")
                    count[key] += 1
                    size[key] += len(sample.payload)
            head = [f"topic, {robots} robots", "messages/s", "kB/s"]
            rows = [*sorted(count), "all"]
            count["all"], size["all"] = count.total(), size.total()
            printed(head, [
                (key, lambda key=key: [f"{count[key] / seconds:.1f}", f"{size[key] / 1000 / seconds:.1f}"])
                for key in rows
            ])  # fmt: skip
            print(f"Load {load()}.\n", flush=True)


def _pattern(topic: Topic[Any]) -> str:
    return topic.key.format(robot="*", zx="*", zy="*")


def main() -> None:
    parser = argparse.ArgumentParser(description="Joining late, asking, and what the wire carries.")
    parser.add_argument("--robots", type=int, nargs="*", default=[8, 32, 64], help="fleets whose traffic is counted")
    parser.add_argument("--joined", type=int, default=JOINED, help="robots of the fleet that a tool joins or asks")
    parser.add_argument("--times", type=int, default=50, help="how often it joins in each phase")
    parser.add_argument("--requests", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=20.0, help="how long traffic is counted")
    options = parser.parse_args()
    print(machine(), "\n")
    joining(options.joined, options.times)
    asking(options.joined, options.requests)
    for robots in options.robots:
        traffic(robots, options.seconds)


if __name__ == "__main__":
    main()
