"""`swarm analyze`: what a run was like, in numbers: from its tape, or from what a dashboard recorded."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from swarm.cli.columns import aligned
from swarm.cli.parsing import Commands, Parser
from swarm.errors import ConfigError
from swarm.installed import without_rerun
from swarm.settings import TAPE

if TYPE_CHECKING:
    from dashboard.fold.account import Saved

STARTS: Final = 20  # of a dashboard, whose files are looked for


def analyze(options: argparse.Namespace) -> int:
    """Print what a run was like."""
    from dashboard.fold import analysis

    first, *others = options.files
    if others:
        raise ConfigError(
            f"analyze: expected one file, got {len(others) + 1}; of one run, the file that was recorded last has the "
            "numbers of the whole run; analyze other runs one after the other"
        )
    found = _taped(first) if first.suffix == TAPE else _recorded(first)
    if options.json:
        print(json.dumps(found, indent=1))
        return 0
    title, *rest = analysis.lines(found)
    rows = analysis.table(found)
    print("\n".join([title, "", aligned(rows, right={2, 3, 4, 5, 7, 8, 9}), "", *rest]))
    return 0


def _taped(path: Path) -> dict[str, Any]:
    """Return the analysis of a tape: what its world has measured when it is run again."""
    from dashboard.fold import analysis
    from dashboard.fold.account import Saved
    from swarm.cli.offline.replay import opened, told
    from swarm.messages import Phase
    from swarm.scenario.prepare import planning_grid
    from world.views import metrics
    from world.views.report import missing

    *notes, outcome = told(replay := opened(path))
    world = replay.world
    notes += [outcome] if replay.difference is not None else []
    reason = "" if world.tasks.complete else f"the tape ends here; {missing(world)}"
    account = Saved(
        scenario=world.settings.name, world=world.identity, run=world.run, time=world.time, phase=Phase.OVER,
        complete=world.tasks.complete, reason=reason, contacts=metrics.contacts(world),
        clearance_min=metrics.clearance_min(world), heard={}, lost={},
        robots=metrics.accounts(world, metrics.shortest_lengths(world, planning_grid(replay.edited()))),
    )  # fmt: skip
    return analysis.analysed(account, True, str(path), notes=notes)


def _recorded(path: Path) -> dict[str, Any]:
    """Return the analysis of what a dashboard has recorded."""
    from dashboard.fold import analysis

    if lacking := without_rerun():
        raise ConfigError(f"analyze: {lacking}")
    from dashboard.rerun.reader import read_account

    account, whole = read_account(path)
    return analysis.analysed(account, whole, str(path), _later(path, account))


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
    one = commands.add_parser("analyze", help="print what a run was like: times, ways, waiting, contacts")
    one.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE.swarm|FILE.rrd",
        help="the tape of a run, or what its dashboard recorded",
    )
    one.add_argument("--json", action="store_true")
    one.set_defaults(command=analyze)
