"""Places for robots that come while a fleet runs: the book of requests, and where a body may be put.

The book outlives a restart: the places stay open. A spot is put to the same questions as a start of the scenario, and
is refused where a robot drives that could not stop before it, or holds the cells under it.
"""

from collections.abc import Collection, Iterator, Sequence
from math import hypot
from typing import Final, NamedTuple

import numpy as np
from msgspec import Struct

from swarm.errors import PeerError
from swarm.geometry import Pose, distance, wrap
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Places
from swarm.messages.short_ids import find_long_id
from swarm.robot.tuning import SAFETY
from swarm.scenario.check import explain_not_free
from swarm.settings import MOST_ROBOTS, RobotSettings, Settings
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.lattice.placement import cells_of, traffic_settings
from world.bodies.edits import can_stop_before

MOST_AT_ONCE: Final = 64  # places in one request; the world looks for them between two ticks
REMEMBERED: Final = 64  # requests; a retry that comes later than so many others counts as new
CLEAR: Final = 0.05  # m, beside the footprint, to walls: as far as robots may stray


class Opened(Struct, kw_only=True, forbid_unknown_fields=True):
    """A request that was carried out."""

    count: int
    kind: str
    at: list[tuple[float, float, float]]
    robots: list[str]

    @property
    def text(self) -> str:
        """The answer to who asked."""
        return f"{', '.join(self.robots)}: the {'places are' if len(self.robots) > 1 else 'place is'} open"


class Book(Struct, kw_only=True, forbid_unknown_fields=True):
    """All places that were opened, in order, and the last requests by their ids."""

    starts: list[Pose]
    kinds: list[str]  # of the robots that start there
    requests: dict[str, Opened]

    def known_request(self, request: Places) -> Opened | None:
        """Return the request that was carried out under this id, if it is the same.

        Raises:
            PeerError: it was another one.
        """
        opened = self.requests.get(find_long_id(request.id, self.requests))
        asked = request.count, request.kind, list(request.at)
        if opened is not None and (opened.count, opened.kind, opened.at) != asked:
            raise PeerError(
                f"places {request.id}: expected what was accepted with it, got another request; use a new id"
            )
        return opened

    def enter(self, request: Places, starts: Sequence[Pose], robots: Sequence[str]) -> Opened:
        """Record places that were opened."""
        self.starts += starts
        self.kinds += [request.kind] * len(starts)
        opened = Opened(count=request.count, kind=request.kind, at=list(request.at), robots=list(robots))
        self.requests[request.id] = opened
        if len(self.requests) > REMEMBERED:
            del self.requests[next(iter(self.requests))]
        return self.requests[request.id]


class Occupant(NamedTuple):
    """One robot, as far as it matters to a body that is put beside it."""

    name: str
    pose: Pose
    wheels: tuple[float, float]  # m/s
    held: Collection[int]  # cells
    body: RobotSettings


