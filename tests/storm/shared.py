"""A short real run in which tests plant faults, and functions that change its history."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import msgspec

from swarm.messages import Broadcast, Command
from swarm.scenario.load import check_values
from swarm.storm.history.history import History, Moment, record
from swarm.storm.plans.plan import StormPlan

FLOOR = """\
###########################
###########################
###########################
###.....................###
###.....................###
###.....................###
###.....................###
###.....................###
###.....................###
###########################
###########################
###########################
"""  # 7 by 2 cells of 1.2 m


def plan_of(**fields: object) -> StormPlan:
    """Make a plan in which two robots change sides; ``fields`` are those of the scenario."""
    raw: dict[str, Any] = {
        "name": "two",
        "map": {"text": FLOOR, "cell": 0.4},
        "robots": 2,
        "limit": 3600.0,
        "return_home": False,
        "start": {"poses": [[1.8, 1.8, 0.0], [9.0, 3.0, 3.0]]},
        "own_targets": [[[9.0, 1.8]], [[1.8, 3.0]]],
        "traffic": {"cell": 1.2, "offset": [0.0, 0.0]},
    }
    faults: dict[str, object] = {
        name: fields.pop(name) for name in ("faults", "late", "slow", "kill_leader_at") if name in fields
    }
    settings = check_values(raw | fields, "test")
    plan = {"profile": "test", "seed": 1, "scenario": msgspec.to_builtins(settings)} | faults
    return msgspec.convert(plan, StormPlan)


@cache
def short_run() -> History:
    """Run it once for all tests; nobody may change it in place."""
    return record(plan_of())


def with_moments(history: History, change: Callable[[Moment], Moment]) -> History:
    """Return the same history with each moment changed."""
    return replace(history, moments=[change(moment) for moment in history.moments])


def with_commands(history: History, change: Callable[[int, str, Command], Command]) -> History:
    """Return the same history with each command changed: of a tick, of a robot."""
    return with_moments(
        history,
        lambda moment: moment._replace(
            commands={name: change(moment.tick, name, command) for name, command in moment.commands.items()}
        ),
    )


def with_words(history: History, change: Callable[[str, Broadcast], Broadcast]) -> History:
    """Return the same history with each broadcast changed."""
    return with_moments(
        history,
        lambda moment: moment._replace(spoken={name: change(name, words) for name, words in moment.spoken.items()}),
    )


def with_report(history: History, robot: str | None = None, **fields: object) -> History:
    """Return the same history with fields of its report changed, or of one robot's row."""
    report = history.report
    if robot is None:
        return replace(history, report=report | fields)
    rows = report["per_robot"]
    return replace(history, report=report | {"per_robot": rows | {robot: rows[robot] | fields}})
