"""The work of `swarm storm`: it runs seeds or plan files on all cores, judges them and reports results at once."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, perf_counter
from typing import Final

from swarm.errors import ConfigError
from swarm.stop_signal import stop_flag
from swarm.storm import summary
from swarm.storm.output import Lines, Say, show_progress, write_plan
from swarm.storm.plans.draw import draw
from swarm.storm.plans.plan import StormPlan, only_simulated, read
from swarm.storm.results import Job, RunResult, lost_result, perform
from swarm.storm.shrink import LONGEST, find_first, first_broken, shrink
from swarm.storm.workers import Lost, answers

INTERRUPTED: Final = 130  # the exit status after Ctrl-C, as in a shell

Results = Iterator[tuple[Job, RunResult]]
Over = Callable[[Job, Callable[[], bool]], RunResult]  # the job, and whether to stop


@dataclass(frozen=True, kw_only=True)
class StormOptions:
    """The options of `swarm storm`."""

    profiles: tuple[str, ...] = ("all",)
    seeds: range = range(0)
    files: tuple[Path, ...] = ()  # plans, instead of seeds
    jobs: int = 1
    twice: bool = False
    over: Over | None = None  # performs a job over real processes too
    results: Path | None = None
    plans: Path | None = None  # a folder for the plans that failed
    as_json: bool = False


def run(options: StormOptions, work: Callable[[Job], RunResult] = perform) -> int:
    """Run a storm and print its summary; return 0 all laws held, 1 one was broken, 2 a file is wrong, 130 interrupted.

    Raises:
        ConfigError: a profile, a plan file or the results file is wrong.
    """
    jobs = jobs_of(options)
    began = perf_counter()
    found: list[RunResult] = []
    with stop_flag() as stop, show_progress(len(jobs)) as (say, done), Lines(options.results, say) as lines:
        wrong = False
        each = _over_processes(jobs, options.over, stop.is_set) if options.over is not None else None
        for job, result in each or _each(jobs, options.jobs, work, stop.is_set):
            found.append(result)
            lines.add(result)
            wrong |= not _tell(job, result, options.plans, say)
            done(job.name)
        wrong |= lines.failed
        interrupted = stop.is_set() and len(found) < len(jobs)
    form = summary.as_json if options.as_json else summary.as_text
    told = form(sorted(found, key=lambda r: (r.profile, r.seed)), perf_counter() - began, interrupted)
    print(told if isinstance(told, str) else json.dumps(told))
    if any(result.violations for result in found):
        return 1
    return INTERRUPTED if interrupted else 2 if wrong else 0


def jobs_of(options: StormOptions) -> list[Job]:
    """Return the jobs to run.

    Raises:
        ConfigError: a profile or a plan file is wrong.
    """
    if options.files:
        plans = [read(path) for path in options.files]
        for path, plan in zip(options.files, plans, strict=True):
            if options.over is not None and (why := only_simulated(plan)):
                raise ConfigError(f"{path}: {why}; run it without --over processes")
        return [Job(plan.profile, plan.seed, plan, options.twice) for plan in plans]
    for profile in options.profiles:
        draw(profile, 0)
    return [Job(profile, seed, None, options.twice) for seed in options.seeds for profile in options.profiles]


def _each(jobs: list[Job], workers: int, work: Callable[[Job], RunResult], stop: Callable[[], bool]) -> Results:
    for job, answer in answers(work, jobs, workers=min(workers, len(jobs)), stop=stop):
        yield job, lost_result(job, answer.why) if isinstance(answer, Lost) else answer


def _over_processes(jobs: list[Job], over: Over, stop: Callable[[], bool]) -> Results:
    """Run one plan after the other, because each needs many processes."""
    for job in jobs:
        result = over(job, stop)
        if stop():
            return
        yield job, result


def _tell(job: Job, result: RunResult, folder: Path | None, say: Say) -> bool:
    """Print the laws that a seed broke and write its plan; return False if the plan cannot be written."""
    for law, tick, _, text in result.violations:
        say(f"{job.name}: {law}, tick {tick}: {text}")
    if folder is None or not result.violations:
        return True
    try:
        plan = draw(job.profile, job.seed) if job.plan is None else job.plan
        write_plan(plan, folder / f"{job.profile}-{job.seed}.yaml")
    except ConfigError as fault:
        say(f"--plans {fault}")
        return False
    return True


def shrink_plan(plan: StormPlan, out: Path, workers: int) -> int:
    """Shrink a plan for at most two minutes and write the result; return 1, or 0 if the plan breaks no law.

    Raises:
        ConfigError: the file cannot be written.
    """
    end = monotonic() + LONGEST
    with stop_flag() as told, show_progress(0) as (say, _):

        def stop() -> bool:
            return told.is_set() or monotonic() > end

        found = [result for _, result in _each([Job(plan.profile, plan.seed, plan)], 1, perform, stop)]
        law = first_broken(found[0].violations) if found else None
        if not found or law is None:
            say("the plan breaks no law; nothing is written" if found else "no time to run it; nothing is written")
            return 0
        broken = next(violation for violation in found[0].violations if violation.law == law)
        say(f"{law}, tick {broken.tick}: {broken.text}")
        time = broken.tick / plan.scenario.rate
        small = shrink(plan, law, time, lambda trials: find_first(trials, workers, stop), stop=stop, say=say)
    write_plan(small, out)
    print(f"{out}: {law}; {small.robots} robots, was {plan.robots}")
    return 1


def show(profile: str, seed: int) -> str:
    """Return the plan of a seed as the text of its file; the first line names its features.

    Raises:
        ConfigError: there is no such profile.
    """
    plan = draw(profile, seed)
    features = ", ".join(sorted(plan.features())) or "nothing but driving"
    return f"# {plan.robots} robots; {features}\n{plan.to_yaml()}"
