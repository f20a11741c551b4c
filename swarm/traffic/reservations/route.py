"""How far a robot is on its way: the cells that it holds, those to come, and what it has left behind.

It holds the cells of its way that were granted, and those that its body is in or brakes into, whatever it wants.
"""

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose
from swarm.messages.traffic import Claim, Record
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants

ALONE: Final = -1  # step of a cell that belongs to no joint plan
BESIDE: Final = -2  # step of a cell that is not on the way: the body or its brake reaches into it, or it is room
VIEW: Final = 2  # cells around the body that count while no robot is near
OFF_WAY: Final = 30  # ticks off its way after which a robot begins its way again where it is


Join = tuple[int, int]  # two cells between which a robot passes


def list_shut_joins(way: Sequence[int], cells: CellMap) -> tuple[Join, ...]:
    """List the joins of a way that a floor does not have."""
    return tuple((a, b) for a, b in pairwise(way) if a != b and b not in cells.neighbours[a])


class RouteProgress(NamedTuple):
    """A way over the cells: ``reservations.held`` is under the robot and ahead of it, ``route`` follows.

    ``steps`` holds the step of each held cell in the joint plan followed: ALONE without a plan, BESIDE off the way.
    """

    reservations: Reservations
    steps: tuple[int, ...]
    route: tuple[int, ...] = ()
    following: bool = False
    sought: bool = False  # the route, even if it is empty, comes from a search for a way of its own

    @property
    def head(self) -> int:
        """The last cell held."""
        return self.reservations.held[-1]

    @property
    def steps_left_behind(self) -> int:
        """The number of cells of the joint plan that lie behind."""
        for step in self.steps:
            if step != BESIDE:
                return max(0, step)
        return 0

    @property
    def way_cell_count(self) -> int:
        """The number of held cells that are on the way."""
        return len(self.steps) - self.steps.count(BESIDE)

    @property
    def next_step(self) -> int:
        """The step in the joint plan of the first cell of the route."""
        return self.steps[-1] + 1

    def body_index(self, body: int) -> int:
        """Return the index of the body's cell in the held cells, the last one if it is there twice; 0 if it is not."""
        held = self.reservations.held
        return len(held) - 1 - held[::-1].index(body) if body in held else 0

    def body_index_before_visit(self, body: int, visits: int) -> int:
        """Return the index of the body's cell, but none beyond the cell that a joint plan leads over and it ``visits``.

        Steps of a plan are not negative. A way of its own ends at that cell, or leads back from it.
        """
        place, held = self.body_index(body), self.reservations.held
        return next((index for index in range(place) if held[index] == visits and self.steps[index] >= 0), place)

    def on_joint_way(self, way: tuple[int, ...]) -> "RouteProgress":
        """Return the progress on the way of a joint plan, which begins at the head."""
        return self._replace(steps=(*self._steps_without_plan()[:-1], 0), route=way[1:], following=True, sought=False)

    def on_own_way(self, route: tuple[int, ...]) -> "RouteProgress":
        """Return the progress on a way of its own, as a search found it."""
        return self._replace(steps=self._steps_without_plan(), route=route, following=False, sought=True)

    def without_way(self) -> "RouteProgress":
        """Return the progress without a way."""
        return self._replace(steps=self._steps_without_plan(), route=(), following=False, sought=False)

    def _steps_without_plan(self) -> tuple[int, ...]:
        return tuple(min(step, ALONE) for step in self.steps)

    def has_strayed(self, body: int) -> bool:
        """Return True if the body is off the way."""
        return self.steps[self.body_index(body)] == BESIDE

    def is_beside(self, body: int, cells: CellMap) -> bool:
        """Return True if a cell is next to a held cell of the way."""
        way = {cell for cell, step in zip(self.reservations.held, self.steps, strict=True) if step != BESIDE}
        return body != OUTSIDE and not way.isdisjoint(cells.neighbours[body])

    def advance_head(self, reservations: Reservations) -> "RouteProgress":
        """Go on to the first cell of the route, which is now the head in ``reservations``."""
        step = self.next_step if self.following else ALONE
        return self._replace(reservations=reservations, steps=(*self.steps, step), route=self.route[1:])

    def hold_beside(self, cells: Collection[int]) -> "RouteProgress":
        """Hold these cells too, beside the way."""
        extra = tuple(sorted(set(cells).difference(self.reservations.held)))
        if not extra:
            return self
        return self._replace(
            reservations=self.reservations.keep_only((*extra, *self.reservations.held)),
            steps=(BESIDE,) * len(extra) + self.steps,
        )

    def without_claims(self) -> "RouteProgress":
        """Withdraw every claim."""
        reservations = self.reservations.withdraw(self.reservations.all_claims)
        return self if reservations is self.reservations else self._replace(reservations=reservations)

    def without_stale_claims(self) -> "RouteProgress":
        """Withdraw the claims that do not match the beginning of the route."""
        claims = self.reservations.claims
        good = 0
        while good < min(len(claims), len(self.route)) and claims[good].cell == self.route[good]:
            good += 1
        return self._replace(reservations=self.reservations.withdraw(claims[good:])) if good < len(claims) else self

    def with_room(self, claim: Claim) -> "RouteProgress":
        """Hold a cell beside the way whose claim was granted."""
        reservations = self.reservations.withdraw([claim])
        return self._replace(
            reservations=reservations.keep_only((claim.cell, *reservations.held)), steps=(BESIDE, *self.steps)
        )

    def release_behind(
        self,
        touched: Collection[int],
        body: int,
        room: Collection[int] = (),
        visits: int = OUTSIDE,
        docking: Collection[int] = (),
    ) -> "RouteProgress":
        """Release the cells behind the body, once the braking path is clear of them or they are held again further on.

        Cells beside the way stay while they are in ``room``. The cell that the robot still ``visits`` stays, and so do
        those after it. Cells of the way that it needs for ``docking`` stay as cells beside the way; then so do those
        from which no held way leads on, for it has left its way for the straight line.
        """
        held = self.reservations.held
        place = self.body_index_before_visit(body, visits)
        if place == 0:
            return self
        keep = [
            index
            for index, cell in enumerate(held)
            if (index >= place and (self.steps[index] != BESIDE or index == place))
            or (
                (cell in touched or cell in docking or (cell in room and self.steps[index] == BESIDE))
                and cell not in held[index + 1 :]
            )
        ]
        steps = tuple([self.steps[index] for index in keep])
        if docking:
            dropped = [index for index in range(place) if index not in keep and self.steps[index] != BESIDE]
            lost = max(dropped, default=-1)
            off_way = {index for index in keep if index < place and (index < lost or held[index] in docking)}
            steps = tuple([BESIDE if index in off_way else self.steps[index] for index in keep])
        if len(keep) == len(held) and steps == self.steps:
            return self
        return self._replace(
            reservations=self.reservations.keep_only(tuple(held[index] for index in keep)), steps=steps
        )

    def on_new_floor(self, cells: CellMap, touched: Collection[int], body: int) -> "RouteProgress":
        """Return the progress on another floor: held cells stay as far as they are joined; all that is ahead is void.

        Cells that the body and its brake are in stay in any case. No new cell is held. If nobody can stand in the cell
        of the body any more, the head is the last one behind it on the way where the robot can stand.
        """
        held, place = self.reservations.held, self.body_index(body)
        end = place + 1
        while end < len(held) and held[end] in cells.neighbours[held[end - 1]]:
            end += 1
        kept = [index for index, cell in enumerate(held) if index < end or cell in touched]
        if not cells.stands[held[end - 1]]:
            way = [index for index in range(end) if self.steps[index] != BESIDE and cells.stands[held[index]]]
            end = way[-1] + 1 if way else end
        order = [index for index in kept if index != end - 1] + [end - 1]
        steps = tuple(BESIDE if index >= end else min(self.steps[index], ALONE) for index in order)
        return RouteProgress(Reservations(tuple(held[index] for index in order), (), self.reservations.number), steps)

    def joins_shut_ahead(self, cells: CellMap, body: int, *, route: bool = True) -> tuple[Join, ...]:
        """List the joins ahead that a floor does not have; those beyond the held cells only if ``route``."""
        held, place = self.reservations.held, self.body_index(body)
        ahead = [cell for cell, step in zip(held[place:], self.steps[place:], strict=True) if step != BESIDE]
        return list_shut_joins((*ahead, *(self.route if route else ())), cells)

    def after_waking(self, touched: Collection[int]) -> "RouteProgress":
        """Drop the claims and the held cells ahead of the body, to be claimed again; the way stays the same."""
        held = self.reservations.held
        end = 1 + max(index for index, cell in enumerate(held) if cell in touched)
        reservations = Reservations(held[:end], (), self.reservations.number)
        return self._replace(reservations=reservations, steps=self.steps[:end], route=(*held[end:], *self.route))

    def turn_round(self, touched: Collection[int]) -> "RouteProgress":
        """Drop the plan, the claims, and the held cells ahead of the braking path; then turn round if that helps.

        A robot that has stopped across two cells drives back: the cell further back becomes the head.
        """
        held = self.reservations.held
        last = max((index for index, cell in enumerate(held) if cell in touched), default=0)
        kept = tuple(dict.fromkeys(held[: last + 1]))[::-1]
        return RouteProgress(Reservations(kept, (), self.reservations.number), (ALONE,) * len(kept))


