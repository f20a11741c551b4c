"""What keys cost a fleet in lockstep: ``python -m benchmarks.secure [--robots N] [--repeat K]``.

The same run with an open router and with keys, in turn; each process is started by its own command. It also compares
the digests.
"""

import argparse
import json
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Final, NamedTuple

import psutil

from benchmarks.measure import machine, table
from swarm.bus import Bus, Endpoint
from swarm.scenario.starts import robot_names
from swarm.secure.keys import make
from swarm.secure.names import WATCHER

CASES: Final = ("open", "keys")


class Ran(NamedTuple):
    """One run."""

    factor: float  # x real time
    router: float  # s of CPU time
    ticks: int
    digest: str


def cpu(pid: int) -> float:
    """Return the CPU time that a process has used [s]."""
    return sum(psutil.Process(pid).cpu_times()[:2])


def ran(case: str, robots: int, keys: Path, folder: Path) -> Ran:
    """Run the paper's scenario once."""
    secure = ("--secure", str(keys)) if case == "keys" else ()
    endpoint = f"{'tls' if secure else 'tcp'}/127.0.0.1:{Endpoint('127.0.0.1', 0).claim().port}"
    wire, report = ("--connect", endpoint, *secure), folder / "report.json"

    with ExitStack() as stack:

        def start(*arguments: str) -> "subprocess.Popen[bytes]":
            process = subprocess.Popen([sys.executable, "-m", "swarm.cli", *arguments], stdout=subprocess.DEVNULL)
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        router = start("router", "--listen", endpoint, *secure)
        with Bus(Endpoint.parse(endpoint, keys if secure else None, WATCHER), "fleet"):  # as soon as the router answers
            began = cpu(router.pid)
        for name in robot_names(robots):
            start("robot", "--id", name, *wire)
        world = ("world", "paper", "--robots", str(robots), "--seed", "7", "--pace", "max", "--report", str(report))
        start(*world, *wire).wait()
        used = cpu(router.pid) - began
    found = json.loads(report.read_text(encoding="utf-8"))
    return Ran(found["real_time_factor"], used, round(20 * found["sim_time"]), found["digest"])


def main() -> None:
    """Run all cases in turn and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    runs: dict[str, list[Ran]] = {case: [] for case in CASES}
    with TemporaryDirectory() as folder:
        keys = Path(folder) / "keys"
        make(keys, robot_names(options.robots), [], 1.0)
        for _ in range(options.repeat):
            for case, done in runs.items():
                done.append(ran(case, options.robots, keys, Path(folder)))
    first = runs["open"][0].digest
    rows = [(f"paper, {options.robots} robots", "x real time", "of open", "router, CPU per tick [ms]", "same run")]
    for case, done in runs.items():
        ratio = median(one.factor / other.factor for one, other in zip(done, runs["open"], strict=True))
        router = median(1000 * one.router / one.ticks for one in done)
        same = "yes" if all(one.digest == first for one in done) else "NO"
        rows.append((case, f"{median(one.factor for one in done):.1f}", f"{ratio:.2f}", f"{router:.2f}", same))
    print(f'{machine()}. Medians of {options.repeat} rounds; "of open" compares runs of one round.\n')
    print(table(rows))


if __name__ == "__main__":
    main()
