"""The laws every run must keep. Each is a function of its own from a recorded run to what broke it.

The judges here share nothing with the planner: they know cells, poses, and what was said aloud on the radio.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import combinations, pairwise
from math import floor, hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.planning.grid import Grid
from swarm.planning.path import plan
from swarm.robot.ground import EASE, RESOLUTION
from swarm.scenario.schema import Settings
from swarm.traffic.cells import FAR, OUTSIDE, CellMap
from swarm.traffic.cells_of import cells_of, comes_near
from world.faults import SILENT, Health
from world.storm.brute import can_all_arrive
from world.storm.history import History, Moment

PUSHED: Final = 100  # ticks after a contact in which a body may be where nothing was granted
NEAR: Final = 2.5  # cells; who is so near to a cell has to acknowledge a claim for it, if it was heard of late
LATELY: Final = 20  # ticks
AWAY: Final = 20  # ticks without a step, after which a robot begins its holds again
STANDS: Final = 90.0  # s of getting nowhere that must be named; the world itself names it sooner
RASTER: Final = 1.5  # m, side of the squares that this judge counts as somewhere new
EXACT: Final = 1e-6  # m and s


class Violation(NamedTuple):
    """A law that was broken."""

    law: str
    tick: int
    robots: tuple[str, ...]
    text: str


Found = Iterator[tuple[int, tuple[str, ...], str]]  # tick, robots, what happened
Law = Callable[[History], Found]


# ---- what the laws need to know of a run


def _held(history: History) -> bool:
    return history.settings.traffic.rule == "holds"


def _floor_at(history: History, tick: int) -> OccupancyMap:
    return next(known for since, known in reversed(history.floors) if since <= tick)


def _cells_at(history: History, tick: int) -> CellMap:
    return cells_of(_floor_at(history, tick), history.settings)


def _dead(history: History) -> set[str]:
    last = next((moment for moment in reversed(history.moments) if moment.health), None)
    return {name for name, health in last.health.items() if health is Health.DEAD} if last else set()


def _pushed(history: History) -> Mapping[int, list[int]]:
    """Return the ticks at which each robot was touched by something, by number."""
    found: dict[int, list[int]] = {}
    for tick, contact, _ in history.contacts:
        found.setdefault(contact.robot, []).append(tick)
    return found


def _was_pushed(pushed: Mapping[int, list[int]], number: int, tick: int) -> bool:
    return any(0 <= tick - at <= PUSHED for at in pushed.get(number, ()))


# ---- the laws


def no_exception(history: History) -> Found:
    """Check that the run came to its end."""
    if history.crash:
        yield len(history.moments), (), history.crash.strip().splitlines()[-1]


def no_contact(history: History) -> Found:
    """Check that nobody touched anything that it could have kept clear of by stopping.

    A robot that stood is not to blame; nor is one that a moving obstacle overtook.
    """
    for tick, contact, struck in history.contacts:
        if struck:
            continue
        name = history.robots[contact.robot]
        if contact.kind == "obstacle" and _mover_came(history, tick, contact.robot):
            continue
        other = f" {history.robots[contact.other]}" if contact.other is not None else ""
        yield tick, (name,), f"{name} touched {contact.kind}{other}"


def _mover_came(history: History, tick: int, number: int) -> bool:
    """Return True if a moving obstacle closed the gap faster than the robot did."""
    now, before = history.moments[min(tick, len(history.moments) - 1)], history.moments[max(0, tick - 2)]
    pose, was = now.poses[number], before.poses[number]
    for mover, mover_was in zip(now.movers, before.movers, strict=True):
        apart = distance(pose, mover)
        if apart > 3 * history.settings.robot.radius:
            continue
        ux, uy = (mover.x - pose.x) / apart, (mover.y - pose.y) / apart
        mine = (pose.x - was.x) * ux + (pose.y - was.y) * uy
        its = -((mover.x - mover_was.x) * ux + (mover.y - mover_was.y) * uy)
        return its >= mine - EXACT
    return False


def no_overlap(history: History) -> Found:
    """Check that no two robots hold one cell.

    A robot that is silent keeps its cells until a look has shown them empty, so a pair with one that has been silent
    is judged by bodies alone: neither may be in a cell that the other takes.
    """
    if not _held(history):
        return
    running: set[tuple[str, str]] = set()
    held: dict[str, frozenset[int]] = {}
    since: dict[str, int] = {}  # silent since, or back since
    for moment in history.moments:
        for name, health in moment.health.items():
            if health in SILENT:
                since[name] = moment.tick
        held |= {name: frozenset(command.held) - {OUTSIDE} for name, command in moment.commands.items()}
        now = set()
        for a, b in combinations(sorted(held), 2):
            shared = held[a] & held[b]
            if not shared:
                continue
            asleep = [name for name in (a, b) if moment.tick - since.get(name, -(10**9)) <= 200]
            if asleep and not _stands_in(history, moment, asleep, shared):
                continue
            now.add((a, b))
            if (a, b) not in running:
                yield moment.tick, (a, b), f"{a} and {b} hold cell {', '.join(map(str, sorted(shared)))}"
        running = now


def _stands_in(history: History, moment: Moment, names: Collection[str], shared: Collection[int]) -> bool:
    cells = _cells_at(history, moment.tick)
    radius = history.settings.robot.radius
    poses = (moment.poses[history.robots.index(name)] for name in names)
    return any(cell in shared for pose in poses for cell in cells.touched(pose.x, pose.y, radius - EXACT))


def no_hold_without_claim(history: History) -> Found:
    """Check that a robot's hold grows only by cells it has claimed aloud, and that all who are near have agreed.

    Whatever the event: an edit, a new map, a stop, a new goal. Excepted is a robot that just began or was away, one that
    drives unconstrained because nobody is in range, and one that was pushed.
    """
    if not _held(history):
        return
    pushed = _pushed(history)
    before: dict[str, tuple[int, frozenset[int], bool]] = {}  # tick, held, unconstrained
    claims: dict[str, dict[int, int]] = {}  # of the newest record: cell -> number
    acks: dict[str, set[tuple[str, int]]] = {}
    heard: dict[str, dict[str, int]] = {}
    for moment in history.moments:
        for name, sense in moment.senses.items():
            heard.setdefault(name, {}).update({sender: moment.tick for sender, _ in sense.hears})
        for name, command in moment.commands.items():
            held = frozenset(command.held) - {OUTSIDE}
            was = before.get(name)
            before[name] = moment.tick, held, command.unconstrained
            number = history.robots.index(name)
            if was is None or moment.tick - was[0] > AWAY or _is_back(history, moment, name):
                continue
            new = held - was[1]
            if not new or command.unconstrained or was[2] or _was_pushed(pushed, number, moment.tick):
                continue
            unclaimed = sorted(new - claims.get(name, {}).keys())
            if unclaimed:
                yield moment.tick, (name,), f"{name} holds cell {unclaimed[0]} that it has not claimed"
                continue
            for cell in sorted(new):
                for other in _must_agree(history, moment, name, cell, heard.get(name, {})):
                    if (name, claims[name][cell]) not in acks.get(other, ()):
                        yield moment.tick, (name, other), f"{name} took cell {cell}, {other} has not agreed"
        for name, broadcast in moment.spoken.items():
            if broadcast.traffic is not None:
                own = broadcast.traffic.own
                claims[name] = {claim.cell: claim.number for claim in own.claims}
                acks.setdefault(name, set()).update(own.acks)


def _is_back(history: History, moment: Moment, name: str) -> bool:
    """Return True in the first tick of a robot's new process."""
    index = moment.tick - history.moments[0].tick
    return index > 0 and history.moments[index - 1].health.get(name) in SILENT