class Footprint(NamedTuple):
    """The body of a robot: where it is, and which cells it reaches into."""

    tick: int
    pose: Pose
    cell: int
    touched: frozenset[int]  # cells that it reaches into, now and until it has come to rest


def footprint_of(inputs: TrafficInputs, radius: float, cells: CellMap) -> Footprint:
    """Return the body, as a disc [m]."""
    x, y, _ = inputs.pose
    touched = cells.swept_cells(((x, y),), radius)
    if len(inputs.braking):
        touched |= cells.swept_cells(inputs.braking, radius)
    return Footprint(inputs.tick, inputs.pose, cells.cell_of(x, y), touched)


def begin_way(
    number: int, body: Footprint, touched: frozenset[int], cells: CellMap, held: Collection[int] = ()
) -> RouteProgress:
    """Begin a way where the robot is, holding only cells that it touches. ``number`` is that of its next claim.

    Where it can drive on from none of them, it keeps the nearest cell to stand in of those ``held`` until now: it takes
    no cell that it neither touches nor held. Only where ``touched`` is empty (the body is outside of all cells) and it
    can stand in none of those held does it take the nearest cell to stand in of the map.
    """
    x, y, _ = body.pose
    joined = [cell for cell in touched if cells.is_joined(cell)] or [cell for cell in held if cells.is_joined(cell)]
    standable = joined or [cell for cell in (*touched, *held) if cells.stands[cell]]
    if standable or not touched:
        head = cells.nearest_standable(x, y, standable)
    else:
        head = body.cell if body.cell in touched else min(touched)
    kept = (*sorted(touched - {head}), head)
    return RouteProgress(Reservations(kept, (), number), (BESIDE,) * (len(kept) - 1) + (ALONE,))


