"""The same plan over real processes in lockstep: the run must be the same, bit for bit."""

import json
from collections.abc import Callable
from typing import Any

from swarm.bus import Endpoint
from swarm.launch.options import Options
from swarm.launch.processes import Processes
from swarm.launch.running import registered
from swarm.launch.supervise.fleet import Ended, Fleet
from swarm.launch.supervise.table import EarlyEnd
from world.storm.history.history import record
from world.storm.laws.judge import judge
from world.storm.plans.draw import draw
from world.storm.plans.plan import StormPlan, only_simulated
from world.storm.results import Job, RunResult, compared, summed


def perform_both(job: Job, stop: Callable[[], bool]) -> RunResult:
    """Run a plan in one process and judge it, then over real processes, and compare the digests."""
    plan = draw(job.profile, job.seed) if job.plan is None else job.plan
    if why := only_simulated(plan):
        return RunResult(profile=job.profile, seed=job.seed, left_out=why)
    history = record(plan)
    result = summed(job, plan, history, judge(history))
    if history.crash:
        return result
    report = over_processes(plan, history.report["sim_time"], stop)
    how = "the run over processes" + ("" if "digest" in report else f" ended early ({report['reason']}) and")
    return compared(result, report.get("digest", "none"), how)


def over_processes(plan: StormPlan, limit: float, stop: Callable[[], bool]) -> dict[str, Any]:
    """Run a plan with a process for each robot, for ``limit`` [simulated s] at most, and return the world's report."""
    scenario = plan.to_scenario()
    options = Options(scenario=scenario, robots=plan.robots, pace="max", asked_limit=limit)
    endpoint = Endpoint("127.0.0.1", 0).claim()
    said: list[str] = []
    with registered("storm", endpoint) as entry:
        path = entry.home / "report.json"
        with Fleet(entry.home, said.append) as fleet:
            Processes(fleet, options, endpoint, entry.name, None, path).start()
            ends = _until_over(fleet, stop)
        if path.exists():
            report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            return report
    return {"reason": "; ".join([*ends, *said]) or "stopped"}


def _until_over(fleet: Fleet, stop: Callable[[], bool]) -> list[str]:
    """Wait until the world has ended; return one line for each process that failed."""
    told: list[str] = []
    while not stop():
        ended: list[Ended] = fleet.watch()
        told += [f"{one.name} ended with status {one.status}: {one.last_lines}" for one in ended if one.status]
        if any(one.then is EarlyEnd.FINISH for one in ended):
            break
    return told
