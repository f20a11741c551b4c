"""How soon is a dead session called gone, and how often one that lives: ``python -m benchmarks.lease [--seconds 20]``.

Zenoh closes a session that has sent nothing for its lease. A short lease notices a frozen robot soon; on a busy machine
it also closes sessions that only had to wait for a processor, and everybody then calls that robot gone. Each row runs
one router and many sessions with a lease, beside processes that do nothing but compute.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import product
from multiprocessing import get_context
from multiprocessing.synchronize import Event as Flag
from queue import Empty, SimpleQueue
from statistics import median
from time import monotonic, sleep
from typing import Final, NamedTuple

import zenoh

from benchmarks.measure import load, machine, printed
from swarm.bus import Endpoint, settings

LEASES: Final = (1.0, 2.0, 3.0)  # s
BURNING: Final = (0, 1, 20)  # processes that compute beside the sessions
ROBOTS: Final = 16
PERIOD: Final = 0.05  # s between two messages of a session
FREEZES: Final = 5  # sessions that are frozen, one after the other
PREFIX: Final = "benchmark/lease"


class Seen(NamedTuple):
    """What a watcher saw of sessions that live, and how soon it missed those that were frozen."""

    false_alarms: int
    longest_gap: float  # s between two messages of one session
    noticed: list[float]  # s


def configured(config: zenoh.Config, lease: float) -> zenoh.Config:
    """Return the settings of a session with another lease [s]."""
    config.insert_json5("transport/link/tx/lease", json.dumps(round(1000 * lease)))
    return config


def route(endpoint: Endpoint, lease: float, up: Flag) -> None:
    """Be the router until killed."""
    with zenoh.open(configured(settings.router(endpoint), lease)):
        up.set()
        signal.pause()


def talk(endpoint: Endpoint, lease: float, name: str) -> None:
    """Be one robot's session until killed: a token, and a message each period."""
    with zenoh.open(configured(settings.client(endpoint), lease)) as session:
        token = session.liveliness().declare_token(f"{PREFIX}/alive/{name}")
        while token:
            session.put(f"{PREFIX}/says/{name}", bytes(100))
            sleep(PERIOD)


@contextmanager
def burning(number: int) -> Iterator[None]:
    """Compute in so many processes inside the block."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(number)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


@contextmanager
def sessions(endpoint: Endpoint, lease: float) -> Iterator[dict[str, int]]:
    """Run the router and the sessions inside the block; the value has the process of each session."""
    context = get_context("spawn")
    up = context.Event()
    router = context.Process(target=route, args=(endpoint, lease, up))
    router.start()
    up.wait(30.0)
    robots = {f"r{k}": context.Process(target=talk, args=(endpoint, lease, f"r{k}")) for k in range(1, ROBOTS + 1)}
    for robot in robots.values():
        robot.start()
    try:
        yield {name: robot.pid or 0 for name, robot in robots.items()}
    finally:
        for process in (*robots.values(), router):
            process.kill()
            process.join()


def watched(lease: float, burners: int, seconds: float) -> Seen:
    """Watch sessions for a time [s], then freeze some of them; only what is seen before that can be a false alarm."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    tokens: SimpleQueue[tuple[str, bool, float]] = SimpleQueue()
    last: dict[str, float] = {}
    gaps = [0.0]

    def on_token(sample: zenoh.Sample) -> None:
        tokens.put((str(sample.key_expr).rpartition("/")[2], sample.kind == zenoh.SampleKind.PUT, monotonic()))

    def on_message(sample: zenoh.Sample) -> None:
        name, now = str(sample.key_expr).rpartition("/")[2], monotonic()
        gaps.append(now - last.get(name, now))
        last[name] = now

    with ExitStack() as stack:
        pids = stack.enter_context(sessions(endpoint, lease))
        session = stack.enter_context(zenoh.open(configured(settings.client(endpoint), lease)))
        callback = zenoh.handlers.Callback
        session.liveliness().declare_subscriber(f"{PREFIX}/alive/*", callback(on_token, indirect=False), history=True)
        present: set[str] = set()
        while len(present) < len(pids):
            name, alive, _ = tokens.get(timeout=60.0)
            (present.add if alive else present.discard)(name)
        session.declare_subscriber(f"{PREFIX}/says/*", callback(on_message, indirect=False))
        stack.enter_context(burning(burners))
        sleep(seconds)
        longest, false_alarms = max(gaps), 0
        while True:
            try:
                false_alarms += not tokens.get_nowait()[1]
            except Empty:
                break
        noticed = []
        for name in list(pids)[:FREEZES]:
            os.kill(pids[name], signal.SIGSTOP)
            since = monotonic()
            noticed.append(gone_at(tokens, name, since) - since)
    return Seen(false_alarms, longest, noticed)


def gone_at(tokens: "SimpleQueue[tuple[str, bool, float]]", name: str, since: float) -> float:
    """Return when [s] a session was called gone."""
    while True:
        who, alive, when = tokens.get(timeout=60.0)
        if who == name and not alive and when > since:
            return when


def row(lease: float, burners: int, seconds: float) -> list[str]:
    """Return the cells of a row."""
    seen = watched(lease, burners, seconds)
    minutes = ROBOTS * seconds / 60
    return [
        str(burners),
        f"{seen.false_alarms / minutes:.2f}",
        f"{seen.longest_gap:.2f}",
        f"{median(seen.noticed):.2f}",
        f"{max(seen.noticed):.2f}",
        load(),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description="Lease against false alarms.")
    parser.add_argument("--seconds", type=float, default=20.0, help="how long the sessions of a row are watched")
    options = parser.parse_args()
    print(machine(), "\n")
    head = [
        f"lease, {ROBOTS} sessions", "processes that compute", "live sessions called gone, a robot and minute",
        "longest gap between messages [s]", "a frozen one called gone after [s], median", "longest", "load",
    ]  # fmt: skip
    cases = product(BURNING, LEASES)
    printed(head, [(f"{lease:g} s", lambda b=b, lease=lease: row(lease, b, options.seconds)) for b, lease in cases])


if __name__ == "__main__":
    main()