def restart_way(progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
    """Begin the way again where the robot is. It holds new cells only if it touches none of those held."""
    held = progress.reservations.held
    touched = body.touched & frozenset(held) or body.touched
    return begin_way(progress.reservations.number, body, touched, cells, held)


def resume_after_sleep(progress: RouteProgress | None, body: Footprint, cells: CellMap) -> RouteProgress:
    """Return the progress of a robot that has just started or was away."""
    if progress is None:
        return begin_way(body.tick * 64 + 1, body, body.touched, cells)
    if body.touched <= set(progress.reservations.held) and not progress.has_strayed(body.cell):
        return progress.after_waking(body.touched)
    return restart_way(progress, body, cells)


def hold_under_body(
    progress: RouteProgress, body: Footprint, cells: CellMap, radius: float, theirs: Collection[int] = ()
) -> RouteProgress:
    """Add the cells under the body to the held cells, but ``theirs``: the robot was pushed, or drove badly."""
    if body.touched.issubset(progress.reservations.held):
        return progress
    under = frozenset(cells.cells_under_disc(body.pose.x, body.pose.y, radius)).difference(theirs, {OUTSIDE})
    return progress.hold_beside(under)


def give_back(progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
    """Drop the way, the claims, and the held cells ahead of the braking path."""
    if BESIDE in progress.steps:  # the cell behind may not be one to stand in
        return restart_way(progress, body, cells)
    return progress.turn_round(body.touched)


def bring_to_rest(progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
    """Return the progress of a robot that was told to stop: it keeps the cells under its body and brake."""
    free = not progress.route and not progress.following and not progress.reservations.all_claims
    if free and body.touched.issuperset(progress.reservations.held):
        return progress
    return give_back(progress, body, cells)


def hold_free_drive_cells(
    progress: RouteProgress, inputs: TrafficInputs, cells: CellMap, settings: TrafficConstants
) -> tuple[RouteProgress, Footprint]:
    """Hold all cells that the body could reach within two ticks: in free drive it may leave the cells held so far."""
    radius = settings.radius + settings.margin + 2 * settings.speed * settings.tick
    body = footprint_of(inputs, radius, cells)
    progress = progress.hold_beside(body.touched)
    if progress.has_strayed(body.cell) and cells.is_joined(body.cell):
        progress = begin_way(progress.reservations.number, body, body.touched, cells)
    return progress, body


def free_drive_cells(
    body: Footprint,
    others: Mapping[str, Record],
    fresh: Mapping[str, Record],
    cells: CellMap,
    settings: TrafficConstants,
) -> tuple[int, ...]:
    """List the free-drive cells: those around the body, if no robot is near enough to ask for any of them, else ().

    The robot then holds what its body and its brake need, and nothing constrains the fuzzy tables.
    """
    (x, y, _), alone = body.pose, settings.alone_distance
    for record in fresh.values():
        if hypot(record.x - x, record.y - y) < alone:
            return ()
    theirs = {cell for record in others.values() for cell in (*record.held, *(claim.cell for claim in record.claims))}
    about = cells.cells_around(body.cell, VIEW)
    return () if not theirs.isdisjoint(about) else tuple(cell for cell in about if cells.stands[cell])


class OffRouteChecker:
    """Notices when a robot has been off its way for long."""

    def __init__(self) -> None:
        self._fled = False  # off its way, because it fled from a threat
        self._on_way = 0  # tick

    def keep_on_way(
        self, progress: RouteProgress, body: Footprint, cells: CellMap, *, threatened: bool
    ) -> RouteProgress:
        """Begin the way again where the robot is, if it has been off it for long.

        A robot in a joint plan begins again only if it fled, or is not next to its way: if it uses room beside its way,
        it comes back. Call it once a tick.
        """
        strayed = progress.has_strayed(body.cell)
        self._fled = strayed and (self._fled or threatened)
        if not strayed or (progress.following and not self._fled and progress.is_beside(body.cell, cells)):
            self._on_way = body.tick
        elif body.tick - self._on_way > OFF_WAY and cells.is_joined(body.cell):
            self._on_way = body.tick
            return restart_way(progress, body, cells)
        return progress
