"""A fleet in real time at a rate of its own: its scenario, and what its report says about late commands and ticks."""

from dataclasses import dataclass
from pathlib import Path
from shutil import copy
from typing import Any, Final

import msgspec

from benchmarks.scaling.fleets import NotMeasured
from swarm.scenario.benchmark import from_benchmark

RATE: Final = 20.0  # Hz, of scenarios that do not say another one
TICKS: Final = 1000  # at least: p99.9 is then not the longest one alone


def at_rate(where: tuple[str, ...], robots: int, rate: float, folder: Path) -> tuple[str, ...]:
    """Return arguments of ``swarm run`` for ``MAP --scen FILE`` at another rate [Hz]: a scenario file in a folder.

    Traffic counts in ticks. Robots broadcast as often in a second as at 20 Hz: so a record is no older, and a robot has
    driven no farther, when the next one comes.
    """
    if rate == RATE:
        return where
    map_file, _, scen = where
    settings = from_benchmark(Path(map_file), Path(scen), robots).settings
    every = max(1, round(settings.radio.every * rate / RATE))
    changed = msgspec.structs.replace(settings, rate=rate, radio=msgspec.structs.replace(settings.radio, every=every))
    copy(map_file, folder)
    file = folder / "scenario.yaml"
    file.write_bytes(msgspec.json.encode(changed))  # JSON is YAML
    return (str(file),)


@dataclass(frozen=True, slots=True)
class Punctual:
    """How punctual a fleet was."""

    late: float  # share of commands that came after their tick
    p50: float  # s
    p99: float  # s
    p99_9: float  # s
    longest: float  # s


def punctual(report: dict[str, Any]) -> Punctual:
    """Read a report of a run in real time.

    Raises:
        NotMeasured: the run did not end by itself, or robots lost their processes, and the others had less to do.
    """
    if "not_reproducible" not in report:
        raise NotMeasured(f"it ended early: {report['reason']}")
    gone = sum("has lost its process" in reason for reason in report["not_reproducible"])
    if gone:
        raise NotMeasured(f"processes of at least {gone} robots were lost on the way")
    times = report["tick_wall"]
    late = report["late_commands"] / (report["ticks"] * report["robots"])
    return Punctual(late, times["p50"], times["p99"], times["p99.9"], times["max"])
