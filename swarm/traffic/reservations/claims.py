"""Layer 1 of one robot: it claims the next cells of its route, and takes those that all near have acknowledged.

It also claims room: cells beside its way in which it would drive if it had them, as far as no other robot needs them. A
robot that such a cell led away from its way, so that only a corner is between them, claims a cell on the way back.
Before a threat it claims all cells that nobody holds: a robot that plans to drive there later can wait.
"""

from collections.abc import Collection, Mapping, Sequence
from math import hypot
from typing import Final, NamedTuple, Protocol

from swarm.geometry import Pose, distance
from swarm.messages.traffic import Claim, Record
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.peers.sightings import has_reserved
from swarm.traffic.peers.situation import Situation, cells_needed_at_stop
from swarm.traffic.reservations.route import BESIDE, Footprint, RouteProgress
from swarm.traffic.reservations.rules import ASK, TAKE, ClaimCase, find_violated_rule
from swarm.traffic.settings import LEANS, TrafficConstants

MOST_BESIDE: Final = 4  # cells beside the way claimed at a time
UNANSWERED: Final = 40  # ticks after which a robot names those that have not acknowledged as the ones it waits for
NOBODY: Final[frozenset[str]] = frozenset()


class EntryOrder(Protocol):
    """The order in which the members of a joint plan enter cells."""

    def waits_for(self, step: int, situation: Situation) -> str | None:
        """Return the robot that must leave the ``step``-th cell of the way before this one enters it, else None."""

    def next_after(self, step: int, situation: Situation) -> bool:
        """Return True if the robot waited for is in that very visit now: no other robot can come in between."""


class ClaimResult(NamedTuple):
    """The new progress of a robot, and the robots that it waits for."""

    progress: RouteProgress
    waits: tuple[str, ...]
    took: bool  # it took a cell of its way


