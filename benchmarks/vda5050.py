"""What the bridge to VDA 5050 costs: CPU and memory, by how often vehicles tell where they are.

    python -m benchmarks.vda5050 [--seconds 20] [--robots 64]

The recorded run of `benchmarks.box` is played through a real router at real rates. Broker, router and a master control
that hears all are processes of their own. The first seconds, in which Python starts, are not counted.
"""

import argparse
import multiprocessing
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from typing import Final

import psutil

from benchmarks.box import FLEET, Played, busy
from benchmarks.dashboard import WARM_UP, router
from benchmarks.measure import machine, printed
from swarm.bus import Bus, Endpoint
from tests.bridge.vda5050.brokers import Broker
from tests.bridge.vda5050.masters import master_on

BAR: Final = 10  # % of a core
STARTS: Final = 4.0  # s more for the bridge and its connections
RATES: Final = (0, 1, 5)  # Hz


def hear_all(port: int, count: "Synchronized[int]") -> None:
    """Be a master control that reads everything, and counts it."""
    with master_on(port) as master:
        while True:
            master.queue.get()
            count.value += 1


@contextmanager
def bridge(endpoint: Endpoint, broker: Broker, rate: int) -> Iterator[psutil.Process]:
    """Run a bridge inside the block."""
    command = [
        sys.executable, "-m", "swarm.cli", "bridge", "vda5050", "--connect", str(endpoint), "--fleet", FLEET,
        "--broker", broker.place, *(["--visualization", str(rate)] if rate else []),
    ]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        assert FLEET in running.stdout.readline(), "it says where it is"
        try:
            yield psutil.Process(running.pid)
        finally:
            running.terminate()


def measured(played: Played, hertz: int, seconds: float) -> Sequence[str]:
    """Return the cells of a row."""
    spawn = multiprocessing.get_context("spawn")
    with (
        tempfile.TemporaryDirectory() as folder, router() as endpoint, Bus(endpoint, FLEET, lambda line: None) as bus,
        Broker(Path(folder)) as broker,
    ):  # fmt: skip
        bus.announce("world", "world")
        played.serve(bus)
        count = spawn.Value("L")
        master = spawn.Process(target=hear_all, args=(broker.port, count))
        master.start()
        with bridge(endpoint, broker, hertz) as process:
            used, memory, heard = list[float](), list[float](), list[int]()
            for _ in played.play(bus, seconds, WARM_UP + STARTS):
                used.append(busy(process))
                heard.append(count.value)
                memory.append(process.memory_full_info().uss / 1e6)
        master.terminate()
        master.join()
    share = 100 * (used[1] - used[0]) / seconds
    rate = (heard[1] - heard[0]) / seconds
    return [f"{share:.1f}", f"{BAR}", f"{rate:.0f}", f"{memory[1]:.0f}", f"{memory[1] - memory[0]:.1f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description="What the bridge to VDA 5050 costs.")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--robots", type=int, default=64)
    given = parser.parse_args()
    print(machine())
    played = Played(given.robots, given.seconds + WARM_UP + STARTS + 1.0)
    print(f"{given.robots} robots, a state of each at least once a second")
    head = ("visualization [Hz]", "CPU [% of a core]", "needed", "messages/s", "own memory [MB]", "grown [MB]")
    printed(head, [
        (str(rate), lambda rate=rate: measured(played, rate, given.seconds)) for rate in RATES  # type: ignore[misc]
    ])  # fmt: skip


if __name__ == "__main__":
    main()
