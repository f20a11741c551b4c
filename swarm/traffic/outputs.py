"""What follows from the decisions of one step: the record that the robot tells, and where it may drive, and how."""

from collections.abc import Collection, Mapping, Sequence
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Disc, Point
from swarm.messages.traffic import Moving, Record, Sighting, TrafficBroadcast
from swarm.traffic.interface import MovingObstacle, TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.joint.protocol import JointPlanning
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.obstacles.detector import ProtectiveStop
from swarm.traffic.own_route import GoalCell
from swarm.traffic.peers.records import PeerRecords, TrafficNote
from swarm.traffic.peers.sightings import has_reserved
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.claims import cells_back_to_way
from swarm.traffic.reservations.route import BESIDE, VIEW, Footprint, RouteProgress
from swarm.traffic.reservations.rules import Acks, Reservations, acknowledgements
from swarm.traffic.settings import TrafficConstants

SLACK: Final = 2.0  # m; the place of a robot whose newest record was not heard, for as long as it counts as fresh


class StepResult(NamedTuple):
    """The decisions of one step. What it tells and where it may drive follow from them."""

    inputs: TrafficInputs
    body: Footprint
    situation: Situation
    progress: RouteProgress
    goal: GoalCell
    joint: JointPlanning
    waits: tuple[str, ...]  # the robots that it waits for
    listens: bool  # it has just started or woken, and claims nothing yet
    halt: ProtectiveStop  # before an unexpected obstacle
    face: Point | None  # m, the point to turn to first
    leans_to: int | None  # the cell that it looks into from the edge of its own cell
    free_drive: tuple[int, ...]  # cells beside those held that it may drive in while no robot is near
    moved: int  # tick of its last progress
    room: tuple[int, ...]  # cells asked for beside the way
    threats: tuple[MovingObstacle, ...]  # obstacles that moved near it in the last tick
    speaks: bool  # it is its turn to broadcast
    events: tuple[TrafficNote, ...]
    docked: bool = False  # it holds all cells that it needs to drive to its place, outside of its cell

    @property
    def busy(self) -> bool:
        """True if the next step is due in the next tick: it makes a joint plan, or an obstacle is near it."""
        halt = self.halt
        return self.joint.own_call is not None or halt.stopped or bool(halt.threats) or self.face is not None


class RecordWriter:
    """Writes one robot's record. ``slot`` is its place in the round of broadcasts, ``side`` [m] that of a cell."""

    def __init__(self, me: str, settings: TrafficConstants, slot: int, side: float) -> None:
        self.me = me
        self._settings = settings
        self._slot = slot
        self._answers = settings.asking_distance(side) + SLACK  # m

    def is_due(self, tick: int, *, often: bool) -> bool:
        """Return True if it is this robot's turn to broadcast."""
        return (tick + self._slot) % (self._settings.often if often else self._settings.every) == 0

    def record(self, result: StepResult, seen: tuple[Sighting, ...], moving: tuple[Moving, ...]) -> Record:
        """Return the record of what was decided."""
        inputs, situation, progress, joint = result.inputs, result.situation, result.progress, result.joint
        return Record(
            robot=self.me,
            stamp=inputs.tick,
            x=inputs.pose.x,
            y=inputs.pose.y,
            error=inputs.uncertainty,
            speed=inputs.speed,
            radius=self._settings.radius if self._settings.tells_body else None,
            top=self._settings.top if self._settings.tells_body else None,
            goal=result.goal.cell,
            then=situation.then,
            idle=situation.idle,
            done=situation.done,
            wants=result.goal.since,
            held=progress.reservations.held,
            claims=progress.reservations.all_claims,
            acks=self._acks(progress.reservations, situation.others, inputs.pose),
            ahead=(*progress.route, *situation.docking)[: self._settings.ahead],
            waits=result.waits,
            moved=result.moved,
            epoch=joint.epoch,
            left=progress.steps_left_behind if joint.epoch is not None else 0,
            entered=max(0, progress.steps[-1]) if joint.epoch is not None else 0,
            frozen=joint.call_epoch,
            need=None if inputs.stands else joint.leader_asked,
            collect=joint.own_call,
            plan=joint.plan_to_carry(situation),
            refusal=joint.refusal_to_tell(inputs.tick),
            stands=inputs.stands,
            listens=result.listens,
            seen=seen,
            moving=moving,
        )

    def _acks(self, reservations: Reservations, others: Mapping[str, Record], pose: Pose) -> Acks:
        """Return the claims that this robot acknowledges, of all that may ask it: those far off ask others."""
        x, y, _ = pose
        near = {
            robot: record
            for robot, record in others.items()
            if record.claims and hypot(record.x - x, record.y - y) <= self._answers
        }
        return acknowledgements(self.me, reservations, near)


