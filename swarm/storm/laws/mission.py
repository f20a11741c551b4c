"""The laws of the mission: robots arrive, a robot that does not arrive is named, and the report is right."""

from collections.abc import Sequence
from itertools import chain, combinations, pairwise
from math import floor
from typing import Final

from swarm.geometry import distance
from swarm.storm.free_space import SPARE, room
from swarm.storm.history.history import History, Moment
from swarm.storm.history.run_facts import EXACT, Found, cells_at, dead_of, floor_at
from swarm.storm.history.ways import Ways
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.lattice.distances import FAR

STANDS: Final = 90.0  # s without progress after which a robot must be named; the world names it earlier
ENDS: Final = 90.0  # s after the last stop; a robot that is done and was sent away stays where it is after 60 s
NO_WAY: Final = "no way exists"  # what is said of the floor itself; of cells that leave floor out, it is "no plan"
RASTER: Final = 1.0  # m, side of the squares that count as progress: as in the world, recomputed here from the poses


def no_exception(history: History) -> Found:
    """Check that no exception ended the run."""
    if history.crash:
        yield len(history.moments), (), history.crash.strip().splitlines()[-1]


def flags_stay(history: History) -> Found:
    """Check that a stop once reached stays reached, but for home, if the robot takes up a stop that it gave up."""
    flags: dict[str, tuple[int, list[bool], list[int]]] = {}
    for moment in history.moments:
        for name, command in moment.commands.items():
            run, was, given_up = flags.get(name, (command.run, [], []))
            if run == command.run and was == command.reached and given_up == command.unreachable:
                continue
            lost = [stop for stop, (a, b) in enumerate(zip(was, command.reached, strict=False)) if a and not b]
            taken_up = set(given_up).difference(command.unreachable)
            if run == command.run and lost and not (taken_up and lost == [len(was) - 1]):
                yield moment.tick, (name,), f"{name} takes back that it reached target {lost[0] + 1}"
            flags[name] = command.run, command.reached, command.unreachable


def all_arrive(history: History) -> Found:
    """Check that each robot with a way past dead robots has arrived, or that the robots are jammed for good.

    The ways are those of the lattice. That no way exists at all may be said only if it holds for the drawing too.
    """
    report, dead = history.report, dead_of(history)
    if not report or report["complete"]:
        return
    ways = Ways(history)
    yield from _robots_denied(history)
    stuck = []
    for number, name in enumerate(history.robots):
        given_up = report["per_robot"][name]["unreachable"]
        for stop, time in enumerate(report["per_robot"][name]["reached"]):
            if name in dead or time is not None:
                continue
            if stop in given_up and not ways.always_there(number, stop):
                continue
            if ways.leads(number, stop):
                stuck.append((name, stop))
            break
    if stuck and not ways.are_jammed():
        last = history.moments[-1].tick
        names = tuple(sorted({name for name, _ in stuck}))
        yield (
            last,
            names,
            "; ".join(f"{name} did not reach target {stop + 1} although a way leads there" for name, stop in stuck),
        )


def _robots_denied(history: History) -> Found:
    """Yield who is said to have no way at all while cells do not lead to all floor that the drawing leads to."""
    for moment in history.moments:
        said = {
            word for event in moment.events if NO_WAY in event.text for word in event.text.replace(",", " ").split()
        }
        for name in said.intersection(history.robots):
            number = history.robots.index(name)
            radius = history.body(number).radius + SPARE
            pose, cells = moment.poses[number], cells_at(history, moment.tick, number)
            start = cells.cell_of(pose.x, pose.y)
            steps = cells.distances(start) if start != OUTSIDE else ()
            for x, y in room(floor_at(history, moment.tick), radius, (pose.x, pose.y)):
                cell = cells.cell_of(x, y)
                if not steps or cell == OUTSIDE or steps[cell] >= FAR:
                    text = (
                        f"it is said that no way exists for {name}, but a way leads to ({x:.2f}, {y:.2f}), and no cells"
                    )
                    yield moment.tick, (name,), text
                    break


def it_ends(history: History) -> Found:
    """Check that the mission ends soon after the last stop is reached: a robot that is done stops out of the way."""
    report = history.report
    if not report or not report["complete"]:
        return
    last = max(time for row in report["per_robot"].values() for time in row["reached"])
    over = history.moments[-1].tick * history.dt
    if over - last > ENDS:
        yield history.moments[-1].tick, (), f"all arrived within {last:.0f} s, but the mission went on to {over:.0f} s"


def truthful(history: History) -> Found:
    """Check that a stop called unreachable cannot be reached, and that a jam called unsolvable cannot be solved."""
    report = history.report
    if not report:
        return
    ways = Ways(history)
    for number, name in enumerate(history.robots):
        for stop in report["per_robot"][name]["unreachable"]:
            if ways.always_there(number, stop):
                yield history.moments[-1].tick, (name,), f"{name} gave up target {stop + 1} that always had a way"
    for moment in history.moments:
        for event in moment.events:
            if event.kind == "unsolvable" and ways.are_jammed(moment) is False:
                yield moment.tick, (), f"event: {event.text}; but a search finds a solution"
                return