class CellClaimer:
    """Applies the rules of ``reservations`` to the cells a robot wants next, in the order of its way and its plan."""

    def __init__(self, me: str, settings: TrafficConstants) -> None:
        self.me = me
        self.settings = settings

    def step(
        self,
        progress: RouteProgress,
        plan: EntryOrder | None,
        situation: Situation,
        body: Footprint,
        room: Collection[int],
        owners: tuple[str, ...] = (),
    ) -> ClaimResult:
        """Claim the next cells of the way, and the cells of ``room`` beside it; take those that are granted.

        A robot that needs cells beside its own at its stop claims none of its way, and those only if there are no
        ``owners`` of them, for whom it waits.
        """
        if situation.docking:
            progress = progress._replace(reservations=progress.reservations.withdraw(progress.reservations.claims))
            near = self._near(situation, body.pose)
            progress = self._make_room(progress, situation, body.pose, () if owners else room, near)
            return ClaimResult(progress, owners, took=False)
        progress, waits = self._ask(progress, plan, situation, body)
        near = (
            self._near(situation, body.pose) if progress.reservations.claims or progress.reservations.beside else NOBODY
        )
        claimed = self._advance(ClaimResult(progress, waits, took=False), plan, situation, body, near)
        if self.settings.in_sight:
            return claimed
        progress = self._make_room(claimed.progress, situation, body.pose, room, near)
        return claimed if progress is claimed.progress else claimed._replace(progress=progress)

    def _advance(
        self, claimed: ClaimResult, plan: EntryOrder | None, situation: Situation, body: Footprint, near: frozenset[str]
    ) -> ClaimResult:
        """Take the claimed cells that all ``near`` have acknowledged, in the order of the plan."""
        progress, waits, took = claimed
        while progress.route:
            cell = progress.route[0]
            held = progress.reservations.held
            step_free = plan is None or plan.waits_for(progress.next_step, situation) is None
            mine = cell in held and not any(cell in record.held for record in situation.fresh.values())
            # it leaves its stop by the cell through which it came only once it has been there, and goes round a loop
            # only once it has left the first cell of it
            too_early = progress.head == situation.stop_to_visit or (body.cell == cell and cell not in held[-2:])
            if mine and not progress.reservations.claims and step_free and not too_early:
                progress = progress.advance_head(progress.reservations.keep_only((*held, cell)))
                continue
            if not progress.reservations.claims or progress.reservations.claims[0].cell != cell:
                break
            claim = progress.reservations.claims[0]
            case = self._case(claim, progress, situation, near)
            heard = not self.settings.in_sight or self._would_be_heard(progress.head, cell, body.pose, situation.cells)
            against = find_violated_rule(TAKE, case) if step_free and heard else "not its turn"
            if against is not None:
                waits = waits if waits and against == "it is too young" else self._hinderers(case)
                break
            progress = progress.advance_head(progress.reservations.hold_claimed(claim))
            took, waits = True, ()
        return ClaimResult(progress, waits, took)

    def _make_room(
        self, progress: RouteProgress, situation: Situation, pose: Pose, room: Collection[int], near: frozenset[str]
    ) -> RouteProgress:
        """Claim the cells of ``room``, beside the way; take those that all others have granted."""
        if progress.reservations.beside:
            given_up = [claim for claim in progress.reservations.beside if claim.cell not in room]
            progress = progress._replace(reservations=progress.reservations.withdraw(given_up))
            for claim in progress.reservations.beside:
                if find_violated_rule(TAKE, self._case(claim, progress, situation, near)) is None:
                    progress = progress.with_room(claim)
        if not room:
            return progress
        # at its stop a robot claims none of its way: a cell of it can be one that it needs there
        ahead = () if situation.docking else progress.route[: self.settings.horizon]
        taken = {
            *progress.reservations.held,
            *[claim.cell for claim in progress.reservations.all_claims],
            *ahead,
            *situation.blocked,
        }
        for cell in room:
            most = len(room) if situation.docking else MOST_BESIDE
            if cell in taken or len(progress.reservations.beside) >= most:
                continue
            if distance(situation.cells.centre(cell), pose) > self.settings.claim_radius:
                continue
            case = self._case(Claim(cell, progress.reservations.number, situation.tick), progress, situation, NOBODY)
            if find_violated_rule(ASK, case) is None:
                progress = progress._replace(reservations=progress.reservations.claim_beside(cell, situation.tick))
        return progress

    def _ask(
        self, progress: RouteProgress, plan: EntryOrder | None, situation: Situation, body: Footprint
    ) -> tuple[RouteProgress, tuple[str, ...]]:
        """Claim what may be claimed, in order; return also who keeps the robot from the first cell of the route."""
        pose, place = body.pose, progress.body_index(body.cell)
        room = self.settings.horizon - (len(progress.reservations.held) - 1 - place)
        for ahead, cell in enumerate(progress.route[: max(0, room)]):
            step = progress.next_step + ahead
            first = plan.waits_for(step, situation) if plan is not None else None
            if plan is not None and first is not None and not (ahead == 0 and plan.next_after(step, situation)):
                return progress, (first,) if ahead == 0 else ()
            if ahead < len(progress.reservations.claims):
                continue
            if cell in progress.reservations.held or cell in situation.blocked:
                return progress, ()
            if distance(situation.cells.centre(cell), pose) > self.settings.claim_radius:
                return progress, ()
            if self.settings.in_sight and not self._would_be_heard(progress.head, cell, pose, situation.cells):
                return progress, ()
            # a joint plan is for all: who stands at its stop may wait for a robot that waits for this one
            if plan is None and (at_stop := _robots_at_stop(cell, progress, situation)):
                return progress, at_stop if ahead == 0 else ()
            case = self._case(Claim(cell, progress.reservations.number, situation.tick), progress, situation, NOBODY)
            against = find_violated_rule(ASK, case)
            if against is not None and not (ahead == 0 and self._queues(against, case, situation)):
                return progress, self._hinderers(case) if ahead == 0 else ()
            progress = progress._replace(reservations=progress.reservations.claim(cell, situation.tick))
        return progress, ()

    def _would_be_heard(self, head: int, cell: int, pose: Pose, cells: CellMap) -> bool:
        """Return True if all that may claim or hold that cell hear me. Round a corner, robots lean towards the cell."""
        if not cells.is_blind(head, cell):
            return distance(cells.centre(head), pose) <= LEANS
        return distance(cells.leaning_point(head, cell, self.settings.leaning_room), pose) <= LEANS

    def _queues(self, against: str, case: ClaimCase, situation: Situation) -> bool:
        """Return True if the robot may queue for the next cell, which another robot holds."""
        cell = case.claim.cell
        held_by_others = [
            robot for robot, notice in case.others.items() if cell in notice.held and (robot, cell) not in case.cleared
        ]
        return against == "somebody holds it" and all(robot in situation.fresh for robot in held_by_others)

    def _case(self, claim: Claim, progress: RouteProgress, situation: Situation, near: frozenset[str]) -> ClaimCase:
        age = situation.tick - claim.stamp
        others = situation.others
        return ClaimCase(
            claim, self.me, self.me, progress.reservations, others, near, situation.cleared, age, self.settings.ripe
        )

    def _near(self, situation: Situation, pose: Pose) -> frozenset[str]:
        """Return the robots heard lately that could claim a cell that I can claim."""
        reach = self.settings.asking_distance(situation.cells.side)
        x, y, _ = pose
        return frozenset(
            [robot for robot, record in situation.fresh.items() if hypot(record.x - x, record.y - y) <= reach]
        )

    def _hinderers(self, case: ClaimCase) -> tuple[str, ...]:
        """Return who holds or claims a cell, or else who has not acknowledged the claim yet."""
        cell = case.claim.cell
        owners = tuple(
            [
                robot
                for robot, notice in case.others.items()
                if has_reserved(notice, cell) and (robot, cell) not in case.cleared
            ]
        )
        if owners or case.age < UNANSWERED:
            return owners
        ack = (self.me, case.claim.number)
        return tuple([robot for robot in sorted(case.near) if ack not in case.others[robot].acks])