def cells_ahead(result: StepResult, place: int) -> tuple[int, ...]:
    """List the held cells to drive through in order, from the one at ``place`` to the head or to the next stop.

    If no other robot is near, the cells of the route that are in view follow.
    """
    ahead = _way_from(result, place)
    if result.free_drive:
        ahead = (*ahead, *result.progress.route)[: 2 * VIEW + 1]
    return ahead[: ahead.index(result.goal.cell) + 1] if has_stop_ahead(result, ahead) else ahead


def _way_from(result: StepResult, place: int) -> tuple[int, ...]:
    """List the held cells of the way from the one at ``place`` on.

    From a cell beside the way, it begins with the last cell of the way that shares a side with it: not with another
    cell beside the way, from which the robot would only come back, nor with cells of the way that it has passed. The
    cell of a stop that it has to visit is not passed over.
    """
    held, steps = result.progress.reservations.held[place:], result.progress.steps[place:]
    if steps[0] != BESIDE:
        return held
    here, cells, visits = held[0], result.situation.cells, result.situation.stop_to_visit
    way = [cell for cell, step in zip(held, steps, strict=True) if step != BESIDE]
    last = way.index(visits) if visits in way else len(way)
    first = max([at for at, cell in enumerate(way[: last + 1]) if _leads_into(here, cell, cells)], default=0)
    return here, *way[first:]


def _leads_into(here: int, cell: int, cells: CellMap) -> bool:
    """Return True if a body gets from a cell into another one across a side that they share."""
    return cell in cells.adjacent_cells(here) and cells.is_passable(here, cell)


def has_stop_ahead(result: StepResult, ahead: Sequence[int]) -> bool:
    """Return True if one of the cells ahead holds the next stop: the robot drives over it, whatever comes then."""
    return result.situation.stop_to_visit in ahead


def waypoints(
    result: StepResult, ahead: Sequence[int], alone: Collection[int], settings: TrafficConstants
) -> tuple[Point, ...]:
    """Return the points to drive to, in order [m]. ``alone`` are the held cells that no other robot holds too."""
    progress, goal, cells, spare = result.progress, result.goal, result.situation.cells, result.inputs.uncertainty
    back = [cell for cell in cells_back_to_way(progress, ahead[0], cells) if cell in progress.reservations.held]
    if back and (result.goal.leaves is not None or (len(ahead) > 1 and _leads_into(ahead[0], ahead[1], cells))):
        back = []
    points = [cells.centre(cell) for cell in (ahead[0], *back[:1], *ahead[1:])]
    if ahead[0] not in alone:  # another robot is in this cell too: do not drive to its middle
        points = points[1:] or [(result.inputs.pose.x, result.inputs.pose.y)]
    if result.docked and goal.dock is not None and progress.head == goal.cell:
        point = goal.dock.next_point(result.inputs.pose[:2], progress.reservations.held, cells, settings)
        # an aim is also looked for on a path round corners, but only to waypoints after the first
        return (point,) if point == goal.dock.place else (point, point)
    if has_stop_ahead(result, ahead) and goal.wish is not None:
        points[-1] = goal.place(goal.wish, settings.standing_room + spare, cells)
    elif progress.route and not result.free_drive and is_bound_for_edge(result, settings):
        points.append(cells.leaning_point(progress.head, progress.route[0], settings.leaning_room + spare))
    elif result.situation.docking and must_reach_point(result, settings):
        points[-1] = cells.centre(progress.head)  # it looks into the cells of silent robots from there
    elif not progress.route and progress.head == goal.cell and goal.wish is not None:
        points[-1] = goal.place(goal.wish, settings.standing_room + spare, cells)
    return tuple(points)


def is_bound_for_edge(result: StepResult, settings: TrafficConstants) -> bool:
    """Return True if the robot drives on in its last cell up to the next one, and not to the middle of its cell.

    There it stands when its turn comes, or it leans to look or to be heard.
    """
    head, following = result.progress.head, result.progress.route[0]
    blind = settings.in_sight and result.situation.cells.is_blind(head, following)
    return following == result.leans_to or blind or not must_reach_point(result, settings)


def must_reach_point(result: StepResult, settings: TrafficConstants) -> bool:
    """Return True if the robot has to reach a certain point in its cell, from which it claims or looks."""
    if not result.progress.route and not result.situation.docking:
        return False
    if settings.in_sight or result.leans_to is not None:
        return True
    if result.situation.docking and _is_too_far_to_claim(result, settings):
        return True
    return not result.situation.fresh.keys() | result.situation.mutes >= set(result.waits)


