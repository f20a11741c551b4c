"""The end of a run: its summary, the lines of it for people, and its files."""

import json
import os
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from dashboard.terminal import ROWS
from swarm.launch.supervise.table import numbered_file
from swarm.settings import BAG

FOOTER: Final = b"RRF2FOOT"  # among the last bytes of a recording that has an index
FOOTER_ROOM: Final = 37  # bytes; a footer of MCAP
# before the place of its index in a footer of MCAP: an opcode and a length; the place is 0 if there is none (mcap.dev)
MCAP_FOOTER: Final = struct.pack("<BQ", 0x02, 20)


def summary_of(path: Path, known: dict[str, Any], trouble: str, lost: list[str]) -> dict[str, Any]:
    """Return the world's report, or a short one of what is ``known`` if the world wrote none.

    ``trouble`` says what went wrong with the processes; the robots in ``lost`` were not started again.
    """
    try:
        summary: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        summary = known | {"complete": False, "passed": False, "reason": trouble or "the world ended without a report"}
    if trouble and summary["reason"] == "interrupted":  # the launcher interrupted the run because of this trouble
        summary["reason"] = trouble
    return summary | {"lost": sorted({*summary.get("lost", []), *lost})}


def summary_lines(summary: dict[str, Any], recordings: list[str]) -> list[str]:
    """Return the summary of a run as lines for people; ``recordings`` are the last of them."""
    lines = ["complete" if summary["complete"] else f"not complete: {summary['reason']}", f"  {_verdict(summary)}"]
    if "contacts" in summary:
        contacts = ", ".join(f"{count} {kind}" for kind, count in summary["contacts"].items())
        gap = summary["clearance_min"]
        lines += [
            f"  simulated {summary['sim_time']:.1f} s in {summary['wall_time']:.1f} s "
            f"({summary['real_time_factor']:.1f} x real time), {summary['late_commands']} late commands",
            f"  contacts: {contacts}; smallest gap {f'{gap:.2f} m' if gap is not None else 'none'}",
            f"  the fuzzy tables steered {summary['steering']['angle']['tables']:.0%} of all turning",
        ]
    if summary.get("robots_per_process", 1) > 1:
        lines.append(f"  robots per process: up to {summary['robots_per_process']}")
    if (pool := summary.get("pool")) is not None:
        lines.append(
            f"  pool: {pool['done']} of {pool['given']} targets done, {pool['per_minute']:.1f} a minute; "
            f"{len(pool['left'])} left"
        )
    lines += [f"  {line}" for line in _format_robots(summary.get("per_robot", {}))]
    if summary.get("lost"):
        lines.append(f"  lost: {', '.join(summary['lost'])} stayed away, or crashed too often to be started again")
    return lines + [f"  {recording}" for recording in recordings]


def _verdict(summary: dict[str, Any]) -> str:
    """Return the exit status with the rule that applies."""
    if "avoidable_contacts" not in summary:
        return "exit status 1: the world wrote no report, so nobody knows whether anything was touched"
    count = summary["avoidable_contacts"]
    avoidable = f"stopping would have avoided {count} contact{'' if count == 1 else 's'}"
    if summary["passed"]:
        touched = any(summary["contacts"].values())
        none = "stopping would not have avoided any contact" if touched else "nobody touched anything"
        return f"exit status 0: complete, and {none}"
    if not summary["complete"]:
        return f"exit status 1: not complete{f', and {avoidable}' if count else ''}"
    return f"exit status 1: complete, but {avoidable}"


def _format_robots(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a line about each robot; of a large fleet totals, and those that lack targets or have contacts."""
    if len(rows) <= ROWS:
        return [_format_robot(name, row) for name, row in rows.items()]
    everybody = rows.values()
    ways, waited = [row["path_length"] for row in everybody], max(row["waiting"] for row in everybody)
    reached = sum(row["targets"] - _count_missing_stops(row) for row in everybody)
    needy = [name for name, row in rows.items() if _count_missing_stops(row) or row["contacts"]]
    more = f"and {len(needy) - ROWS} more that lack targets or touched something; --report FILE has all"
    return [
        f"{len(rows)} robots reached {reached} of {sum(row['targets'] for row in everybody)} targets",
        f"each drove {min(ways):.1f} m to {max(ways):.1f} m and waited at most {waited:.1f} s",
        *(_format_robot(name, rows[name]) for name in needy[:ROWS]),
        *([more] if len(needy) > ROWS else []),
    ]


def _count_missing_stops(row: dict[str, Any]) -> int:
    """Return how many of its stops a robot has not reached."""
    return 0 if row["laps"] else row["reached"].count(None)


def _format_robot(name: str, row: dict[str, Any]) -> str:
    lacks = ["no way" if stop in row["unreachable"] else "not reached" for stop in range(len(row["reached"]))]
    times = (lack if time is None else f"{time:.0f} s" for lack, time in zip(lacks, row["reached"], strict=True))
    laps = f"{row['laps']} laps; " if row["laps"] else ""
    touched = f", {row['contacts']} contact{'' if row['contacts'] == 1 else 's'}" if row["contacts"] else ""
    stops = f"targets: {', '.join(times)}; " if row["reached"] else ""
    return f"{name}: {laps}{stops}drove {row['path_length']:.1f} m, waited {row['waiting']:.1f} s{touched}"


def format_recordings(record: Path | None, starts: int, since: int) -> list[str]:
    """Return a line about each recording of a run, whose process was started ``starts`` times.

    Older files of the same names are left out: they are those that were changed before ``since`` [ns, Unix time].
    """
    if record is None:
        return []
    if record.suffix == BAG:
        how, without = "open it in Foxglove, or: ros2 bag play", "its process was killed; its last seconds are missing"
    else:
        how = "open it with: rerun"
        without = "its dashboard was killed, its disk is full, or it is too large; the tape has the whole run"
    lines = [
        f"recorded: {path}  ({how} {path})" if whole else f"recorded without index: {path}  ({without})"
        for path, whole in _list_recordings(record, starts, since)
    ]
    return lines or [f"not recorded: {record} was not written"]


def format_tape_line(tape: Path) -> list[str]:
    """Return a line about the tape of a run."""
    return [f"tape: {tape}  (run it again with: swarm replay {tape})"] if tape.is_file() else []


def _list_recordings(record: Path, starts: int, since: int) -> Iterator[tuple[Path, bool]]:
    """Yield each recording, and whether it has an index: that is written when a file is finished."""
    for number in range(1, starts + 1):
        first = numbered_file(record, number)
        for path in (first, *sorted(first.parent.glob(f"{first.stem}-run*{first.suffix}"))):
            with suppress(OSError):
                if path.stat().st_mtime_ns >= since:
                    with path.open("rb") as file:
                        file.seek(-min(FOOTER_ROOM, path.stat().st_size), os.SEEK_END)
                        end = file.read(FOOTER_ROOM)
                    indexed = end[:9] == MCAP_FOOTER and any(end[9:17])
                    yield path, indexed if record.suffix == BAG else FOOTER in end
