"""What the dashboard costs: CPU of its process, as a share of one core, and its memory, while a fleet sends.

    python -m benchmarks.dashboard [--seconds 20]

A sender plays a made-up run of the fleet through a real router at real rates. The first seconds, in which Python
starts, are not counted. The router and the sender are other processes and are not counted either. No viewer is
attached. Wanted: less than 5 % of a core at 64 robots, and at most 0.25 MB a robot-minute in the file, which is made
smaller when it is finished. Robots do joint plans in groups of eight.

    python -m benchmarks.dashboard --hours 24 [--robots 8]

draws a run without a wire as fast as it goes, for viewers that come late and into a file, in batches of half a second
as in real time, and prints how the memory of the process grows.
"""

import argparse
import multiprocessing
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import Final

import psutil
from msgspec.structs import replace

from benchmarks.measure import machine, table
from dashboard.rerun import Recordings
from dashboard.show import Show
from swarm.bus import Bus, Endpoint, Presence
from swarm.bus.router import run as route
from swarm.messages import CLOCK, RADIO, Map, Message, Phase
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
    Case(64, "--web", 1),
    Case(8, "--web", 30),
)
BATCH: Final = 10  # ticks between two drawings, as in real time
PRINTS: Final = 12  # rows of the table of a long run


def main() -> None:
    parser = argparse.ArgumentParser(description="What the dashboard costs.")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--robots", type=int, help="only this fleet")
    parser.add_argument("--hours", type=float, help="draw a run of so many hours without a wire, for its memory")
    given = parser.parse_args()
    print(machine())
    if given.hours is not None:
        print(table([("drawn", "memory (RSS)", "own (USS)", "file"), *long_run(given.robots or 8, given.hours)]))
        return
    rows: list[tuple[str, ...]] = [
        ("fleet", "CPU of a core", "memory (RSS)", "own (USS)", "grows by", "messages/s", "file, a robot-minute")
    ]
    rows += [measure(case, given.seconds) for case in CASES if given.robots in {None, case.robots}]
    print(table(rows))


def long_run(robots: int, hours: float) -> Iterator[tuple[str, ...]]:
    """Draw the same rehearsal again and again, later each time, for viewers and a file; yield rows of the memory."""
    rehearsal, process = Rehearsal(robots), psutil.Process()
    ticks = int(hours * 3600 * RATE)
    made = [list(rehearsal.messages(tick)) for tick in range(rehearsal.ticks - 1)]
    scenario, packed = rehearsal.scenario.to_wire()
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "long.rrd"
        recorder = Recordings(serve=("127.0.0.1", Endpoint("127.0.0.1", 0).claim().port), record=record)
        show = Show(recorder, "bench")
        show.take(Map(scenario=scenario, packed=packed))
        for tick in range(ticks + 1):
            for topic, message, _ in made[tick % len(made)]:
                if topic is not RADIO:
                    show.take(later(message, tick))
            if tick % BATCH == 0:
                show.draw()
            if tick % max(1, ticks // PRINTS) == 0:
                full, size = process.memory_full_info(), record.stat().st_size if record.exists() else 0
                drawn = f"{robots} robots, {tick / RATE / 3600:.2f} h"
                yield drawn, f"{full.rss / 1e6:.0f} MB", f"{full.uss / 1e6:.0f} MB", f"{size / 1e6:.1f} MB"
        recorder.close(within=0.0)


def later(message: Message, tick: int) -> Message:
    """Return the message as if it was sent at another tick."""
    fields = {"tick": tick, "time": tick / RATE}
    return replace(message, **{name: value for name, value in fields.items() if name in message.__struct_fields__})


def measure(case: Case, seconds: float) -> tuple[str, ...]:
    rehearsal = Rehearsal(case.robots)
    begin = BEGIN if case.factor == 1 else 0
    ticks = range(begin, min(rehearsal.ticks, begin + int((seconds + 2 * WARM_UP) * RATE * case.factor)))
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
            bus.send(
                CLOCK, replace(rehearsal.clock(ticks[min(sent, len(ticks) - 1)]), phase=Phase.OVER)
            )  # then it makes its file smaller
            drawn, raw = (monotonic() - start) * case.factor / 60 * case.robots, record.stat().st_size
            process.wait(30)
        size = record.stat().st_size
    return (
        f"{case.robots} robots, {case.factor:g} x real time, {case.mode.strip('-')}",
        f"{share:.1%}",
        f"{full.rss / 1e6:.0f} MB",
        f"{full.uss / 1e6:.0f} MB",
        f"{(full.rss - memory) / 1e6:.1f} MB in {took:.0f} s",
        f"{rate:.0f}",
        f"{raw / 1e6 / drawn:.2f} MB, at the end {size / 1e6 / drawn:.2f}",
    )


@contextmanager
def router() -> Iterator[Endpoint]:
    """Yield a router in its own process: it is not counted, and does not share the sender's threads."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    process = multiprocessing.get_context("spawn").Process(target=route, args=(endpoint, signal.pause))
    process.start()
    while process.is_alive():  # on a busy machine Python starts slowly
        with suppress(OSError), socket.create_connection((endpoint.host, endpoint.port), timeout=1.0):
            break
        process.join(0.1)
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