def _must_agree(history: History, moment: Moment, me: str, cell: int, heard: Mapping[str, int]) -> list[str]:
    """List who is so near to a cell, and was heard by ``me`` itself so lately, that it has to agree."""
    cells = _cells_at(history, moment.tick)
    x, y = cells.centre(cell)
    late = LATELY - history.late
    return [
        name
        for name, pose in zip(history.robots, moment.poses, strict=True)
        if name != me
        and moment.tick - heard.get(name, -(10**9)) <= late
        and hypot(pose.x - x, pose.y - y) <= NEAR * cells.side
    ]


def no_body_outside(history: History) -> Found:
    """Check that each body is inside the cells that its robot holds."""
    if not _held(history):
        return
    pushed = _pushed(history)
    radius = history.settings.robot.radius
    held: dict[str, frozenset[int]] = {}
    outside: set[str] = set()
    for moment in history.moments[:-1]:
        held |= {name: frozenset(command.held) for name, command in moment.commands.items()}
        cells = _cells_at(history, moment.tick)
        for number, (name, pose) in enumerate(zip(history.robots, moment.poses, strict=True)):
            if name not in held:
                continue
            out = [cell for cell in cells.touched(pose.x, pose.y, radius - EXACT) if cell not in held[name]]
            if out and name not in outside and not _was_pushed(pushed, number, moment.tick):
                yield moment.tick, (name,), f"{name} is in cell {out[0]} that it does not hold"
            outside = outside | {name} if out else outside - {name}


