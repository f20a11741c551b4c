"""The same plan over real processes in lockstep: every answer must be the same, bit for bit."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from swarm.blackbox.explain.first_difference import differences
from swarm.blackbox.replay.replay import Replay
from swarm.bus import Endpoint
from swarm.launch.fleet_registry import register_fleet
from swarm.launch.options import Options
from swarm.launch.processes import Processes
from swarm.launch.supervise.fleet import Ended, Fleet
from swarm.launch.supervise.table import EarlyEnd
from swarm.storm.history.history import History, record
from swarm.storm.laws.judge import Violation, judge
from swarm.storm.plans.draw import draw
from swarm.storm.plans.plan import StormPlan, only_simulated
from swarm.storm.results import REPLAY, Job, RunResult, compare_digests, summarise_run
from swarm.tape.reader import TapeFile


def perform_both(job: Job, stop: Callable[[], bool]) -> RunResult:
    """Run a plan in one process and judge it, then over real processes, and compare all answers and the digests."""
    plan = draw(job.profile, job.seed) if job.plan is None else job.plan
    if why := only_simulated(plan):
        return RunResult(profile=job.profile, seed=job.seed, left_out=why)
    history = record(plan)
    result = summarise_run(job, plan, history, judge(history))
    if history.crash:
        return result
    report, first = run_over_processes(plan, history, stop)
    if first is not None:
        return replace(result, violations=(*result.violations, first))
    how = "the run over processes" + ("" if "digest" in report else f" ended early ({report['reason']}) and")
    return compare_digests(result, report.get("digest", "none"), how)


def run_over_processes(
    plan: StormPlan, history: History, stop: Callable[[], bool]
) -> tuple[dict[str, Any], Violation | None]:
    """Run a plan with a process for each robot, for as long as its ``history`` in one process at most.

    Return the world's report, and the first answer on its tape that is not that of the history.
    """
    scenario = plan.to_scenario()
    options = Options(scenario=scenario, robots=plan.robots, pace="max", asked_limit=history.report["sim_time"])
    endpoint = Endpoint("127.0.0.1", 0).claim()
    said: list[str] = []
    with register_fleet("storm", endpoint) as entry:
        path = entry.home / "report.json"
        with Fleet(entry.home, said.append) as fleet:
            Processes(fleet, options, endpoint, entry.name, None, path, tape=entry.tape).start()
            ends = _until_over(fleet, stop)
        if path.exists():
            report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            return report, find_first_other_answer(entry.tape, history)
    return {"reason": "; ".join([*ends, *said]) or "stopped"}, None


def find_first_other_answer(tape: Path, history: History) -> Violation | None:
    """Return the first answer on a tape that is not that of a history; None: all are.

    Raises:
        ConfigError: the file is no tape.
    """
    replay = Replay(TapeFile(tape))
    for moment in history.moments:
        if (tick := replay.step()) is None:
            break
        for name, command, _ in tick.steps:
            for values in differences(moment.commands.get(name), command, "command"):
                text = f"over processes {name} answers otherwise: {values.text}"
                return Violation(REPLAY, moment.tick, (name,), text)
    found = replay.difference
    return found and Violation(REPLAY, found.tick, (found.robot,), f"the tape is not replayed: {found.text}")


def _until_over(fleet: Fleet, stop: Callable[[], bool]) -> list[str]:
    """Wait until the world has ended; return one line for each process that failed."""
    told: list[str] = []
    while not stop():
        ended: list[Ended] = fleet.watch()
        told += [f"{one.name} ended with status {one.status}: {one.last_lines}" for one in ended if one.status]
        if any(one.then is EarlyEnd.FINISH for one in ended):
            break
    return told
