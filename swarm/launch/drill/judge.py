"""The laws of a drill: what must hold after a fault. Each returns what is wrong, "" for nothing."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

LINES: Final = 3  # last lines of the output that a broken law shows


@dataclass(frozen=True)
class Observed:
    """What came of one run with a fault."""

    status: int | None  # exit status of `swarm run`; None: it did not end in time
    text: str  # what it printed
    report: dict[str, Any]  # {} if it wrote none
    told: tuple[tuple[str, str], ...] = ()  # (robot, text) of every stop that was told as reached
    processes: tuple[str, ...] = ()  # that were left
    files: tuple[str, ...] = ()  # that were left
    digest: str = ""  # of the same run without a fault, in lockstep
    expected: tuple[str, ...] = field(default=())  # parts of the output that the row demands

    @property
    def missing_stops(self) -> dict[str, int]:
        """How many stops each robot lacks, of those that lack any."""
        lacking = {name: row["reached"].count(None) for name, row in self.report.get("per_robot", {}).items()}
        return {name: count for name, count in lacking.items() if count}


def ends_by_itself(seen: Observed) -> str:
    """Check that the command ended by itself."""
    return "" if seen.status is not None else "it did not end in time"


def complete(seen: Observed) -> str:
    """Check that the mission is complete and the exit status is 0."""
    if seen.report.get("complete") and seen.status == 0:
        return ""
    reason = seen.report.get("reason") or "; ".join(seen.text.splitlines()[-LINES:])
    return f"exit status {seen.status}, not complete: {reason}"


def nothing_lost(seen: Observed) -> str:
    """Check that the report has a time for every stop of every robot, in order."""
    if not seen.report.get("per_robot"):
        return "the report has no robots"
    lost = ", ".join(f"{name} lacks {count} target{'s' * (count > 1)}" for name, count in seen.missing_stops.items())
    rows = {
        name: [time for time in row["reached"] if time is not None] for name, row in seen.report["per_robot"].items()
    }
    return lost or ", ".join(f"{name}'s targets are out of order" for name, row in rows.items() if row != sorted(row))


def nothing_doubled(seen: Observed) -> str:
    """Check that no stop was told as reached twice."""
    twice = [f"{robot} {text}" for (robot, text), count in Counter(seen.told).items() if count > 1]
    return f"told twice: {', '.join(twice)}" if twice else ""


def no_contact(seen: Observed) -> str:
    """Check that no robot touched another one, a wall or an obstacle."""
    touched = [f"{count} {kind}" for kind, count in seen.report.get("contacts", {}).items() if count]
    return f"contacts: {', '.join(touched)}" if touched else ""


def no_overlap(seen: Observed) -> str:
    """Check that no two robots ever held one cell, and that no body was outside the cells that its robot held."""
    traffic = seen.report.get("traffic", {"overlaps": "no report", "outside": "no report"})
    return ", ".join(f"{kind}: {traffic[kind]}" for kind in ("overlaps", "outside") if traffic[kind])


def same_run(seen: Observed) -> str:
    """Check that the run is the one without a fault, bit for bit."""
    got = seen.report.get("digest", "none")
    return "" if got == seen.digest else f"digest {got[:8]} instead of {seen.digest[:8]}"


def nothing_left(seen: Observed) -> str:
    """Check that no process, no folder and no half file is left."""
    return "; ".join(f"left: {one}" for one in (*seen.processes, *seen.files))


def no_traceback(seen: Observed) -> str:
    """Check that everything was said in sentences."""
    at = seen.text.find("Traceback")
    return "" if at < 0 else f"a traceback: {seen.text[at:].splitlines()[-1]}"


def only_lost_lack(seen: Observed) -> str:
    """Check that a robot was given up and named, and that every other one has finished."""
    if not (lost := seen.report.get("lost")):
        return "no robot is named as lost"
    others = [name for name in seen.missing_stops if name not in lost]
    return f"{', '.join(others)} did not finish either" if others else ""


def in_order(seen: Observed) -> str:
    """Check that the run was interrupted and reported."""
    if seen.status != 1:
        return f"exit status {seen.status} instead of 1"
    reason = seen.report.get("reason", "no report")
    return "" if reason == "interrupted" and seen.report.get("ticks") else f"the report's reason: {reason}"


def output_complete(seen: Observed) -> str:
    """Check that the output has what the row demands."""
    missing = [part for part in seen.expected if part not in seen.text]
    return f"not said: {', '.join(missing)}" if missing else ""


Law = Callable[[Observed], str]
ALWAYS: Final[tuple[Law, ...]] = (ends_by_itself, no_contact, nothing_left, no_traceback)
WHOLE: Final[tuple[Law, ...]] = (complete, nothing_lost, nothing_doubled)
LAWS: Final[tuple[Law, ...]] = (*ALWAYS, *WHOLE, no_overlap, same_run, only_lost_lack, in_order, output_complete)


def broken(laws: Sequence[Law], seen: Observed) -> list[str]:
    """Return what is wrong, one text for each broken law, named."""
    return [f"{law.__name__.replace('_', ' ')}: {wrong}" for law in laws if (wrong := law(seen))]
