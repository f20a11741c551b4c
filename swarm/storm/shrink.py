"""The shrinking of a plan that breaks a law: a greedy search, one kind of cut after the other."""

from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

from msgspec.structs import replace

from swarm.storm.history.history import record
from swarm.storm.laws.judge import Violation, judge
from swarm.storm.plans.plan import StormPlan
from swarm.storm.plans.simpler import CUTS, simpler, size
from swarm.storm.workers import answers

LONGEST: Final = 120.0  # s of wall time for one shrinking
SLACK: Final = 1.1  # a candidate's time limit is this factor times the time in which the plan broke its law
MORE: Final = 10.0  # s, simulated, added to a candidate's time limit


class Trial(NamedTuple):
    """A plan and the law that it should break."""

    plan: StormPlan
    law: str


First = Callable[[Iterable[Trial]], tuple[StormPlan, float] | None]  # the first plan that breaks its law, and when [s]


def find_break_time(trial: Trial) -> float | None:
    """Return when [simulated s] a plan breaks the law, or None if it does not.

    A law that a run breaks only because its time is up does not count: the robots might have arrived later.
    """
    history = record(trial.plan)
    end = history.report.get("sim_time", 0.0)
    timed_out = end >= trial.plan.scenario.limit
    for law, tick, _, _ in judge(history):
        if law == trial.law and not (timed_out and tick >= history.moments[-1].tick):
            return tick * history.dt
    return None


def first_broken(violations: Iterable[Violation]) -> str | None:
    """Return the law that is broken first."""
    return min(violations, key=lambda violation: violation.tick, default=Violation("", 0, (), "")).law or None


def find_first(trials: Iterable[Trial], workers: int, stop: Callable[[], bool]) -> tuple[StormPlan, float] | None:
    """Run candidates in parallel until one breaks its law. A candidate whose process dies does not count."""
    for trial, time in answers(find_break_time, trials, workers=workers, stop=stop):
        if isinstance(time, float):
            return trial.plan, time
    return None


def shrink(
    plan: StormPlan,
    law: str,
    time: float,
    first: First,
    *,
    stop: Callable[[], bool] = lambda: False,
    say: Callable[[str], None] = lambda text: None,
) -> StormPlan:
    """Return the smallest plan found that breaks ``law``, which ``plan`` breaks at ``time`` [simulated s].

    ``first`` runs candidates. A cut that works is tried again on the smaller plan, until no cut works.
    """
    limit = plan.scenario.limit
    done = False
    while not done and not stop():
        done = True
        for cut in CUTS:
            while not stop():
                end = min(limit, SLACK * time + MORE)
                found = first(Trial(_limit_plan(one, end), law) for one in simpler(plan, cut))
                if found is None:
                    break
                plan, time = _limit_plan(found[0], limit), found[1]
                done = False
                robots, wrong, stops, floor = size(plan)
                say(f"{cut.__name__}: {robots} robots, {wrong} faults, {stops} stops, {floor} characters of floor")
    return plan


def _limit_plan(plan: StormPlan, limit: float) -> StormPlan:
    return replace(plan, scenario=replace(plan.scenario, limit=limit))
