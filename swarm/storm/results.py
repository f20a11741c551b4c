"""The result of one plan: the plan is run and judged, and the result is a few plain fields that fit a JSON line."""

from traceback import format_exc
from typing import Any, Final, NamedTuple

from msgspec import Struct
from msgspec.structs import asdict, replace

from swarm.storm.history.history import History, record
from swarm.storm.history.run_facts import dead_of
from swarm.storm.laws.judge import Violation, judge
from swarm.storm.plans.draw import draw
from swarm.storm.plans.plan import StormPlan

NOBODY_DEAD: Final = "known floor, nobody dead"
SOME_DEAD: Final = "known floor, with the dead"
UNKNOWN: Final = "unknown floor"
CLASSES: Final = (NOBODY_DEAD, SOME_DEAD, UNKNOWN)
CRASH: Final = "no exception"
REPLAY: Final = "same digest"
NAMING: Final = frozenset({"stalled", "unsolvable", "no_plan_found", "unreachable"})  # events that say who is stuck


class Job(NamedTuple):
    """One plan to run: the one that a seed draws, or one from a file."""

    profile: str
    seed: int
    plan: StormPlan | None = None
    twice: bool = False  # run it again in the same process, and compare the digests

    @property
    def name(self) -> str:
        """Name of the job for people."""
        return f"{self.profile} {self.seed}"


class RunResult(Struct, frozen=True, kw_only=True):
    """The result of one run, as a summary counts it."""

    profile: str
    seed: int
    robots: int = 0
    features: tuple[str, ...] = ()
    category: str = UNKNOWN  # one of CLASSES
    complete: bool = False
    sim_time: float = 0.0  # s
    stalled: int = 0
    silent: bool = False  # a living robot did not arrive, and nothing says who is stuck
    reason: str = ""
    violations: tuple[Violation, ...] = ()
    digest: str = ""
    wall_time: float = 0.0  # s
    left_out: str = ""  # why the plan was not run

    def to_builtins(self) -> dict[str, Any]:
        """Return the fields as JSON takes them, each violation an object."""
        return asdict(self) | {"violations": [violation._asdict() for violation in self.violations]}


def perform(job: Job) -> RunResult:
    """Draw, run and judge one plan; an exception on the way is a violation too."""
    try:
        plan = draw(job.profile, job.seed) if job.plan is None else job.plan
        history = record(plan)
        result = summarise_run(job, plan, history, judge(history))
        if job.twice and not history.crash:
            result = compare_digests(result, record(plan).report.get("digest", ""), "the second run")
        return result
    except Exception:
        return lost_result(job, format_exc().strip().splitlines()[-1])


def summarise_run(job: Job, plan: StormPlan, history: History, violations: list[Violation]) -> RunResult:
    """Return the result of a judged run."""
    report = history.report
    return RunResult(
        profile=job.profile,
        seed=job.seed,
        robots=plan.robots,
        features=tuple(sorted(plan.features())),
        category=(SOME_DEAD if dead_of(history) else NOBODY_DEAD) if plan.scenario.map.known else UNKNOWN,
        complete=report.get("complete", False),
        sim_time=report.get("sim_time", 0.0),
        stalled=report["traffic"]["stalled"] if report else 0,
        silent=is_silent(history),
        reason=report.get("reason", ""),
        violations=tuple(violations),
        digest=report.get("digest", ""),
        wall_time=history.wall_time,
    )


def is_silent(history: History) -> bool:
    """Return True if a living robot did not arrive, and neither the report nor any event says who is stuck."""
    report, dead = history.report, dead_of(history)
    rows = report.get("per_robot", {})
    if all(name in dead or None not in row["reached"] for name, row in rows.items()):
        return False
    if report["traffic"]["stalled"] or any(row["unreachable"] for row in rows.values()):
        return False
    return not any(event.kind in NAMING for moment in history.moments for event in moment.events)


def compare_digests(result: RunResult, digest: str, how: str) -> RunResult:
    """Return the result, with one more violation if another run of the plan has another digest."""
    if digest == result.digest:
        return result
    tick = 0  # a digest says that runs differ, not where
    breach = Violation(REPLAY, tick, (), f"{how} has the digest {digest[:12]}, not {result.digest[:12]}")
    return replace(result, violations=(*result.violations, breach))


def lost_result(job: Job, why: str) -> RunResult:
    """Return the result of a job that gave no answer."""
    return RunResult(profile=job.profile, seed=job.seed, violations=(Violation(CRASH, 0, (), why),))
