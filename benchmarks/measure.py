"""Shared by all benchmarks: timing cases in turn, a table, and a description of the machine."""

import os
import platform
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Final

DATA: Final = Path(__file__).parents[2] / "shared" / "data" / "mapf"  # public benchmark maps, beside the project


def interleave(cases: dict[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """Call each case once per round, one after the other, and return the times [s] of each case's calls.

    Competing cases are timed in the same round, so that other load on the machine affects all of them. Compare medians
    of ratios within a round rather than absolute times. A first round is not timed.
    """
    seconds: dict[str, list[float]] = {name: [] for name in cases}
    for timed in range(rounds + 1):
        for name, case in cases.items():
            start = perf_counter()
            case()
            if timed:
                seconds[name].append(perf_counter() - start)
    return seconds


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of text as a Markdown table; the first row is the head, all columns but the first align right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    ruler = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = []
    for row in (rows[0], ruler, *rows[1:]):
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def printed(
    head: Sequence[str], rows: Iterable[tuple[str, Callable[[], Sequence[str]]]], *faults: type[Exception]
) -> None:
    """Print a table row by row: the head, then each row as soon as it is measured; a row is its name and its measuring.

    A row whose measuring raises one of ``faults`` shows the error, and the next ones are measured all the same.
    """
    rows = list(rows)
    widths = [max(map(len, (head[0], *(name for name, _ in rows)))), *map(len, head[1:])]
    print(table([[head[0].ljust(widths[0]), *head[1:]]]), flush=True)
    for name, measure in rows:
        try:
            cells = measure()
        except faults as fault:
            cells = [f"{type(fault).__name__}: {fault}".replace("\n", " ").replace("|", "/"), *[""] * (len(head) - 2)]
        line = [name.ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True))]
        print(f"| {' | '.join(line)} |", flush=True)
    print(flush=True)


def load() -> str:
    """Return the load of the machine: processes that compute or wait to, over the last minute."""
    return f"{os.getloadavg()[0]:.1f}"


def machine() -> str:
    """Return a line about the machine: processor, cores, load, Python."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line.partition(":")[2].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    return f"{model}, {os.cpu_count()} cores, load {load()}, Python {platform.python_version()}"
