"""One robot's part in traffic: from what it senses and hears in a tick, to what it holds and where it may drive.

Three layers, each safe without the one above. Layer 0: the body stays in the held cells, and stops before unexpected
obstacles (``presence``, ``halting``). Layer 1: a cell is held only once all robots near have acknowledged the claim
(``claiming``, ``reservations``). Layer 2: which way to go, alone (``route``) or by a joint plan (``joint``). The state
is pure: no clock, no I/O, no randomness of its own.
"""

from collections.abc import Callable, Mapping
from functools import partial

from swarm.errors import ConfigError
from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record, TrafficBroadcast
from swarm.traffic.goal import Goal
from swarm.traffic.interface import TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.joint.protocol import Decision, JointPlanning
from swarm.traffic.joint.states import Speaks
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.obstacles.detector import Halt, Halting, robot_at
from swarm.traffic.obstacles.inspection import Lookout
from swarm.traffic.obstacles.tracker import Kept, Threat
from swarm.traffic.outputs import granted
from swarm.traffic.own_record import Telling
from swarm.traffic.own_route import OwnWay
from swarm.traffic.peers.records import Event, PeerRecords
from swarm.traffic.peers.sightings import Sightings
from swarm.traffic.peers.situation import Situation
from swarm.traffic.peers.step_aside import Aside
from swarm.traffic.reservations.claims import Claiming
from swarm.traffic.reservations.presence import (
    Footprint,
    Presence,
    awoken,
    footprint_of,
    free_drive_cells,
    given_back,
    owned_up,
    spread,
)  # fmt: skip
from swarm.traffic.reservations.route import RouteProgress
from swarm.traffic.reservations.side_cells import room_beside
from swarm.traffic.reservations.stopped import brought_to_rest, kept_cells
from swarm.traffic.result import Doing
from swarm.traffic.settings import LEAST_CLAIM, TrafficSettings

__all__ = ["Traffic", "TrafficActivity", "TrafficInputs", "TrafficOutputs"]

Halted = tuple[RouteProgress, Halt, tuple[Event, ...]]


