"""One robot's part in traffic: told each tick what it senses and hears, it says what it holds and where it may drive.

Three layers, each safe without the one above. 0: the body stays in the cells held, and stops for unexpected obstacles
(``presence``, ``halting``). 1: a cell is held only once all near have acknowledged the claim (``claiming``, ``holds``).
2: which way to go, alone (``route``) or by a joint plan (``joint``). Pure in its state: no clock, no I/O, no chance of
its own.
"""

from collections.abc import Callable, Mapping

from msgspec.structs import replace

from swarm.errors import ConfigError
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record, TrafficBroadcast
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.claiming import Claiming
from swarm.traffic.doing import Doing
from swarm.traffic.goal import Goal
from swarm.traffic.granting import activity, looks, stops_in, way_ahead, waypoints
from swarm.traffic.halting import Halt, Halting, robot_at
from swarm.traffic.hearsay import Event, Hearsay
from swarm.traffic.interface import TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.joint import JointPlanning
from swarm.traffic.lookout import Lookout
from swarm.traffic.presence import Body, Presence, awoken, body_of, cells_for_me_alone, given_back, owned_up, spread
from swarm.traffic.room import room_beside
from swarm.traffic.route import OwnWay
from swarm.traffic.settings import LEAST_CLAIM, TrafficSettings
from swarm.traffic.sightings import Sightings
from swarm.traffic.situation import Situation
from swarm.traffic.telling import Telling
from swarm.traffic.threat import Kept, Threat
from swarm.traffic.walk import Walk

__all__ = ["Traffic", "TrafficActivity", "TrafficInputs", "TrafficOutputs"]