class Spots:
    """The free floor at one moment."""

    def __init__(
        self, settings: Settings, floor: OccupancyMap, occupants: Sequence[Occupant],
        movers: Sequence[Pose], homes: Sequence[tuple[Point, float]], wanted: Sequence[Point],
    ) -> None:  # fmt: skip
        """Look at the floor for new robots, whose ``settings`` these are.

        A restart puts bodies back to their ``homes``, place and radius [m]: no other body may be put there. ``wanted``
        are places [m] that robots are to visit: they are the last to be chosen.
        """
        self._settings, self._floor = settings, floor
        self._cells = cells = cells_of(floor, settings)
        self._occupants = list(occupants)
        outlines = (mover.radius or hypot(*(mover.size or (0.0, 0.0))) / 2 for mover in settings.movers)
        self._movers = list(zip(movers, outlines, strict=True))
        self._homes = homes
        self._wanted = {cells.cell_of(*place) for place in [*(home for home, _ in homes), *wanted]}
        self._enough = traffic_settings(settings).claim_radius + cells.side  # m to other bodies; more is no better

    def starts(self, request: Places, robots: int) -> list[Pose]:
        """Return where the bodies of a request are put; the fleet has ``robots`` now.

        Raises:
            PeerError: the request is refused: there are too many, or a spot is not free.
        """
        where = f"places {request.id}"
        if not 1 <= request.count <= MOST_AT_ONCE or request.count < len(request.at):
            raise PeerError(
                f"{where}: expected 1 to {MOST_AT_ONCE} places, and no more starts than places, got {request.count} "
                f"with {len(request.at)} starts; ask again for more"
            )
        if robots + request.count > MOST_ROBOTS:
            raise PeerError(
                f"{where}: expected at most {MOST_ROBOTS} robots, got {request.count} beside the {robots} of now"
            )
        found: list[Pose] = []
        for number, (x, y, yaw) in enumerate(request.at, start=1):
            if (fault := self._fault((x, y))) is not None:
                raise PeerError(f"{where}: place {number} at ({x:g}, {y:g}): {fault}")
            found.append(self._take(Pose(x, y, wrap(yaw))))
        found.extend(self._take(Pose(*spot, 0.0)) for spot in self._free_places(request.count - len(found)))
        if len(found) < request.count:
            raise PeerError(
                f"{where}: expected a free cell for each of {request.count} robots, found {len(found)}; ask for "
                "fewer, or wait until robots have driven on"
            )
        return found

    def _take(self, start: Pose) -> Pose:
        touched = self._cells.cells_under_disc(start.x, start.y, self._settings.robot.radius + SAFETY.gap)
        self._occupants.append(Occupant("another new one", start, (0.0, 0.0), touched, self._settings.robot))
        return start

    def _fault(self, at: Point) -> str | None:
        """Return what is wrong with a spot [m]; None: a body may be put there."""
        settings, cells, robot = self._settings, self._cells, self._settings.robot
        if wrong := explain_not_free(self._floor, at):
            return f"{wrong}; move it"
        touched = cells.cells_under_disc(*at, robot.radius + CLEAR)
        if OUTSIDE in touched or not cells.can_fit_disc(touched, *at, robot.radius + CLEAR):
            return f"expected at least {robot.radius + CLEAR:g} m from any wall and from the edge of the map; move it"
        if not cells.stands[cells.cell_of(*at)]:
            return "expected a cell in which a robot can stand, got one that is too narrow; move it"
        for pose, radius in self._movers:
            if distance(at, pose) <= robot.radius + radius + SAFETY.gap:
                return "expected a free place, a moving obstacle is there; wait or move it"
        for other in self._occupants:
            gap = distance(at, other.pose) - robot.radius - other.body.radius
            if gap <= SAFETY.gap:
                return f"expected a free place, {other.name} stands there; move it"
            if not can_stop_before(gap, other.wheels, other.body, 1.0 / settings.rate):
                return (
                    f"expected a place that {other.name} can stop before, it drives {gap:.2f} m away; wait or move it"
                )
            if not set(touched).isdisjoint(other.held):
                return f"expected a place that nobody has reserved, {other.name} holds it; wait or move it"
        if any(distance(at, home) <= robot.radius + radius + SAFETY.gap for home, radius in self._homes):
            return "expected a place that is nobody's home, a restart puts a robot back there; move it"
        return None

    def _free_places(self, count: int) -> Iterator[Point]:
        """Yield middles of cells [m], the best first: joined to robots, wanted by none, out of reach of claims.

        The caller takes each before the next, so that the next one is far from it as well.
        """
        cells, taken = self._cells, 0
        standing = [cell for cell in range(len(cells)) if cells.stands[cell]]
        centres = np.array([cells.centre(cell) for cell in standing], np.float64).reshape(-1, 2)
        piece = cells.pieces
        joined = {piece[cells.cell_of(*other.pose[:2])] for other in self._occupants}
        worse = np.array([4.0 * (piece[cell] not in joined) + 2.0 * (cell in self._wanted) for cell in standing])
        apart = np.full(len(standing), self._enough)  # m to the nearest body
        seen = 0
        while taken < count and len(standing):
            for other in self._occupants[seen:]:
                np.minimum(apart, np.hypot(*(centres - other.pose[:2]).T), out=apart)
            seen = len(self._occupants)
            best = int(np.argmin(worse - apart / self._enough))
            if worse[best] == np.inf:
                return
            worse[best] = np.inf  # nor is it free for a later one
            if self._fault(spot := cells.centre(standing[best])) is None:
                taken += 1
                yield spot
