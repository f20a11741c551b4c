"""A fleet of real processes gives the same run each time: ``python -m benchmarks.fleet [--repeat 5]``.

It compares the digests of runs over processes, with a busy core beside them, and in one process without a bus.
``benchmarks.scale`` measures what such a fleet costs.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from benchmarks.measure import machine, table
from swarm.scenario.load import load
from world.simulate import Simulation

ROOT: Final = Path(__file__).parents[1]
SCENARIO: Final = ROOT / "scenarios" / "paper.yaml"


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


def main() -> None:
    parser = argparse.ArgumentParser(description="The same run each time, over processes and in one.")
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    print(machine(), "\n")
    determinism(options.repeat)


if __name__ == "__main__":
    main()