class Traffic:
    """The traffic of one robot. ``slot`` is its place in the round of broadcasts."""

    def __init__(self, me: str, cells: CellMap, settings: TrafficSettings, *, slot: int = 0) -> None:
        if settings.claim_radius < LEAST_CLAIM * cells.side:
            raise ConfigError(
                f"radio range {settings.radio_range} m is too short for cells of {cells.side} m: a robot claims no "
                f"farther than (range - 1)/2, which must be at least {LEAST_CLAIM} cells; "
                "make cells smaller or the range longer"
            )
        self.me = me
        self.settings = settings
        self._peers = PeerRecords(me, settings)
        self._sightings = Sightings(settings)
        self._presence = Presence()
        self._halting = Halting(settings)
        self._joint = JointPlanning(me, settings)
        self._own_way = OwnWay()
        self._claiming = Claiming(me, settings)
        self._lookout = Lookout(settings)
        self._telling = Telling(me, settings, slot, cells.side)
        self._goal = Goal()
        self._aside = Aside()
        self._progress: RouteProgress | None = None
        self._listen_until = 0  # tick
        self._moved = 0  # tick of its last progress
        self._threats: tuple[Threat, ...] = ()  # obstacles that move near it
        self._kept = Kept()
        self._joins = cells.neighbours  # of the last tick

    def step(self, inputs: TrafficInputs, cells: CellMap) -> TrafficOutputs:
        """Compute the outputs of one tick; call it each tick, before the motors run.

        The ``cells`` may be those of another floor than in the last tick, but on the same lattice. Held cells and what
        is known of others stay then; claims, the way and a joint plan are void. If robots learn the floor, only what
        the new cells break is void.
        """
        # where it is, and what the others say
        tick = inputs.tick
        body = footprint_of(inputs, self.settings.radius + self.settings.margin, cells)
        progress = self._present(body, cells)
        if cells.neighbours is not self._joins:
            progress = self._over_new_cells(progress, body, cells)
        self._joins = cells.neighbours
        listens = tick < self._listen_until
        events = self._peers.hear(tick, cells, inputs.heard, inputs.mute)
        fresh = self._peers.fresh(tick)
        self._sightings.hear(tick, fresh.values())
        if self._peers.mutes:
            inputs = self._aside.look(inputs, self._peers.mutes, progress.head, self._held_by_others(), cells)

        # layer 0: the cells that the body needs, and unexpected obstacles
        waits_here = listens or self._joint.frozen is not None or not progress.route or inputs.stands
        shut_in = waits_here or self.settings.in_sight  # it comes to rest in held cells
        free_drive = () if shut_in else free_drive_cells(body, self._peers.others, fresh, cells, self.settings)
        if free_drive:
            progress, body = spread(progress, inputs, cells, self.settings)
        threats = self._threats
        progress = self._presence.kept_on_way(progress, body, cells, threatened=bool(threats))
        asks = not free_drive and self._joint.frozen is None and not listens
        room = room_beside(progress, inputs, fresh, threats, cells) if asks else ()
        before, progress = progress.on_way, progress.released(body.touched, body.cell, room)
        self._moved = tick if progress.on_way < before else self._moved
        other_goal = self._goal.set(inputs.goal, progress, body, cells, self.settings.radius)
        stays = self._peers.mutes.stays(tick)
        if stays and not stays.isdisjoint(set(progress.reservations.held) - body.touched):
            progress = given_back(progress, body, cells)
        progress, halt, halted = self._halt(progress, inputs, body, cells)
        self._threats = halt.threats

        # layer 2: which way
        if other_goal or not progress.following:
            self._joint.leave()
        situation = self._situation(inputs, progress, fresh, cells)
        decision = self._decide_jointly(situation, stands=inputs.stands)
        events += (*halted, *decision.events)
        found = self._find_way(progress, situation, decision.way, inputs) if not inputs.stands else progress
        progress = brought_to_rest(progress, body, cells) if inputs.stands else found

        # layer 1: which of its cells
        waits: tuple[str, ...] = ()
        face = None
        if self._joint.frozen is not None or inputs.stands:
            progress = progress.without_claims()
        elif not listens:
            progress, waits, took = self._claiming.step(progress, self._joint.following, situation, body, room)
            self._moved = tick if took else self._moved
            face = self._look(progress, situation, waits, inputs)
        self._progress = progress
        complaint = self._peers.mutes.complaint(tick, waits)
        events += [Event("mute_in_the_way", (self.me, *waits), complaint)] if complaint else []

        # what it tells, and where it may drive
        doing = Doing(
            inputs, situation, progress, self._goal, self._joint, waits, listens, halt.stopped, face,
            self._lookout.leans_to, free_drive, self._moved, room, threats,
        )  # fmt: skip
        speaks = self._telling.is_due(tick, often=listens or self._peers.somebody_listens(tick))
        if speaks and not inputs.stands:
            held, ahead = progress.reservations.held, progress.route[: self.settings.ahead]
            self._joint.ask(Speaks(self.me, held, ahead, waits, self._joint.epoch, self._moved, situation))
        broadcast = self._broadcast(doing) if speaks else None
        silent, found_at = self._peers.fallen_silent(tick), self._halting.places(tick)
        still = self._lookout.still_bodies(silent, found_at, body.pose, cells)
        return granted(doing, body, self._peers, still, broadcast, events, cells, self.settings)

    def _held_by_others(self) -> set[int]:
        return {cell for record in self._peers.others.values() for cell in record.held}

    # ---- the floor, the body and its cells

    def _over_new_cells(self, progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
        """Return the progress on new cells. What is ahead is void; on a learned floor, only if a join is shut."""
        self._goal.wish = None  # the goal's cell is chosen again
        if self.settings.learns:
            if not progress.shut(cells, body.cell):
                return progress._replace(sought=False)
            if not progress.shut(cells, body.cell, route=False):
                return progress.nowhere()
        self._joint.void()
        self._goal.cell = OUTSIDE
        return progress.over(cells, body.touched, body.cell)

    def _present(self, body: Footprint, cells: CellMap) -> RouteProgress:
        """Return the progress at this tick: begun, awoken, or with the cells that the body has strayed into."""
        progress, away = self._progress, self._presence.was_away(body.tick, self.settings.gap)
        if progress is not None and not away:
            return owned_up(progress, body, cells, self.settings.radius)
        self._listen_until, self._moved = body.tick + self.settings.listen, body.tick
        self._joint.wake(body.tick)
        self._peers.wake(body.tick)
        return awoken(progress, body, cells)

    # ---- unexpected obstacles

    def robot_at(self, tick: int, cells: CellMap) -> Callable[[Point], bool]:
        """Return a test: True if another robot's body may be at a point [m] at ``tick``.

        While this robot listens, others may be anywhere.
        """
        if self._progress is None or tick < self._listen_until:
            return lambda place: True
        return robot_at(self._peers.others.values(), tick, cells, self.settings)

    def _halt(self, progress: RouteProgress, inputs: TrafficInputs, body: Footprint, cells: CellMap) -> Halted:
        """Stop before an unexpected obstacle; if it stays, give back the cells ahead and plan round it."""
        if self.settings.learns and inputs.tick < self._listen_until:
            return progress, Halt(stopped=False), ()  # it has learned no walls yet, and stands still
        mine = self._peers.alone_in(progress.reservations.held, inputs.tick)
        halt = self._halting.look(inputs, self._peers.expected(), mine, cells)
        kept_from = self._kept.look(progress, body.cell, threatened=bool(halt.threats))
        if kept_from is not None:
            self._sightings.note(kept_from, empty=False, tick=inputs.tick)
            text = f"gave up cell {kept_from}: a moving obstacle blocks the way into it"
            return given_back(progress, body, cells), halt, (Event("halted", (self.me,), text),)
        if halt.found is None:
            return progress, halt, ()
        cell = cells.cell_of(*halt.found)
        if cell not in {OUTSIDE, body.cell}:
            self._sightings.note(cell, empty=False, tick=inputs.tick)
        if len(progress.reservations.held) > 1 and not halt.threats:
            progress = given_back(progress, body, cells)
        gap = max(0.0, distance(halt.found, inputs.pose) - self.settings.radius)
        text = f"stopped: unexpected obstacle {gap:.1f} m ahead, in cell {cell}"
        return progress, halt, (Event("halted", (self.me,), text),)

    # ---- which way, and which of its cells

    def _situation(
        self, inputs: TrafficInputs, progress: RouteProgress, fresh: Mapping[str, Record], cells: CellMap
    ) -> Situation:
        others = self._peers.others
        return Situation(
            tick=inputs.tick,
            cells=cells,
            head=progress.head,
            goal=self._goal.cell,
            idle=inputs.goal is None,
            moved=self._moved,
            blocked=self._sightings.occupied() | kept_cells(fresh),
            cleared=self._sightings.cleared(others, self._peers.heard_lately(inputs.tick)),
            others=others,
            fresh=fresh,
            done=inputs.done,
            wants=self._goal.since,
            bodies=partial(self._lookout.remembered, self._peers.fallen_silent(inputs.tick), cells),
            mutes=self._peers.mutes.names,
            stays=self._peers.mutes.stays(inputs.tick),
        )

    def _decide_jointly(self, situation: Situation, *, stands: bool) -> Decision:
        if not stands:
            return self._joint.step(situation)
        self._joint.void()
        return Decision()

    def _find_way(
        self, progress: RouteProgress, situation: Situation, adopted: tuple[int, ...] | None, inputs: TrafficInputs
    ) -> RouteProgress:
        """Take the way of the joint plan adopted in this step, or keep to the plan, or find a way of its own."""
        if adopted is not None:
            if situation.idle:
                self._goal.cell = adopted[-1]
            self._moved = situation.tick
            return progress.onto(adopted).without_stale_claims()
        plan = self._joint.following
        if plan is not None and plan.keeps(progress, situation) and situation.stays.isdisjoint(progress.route[:1]):
            return progress
        self._joint.leave()
        return self._own_way.find(progress, situation, inputs.path, self._goal.way_out)

    def _look(
        self, progress: RouteProgress, situation: Situation, waits: tuple[str, ...], inputs: TrafficInputs
    ) -> Point | None:
        """Look at the next cell if only silent robots keep it; return the point to turn to [m], or None."""
        face, seen = self._lookout.look(progress, situation, waits, inputs)
        if seen is not None:
            self._sightings.note(seen.cell, empty=seen.empty, tick=seen.tick)
            if not seen.empty:
                self._joint.leave()
        return face

    # ---- what it tells, and where it may drive

    def _broadcast(self, doing: Doing) -> TrafficBroadcast:
        tick, pose = doing.inputs.tick, doing.inputs.pose
        own = self._telling.record(doing, self._sightings.told(), self._halting.moving())
        return TrafficBroadcast(own=own, others=self._peers.passed_on(tick, pose.x, pose.y))
