"""`swarm analyze`: what a run was like, in numbers: what its world measures when its tape is run again."""

import argparse
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.columns import align_rows
from swarm.settings import TAPE

if TYPE_CHECKING:
    from swarm.messages import Account, Status


def analyze(options: argparse.Namespace) -> int:
    """Print what a run was like."""
    from swarm.blackbox.replay.wire import Wire
    from swarm.cli.offline.replay import open_replay, replay_tape
    from swarm.messages import Phase

    *notes, outcome = replay_tape(replay := open_replay(options.file))
    notes += [outcome] if replay.difference is not None else []
    found = analyse_run(Wire(replay).status(Phase.OVER), str(options.file), notes)
    if options.json:
        print(json.dumps(found, indent=1))
        return 0
    title, *rest = format_analysis(found)
    print("\n".join([title, "", align_rows(table(found), right={2, 3, 4, 5, 7, 8, 9}), "", *rest]))
    return 0


def analyse_run(status: "Status", file: str, notes: Iterable[str] = ()) -> dict[str, Any]:
    """Return the analysis of a run's last status; what is in the report too has the same name and value there.

    ``notes`` are sentences to add.
    """
    accounts = {row.robot: row.account for row in status.robots if row.account is not None}
    rows = list(accounts.values())
    return {
        "file": file,
        "notes": list(notes),
        "scenario": status.scenario,
        "run": status.run,
        "complete": status.complete,
        "reason": status.reason and f"the tape ends here; {status.reason}",
        "sim_time": status.time,
        "contacts": status.contacts,
        "clearance_min": status.clearance_min,
        "per_robot": {name: _row(row) for name, row in accounts.items()},
        "total": {
            "targets": sum(row.targets for row in rows),
            "reached": sum(time is not None for row in rows for time in row.reached),
            "path_length": sum(row.path_length for row in rows),
            "shortest_length": _sum(row.shortest_length for row in rows),
            "detour": _ratio(rows),
            "waiting": sum(row.waiting for row in rows),
            "replans": sum(row.replans for row in rows),
            "contacts": sum(status.contacts.values()),
        },
    }


def format_analysis(analysis: dict[str, Any]) -> list[str]:
    """Return an analysis as lines for people, before and after the table of ``table``."""
    contacts = ", ".join(f"{count} {kind}" for kind, count in analysis["contacts"].items())
    gap = analysis["clearance_min"]
    return [
        f"{analysis['scenario']}, run {analysis['run']}: {'complete' if analysis['complete'] else 'not complete'} "
        f"after {analysis['sim_time']:.1f} s" + (f": {analysis['reason']}" if analysis["reason"] else ""),
        *(f"note: {note}" for note in analysis["notes"]),
        f"contacts: {contacts}; smallest gap {f'{gap:.2f} m' if gap is not None else 'none'}",
    ]


def table(analysis: dict[str, Any]) -> list[Sequence[str]]:
    """Return the rows of a table: a header, each robot, and the total."""
    total, laps = analysis["total"], any(row["laps"] for row in analysis["per_robot"].values())
    header = ["robot", "targets at [s]", "way [m]", "shortest [m]", "ratio", "waited [s]", "for", "contacts", "replans"]
    rows = [header + ["laps"] * laps]
    for name, row in analysis["per_robot"].items():
        stops = ", ".join(_number(time, 1) for time in row["reached"]) or "-"
        waits = ", ".join(f"{other} {time:.1f}" for other, time in row["waits_for"].items()) or "-"
        rows.append([name, stops, *_measure_tape(row), waits, *_counts(row), *[f"{row['laps']}"] * laps])
    reached = f"{total['reached']} of {total['targets']}"
    rows.append(["total", reached, *_measure_tape(total), "", *_counts(total), *[""] * laps])
    return list(rows)


def _row(row: "Account") -> dict[str, Any]:
    named = {name: getattr(row, name) for name in row.__struct_fields__}
    return named | {"detour": _ratio([row])}


def _ratio(rows: Sequence["Account"]) -> float | None:
    """Return way over shortest way of robots that were at all their stops once, None if there are none."""
    done = [row for row in rows if row.shortest_length and row.reached and None not in row.reached and not row.laps]
    shortest = sum(row.shortest_length or 0.0 for row in done)
    return sum(row.path_length for row in done) / shortest if shortest else None


def _sum(lengths: Iterable[float | None]) -> float | None:
    known = list(lengths)
    return None if None in known else sum(length or 0.0 for length in known)


def _measure_tape(row: dict[str, Any]) -> list[str]:
    numbers = (("path_length", 1), ("shortest_length", 1), ("detour", 2), ("waiting", 1))
    return [_number(row[name], digits) for name, digits in numbers]


def _counts(row: dict[str, Any]) -> list[str]:
    return [f"{row['contacts']}", f"{row['replans']}"]


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("analyze", help="print what a run was like: times, ways, waiting, contacts")
    one.add_argument("file", type=Path, metavar=f"FILE{TAPE}", help="the tape of a run")
    one.add_argument("--json", action="store_true")
    one.set_defaults(command=analyze)
