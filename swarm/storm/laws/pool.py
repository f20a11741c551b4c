"""The law of the pool: each target is visited once, by the robot that was sent there, and none is lost."""

import re
from collections.abc import Mapping
from typing import Final

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.storm.history.history import History
from swarm.storm.history.run_facts import Found, dead_of
from swarm.storm.history.ways import Ways
from world.tasks.dispatcher import GONE

NAMED: Final = re.compile(r"(?:takes |is at )?pool target (\S+)")
LATER: Final = 1.0  # s after which an errand must be back


def pool_is_kept(history: History) -> Found:
    """Check that each target has one robot at a time, counts only when that is there, and comes back if it is lost."""
    settings = history.settings
    at = {f"scenario/{number}": target for number, target in enumerate(settings.pool, start=1)}
    has: dict[str, str] = {}  # errand -> robot
    done: set[str] = set()
    heard: dict[str, int] = {}  # robot -> tick of its newest command
    gone = round((GONE + LATER) * settings.rate)
    for moment, after in zip(history.moments, history.moments[1:], strict=False):
        heard |= {name: command.tick for name, command in moment.commands.items()}
        for event in moment.events:
            found = NAMED.match(event.text)
            if found is None or event.kind not in {"errand", "errand_back", "reached"} or event.robot is None:
                continue
            errand, robot = found[1], event.robot
            if event.kind == "errand_back":
                has.pop(errand, None)
                continue
            if errand in done:
                yield moment.tick, (robot,), f"{robot}: errand {errand} was done before"
            if event.kind == "errand":
                if errand in has:
                    yield moment.tick, (robot,), f"{robot} gets errand {errand}, which {has[errand]} has"
                has[errand] = robot
                continue
            number = history.robots.index(robot)
            away = min(distance(poses[number], at[errand]) for poses in (moment.poses, after.poses))
            if has.pop(errand, None) != robot or away > settings.reach:
                yield (
                    moment.tick,
                    (robot,),
                    f"{robot} counts as at errand {errand}, {away:.2f} m away or not sent there",
                )
            done.add(errand)
        for errand, robot in has.items():
            if moment.tick - heard.get(robot, 0) > gone:
                yield moment.tick, (robot,), f"{robot} is gone and still has errand {errand}"
    yield from _at_the_end(history, at, done, busy=set(has.values()))


def _at_the_end(history: History, at: Mapping[str, Point], done: set[str], busy: set[str]) -> Found:
    """Check that each errand is done or left, and that none is left that a living robot could have visited.

    A robot with stops of its own serves the pool only after them: one that cannot get there could visit no errand.
    Robots in ``busy`` have errands.
    """
    given = set(at)
    tick = history.moments[-1].tick if history.moments else 0
    pool = history.report.get("pool", {"done": 0, "left": []})
    left = {one["errand"] for one in pool["left"]}
    if history.report and (left & done or left | done != given or pool["done"] != len(done)):
        yield tick, (), f"of {sorted(given)} the report says {pool['done']} are done and {sorted(left)} are left"
    dead, ways = dead_of(history), Ways(history)
    serving = [number for number, name in enumerate(history.robots) if name not in dead and _serves(history, name)]
    willing = [
        number
        for number in serving
        if not left
        or history.robots[number] in busy
        or all(ways.leads_to(number, stop) for stop in _own_left(history, number))
    ]
    for errand in sorted(left):
        able = {history.robots[number]: ways.can_visit(number, at[errand]) for number in willing}
        if could := [name for name, can in able.items() if can or (can is None and not dead)]:
            yield tick, (), f"errand {errand} is left in the pool, although {', '.join(could)} could have visited it"


def _own_left(history: History, number: int) -> list[Point]:
    """List the stops [m] that a robot has at the end and has neither reached nor given up."""
    name = history.robots[number]
    row, stops = history.report["per_robot"][name], history.stops[number]
    for moment in reversed(history.moments):
        sense = moment.senses.get(name)
        if sense is not None and sense.assigned is not None:
            stops = tuple(sense.assigned.stops)
            break
    return [
        at
        for stop, (at, time) in enumerate(zip(stops, row["reached"], strict=False))
        if time is None and stop not in row["unreachable"]
    ]


def _serves(history: History, robot: str) -> bool:
    """Return True if a robot takes errands at the end, by the requests of the scenario."""
    until = history.moments[-1].tick * history.dt
    asked = sorted((one for one in history.settings.orders if one.robot == robot), key=lambda one: one.at)
    does = [one.do or "order" for one in asked if one.at <= until]
    last = [do for do in does if do not in {"stop", "go_on"}][-1:]
    held = [do for do in does if do in {"stop", "go_on"}][-1:]
    return last not in (["home"], ["cancel"]) and held != ["stop"]
