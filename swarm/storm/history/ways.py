"""The search for stops that the robots of a recorded run could still reach, past dead robots and past each other."""

from itertools import combinations

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.storm.free_space import room
from swarm.storm.history.brute import can_all_arrive
from swarm.storm.history.disc_search import can_all_arrive_on_drawing
from swarm.storm.history.history import History, Moment
from swarm.storm.history.run_facts import cells_at, cells_swept, dead_of, floor_at
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.placement import cells_of, comes_near


class Ways:
    """The stops that can be reached past the dead robots of a run, and whether the living are jammed for good."""

    def __init__(self, history: History) -> None:
        self._history = history
        self._last = history.moments[-1]
        self._dead = dead_of(history)
        self._jams: dict[int, bool | None] = {}

    def leads(self, number: int, stop: int) -> bool:
        """Return True if cells without a dead robot lead from a robot's last pose to a stop of the scenario."""
        return self.leads_to(number, self._history.stops[number][stop])

    def leads_to(self, number: int, place: Point) -> bool:
        """Return True if cells without a dead robot lead from a robot's last pose to a place [m].

        Beside dead robots, cells that a moving obstacle sweeps count as no way: if the dead leave only those, the
        obstacle may shut them for good, to and fro. Where nobody is dead, no world is drawn in which it cuts floor off.
        """
        if self._history.is_drawn:
            return self._leads_over_drawing(number, place)
        cells = cells_at(self._history, self._last.tick, number)
        bodies, goals = self._bodies(cells, number), self._standing(cells, place)
        swept = cells_swept(self._history, cells, number) if bodies else frozenset()
        return bool(goals & self._reach(cells, number, bodies, swept))

    def always_there(self, number: int, stop: int) -> bool:
        """Return True if cells lead from a robot's last pose to a stop on each floor of the run, without bodies."""
        history = self._history
        here = self._last.poses[number]
        point = history.stops[number][stop]
        for _, known in history.floors:
            own = history.settings_of(number)
            if not comes_near(cells_of(known, own), (here.x, here.y), point, own):
                return False
        return True

    def are_jammed(self, moment: Moment | None = None) -> bool | None:
        """Return True if the living robots cannot all reach their stops that are left, None if that is not known.

        Of robots unlike each other it is asked as if all were as narrow as the narrowest: then it is surely so.
        """
        moment = moment or self._last
        if moment.tick not in self._jams:
            self._jams[moment.tick] = self._search(moment)
        return self._jams[moment.tick]

    def can_visit(self, number: int, place: Point) -> bool | None:
        """Return True if a robot can get to a place [m] at the end while the living make room, None if not known."""
        cells = cells_at(self._history, self._last.tick, self._narrowest)
        blocked = self._bodies(cells, -1)
        living = [one for one, name in enumerate(self._history.robots) if name not in self._dead]
        starts = [cells.cell_of(*self._last.poses[one][:2]) for one in living]
        if len(set(starts)) < len(starts) or not blocked.isdisjoint(starts) or OUTSIDE in starts:
            return None
        goals = self._standing(cells, place)
        return can_all_arrive(
            _without_blocked(blocked, cells), starts, [[goals] if one == number else [] for one in living]
        )

    @property
    def _narrowest(self) -> int:
        """The number of a robot that no living one is narrower than."""
        history = self._history
        living = [number for number, name in enumerate(history.robots) if name not in self._dead]
        return min(living, key=lambda number: history.body(number).radius, default=0)

    def _leads_over_drawing(self, number: int, place: Point) -> bool:
        """Return True if a body can be moved from a robot's last pose to within its reach of a place [m]."""
        settings, here = self._history.settings, self._last.poses[number][:2]
        reached = room(floor_at(self._history, self._last.tick), self._history.body(number).radius, here)
        return any(distance(point, place) <= settings.reach for point in reached)

    def _search_drawing(self, moment: Moment) -> bool | None:
        history, time = self._history, moment.tick * self._history.dt
        living = [number for number, name in enumerate(history.robots) if name not in self._dead]
        reached = [history.report["per_robot"][history.robots[number]]["reached"] for number in living]
        stops = [
            [history.stops[number][stop] for stop, at in enumerate(row) if at is None or at > time]
            for number, row in zip(living, reached, strict=True)
        ]
        starts = [moment.poses[number][:2] for number in living]
        settings = history.settings
        radius = history.body(self._narrowest).radius
        found = can_all_arrive_on_drawing(floor_at(history, moment.tick), radius, starts, stops, settings.reach)
        return None if found is None else not found

    def _search(self, moment: Moment) -> bool | None:
        history = self._history
        if history.is_drawn:
            return self._search_drawing(moment)
        cells = cells_at(history, moment.tick, self._narrowest)
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
            stops.append([self._standing(cells, history.stops[number][stop]) for stop in left])
        neighbours = _without_blocked(blocked, cells)
        for pair in combinations(range(len(starts)), 2):
            alone = can_all_arrive(neighbours, [starts[i] for i in pair], [stops[i] for i in pair])
            if alone is False:
                return True
        for robot, row in enumerate(stops):  # easier: the others only make room, and it does not matter who is who
            alone = can_all_arrive(neighbours, starts, [row if other == robot else [] for other in range(len(starts))])
            if alone is False:
                return True
        found = can_all_arrive(neighbours, starts, stops)
        return None if found is None else not found

    def _bodies(self, cells: CellMap, but: int) -> frozenset[int]:
        """Return the cells that dead robots are in, without those of robot number ``but``."""
        return frozenset(
            cell
            for number, (name, pose) in enumerate(zip(self._history.robots, self._last.poses, strict=True))
            if name in self._dead and number != but
            for cell in cells.cells_under_disc(pose.x, pose.y, self._history.body(number).radius)
        )

    def _reach(self, cells: CellMap, number: int, blocked: frozenset[int], swept: frozenset[int]) -> frozenset[int]:
        pose, radius = self._last.poses[number], self._history.body(number).radius
        under = [
            cell
            for cell in cells.cells_under_disc(pose.x, pose.y, radius)
            if cell != OUTSIDE and cells.stands[cell] and cell not in blocked
        ]
        shut = blocked | swept.difference(under)
        return frozenset(
            cell for start in under for cell, steps in enumerate(cells.distances(start, shut)) if steps < FAR
        )

    def _standing(self, cells: CellMap, place: Point) -> frozenset[int]:
        """List the cells in which a stop at a place [m] counts as reached."""
        cell = cells.cell_of(*place)
        return frozenset({cell} if cell != OUTSIDE and cells.stands[cell] else ())


def _without_blocked(blocked: frozenset[int], cells: CellMap) -> list[tuple[int, ...]]:
    """Return the neighbours of each cell, without those that are blocked."""
    return [tuple(other for other in near if other not in blocked) for near in cells.neighbours]
