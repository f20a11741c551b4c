"""What the dashboard costs: CPU of its process, as a share of one core, and its memory, while a fleet sends.

    python -m benchmarks.dashboard [--seconds 20]

A sender plays a made-up run of the fleet through a real router at real rates. The first seconds, in which Python
starts, are not counted. The router and the sender are other processes and are not counted either. No viewer is
attached.
"""

import argparse
import multiprocessing
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import Final

import psutil

from benchmarks.measure import machine, table
from swarm.bus import Bus, Endpoint, Presence
from swarm.bus.router import run as route
from tests.dashboard.actors import World
from tests.dashboard.rehearsal import RATE, Rehearsal

BEGIN: Final = 35 * RATE  # tick at which all eight robots drive
WARM_UP: Final = 3.0  # s, sent but not counted


@dataclass(frozen=True)
class Case:
    """One measurement."""

    robots: int
    mode: str
    factor: float  # times real time


CASES: Final = (
    Case(8, "--off-screen", 1),
    Case(8, "--web", 1),
    Case(32, "--web", 1),
    Case(8, "--web", 30),
)


def main() -> None:
    parser = argparse.ArgumentParser(description="What the dashboard costs.")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    seconds = parser.parse_args().seconds
    rows = [("fleet", "CPU of a core", "memory (RSS)", "own (USS)", "grows by", "messages/s", "file")]
    rows += [measure(case, seconds) for case in CASES]
    print(machine())
    print(table(rows))


def measure(case: Case, seconds: float) -> tuple[str, ...]:
    rehearsal = Rehearsal(case.robots)
    ticks = range(BEGIN if case.factor == 1 else 0, rehearsal.ticks)
    made = [list(rehearsal.messages(tick)) for tick in ticks]
    with tempfile.TemporaryDirectory() as folder, router() as endpoint, Bus(endpoint, "bench") as bus:
        record = Path(folder) / "bench.rrd"
        World(bus, rehearsal).serve()
        bus.watch_presence()
        with dashboard(endpoint, case.mode, record) as process:
            while not isinstance(arrived := bus.receive(timeout=30), Presence) or arrived.role != "dashboard":
                pass
            start, sent, before, memory = monotonic(), 0, None, 0
            for messages in made:
                while (now := monotonic()) < start + sent / RATE / case.factor:
                    sleep(start + sent / RATE / case.factor - now)
                if before is None and now - start >= WARM_UP / case.factor:
                    before, since, first, memory = process.cpu_times(), now, sent, process.memory_info().rss
                if before is not None and now - since >= seconds:
                    break
                for topic, message, ids in messages:
                    bus.send(topic, message, **ids)
                sent += 1
            assert before is not None
            after, took = process.cpu_times(), monotonic() - since
            share = (after.user + after.system - before.user - before.system) / took
            full = process.memory_full_info()
            rate = sum(map(len, made[first:sent])) / took
        size = record.stat().st_size
    return (
        f"{case.robots} robots, {case.factor:g} x real time, {case.mode.strip('-')}",
        f"{share:.1%}",
        f"{full.rss / 1e6:.0f} MB",
        f"{full.uss / 1e6:.0f} MB",
        f"{(full.rss - memory) / 1e6:.1f} MB in {took:.0f} s",
        f"{rate:.0f}",
        f"{size / 1e6:.2f} MB",
    )


@contextmanager
def router() -> Iterator[Endpoint]:
    """Yield a router in its own process: it is not counted, and does not share the sender's threads."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    process = multiprocessing.get_context("spawn").Process(target=route, args=(endpoint, signal.pause))
    process.start()
    try:
        yield endpoint
    finally:
        process.terminate()
        process.join()


@contextmanager
def dashboard(endpoint: Endpoint, mode: str, record: Path) -> Iterator[psutil.Process]:
    command = [sys.executable, "-m", "dashboard", "--connect", str(endpoint), "--fleet", "bench", mode]
    running = subprocess.Popen([*command, "--record", str(record)], stdout=subprocess.DEVNULL)
    try:
        yield psutil.Process(running.pid)
        running.terminate()
        running.wait(20)
    finally:
        running.kill()


if __name__ == "__main__":
    main()
