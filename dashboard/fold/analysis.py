"""What a recorded run was like: an account as a table of numbers, and as lines for people. Pure."""

from collections.abc import Iterable, Sequence
from typing import Any

from dashboard.fold.account import Saved
from swarm.messages import Account, Phase


def analysed(
    account: Saved, whole: bool, file: str, later: str | None = None, notes: Iterable[str] = ()
) -> dict[str, Any]:
    """Return the analysis of a recording or a tape; what is in the report too has the same name and value there.

    ``whole`` is False if the file is cut. ``later`` is the file of a dashboard that was started again in the same run.
    ``notes`` are sentences to add.
    """
    rows = list(account.robots.values())
    return {
        "file": file,
        "notes": [*_notes(account, whole, later), *notes],
        "scenario": account.scenario,
        "run": account.run,
        "over": account.phase is Phase.OVER,
        "complete": account.complete,
        "reason": account.reason,
        "sim_time": account.time,
        "contacts": account.contacts,
        "clearance_min": account.clearance_min,
        "per_robot": {name: _row(row) for name, row in account.robots.items()},
        "total": {
            "targets": sum(row.targets for row in rows),
            "reached": sum(time is not None for row in rows for time in row.reached),
            "path_length": sum(row.path_length for row in rows),
            "shortest_length": _sum(row.shortest_length for row in rows),
            "detour": _ratio(rows),
            "waiting": sum(row.waiting for row in rows),
            "replans": sum(row.replans for row in rows),
            "contacts": sum(account.contacts.values()),
        },
        "messages": {"heard": account.heard, "lost": account.lost},
    }


def lines(analysis: dict[str, Any]) -> list[str]:
    """Return an analysis as lines for people, before and after the table of ``table``."""
    contacts = ", ".join(f"{count} {kind}" for kind, count in analysis["contacts"].items())
    gap, lost = analysis["clearance_min"], analysis["messages"]["lost"]
    heard = sum(analysis["messages"]["heard"].values())
    missed = ", ".join(f"{count} of {topic}" for topic, count in lost.items())
    state = "complete" if analysis["complete"] else "not complete" if analysis["over"] else "not over"
    heard_line = (
        f"messages to the dashboard: {heard} heard, {sum(lost.values())} lost{f' ({missed})' if missed else ''}"
    )
    return [
        f"{analysis['scenario']}, run {analysis['run']}: {state} after {analysis['sim_time']:.1f} s"
        + (f": {analysis['reason']}" if analysis["reason"] else ""),
        *(f"note: {note}" for note in analysis["notes"]),
        f"contacts: {contacts}; smallest gap {f'{gap:.2f} m' if gap is not None else 'none'}",
        *([heard_line] if heard else []),
    ]


def table(analysis: dict[str, Any]) -> list[Sequence[str]]:
    """Return the rows of a table: a header, each robot, and the total."""
    total, laps = analysis["total"], any(row["laps"] for row in analysis["per_robot"].values())
    header = ["robot", "targets at [s]", "way [m]", "shortest [m]", "ratio", "waited [s]", "for", "contacts", "replans"]
    rows = [header + ["laps"] * laps]
    for name, row in analysis["per_robot"].items():
        stops = ", ".join(_number(time, 1) for time in row["reached"]) or "-"
        waits = ", ".join(f"{other} {time:.1f}" for other, time in row["waits_for"].items()) or "-"
        rows.append([name, stops, *_measured(row), waits, *_counts(row), *[f"{row['laps']}"] * laps])
    reached = f"{total['reached']} of {total['targets']}"
    rows.append(["total", reached, *_measured(total), "", *_counts(total), *[""] * laps])
    return list(rows)


def _notes(account: Saved, whole: bool, later: str | None) -> Iterable[str]:
    """Yield a sentence about each thing that the analysis lacks."""
    until = f"the numbers are those of {account.time:.1f} s"
    if account.phase is not Phase.OVER:
        why = "the recording ends before the run" if whole else "the recording is cut: its dashboard was killed"
        yield f"{why}; {until}, without the shortest ways"
    elif not whole:
        yield "the recording is cut at its end, but it has the numbers of the whole run"
    if later is not None:
        yield f"the dashboard was started again, and {later} goes on with this run; analyze that file"


def _row(row: Account) -> dict[str, Any]:
    named = {name: getattr(row, name) for name in row.__struct_fields__}
    return named | {"detour": _ratio([row])}


def _ratio(rows: Sequence[Account]) -> float | None:
    """Return way over shortest way of robots that were at all their stops once, None if there are none."""
    done = [row for row in rows if row.shortest_length and row.reached and None not in row.reached and not row.laps]
    shortest = sum(row.shortest_length or 0.0 for row in done)
    return sum(row.path_length for row in done) / shortest if shortest else None


def _sum(lengths: Iterable[float | None]) -> float | None:
    known = list(lengths)
    return None if None in known else sum(length or 0.0 for length in known)


def _measured(row: dict[str, Any]) -> list[str]:
    numbers = (("path_length", 1), ("shortest_length", 1), ("detour", 2), ("waiting", 1))
    return [_number(row[name], digits) for name, digits in numbers]


def _counts(row: dict[str, Any]) -> list[str]:
    return [f"{row['contacts']}", f"{row['replans']}"]


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
