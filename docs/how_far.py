"""Makes the table of deploy.md: what a fleet of each size runs on, and what it takes there, as a benchmark computed it.

Its numbers are those of the section of `benchmarks.scale --wire` in benchmarks.md: they change when that is made again.
"""

import re
from pathlib import Path
from typing import Final, NamedTuple

from docs.markdown import rows

PAGE: Final = Path(__file__).parent / "benchmarks.md"
SECTION: Final = "`python -m benchmarks.scale --wire`"
SPARSE: Final = "warehouse 64"  # the measured fleets that all are computed from
CROWDED: Final = "random-32-32-20 32"
ANY: Final = "Kubernetes, or `swarm robot --count K` on the hosts"


class Setting(NamedTuple):
    """What a fleet of some size runs on, and how much of the row was measured."""

    engine: str
    floors: str
    measured: str


SIZES: Final = {
    10: Setting("`swarm run`, or compose", "one", "fleets of 8 in real time, of 3 to 10 in containers"),
    100: Setting(ANY, "one", "64 to 256 on two cores, below real time; two to four hosts with 8 to 16 robots"),
    1_000: Setting(ANY, "as many as worlds", "1,000 in one process; as processes nothing"),
    10_000: Setting(ANY, "as many as worlds", "nothing"),
}


def table() -> str:
    """Return the table; each number is that of a fleet in a warehouse, to that of one in a crowd."""
    measured = _rows()
    head = (
        "robots", "engine", "floors", "routers and hosts", "worlds", "cores for robots, worlds, routers",
        "robots' memory [GB]", "messages a second into routers, out of them", "Mbit/s into, out of", "measured",
    )  # fmt: skip
    asked = "senses and commands [1/s]"
    body = []
    for robots, setting in SIZES.items():
        of = [measured[f"{name}: {robots:,}"] for name in (SPARSE, CROWDED)]
        cores = _span(of, "cores for robots", "for the world", "for routers")
        said = f"{_span(of, 'broadcasts sent [1/s]', asked)}; {_span(of, 'delivered [1/s]', asked)}"
        sent = f"{_span(of, 'into the routers [Mbit/s]')}; {_span(of, 'out of them [Mbit/s]')}"
        body.append((
            f"{robots:,}", setting.engine, setting.floors, _span(of, "hosts of 8 cores, 50% of each"),
            _span(of, "worlds, 50% of a core each"), cores, _span(of, "robots' own memory [GB]"), said, sent,
            setting.measured,
        ))  # fmt: skip
    return rows(head, *body)


def _span(of: list[dict[str, str]], *columns: str) -> str:
    """Return the sum of some columns, from the smaller to the larger of two rows."""
    low, high = sorted(sum(float(row[column].replace(",", "")) for column in columns) for row in of)
    return _text(low) if low == high else f"{_text(low)} to {_text(high)}"


def _text(number: float) -> str:
    return f"{number:,.0f}" if number >= 100 or number == int(number) else f"{number:.1f}"


def _rows() -> dict[str, dict[str, str]]:
    """Return the rows of the benchmark's table by their first cell, each by the head of its column."""
    section = PAGE.read_text(encoding="utf-8").split(f"## {SECTION}\n")[1].split("\n## ")[0]
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in re.findall(r"^\|.*\|$", section, re.M)]
    head, _, *body = lines
    return {row[0]: dict(zip(head, row, strict=True)) for row in body}
