"""Where a robot may drive after one step, and how: its waypoints and its activity."""

from collections.abc import Collection, Sequence

from swarm.maps.occupancy import Point
from swarm.messages.traffic import TrafficBroadcast
from swarm.traffic.interface import TrafficActivity, TrafficOutputs
from swarm.traffic.lattice.breadth_first import FAR
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.peers.records import Event, PeerRecords
from swarm.traffic.peers.sightings import keeps
from swarm.traffic.reservations.presence import VIEW, Footprint
from swarm.traffic.reservations.side_cells import way_back
from swarm.traffic.result import Doing
from swarm.traffic.settings import TrafficSettings


def way_ahead(doing: Doing, place: int) -> tuple[int, ...]:
    """List the held cells to drive through in order, from the one at ``place`` to the head or to the next stop.

    If no other robot is near, the cells of the route that are in view follow.
    """
    ahead = doing.progress.reservations.held[place:]
    if doing.free_drive:
        ahead = (*ahead, *doing.progress.route)[: 2 * VIEW + 1]
    return ahead[: ahead.index(doing.goal.cell) + 1] if stops_in(doing, ahead) else ahead


def stops_in(doing: Doing, ahead: Sequence[int]) -> bool:
    """Return True if one of the cells ahead holds the next stop: the robot drives over it, whatever comes then."""
    return doing.goal.cell in ahead and not doing.inputs.done and doing.inputs.goal is not None


def waypoints(
    doing: Doing, ahead: Sequence[int], alone: Collection[int], cells: CellMap, settings: TrafficSettings
) -> tuple[Point, ...]:
    """Return the points to drive to, in order [m]. ``alone`` are the held cells that no other robot holds too."""
    progress, goal = doing.progress, doing.goal
    back = [cell for cell in way_back(progress, ahead[0], cells) if cell in progress.reservations.held]
    points = [cells.centre(cell) for cell in (ahead[0], *back[:1], *ahead[1:])]
    if ahead[0] not in alone:  # another robot is in this cell too: do not drive to its middle
        points = points[1:] or [(doing.inputs.pose.x, doing.inputs.pose.y)]
    if stops_in(doing, ahead) and goal.wish is not None:
        points[-1] = goal.place(goal.wish, settings.standing_room, cells)
    elif progress.route and (
        progress.route[0] == doing.leans_to or (settings.in_sight and cells.is_blind(progress.head, progress.route[0]))
    ):
        points.append(cells.leaning(progress.head, progress.route[0], settings.leaning_room))
    elif not progress.route and progress.head == goal.cell and goal.wish is not None:
        points[-1] = goal.place(goal.wish, settings.standing_room, cells)
    return tuple(points)


def looks(doing: Doing, settings: TrafficSettings) -> bool:
    """Return True if the robot has to reach a certain point in its cell, from which it claims or looks."""
    if not doing.progress.route:
        return False
    if settings.in_sight or doing.leans_to is not None:
        return True
    return not doing.situation.fresh.keys() | doing.situation.mutes >= set(doing.waits)


def activity(doing: Doing) -> TrafficActivity:
    """Return the activity of the robot: the first in this order that applies."""
    progress, joint = doing.progress, doing.joint
    if doing.stopped:
        return TrafficActivity.HALTED
    if joint.frozen is not None:
        return TrafficActivity.LEADING if joint.collect is not None else TrafficActivity.STANDING
    if doing.listens:
        return TrafficActivity.LISTENING
    if doing.face is not None:
        return TrafficActivity.LOOKING
    if not progress.route and progress.head == doing.goal.cell:
        return TrafficActivity.ARRIVED
    if doing.waits and len(progress.reservations.held) == 1:
        return TrafficActivity.WAITING
    if not progress.route:
        return TrafficActivity.WAITING if joint.epoch is not None else TrafficActivity.CUT_OFF
    return TrafficActivity.CUT_OFF if stands_before_body(doing) else TrafficActivity.DRIVING


def stands_before_body(doing: Doing) -> bool:
    """Return True if the robot is at its head, and a body stands in the next cell of its way: its goal, then."""
    held, route = doing.progress.reservations.held, doing.progress.route
    return len(held) == 1 and bool(route) and route[0] in doing.situation.blocked


def hinderers(doing: Doing, cells: CellMap) -> tuple[str, ...]:
    """Return the robots that a robot waits for, also those that shut its way: silent, or told to stop.

    Decisions are made without those that shut its way: no claim and no joint plan moves them.
    """
    if doing.waits or activity(doing) is not TrafficActivity.CUT_OFF:
        return doing.waits
    situation, route = doing.situation, doing.progress.route
    cell = route[0] if route else first_shut(situation.head, situation.goal, situation.blocked, cells)
    return tuple([robot for robot, record in situation.others.items() if keeps(record, cell)])


def first_shut(start: int, goal: int, shut: Collection[int], cells: CellMap) -> int:
    """Return the first of the cells that are ``shut`` on a shortest way over the floor; OUTSIDE: there is none."""
    steps, cell = cells.distances(goal), start
    while cell != goal and steps[cell] < FAR:
        cell = min(cells.neighbours[cell], key=steps.__getitem__)
        if cell in shut:
            return cell
    return OUTSIDE


def granted(
    doing: Doing,
    body: Footprint,
    peers: PeerRecords,
    still: Sequence[Point],
    broadcast: TrafficBroadcast | None,
    events: Sequence[Event],
    cells: CellMap,
    settings: TrafficSettings,
) -> TrafficOutputs:
    """Return the outputs of a step; ``still`` [m] are bodies that stand near, ``broadcast`` and ``events`` are told."""
    tick, held, place = body.tick, doing.progress.reservations.held, doing.progress.place(body.cell)
    alone, ahead = peers.alone_in(held, tick), way_ahead(doing, place)
    stops, to_look, following = stops_in(doing, ahead), looks(doing, settings), doing.joint.following
    return TrafficOutputs(
        broadcast=broadcast,
        held=held,
        drivable=tuple(dict.fromkeys((*alone, held[place], *doing.free_drive))),
        unconstrained=bool(doing.free_drive),
        waypoints=waypoints(doing, ahead, alone, cells, settings),
        beside=(*peers.holders_of(held[place], tick), *still),
        may_drive=not doing.stopped,
        threats=doing.threats,
        room=doing.room,
        exactly=stops or to_look,
        looks=not stops and to_look,
        face=doing.face,
        waits=hinderers(doing, cells),
        activity=activity(doing),
        events=tuple(events),
        way=(*held[place:], *doing.progress.route),
        members=following.members if following is not None else (),
    )
