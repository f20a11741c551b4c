"""The summary of results: failure rates with their intervals, by class, profile, feature and law."""

from collections.abc import Callable, Iterable, Sequence
from math import sqrt
from typing import Any, Final, NamedTuple

from swarm.storm.laws.judge import LAWS
from swarm.storm.results import CLASSES, REPLAY, RunResult

Z: Final = 1.959964  # quantile of the normal distribution for 95 %


class Counts(NamedTuple):
    """The counts of a group of runs."""

    name: str
    runs: int
    failed: int
    silent: int

    @property
    def rate(self) -> float:
        """Share of runs that failed."""
        return self.failed / self.runs if self.runs else 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """The rate's 95 % interval."""
        return wilson(self.failed, self.runs)


def wilson(failed: int, runs: int) -> tuple[float, float]:
    """Compute Wilson's 95 % interval of a rate (JASA 22, 1927).

    >>> [round(bound, 4) for bound in wilson(16, 218)]
    [0.0457, 0.1159]
    """
    if runs == 0:
        return 0.0, 1.0
    share, z2 = failed / runs, Z * Z / runs
    middle = share + z2 / 2
    half = sqrt(z2 * (share * (1 - share) + z2 / 4))
    return max(0.0, (middle - half) / (1 + z2)), min(1.0, (middle + half) / (1 + z2))


def count_group(
    name: str, results: Iterable[RunResult], broke: Callable[[RunResult], bool] = lambda r: bool(r.violations)
) -> Counts:
    """Count the runs, the failed runs and the silent runs of a group."""
    results = list(results)
    return Counts(name, len(results), sum(map(broke, results)), sum(result.silent for result in results))


def results_run(results: Iterable[RunResult]) -> list[RunResult]:
    """Return the results of the plans that were run."""
    return [result for result in results if not result.left_out]


def tables(results: Sequence[RunResult]) -> dict[str, list[Counts]]:
    """Count by class, profile, feature and law; a class, feature or law that never came up has no row."""
    results = results_run(results)
    profiles = sorted({result.profile for result in results})
    features = sorted({feature for result in results for feature in result.features})
    found = {
        "class": [count_group(name, (r for r in results if r.category == name)) for name in CLASSES],
        "profile": [count_group(name, (r for r in results if r.profile == name)) for name in profiles],
        "feature": [count_group(name, (r for r in results if name in r.features)) for name in features],
        "law": [count_group(law, results, lambda r, law=law: has_broken(r, law)) for law in (*LAWS, REPLAY)],  # type: ignore[misc]
    }
    found["class"] = [one for one in found["class"] if one.runs]
    found["law"] = [one for one in found["law"] if one.failed]
    return found


def has_broken(result: RunResult, law: str) -> bool:
    """Return True if a run broke that law."""
    return any(violation.law == law for violation in result.violations)


def as_json(results: Sequence[RunResult], wall_time: float, interrupted: bool) -> dict[str, Any]:
    """Return the summary for other tools; ``wall_time`` [s] is that of the whole storm."""
    total = count_group("all", results_run(results))
    failures = [
        {"profile": result.profile, "seed": result.seed, **violation._asdict()}
        for result in results
        for violation in result.violations
    ]
    return {
        "runs": total.runs,
        "failed": total.failed,
        "rate": total.rate,
        "interval": list(total.interval),
        "silent": total.silent,
        "left_out": len(results) - total.runs,
        "interrupted": interrupted,
        "wall_time": wall_time,
        "seeds_per_hour": seeds_per_hour(total.runs, wall_time),
        "by": {kind: [_plain(one) for one in rows] for kind, rows in tables(results).items()},
        "failures": failures,
    }


def _plain(one: Counts) -> dict[str, Any]:
    return one._asdict() | {"rate": one.rate, "interval": list(one.interval)}


def seeds_per_hour(runs: int, wall_time: float) -> float:
    """Return the number of seeds run per hour; ``wall_time`` in s."""
    return 3600.0 * runs / wall_time if wall_time else 0.0


def as_text(results: Sequence[RunResult], wall_time: float, interrupted: bool) -> str:
    """Return the summary as a text for people."""
    total = count_group("all", results_run(results))
    lines = [f"{'':30}{'runs':>6}{'failed':>8}{'rate':>9}{'95 %':>16}{'silent':>8}"]
    for kind, rows in tables(results).items():
        if rows:
            lines += [f"by {kind}", *map(format_summary_row, rows)]
    lines += ["", format_summary_row(total), f"{seeds_per_hour(total.runs, wall_time):.0f} seeds an hour"]
    if len(results) > total.runs:
        lines.append(f"{len(results) - total.runs} left out: {next(r.left_out for r in results if r.left_out)}")
    lines.append(verdict(total))
    if interrupted:
        lines.append("interrupted: only these seeds were run")
    return "\n".join(lines)


def verdict(total: Counts) -> str:
    """Return what came out, in words.

    >>> verdict(Counts("all", 2, 0, 0))
    'no law was broken in 2 runs'
    >>> verdict(Counts("all", 1, 1, 1))
    'laws were broken in 1 of 1 run; in 1 a living robot did not arrive and nothing says who is stuck (silent)'
    """
    runs = f"{total.runs} run{'s' * (total.runs != 1)}"
    said = f"laws were broken in {total.failed} of {runs}" if total.failed else f"no law was broken in {runs}"
    stuck = f"; in {total.silent} a living robot did not arrive and nothing says who is stuck (silent)"
    return said + stuck * bool(total.silent)


def format_summary_row(one: Counts) -> str:
    """Return one row as a line of text."""
    low, high = one.interval
    bounds = f"{100 * low:.1f}-{100 * high:.1f} %"
    return f"  {one.name:28}{one.runs:6}{one.failed:8}{100 * one.rate:8.1f}%{bounds:>16}{one.silent:8}"
