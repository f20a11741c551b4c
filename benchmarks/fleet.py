"""A fleet of real processes: determinism, start-up, memory and speed: ``python -m benchmarks.fleet``.

    python -m benchmarks.fleet [--repeat 5] [--only determinism|start|memory|speed]

Times depend on the machine's load: each is repeated, and the best and the median are printed with the load.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from time import perf_counter, sleep
from typing import Any, Final

import psutil

from benchmarks.measure import machine, table
from swarm.scenario.load import load
from world.simulate import Simulation

ROOT: Final = Path(__file__).parents[1]
SCENARIO: Final = ROOT / "scenarios" / "paper.yaml"
NEEDED_START, NEEDED_USS, NEEDED_SPEED = 3.0, 15.0, 15.0  # s, MB, times real time
SPEED_LIMIT: Final = 150.0  # s, simulated, of a run whose speed is measured
SETTLED: Final = 3.0  # s after the first tick: memory no longer grows


def command(*arguments: str) -> list[str]:
    """Return the command line of `swarm run` with the paper's scenario."""
    return [sys.executable, "-m", "swarm.cli", "run", str(SCENARIO), *arguments]


def reported(*arguments: str) -> dict[str, Any]:
    """Run a fleet to its end and return its report."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        subprocess.run(
            command("--pace", "max", "--dashboard", "off", "--report", str(file), *arguments),
            cwd=ROOT, stdout=subprocess.DEVNULL, check=False,
        )  # fmt: skip
        found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


@contextmanager
def burning() -> Iterator[None]:
    """Keep one core busy with another process inside the block."""
    process = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        yield
    finally:
        process.kill()
        process.wait()


def determinism(repeat: int) -> None:
    """Compare digests: run after run, under load, without a bus, and of another seed."""
    arguments = ("--robots", "4", "--seed", "7")
    rows = [("run", "digest")]
    rows += [(f"processes, {number}", reported(*arguments)["digest"]) for number in range(1, repeat + 1)]
    with burning():
        rows.append(("processes, a core burning", reported(*arguments)["digest"]))
    rows.append(("in process, no bus", Simulation.of(load(SCENARIO), 4, 7).run()["digest"]))
    other = reported("--robots", "4", "--seed", "8")["digest"]
    equal = len({digest for _, digest in rows[1:]}) == 1
    print(table([*rows, ("processes, another seed", other)]))
    differs = other != rows[1][1]
    print(f"equal runs {'give one digest' if equal else 'DIFFER'}; another seed {'another' if differs else 'THE SAME'}")


def first_tick(*arguments: str) -> float:
    """Return the time [s] from the command until the launcher shows that the run runs (it checks at 10 Hz)."""
    began = perf_counter()
    process = subprocess.Popen(
        command("--robots", "8", "--limit", "5", *arguments), cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    took = next((perf_counter() - began for line in process.stdout if "running" in line), float("nan"))
    process.stdout.read()
    process.wait()
    return took


def start_up(repeat: int) -> None:
    """Measure the time from the command to the first tick."""
    rows = [("8 robots, from the command to the first tick [s]", "best", "median", "needed")]
    for mode in ("off", "web"):
        times = [first_tick("--dashboard", mode) for _ in range(repeat)]
        rows.append((f"--dashboard {mode}", f"{min(times):.2f}", f"{median(times):.2f}", f"< {NEEDED_START:g}"))
    print(table(rows))


def memory() -> None:
    """Measure each process of a fleet while it drives in real time."""
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(
            command("--robots", "8", "--dashboard", "web", "--limit", "60"), cwd=ROOT, stdout=output, text=True
        )
        try:
            while "running" not in _so_far(output) and process.poll() is None:
                sleep(0.1)
            sleep(SETTLED)
            found = [child.memory_full_info() for child in _robots(process.pid)]
        finally:
            process.terminate()
            process.wait()
    own, resident = [info.uss / 1e6 for info in found], [info.rss / 1e6 for info in found]
    print(table([
        ("memory of a robot's process [MB]", "smallest", "largest", "needed"),
        ("own (USS)", f"{min(own):.1f}", f"{max(own):.1f}", f"< {NEEDED_USS:g}"),
        ("resident (RSS), mostly shared", f"{min(resident):.1f}", f"{max(resident):.1f}", ""),
    ]))  # fmt: skip


def _so_far(output: Any) -> str:  # noqa: ANN401, a temporary file
    output.seek(0)
    return str(output.read())


def _robots(launcher: int) -> list[psutil.Process]:
    """Return the robots' processes: the youngest eight that the fork server made."""
    deep = [child for child in psutil.Process(launcher).children(recursive=True) if child.ppid() != launcher]
    return sorted(deep, key=lambda child: child.pid)[-8:]


def speed(repeat: int) -> None:
    """Measure lockstep: simulated time over wall time."""
    factors = [
        reported("--robots", "8", "--seed", "7", "--limit", f"{SPEED_LIMIT:g}")["real_time_factor"]
        for _ in range(repeat)
    ]
    print(table([
        ("8 robots in lockstep at 20 Hz, dashboard off", "best", "median", "needed"),
        ("times real time", f"{max(factors):.1f}", f"{median(factors):.1f}", f"> {NEEDED_SPEED:g}"),
    ]))  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="Determinism, start-up, memory and speed of real processes.")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--only", choices=("determinism", "start", "memory", "speed"))
    options = parser.parse_args()
    parts: dict[str, Callable[[], None]] = {
        "speed": lambda: speed(options.repeat),
        "start": lambda: start_up(options.repeat),
        "memory": memory,
        "determinism": lambda: determinism(options.repeat),
    }
    print(machine())
    for name, part in parts.items():
        if options.only in (None, name):
            print(flush=True)
            part()


if __name__ == "__main__":
    main()