def flags_stay(history: History) -> Found:
    """Check that a reached flag never goes back."""
    flags: dict[str, tuple[int, list[bool]]] = {}
    for moment in history.moments:
        for name, command in moment.commands.items():
            run, was = flags.get(name, (command.run, []))
            lost = [stop for stop, (a, b) in enumerate(zip(was, command.reached, strict=False)) if a and not b]
            if run == command.run and lost:
                yield moment.tick, (name,), f"{name} takes back that it reached stop {lost[0] + 1}"
            flags[name] = command.run, list(command.reached)


def all_arrive(history: History) -> Found:
    """Check that each robot that has a way past dead bodies has arrived, or that nobody could."""
    report, dead = history.report, _dead(history)
    if not report or report["complete"]:
        return
    ways = _Ways(history)
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
    if stuck and not ways.jammed():
        last = history.moments[-1].tick
        names = tuple(sorted({name for name, _ in stuck}))
        yield (
            last,
            names,
            "; ".join(f"{name} did not reach stop {stop + 1} though a way leads there" for name, stop in stuck),
        )


def truthful(history: History) -> Found:
    """Check that nothing is called unreachable or unsolvable that can be reached or solved."""
    report = history.report
    if not report:
        return
    ways = _Ways(history)
    for number, name in enumerate(history.robots):
        for stop in report["per_robot"][name]["unreachable"]:
            if ways.always_there(number, stop):
                yield history.moments[-1].tick, (name,), f"{name} gave up stop {stop + 1} though a way always led there"
    for moment in history.moments:
        for event in moment.events:
            if event.kind == "unsolvable" and ways.jammed(moment) is False:
                yield moment.tick, (), f"said: {event.text}; but a search finds a way"
                return


def nobody_stands_unnamed(history: History) -> Found:
    """Check that who got nowhere for long with stops left is counted and named."""
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
            square = floor(pose.x / RASTER + 0.5), floor(pose.y / RASTER + 0.5)
            if under_way.get(name, -1) != stop:
                seen[name] = set()
            if stop is None or square not in seen[name]:
                seen[name].add(square)
                under_way[name], since[name] = stop, moment.tick
            elif (moment.tick - since[name]) * history.dt > STANDS and name not in blamed:
                if not any(robot == name and since[name] <= tick <= moment.tick for robot, tick in named):
                    blamed.add(name)
                    yield moment.tick, (name,), f"{name} has got nowhere for {STANDS:g} s and nothing says so"
    for name in history.robots:
        counted = history.report["per_robot"][name]["stalled"]
        if counted != sum(robot == name for robot, _ in named):
            yield history.moments[-1].tick, (name,), f"the report counts {counted} stalls of {name}, the events do not"


def report_agrees(history: History) -> Found:
    """Check the report against the poses."""
    report, settings = history.report, history.settings
    if not report:
        return
    last = history.moments[-1].tick

    def differs(what: str, said: float, seen: float, tolerance: float = EXACT) -> Found:
        if abs(said - seen) > tolerance:
            yield last, (), f"the report says {what} {said:g}, the poses say {seen:g}"

    yield from differs("sim_time", report["sim_time"], last * history.dt)
    yield from differs("ticks", report["ticks"], last)
    complete = all(time is not None for row in report["per_robot"].values() for time in row["reached"])
    yield from differs("complete", report["complete"], complete)
    if not complete and not report["reason"]:
        yield last, (), "the report is not complete and does not say why"
    for number, name in enumerate(history.robots):
        row = report["per_robot"][name]
        track = [moment.poses[number] for moment in history.moments]
        driven = sum(distance(a, b) for a, b in pairwise(track))
        yield from differs(f"path_length of {name}", row["path_length"], driven, 1e-6 * max(1.0, driven))
        for stop, time in enumerate(row["reached"]):
            if time is None:
                continue
            away = distance(track[round(time / history.dt)], history.stops[number][stop])
            slack = (2 + history.late) * 4.0 * settings.robot.speed_scale * history.dt
            if away > settings.reach + slack:
                yield last, (name,), f"the report says {name} reached stop {stop + 1}, it was {away:.2f} m away"
    gap = min((_gap(moment, settings.robot.radius) for moment in history.moments), default=1.0)
    if len(history.robots) > 1 and report["clearance_min"] > gap + EXACT:
        yield last, (), f"the report says clearance_min {report['clearance_min']:g}, two robots were {gap:g} m apart"
    if gap < -1e-3 and not report["contacts"]["robot"]:
        yield last, (), "two bodies overlap and the report has no contact"


def _gap(moment: Moment, radius: float) -> float:
    return min((distance(a, b) for a, b in combinations(moment.poses, 2)), default=1e9) - 2 * radius


