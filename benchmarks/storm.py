"""Storm: random worlds held against the laws, how often they fail, and whether a seed means the same run again.

``--share 1`` runs all seeds that are needed to accept a version; the default is a small share. Seeds begin at
``--start``: use seeds that nobody has looked at yet. ``--python`` runs the package of another environment.
"""

import argparse
import json
import os
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

from benchmarks.measure import machine, table


class Case(NamedTuple):
    """One storm."""

    name: str
    seeds: int  # of each profile, to accept a version
    arguments: tuple[str, ...]


# fmt: off
OTHERS: Final = "late,sight,suspend,edits,movers,away,shared,crowd,patrol"
CASES: Final = (
    Case("all",                            3000, ("--profile", "all")),
    Case("dead",                           1000, ("--profile", "dead")),
    Case("claims, contest",                 300, ("--profile", "claims,contest")),
    Case("unsolvable, asleep",              250, ("--profile", "unsolvable,asleep")),
    Case("the other known floors",           75, ("--profile", OTHERS)),
    Case("unknown",                        1000, ("--profile", "unknown")),
    Case("every seed twice",                200, ("--profile", "all", "--twice")),
    Case("in one process and over many",     30, ("--profile", "calm,edits", "--over", "processes")),
)
# fmt: on


def swarm(python: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command line of the package that is installed beside an interpreter."""
    command = [python, "-m", "swarm.cli", *arguments]
    with TemporaryDirectory() as empty:  # in a checkout, Python would import the code there
        return subprocess.run(command, cwd=empty, stdout=subprocess.PIPE, text=True, check=False)


def storm(case: Case, seeds: int, start: int, jobs: int, python: str) -> dict[str, Any]:
    """Run a storm and return its summary."""
    answer = swarm(
        python, "storm", *case.arguments, "--json",
        "--seeds", str(seeds), "--start", str(start), "--jobs", str(jobs),
    )  # fmt: skip
    if answer.returncode not in {0, 1}:
        raise SystemExit(f"{case.name}: swarm storm ended with status {answer.returncode}")
    summary: dict[str, Any] = json.loads(answer.stdout)
    return summary


def row(name: str, counted: dict[str, Any]) -> tuple[str, ...]:
    """Return counts as a row: runs, failed, rate, interval, silent."""
    low, high = counted["interval"]
    rate, interval = f"{100 * counted['rate']:.1f} %", f"{100 * low:.1f}-{100 * high:.1f} %"
    return name, str(counted["runs"]), str(counted["failed"]), rate, interval, str(counted["silent"])


def main() -> int:
    parser = argparse.ArgumentParser(description="Run storms and print how often they fail.")
    parser.add_argument("--share", type=float, default=0.02, help="share of the seeds needed to accept a version")
    parser.add_argument("--start", type=int, default=100_000, help="the first seed")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--python", type=os.path.abspath, default=sys.executable, help="interpreter of the package")
    options = parser.parse_args()
    rows: list[tuple[str, ...]] = [("storm", "runs", "failed", "rate", "95 %", "silent")]
    speeds, broken = [], []
    for case in CASES:
        told = storm(case, max(2, round(options.share * case.seeds)), options.start, options.jobs, options.python)
        rows.append(row(case.name, told))
        if len(told["by"]["class"]) > 1:
            rows += [row(f"- {one['name']}", one) for one in told["by"]["class"]]
        speeds.append(f"{case.name} {told['seeds_per_hour']:.0f}")
        broken += [f"{one['profile']} {one['seed']}: {one['law']}: {one['text']}" for one in told["failures"]]
        print(f"{case.name}: {told['failed']} of {told['runs']}", file=sys.stderr, flush=True)
    package = swarm(options.python, "--version").stdout.strip()
    print(f"{machine()}, {package}; `--share {options.share:g} --start {options.start}`\n")
    print(table(rows))
    print(f"\nSeeds an hour, {options.jobs} side by side: {', '.join(speeds)}.")
    if broken:
        print("\nWhat broke:\n")
        print("\n".join(f"- {line}" for line in broken[:40]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