def nobody_stands_unnamed(history: History) -> Found:
    """Check that a robot that makes no progress for long with stops left is counted and named."""
    if not history.report:
        return
    named = {
        (event.robot, event.tick) for moment in history.moments for event in moment.events if event.kind == "stalled"
    }
    seen: dict[str, set[tuple[int, int]]] = {name: set() for name in history.robots}
    since: dict[str, int] = dict.fromkeys(history.robots, 0)
    under_way: dict[str, int | None] = {}
    blamed: set[str] = set()
    reached = {name: history.report["per_robot"][name]["reached"] for name in history.robots}
    given_up: dict[str, list[int]] = {name: [] for name in history.robots}
    for moment in history.moments:
        for name, command in moment.commands.items():
            given_up[name] = command.unreachable
        time = moment.tick * history.dt
        for name, pose in zip(history.robots, moment.poses, strict=True):
            left = [
                stop
                for stop, at in enumerate(reached[name])
                if (at is None or at > time) and stop not in given_up[name]
            ]
            stop = left[0] if left else None
            square = floor(pose.x / RASTER), floor(pose.y / RASTER)
            if under_way.get(name, -1) != stop:
                seen[name] = set()
            if stop is None or square not in seen[name]:
                seen[name].add(square)
                under_way[name], since[name] = stop, moment.tick
                continue
            if (moment.tick - since[name]) * history.dt <= STANDS or name in blamed:
                continue
            if not any(robot == name and since[name] <= tick <= moment.tick for robot, tick in named):
                blamed.add(name)
                yield moment.tick, (name,), f"{name} has made no progress for {STANDS:g} s and no event says so"
    last, dead = history.moments[-1].tick, dead_of(history)
    behind = tuple(name for name in history.robots if under_way.get(name) is not None and name not in dead)
    stand = behind and all((last - since[name]) * history.dt > STANDS for name in behind)
    if stand and not _is_stopped_at_end(history) and not history.report["traffic"]["deadlocks"]:
        yield last, behind, f"nobody has made progress for {STANDS:g} s, and the report counts no deadlock"
    for name in history.robots:
        counted = history.report["per_robot"][name]["stalled"]
        if counted != sum(robot == name for robot, _ in named):
            yield history.moments[-1].tick, (name,), f"the report counts {counted} stalls of {name}, the events do not"


def _is_stopped_at_end(history: History) -> bool:
    """Return True if somebody is told to stop at the end: others may wait for that robot."""
    last = next((moment for moment in reversed(history.moments) if moment.senses), None)
    return last is not None and any(sense.stopped for sense in last.senses.values())


def report_agrees(history: History) -> Found:
    """Check that the report agrees with the poses."""
    report, settings = history.report, history.settings
    if not report:
        return
    last = history.moments[-1].tick

    def differs(what: str, said: float, seen: float, tolerance: float = EXACT) -> Found:
        if abs(said - seen) > tolerance:
            yield last, (), f"the report says {what} {said:g}, the poses say {seen:g}"

    yield from differs("sim_time", report["sim_time"], last * history.dt)
    yield from differs("ticks", report["ticks"], last)
    complete = not _is_cancelled(history) and all(
        time is not None for row in report["per_robot"].values() for time in row["reached"]
    )
    yield from differs("complete", report["complete"], complete)
    if not complete and not report["reason"]:
        yield last, (), "the report is not complete and does not say why"
    for number, name in enumerate(history.robots):
        row = report["per_robot"][name]
        track = [moment.poses[number] for moment in history.moments]
        driven = sum(distance(a, b) for a, b in pairwise(track) if a != b)
        yield from differs(f"path_length of {name}", row["path_length"], driven, 1e-6 * max(1.0, driven))
        for stop, time in enumerate(row["reached"]):
            if time is None:
                continue
            away = distance(track[round(time / history.dt)], history.stops[number][stop])
            slack = (2 + history.late) * history.body(number).top_speed * history.dt
            if away > settings.reach + slack:
                yield last, (name,), f"the report says {name} reached target {stop + 1}, it was {away:.2f} m away"
    arrivals = [time for row in report["per_robot"].values() for time in row["reached"] if time is not None]
    over = last * history.dt - max(arrivals) if complete and arrivals else 0.0
    yield from differs("settling", report["traffic"]["settling"], over)
    radii = [body.radius for body in history.bodies]
    gap = min((_gap(moment, radii) for moment in history.moments), default=1.0)
    if len(history.robots) > 1 and report["clearance_min"] > gap + EXACT:
        yield last, (), f"the report says clearance_min {report['clearance_min']:g}, two robots were {gap:g} m apart"
    if gap < -1e-3 and not report["contacts"]["robot"]:
        yield last, (), "two bodies overlap and the report has no contact"


def _is_cancelled(history: History) -> bool:
    """Return True if some robot's targets were cancelled, by the events, and no order came after that."""
    dropped: dict[str | None, bool] = {}
    for event in chain.from_iterable(moment.events for moment in history.moments):
        by_cancel = event.kind == "cancelled" and "cancelled by no targets" in event.text
        if event.kind == "order" or (by_cancel and not event.text.startswith("pool target")):
            dropped[event.robot] = by_cancel
    return any(dropped.values())


def _gap(moment: Moment, radii: Sequence[float]) -> float:
    pairs = combinations(zip(moment.poses, radii, strict=True), 2)
    return min((distance(a, b) - one - other for (a, one), (b, other) in pairs), default=1e9)