class Traffic:
    """One robot's traffic. ``slot`` is its place in the round of broadcasts."""

    def __init__(self, me: str, cells: CellMap, settings: TrafficSettings, *, slot: int = 0) -> None:
        if settings.claim_radius < LEAST_CLAIM * cells.side:
            raise ConfigError(
                f"radio range {settings.radio_range} m is too short for cells of {cells.side} m: a robot claims no "
                f"farther than (range - 1)/2, which must be at least {LEAST_CLAIM} cells; "
                "make cells smaller or the range longer"
            )
        self.me = me
        self.cells = cells
        self.settings = settings
        self._hearsay = Hearsay(me, cells, settings)
        self._sightings = Sightings(settings)
        self._presence = Presence()
        self._halting = Halting(cells, settings)
        self._joint = JointPlanning(me, cells, settings)
        self._own_way = OwnWay()
        self._claiming = Claiming(me, cells, settings)
        self._lookout = Lookout(cells, settings)
        self._telling = Telling(me, settings, slot)
        self._goal = Goal()
        self._walk: Walk | None = None
        self._listen_until = 0  # tick
        self._moved = 0  # tick at which it last got on
        self._threat: Threat | None = None  # what comes towards it
        self._kept = Kept()
        self._new_cells: CellMap | None = None

    def take_cells(self, cells: CellMap) -> None:
        """Take another floor, on the same lattice, from the next step on.

        What is held and what is known of others stays; claims, the way and a joint plan are void. Where robots learn
        the floor, only what the new cells break is.
        """
        self._new_cells = cells

    def step(self, inputs: TrafficInputs) -> TrafficOutputs:
        """Take one tick's inputs; call it each tick, before the motors run."""
        # where it is, and what the others say
        tick, cells_changed = inputs.tick, self._swap_cells()
        body = body_of(inputs, self.settings.radius + self.settings.margin, self.cells)
        walk = self._present(body)
        if cells_changed:
            walk = self._over_new_cells(walk, body)
        listens = tick < self._listen_until
        events = self._hearsay.hear(tick, inputs.heard)
        fresh = self._hearsay.fresh(tick)
        self._sightings.hear(tick, fresh.values())

        # layer 0: the cells that the body needs, and unexpected obstacles
        floor = self._floor_for_me_alone(walk, body, fresh)
        if floor:
            walk, body = spread(walk, inputs, self.cells, self.settings)
        threat = self._threat
        walk = self._presence.kept_on_way(walk, body, self.cells, threatened=threat is not None)
        asks = not floor and self._joint.frozen is None and not listens
        room = room_beside(walk, inputs, fresh, threat, self.cells) if asks else ()
        walk = self._release(walk, body, room)
        other_goal = self._goal.set(inputs.goal, walk, body, self.cells, self.settings.radius)
        walk, halt, halted = self._halt(walk, inputs, body)
        self._threat = halt.threat

        # layer 2: which way
        if other_goal or not walk.following:
            self._joint.leave()
        situation = self._situation(inputs, walk, fresh)
        decision = self._joint.step(situation)
        events += (*halted, *decision.events)
        walk = self._find_way(walk, situation, decision.way, inputs)

        # layer 1: which of its cells
        waits: tuple[str, ...] = ()
        face = None
        if self._joint.frozen is not None:
            walk = walk.without_claims()
        elif not listens:
            walk, waits, took = self._claiming.step(walk, self._joint.following, situation, body, room)
            self._moved = tick if took else self._moved
            face = self._look(walk, situation, waits, inputs)
        self._walk = walk

        # what it tells, and where it may drive
        doing = Doing(
            inputs, situation, walk, self._goal, self._joint, waits, listens, halt.stopped, face,
            self._lookout.leans_to, floor, self._moved, room, threat,
        )  # fmt: skip
        return self._outputs(doing, body, self._broadcast(doing), events)

    # ---- the floor, the body and its cells

    def _swap_cells(self) -> bool:
        """Take the new floor, if there is one, in every part that knows the cells; return True if joins differ."""
        cells, self._new_cells = self._new_cells, None
        if cells is None:
            return False
        changed = cells.neighbours is not self.cells.neighbours
        self.cells = cells
        self._hearsay.cells = self._halting.cells = self._claiming.cells = self._lookout.cells = cells
        self._joint.take_cells(cells)
        return changed

    def _over_new_cells(self, walk: Walk, body: Body) -> Walk:
        """Return the walk on new cells: what is ahead is void, where robots learn the floor only if it is broken."""
        self._goal.wish = None  # the goal's cell is chosen again
        if self.settings.learns:
            if not walk.shut(self.cells, body.cell):
                return walk._replace(sought=False)
            if not walk.shut(self.cells, body.cell, route=False):
                return walk.nowhere()
        self._joint.void()
        self._goal.cell = OUTSIDE
        return walk.over(self.cells, body.touched, body.cell)

    def _present(self, body: Body) -> Walk:
        """Bring the walk up to now: begin, wake up, or own up to having left the held cells."""
        walk, away = self._walk, self._presence.was_away(body.tick, self.settings.gap)
        if walk is not None and not away:
            return owned_up(walk, body, self.cells, self.settings.radius)
        self._listen_until = body.tick + self.settings.listen
        self._moved = body.tick
        self._joint.reset(body.tick)
        self._hearsay.wake(body.tick)
        return awoken(walk, body, self.cells)

    def _floor_for_me_alone(self, walk: Walk, body: Body, fresh: Mapping[str, Record]) -> tuple[int, ...]:
        """List the cells to drive in beside those held, while nobody is so near that any of them could be asked for.

        () where others are near, and where the goal is: it is come to rest at inside held cells.
        """
        listens = body.tick < self._listen_until
        if listens or self._joint.frozen is not None or not walk.route or self.settings.in_sight:
            return ()
        return cells_for_me_alone(body, self._hearsay.others, fresh, self.cells, self.settings)

    def _release(self, walk: Walk, body: Body, room: tuple[int, ...]) -> Walk:
        released = walk.released(body.touched, body.cell, room)
        if released.on_way < walk.on_way:
            self._moved = body.tick
        return released

    # ---- unexpected obstacles

    def robot_at(self, tick: int) -> Callable[[Point], bool]:
        """Return the test whether another robot's body may be at a place [m] at a tick.

        While it listens for who is near, it may be anywhere.
        """
        if self._walk is None or tick < self._listen_until:
            return lambda place: True
        return robot_at(self._hearsay.others.values(), tick, self.cells, self.settings)

    def _halt(self, walk: Walk, inputs: TrafficInputs, body: Body) -> tuple[Walk, Halt, tuple[Event, ...]]:
        """Stop before an unexpected obstacle; where it stays, give back what is ahead and plan round it."""
        if self.settings.learns and inputs.tick < self._listen_until:
            return walk, Halt(stopped=False), ()  # it has learned no walls yet, and stands
        mine = self._hearsay.alone_in(walk.ledger.held, inputs.tick)
        halt = self._halting.look(inputs, self._hearsay.others.values(), mine)
        kept_from = self._kept.look(walk, body.cell, threatened=halt.threat is not None)
        if kept_from is not None:
            self._sightings.note(kept_from, empty=False, tick=inputs.tick)
            text = f"{self.me} gave up cell {kept_from}: what moves there keeps it from it"
            return given_back(walk, body, self.cells), halt, (Event("halted", (self.me,), text),)
        if halt.found is None:
            return walk, halt, ()
        cell = self.cells.cell_of(*halt.found)
        if cell not in {OUTSIDE, body.cell}:
            self._sightings.note(cell, empty=False, tick=inputs.tick)
        if len(walk.ledger.held) > 1 and halt.threat is None:
            walk = given_back(walk, body, self.cells)
        event = Event("halted", (self.me,), f"{self.me} stopped: unexpected obstacle in cell {cell}")
        return walk, halt, (event,)

    # ---- which way, and which of its cells

    def _situation(self, inputs: TrafficInputs, walk: Walk, fresh: Mapping[str, Record]) -> Situation:
        others = self._hearsay.others
        return Situation(
            tick=inputs.tick,
            head=walk.head,
            goal=self._goal.cell,
            idle=inputs.goal is None,
            moved=self._moved,
            blocked=self._sightings.occupied(),
            cleared=self._sightings.cleared(others, fresh),
            others=others,
            fresh=fresh,
            done=inputs.done,
            wants=self._goal.since,
            bodies=self._lookout.remembered(self._hearsay.fallen_silent(inputs.tick)),
        )

    def _find_way(
        self, walk: Walk, situation: Situation, adopted: tuple[int, ...] | None, inputs: TrafficInputs
    ) -> Walk:
        """Take the way of the joint plan adopted just now, or keep to the plan, or find a way of its own."""
        if adopted is not None:
            if situation.idle:
                self._goal.cell = adopted[-1]
            self._moved = situation.tick
            return walk.onto(adopted).without_stale_claims()
        plan = self._joint.following
        if plan is not None and plan.keeps(walk, situation):
            return walk
        self._joint.leave()
        return self._own_way.find(walk, situation, inputs.path, self.cells, self._goal.way_out)

    def _look(self, walk: Walk, situation: Situation, waits: tuple[str, ...], inputs: TrafficInputs) -> Point | None:
        """Look at the next cell if only silent robots keep it, and return what to turn to [m]."""
        face, seen = self._lookout.look(walk, situation, waits, inputs)
        if seen is not None:
            self._sightings.note(seen.cell, empty=seen.empty, tick=seen.tick)
            if not seen.empty:
                self._joint.leave()
        return face

    # ---- what it tells, and where it may drive

    def _broadcast(self, doing: Doing) -> TrafficBroadcast | None:
        """Return what to tell the others, when it is this robot's turn."""
        tick, pose = doing.inputs.tick, doing.inputs.pose
        if not self._telling.is_due(tick, often=doing.listens or self._hearsay.somebody_listens(tick)):
            return None
        own = self._telling.record(doing, self._sightings.told())
        need = self._joint.ask(own, doing.situation)
        if need is not None:
            own = replace(own, need=need)
        return TrafficBroadcast(own=own, others=self._hearsay.passed_on(tick, pose.x, pose.y))

    def _outputs(
        self, doing: Doing, body: Body, broadcast: TrafficBroadcast | None, events: list[Event]
    ) -> TrafficOutputs:
        tick, held, place = body.tick, doing.walk.ledger.held, doing.walk.place(body.cell)
        alone, ahead = self._hearsay.alone_in(held, tick), way_ahead(doing, place)
        stops, silent = stops_in(doing, ahead), self._hearsay.fallen_silent(tick)
        to_look = looks(doing, self.settings)
        still = self._lookout.still_bodies(silent, self._halting.places(tick), body.pose)
        return TrafficOutputs(
            broadcast=broadcast,
            held=held,
            drivable=tuple(dict.fromkeys((*alone, held[place], *doing.floor))),
            at_large=bool(doing.floor),
            waypoints=waypoints(doing, ahead, alone, self.cells, self.settings),
            beside=(*self._hearsay.holders_of(held[place], tick), *still),
            may_drive=not doing.stopped,
            threat=doing.threat,
            room=doing.room,
            exactly=stops or to_look,
            looks=not stops and to_look,
            face=doing.face,
            waits=doing.waits,
            activity=activity(doing),
            events=tuple(events),
            way=(*held[place:], *doing.walk.route),
            members=self._joint.following.members if self._joint.following is not None else (),
        )