LAWS: Final[Mapping[str, Law]] = {
    "no exception": no_exception,
    "no contact": no_contact,
    "no overlap": no_overlap,
    "no hold without a claim": no_hold_without_claim,
    "no body outside": no_body_outside,
    "flags stay": flags_stay,
    "all arrive": all_arrive,
    "truthful": truthful,
    "nobody stands unnamed": nobody_stands_unnamed,
    "the report agrees": report_agrees,
}


def judge(history: History) -> list[Violation]:
    """Hold every law against a run; return the first breach of each law by each robot."""
    found = []
    for law, function in LAWS.items():
        blamed = set()
        for tick, robots, text in function(history):
            if robots not in blamed:
                blamed.add(robots)
                found.append(Violation(law, tick, robots, text))
    return found


class _Ways:
    """Which stops can be reached past the dead bodies of a run, and whether the rest is jammed for good."""

    def __init__(self, history: History) -> None:
        self._history = history
        self._last = history.moments[-1]
        self._dead = _dead(history)
        self._jams: dict[int, bool | None] = {}

    def leads(self, number: int, stop: int) -> bool:
        """Return True if cells without a dead body lead a robot from where it ended to a stop."""
        cells = _cells_at(self._history, self._last.tick)
        goals = self._goals(cells, number, stop)
        return bool(goals & self._reach(cells, self._last.poses[number], self._bodies(cells, number)))

    def always_there(self, number: int, stop: int) -> bool:
        """Return True if a way from the robot's place to a stop was there on each floor of the run, bodies left out.

        On an unknown floor the map alone counts, not the lattice.
        """
        history = self._history
        here = self._last.poses[number]
        point = history.stops[number][stop]
        if not _held(history):
            return all(_path_leads(known, history.settings, here, point) for _, known in history.floors)
        for _, known in history.floors:
            cells = cells_of(known, history.settings)
            if not comes_near(cells, (here.x, here.y), point, history.settings):
                return False
        return True

    def jammed(self, moment: Moment | None = None) -> bool | None:
        """Return True if the robots that live cannot all reach what is left to them; None where that is not known."""
        moment = moment or self._last
        if moment.tick not in self._jams:
            self._jams[moment.tick] = self._search(moment)
        return self._jams[moment.tick]

    def _search(self, moment: Moment) -> bool | None:
        history = self._history
        cells = _cells_at(history, moment.tick)
        blocked = self._bodies(cells, -1)
        starts: list[int] = []
        stops: list[list[frozenset[int]]] = []
        time = moment.tick * history.dt
        for number, name in enumerate(history.robots):
            if name in self._dead:
                continue
            row = history.report["per_robot"][name]
            pose = moment.poses[number]
            start = cells.cell_of(pose.x, pose.y)
            if start in starts or start in blocked or start == OUTSIDE:
                return None
            starts.append(start)
            left = [
                stop
                for stop, at in enumerate(row["reached"])
                if (at is None or at > time) and stop not in row["unreachable"]
            ]
            stops.append([self._goals(cells, number, stop) for stop in left])
        neighbours = [tuple(other for other in near if other not in blocked) for near in cells.neighbours]
        for pair in combinations(range(len(starts)), 2):
            alone = can_all_arrive(neighbours, [starts[i] for i in pair], [stops[i] for i in pair])
            if alone is False:
                return True
        found = can_all_arrive(neighbours, starts, stops)
        return None if found is None else not found

    def _bodies(self, cells: CellMap, but: int) -> frozenset[int]:
        """List the cells that dead bodies are in."""
        radius = self._history.settings.robot.radius
        return frozenset(
            cell
            for number, (name, pose) in enumerate(zip(self._history.robots, self._last.poses, strict=True))
            if name in self._dead and number != but
            for cell in cells.touched(pose.x, pose.y, radius)
        )

    def _reach(self, cells: CellMap, pose: Pose, blocked: frozenset[int]) -> frozenset[int]:
        under = [
            cell
            for cell in cells.touched(pose.x, pose.y, self._history.settings.robot.radius)
            if cell != OUTSIDE and cells.stands[cell] and cell not in blocked
        ]
        return frozenset(
            cell for start in under for cell, steps in enumerate(cells.distances(start, blocked)) if steps < FAR
        )

    def _goals(self, cells: CellMap, number: int, stop: int) -> frozenset[int]:
        """List the cells in which a stop counts as reached."""
        point = self._history.stops[number][stop]
        cell = cells.cell_of(*point)
        return frozenset({cell} if cell != OUTSIDE and cells.stands[cell] else ())


def _path_leads(known: OccupancyMap, settings: Settings, here: Pose, there: Point) -> bool:
    """Return True if a path on a floor, known whole, leads a robot's footprint from one place to another."""
    grid = Grid.grown(known, settings.robot.radius, EASE * settings.robot.distance_scale, RESOLUTION)
    return plan(grid, (here.x, here.y), there) is not None