def _robots_at_stop(cell: int, progress: RouteProgress, situation: Situation) -> tuple[str, ...]:
    """Return the robots that stand at their stops and need a cell: nobody enters it before they have been there.

    Who holds a cell that such a robot needs must be able to leave, so it may enter others.
    """
    found = []
    for robot, record in situation.fresh.items():
        needed = cells_needed_at_stop(record)
        if cell in needed and not any(held in needed for held in progress.reservations.held):
            found.append(robot)
    return tuple(found)


def list_room_cells(
    progress: RouteProgress,
    pose: Pose,
    sweeps: Sequence[int],
    fresh: Mapping[str, Record],
    threats: Sequence[tuple[float, ...]],
    cells: CellMap,
) -> tuple[int, ...]:
    """List the cells to ask for: back to the way, then where the tables would drive; or away from threats.

    ``sweeps`` are the cells that the tables would drive over; ``threats`` are points [m], of which x and y count.
    Without a threat, a robot in its head cell asks for none: it has no cell ahead to drive to.
    """
    if threats:
        theirs = {cell for one in fresh.values() for cell in one.held}
        return tuple([cell for cell in _cells_away_from_threats(threats, pose, cells) if cell not in theirs])
    here = cells.cell_of(*pose[:2])
    held = progress.reservations.held
    back = [cell for cell in cells_back_to_way(progress, here, cells) if cell in held or not _is_wanted(cell, fresh)]
    if not sweeps or progress.body_index(here) >= len(progress.reservations.held) - 1:
        return tuple(back)
    beside = _cells_beside_way(progress, cells)
    return (*back, *[cell for cell in sweeps if cell in beside and not _is_wanted(cell, fresh)])


def cells_back_to_way(progress: RouteProgress, here: int, cells: CellMap) -> tuple[int, ...]:
    """List the cells between a robot's cell ``here`` beside its way and the cells of its way.

    There are none if it is on its way, or if it can stand in its cell, and that one and one of the way share a side.
    Where it cannot, in a cell that is half wall, it may have to drive along the edge of that cell, and so needs those
    that it holds there, and the cells beside them.
    """
    if not progress.has_strayed(here) or here == OUTSIDE:
        return ()
    beside = _cells_beside_way(progress, cells)
    if cells.stands[here] and here in beside:
        return ()
    held = list(zip(progress.reservations.held, progress.steps, strict=True))
    under = {here} if cells.stands[here] else {cell for cell, step in held if step == BESIDE}
    near = under | {cell for one in under for cell in cells.adjacent_cells(one) if cells.is_passable(one, cell)}
    way = {here, *(cell for cell, step in held if step != BESIDE)}
    return tuple(sorted((near & beside) - way))


def _cells_beside_way(progress: RouteProgress, cells: CellMap) -> set[int]:
    """Return the cells that share a side with a cell of the way that the robot holds, no wall all along it."""
    held = zip(progress.reservations.held, progress.steps, strict=True)
    way = [cell for cell, step in held if step != BESIDE]
    return {near for cell in way for near in cells.adjacent_cells(cell) if cells.is_passable(cell, near)}


def _is_wanted(cell: int, fresh: Mapping[str, Record]) -> bool:
    """Return True if a robot holds or claims a cell, or its way leads there."""
    return any(
        cell in one.held or cell in one.ahead or any(claim.cell == cell for claim in one.claims)
        for one in fresh.values()
    )


def _cells_away_from_threats(threats: Sequence[tuple[float, ...]], pose: Pose, cells: CellMap) -> list[int]:
    """List the cells around the robot that it can stand in and that are farther from the nearest threat than it is.

    From a cell that it cannot stand in, it would find no way on.
    """

    def gap(place: tuple[float, ...]) -> float:
        return min(distance(threat, place) for threat in threats)

    about = cells.cells_around(cells.cell_of(pose.x, pose.y), 1)
    return [cell for cell in about if cells.stands[cell] and gap(cells.centre(cell)) > gap(pose)]