def _is_too_far_to_claim(result: StepResult, settings: TrafficConstants) -> bool:
    """Return True if a cell that the robot needs at its stop is so far off that it may not claim it from here."""
    cells, here = result.situation.cells, result.inputs.pose
    return any(distance(cells.centre(cell), here) > settings.claim_radius for cell in result.situation.docking)


def activity(result: StepResult) -> TrafficActivity:
    """Return the activity of the robot: the first in this order that applies."""
    progress, joint = result.progress, result.joint
    if result.halt.stopped:
        return TrafficActivity.HALTED
    if joint.call_epoch is not None:
        return TrafficActivity.LEADING if joint.own_call is not None else TrafficActivity.STANDING
    if result.listens:
        return TrafficActivity.LISTENING
    if result.face is not None:
        return TrafficActivity.LOOKING
    if not progress.route and progress.head == result.goal.cell:
        return TrafficActivity.ARRIVED
    if result.waits and len(progress.reservations.held) == 1:
        return TrafficActivity.WAITING
    if not progress.route:
        return TrafficActivity.WAITING if joint.epoch is not None else TrafficActivity.CUT_OFF
    return TrafficActivity.CUT_OFF if is_stopped_by_body(result) else TrafficActivity.DRIVING


def is_stopped_by_body(result: StepResult) -> bool:
    """Return True if the robot is at its head, and a body stands in the next cell of its way: its goal, then."""
    held, route = result.progress.reservations.held, result.progress.route
    return len(held) == 1 and bool(route) and route[0] in result.situation.blocked


def find_hinderers(result: StepResult, doing: TrafficActivity) -> tuple[str, ...]:
    """Return the robots that a robot waits for, also those that shut its way: silent, or told to stop.

    Decisions are made without those that shut its way: no claim and no joint plan moves them.
    """
    if result.waits or doing is not TrafficActivity.CUT_OFF:
        return result.waits
    situation, route = result.situation, result.progress.route
    cell = route[0] if route else first_shut_cell(situation.head, situation.goal, situation.blocked, situation.cells)
    return tuple([robot for robot, record in situation.others.items() if has_reserved(record, cell)])


def first_shut_cell(start: int, goal: int, shut: Collection[int], cells: CellMap) -> int:
    """Return the first of the cells that are ``shut`` on a shortest way over the floor; OUTSIDE: there is none."""
    steps, cell = cells.distances(goal), start
    while cell != goal and steps[cell] < FAR:
        cell = min(cells.neighbours[cell], key=steps.__getitem__)
        if cell in shut:
            return cell
    return OUTSIDE


def outputs_of(
    result: StepResult,
    peers: PeerRecords,
    still: Sequence[Disc],
    broadcast: TrafficBroadcast | None,
    settings: TrafficConstants,
) -> TrafficOutputs:
    """Return the outputs of a step; ``still`` are bodies that stand near, ``broadcast`` is told."""
    tick, held = result.situation.tick, result.progress.reservations.held
    place = result.progress.body_index(result.body.cell)
    first = result.progress.body_index_before_visit(result.body.cell, result.situation.stop_to_visit)
    dock = result.goal.leaves or (result.goal.dock if result.docked else None)
    if dock is not None and dock.cell in held:  # between its cell and its place: the way goes on from the cell
        first = len(held) - 1 - held[::-1].index(dock.cell)
    alone, ahead = peers.cells_held_alone(held, tick), cells_ahead(result, first)
    stops, to_look, following = (
        has_stop_ahead(result, ahead),
        must_reach_point(result, settings),
        result.joint.following,
    )
    doing = activity(result)
    return TrafficOutputs(
        broadcast=broadcast,
        held=held,
        drivable=tuple(dict.fromkeys((*alone, held[place], *result.free_drive))),
        unconstrained=bool(result.free_drive),
        waypoints=waypoints(result, ahead, alone, settings),
        beside=(*peers.holder_bodies(held[place], tick), *still, *result.halt.bodies),
        may_drive=not result.halt.stopped,
        threats=result.threats,
        room=result.room,
        exactly=stops or to_look or result.docked,
        looks=not stops and to_look and not result.docked,
        docks=result.docked,
        face=result.face,
        waits=find_hinderers(result, doing),
        activity=doing,
        events=result.events,
        way=(*held[first:], *result.progress.route),
        members=following.members if following is not None else (),
    )
