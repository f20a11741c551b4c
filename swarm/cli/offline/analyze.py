"""`swarm analyze`: what a recorded run was like, in numbers."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Final

from swarm.cli.columns import aligned
from swarm.cli.parsing import Commands, Parser
from swarm.errors import ConfigError
from swarm.installed import without_rerun

if TYPE_CHECKING:
    from dashboard.fold.account import Saved

STARTS: Final = 20  # of a dashboard, whose files are looked for


def analyze(options: argparse.Namespace) -> int:
    """Print what a recorded run was like."""
    from dashboard.fold import analysis

    if lacking := without_rerun():
        raise ConfigError(f"analyze: {lacking}")
    from dashboard.rerun.reader import read_account

    first, *others = options.files
    if others:
        raise ConfigError(
            f"analyze: expected one file, got {len(others) + 1}; of one run, the file that was recorded last has the "
            "numbers of the whole run; analyze other runs one after the other"
        )
    account, whole = read_account(first)
    found = analysis.analysed(account, whole, str(first), _later(first, account))
    if options.json:
        print(json.dumps(found, indent=1))
        return 0
    title, *rest = analysis.lines(found)
    rows = analysis.table(found)
    print("\n".join([title, "", aligned(rows, right={2, 3, 4, 5, 7, 8, 9}), "", *rest]))
    return 0


def _later(path: Path, account: "Saved") -> str | None:
    """Return the newest file in which a dashboard that was started again has gone on with a run, or None."""
    from dashboard.fold.account import is_earlier
    from dashboard.rerun.reader import read_account
    from swarm.launch.supervise.table import numbered

    for number in range(STARTS, 1, -1):
        other = numbered(path, number)
        if other.is_file():
            try:
                later, _ = read_account(other)
            except ConfigError:
                continue
            if is_earlier(account, later):
                return str(other)
    return None


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("analyze", help="print what a recorded run was like: times, ways, waiting, contacts")
    one.add_argument("files", type=Path, nargs="+", metavar="FILE.rrd", help="what `swarm run --record` has written")
    one.add_argument("--json", action="store_true")
    one.set_defaults(command=analyze)
