"""Runs rows of the table and returns what came of each."""

import shutil
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from swarm.errors import ConfigError, SwarmError, suggest
from swarm.launch.drill.fleet_under_drill import LiveFleet
from swarm.launch.drill.floor import undisturbed_digest
from swarm.launch.drill.judge import Observed, broken, same_run
from swarm.launch.drill.table import LOCKSTEP, ROWS, TABLE, Row


@dataclass(frozen=True)
class RowResult:
    """What came of one row at one pace."""

    row: str
    pace: str
    outcome: str  # pass, fail or skip
    seconds: float
    seen: str  # what is wrong, or why it was skipped

    def line(self) -> str:
        """Return it as a line for people."""
        pace = "lockstep" if self.pace == LOCKSTEP else f"pace {self.pace}"
        return f"{self.outcome:4}  {self.row:17}{pace:9}{self.seconds:6.1f} s{'  ' * bool(self.seen)}{self.seen}"


def select_rows(names: Iterable[str]) -> list[Row]:
    """Return the rows with these names, or all rows for no names.

    Raises:
        ConfigError: there is no such row.
    """
    for name in (names := list(names)):
        if name not in ROWS:
            raise ConfigError(f"--row: expected a row of the drill, got {name!r}; {suggest(name, ROWS)}")
    return [ROWS[name] for name in names] or list(TABLE)


def run_drills(rows: Iterable[Row], repeat: int, keep: Path | None = None) -> Iterator[RowResult]:
    """Run each row at each of its paces, ``repeat`` times; ``keep`` is where the files of those that fail are kept."""
    for row in rows:
        for pace in row.paces:
            for _ in range(repeat):
                yield run_row(row, pace, keep)


def run_row(row: Row, pace: str, keep: Path | None = None) -> RowResult:
    """Run a row at a pace and judge it; if it fails, keep its scenario, output and report in a folder in ``keep``."""
    if lacks := row.lacks():
        return RowResult(row.name, pace, "skip", 0.0, lacks)
    begun = monotonic()
    with TemporaryDirectory(prefix="swarm-drill-") as folder:
        try:
            wrong = broken(row.laws_at(pace), _perform_row(row, pace, Path(folder)))
        except SwarmError as fault:
            wrong = [f"the fault could not be injected: {' '.join(str(fault).split())}"]
        if wrong and keep is not None:
            with suppress(shutil.Error):  # sockets cannot be copied
                shutil.copytree(folder, keep / f"{row.name}-{pace}-{Path(folder).name}")
    return RowResult(row.name, pace, "fail" if wrong else "pass", monotonic() - begun, "; ".join(wrong))


def _perform_row(row: Row, pace: str, folder: Path) -> Observed:
    digest = undisturbed_digest() if same_run in row.laws_at(pace) else ""
    options = tuple(option.format(folder=folder) for option in row.options)
    with LiveFleet(folder, pace, options, row.scenario, row.environ(folder)) as live:
        live.wait_for_truth(lambda truth: truth.tick >= row.tick, f"tick {row.tick}")
        row.inject(live)
        return live.finish(digest, row.expected)


def as_json(outcome: RowResult) -> dict[str, object]:
    """Return an outcome as plain values."""
    return asdict(outcome)
