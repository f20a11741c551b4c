"""One robot's part in traffic: told each tick what it senses and hears, it says what it holds and where it may drive.

Three layers, each safe without the one above. 0: the body stays in the cells held, and stops for unexpected obstacles
(``halting``). 1: a cell is held only once all near have acknowledged the claim (``holds``). 2: which way to go, alone
or by a joint plan (``joint``). Pure in its state: no clock, no I/O, no chance of its own.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from math import hypot
from typing import Final

from swarm.errors import ConfigError
from swarm.geometry import Pose, bearing, distance
from swarm.maps.occupancy import Point
from swarm.traffic.cells import FAR, OUTSIDE, CellMap
from swarm.traffic.claiming import Claiming
from swarm.traffic.halting import Halt, Halting, robot_at
from swarm.traffic.hearsay import Event, Hearsay
from swarm.traffic.holds import Acks, Ledger, acknowledged
from swarm.traffic.interface import TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.joint import JointPlanning
from swarm.traffic.look import View, has_gone, is_out_of_range, view
from swarm.traffic.need import Needs
from swarm.traffic.record import Record, TrafficBroadcast
from swarm.traffic.route import own_way
from swarm.traffic.settings import LEAST_CLAIM, TrafficSettings
from swarm.traffic.sightings import Sightings, keeps
from swarm.traffic.situation import Situation
from swarm.traffic.walk import ALONE, BESIDE, Walk

__all__ = ["Traffic", "TrafficActivity", "TrafficInputs", "TrafficOutputs"]

RETRY: Final = 20  # ticks between two tries to find a way where there was none
FACING: Final = 0.1  # rad, off the cell looked at
VIEW: Final = 2  # cells about the body that are thought of when nobody is near
LEANS: Final = 0.1  # m, off the place where it leans
CENTRED: Final = 0.25  # m, off the middle of the cell looked from


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
        self._slot = slot
        self._hearsay = Hearsay(me, cells, settings)
        self._halting = Halting(cells, settings)
        self._joint = JointPlanning(me, cells, settings)
        self._claiming = Claiming(me, cells, settings, self._joint)
        self._needs = Needs(me, settings)
        self._walk: Walk | None = None
        self._threat: Point | None = None  # where something is that comes towards it
        self._fled = False  # it has left its way for that
        self._last_tick = -1
        self._listen_until = 0
        self._moved = 0
        self._on_way = 0
        self._goal = OUTSIDE
        self._wants = 0  # tick since which it has had this goal
        self._way_out: tuple[int, ...] = ()  # of a cell that is none to stand in
        self._wish: Point | None = None
        self._stand_for: tuple[CellMap, int, Point] | None = None  # where in its goal's cell it wants to be,
        self._stand: Point = (0.0, 0.0)  # and where it can stand
        self._agreed_for: tuple[Ledger, Mapping[str, Record]] | None = None  # what it holds and what others claim,
        self._agreed: Acks = ()  # and to which of their claims it agrees
        self._route_for: tuple[int, frozenset[int]] | None = None
        self._retry_at = 0
        self._sightings = Sightings(settings)
        self._leans_to: int | None = None  # the cell that cannot be judged from the middle of this one
        self._gone: dict[str, int] = {}  # silent robots that are not where they said last, and when they said it
        self._new_cells: CellMap | None = None

    def take_cells(self, cells: CellMap) -> None:
        """Take another floor, on the same lattice, from the next step on.

        What is held and what is known of others stays; claims, the way and a joint plan are void. Where robots learn
        the floor, only what the new cells break is.
        """
        self._new_cells = cells

    def step(self, inputs: TrafficInputs) -> TrafficOutputs:
        """Take one tick's inputs; call it each tick, before the motors run."""
        tick, pose = inputs.tick, inputs.pose
        changed = self._swap_cells()
        body = self.cells.cell_of(pose.x, pose.y)
        footprint = self.settings.radius + self.settings.margin
        touched = self._swept(inputs, footprint)
        walk = self._present(tick, body, touched, pose)
        if changed:
            walk = self._over_new_cells(walk, touched, body)
        events = self._hearsay.hear(tick, inputs.heard)
        fresh = self._hearsay.fresh(tick)
        self._sightings.hear(tick, fresh.values())
        floor = self._floor_for_me_alone(walk, tick, body, pose, fresh)
        if floor:
            touched = self._swept(inputs, footprint + 2 * self.settings.speed * self.settings.tick)
            walk = walk.widened(touched)
            if walk.strayed(body) and self.cells.stands[body]:
                walk = self._begun(walk.ledger.number, touched, pose)
        walk = self._begun_anew(walk, tick, body, touched, pose)
        threat = self._threat
        room = self._room(walk, inputs, fresh, floor)
        walk = self._release(walk, touched, body, tick, room)
        self._set_goal(inputs.goal, walk, pose)
        walk, halt = self._halt(walk, inputs, touched, events)
        self._threat = halt.threat

        situation = Situation(
            tick,
            walk.head,
            self._goal,
            inputs.goal is None,
            self._moved,
            self._sightings.occupied(),
            self._sightings.cleared(self._hearsay.others, fresh),
            self._hearsay.others,
            fresh,
            inputs.done,
            self._wants,
            self._remembered(tick),
        )
        events += self._joint.step(situation)
        walk = self._find_way(walk, situation, inputs.path)
        waits: tuple[str, ...] = ()
        face = None
        if self._joint.frozen is not None:
            walk = walk._replace(ledger=walk.ledger.withdraw(walk.ledger.all_claims))
        elif tick >= self._listen_until:
            walk, waits = self._claiming.advance(walk, situation, pose, body)
            self._moved = max(self._moved, self._claiming.took_at)
            if not self.settings.in_sight:
                walk = self._claiming.make_room(walk, situation, pose, room)
            face = self._look(walk, situation, waits, inputs)
        self._walk = walk
        sends = self._speaks(tick)
        if sends:
            self._joint.need = None
            may_need = self._joint.frozen is None and walk.route and (waits or self._joint.epoch is not None)
            if may_need and self._needs.joint_plan(self._own_record(inputs, waits), situation, self._joint):
                self._joint.ask(situation)
        return self._outputs(inputs, walk, walk.place(body), waits, face, halt, events, sends, floor, room, threat)

    def _speaks(self, tick: int) -> bool:
        """Return True if it is this robot's turn to broadcast; more often where somebody has just begun to listen."""
        settings = self.settings
        listens = tick < self._listen_until or self._hearsay.somebody_listens(tick)
        return (tick + self._slot) % (settings.often if listens else settings.every) == 0

    def _swap_cells(self) -> bool:
        """Take the new floor, if there is one, in every part that knows the cells; return True if joins differ."""
        cells, self._new_cells = self._new_cells, None
        if cells is None:
            return False
        changed = cells.neighbours is not self.cells.neighbours
        self.cells = cells
        self._hearsay.cells = self._halting.cells = self._claiming.cells = self._joint.cells = cells
        return changed

    def _over_new_cells(self, walk: Walk, touched: frozenset[int], body: int) -> Walk:
        """Return the walk on new cells: what is ahead is void, where robots learn the floor only if it is broken."""
        self._route_for = None
        self._wish = None  # the goal's cell is chosen again
        if self.settings.learns:
            if not walk.shut(self.cells, body):
                return walk
            self._joint.leave()
            if not walk.shut(self.cells, body, route=False):
                return walk.alone(())
        self._joint.void()
        self._goal = OUTSIDE
        return walk.over(self.cells, touched, body)

    # ---- the body and its cells

    def _swept(self, inputs: TrafficInputs, radius: float) -> frozenset[int]:
        """Return the cells that a disc about the body reaches into, now and until it has come to rest."""
        under = self.cells.swept(((inputs.pose.x, inputs.pose.y),), radius)
        return under | self.cells.swept(inputs.braking, radius) if len(inputs.braking) else under

    def _present(self, tick: int, body: int, touched: frozenset[int], pose: Pose) -> Walk:
        """Bring the walk up to now: begin, wake up, or own up to having left the held cells."""
        walk, gap = self._walk, tick - self._last_tick
        self._last_tick = tick
        if walk is not None and gap <= self.settings.gap:
            if touched.issubset(walk.ledger.held):
                return walk
            under = frozenset(self.cells.touched(pose.x, pose.y, self.settings.radius)) - {OUTSIDE}
            return walk.widened(under)  # pushed, or driven badly: what the body is in is no longer free
        self._listen_until = tick + self.settings.listen
        self._moved = tick
        self._joint.reset(tick)
        self._hearsay.wake(tick)
        if walk is not None and touched <= set(walk.ledger.held) and not walk.strayed(body):
            return walk.awoken(touched)
        if walk is None:
            return self._begun(tick * 64 + 1, touched, pose)
        return self._begun(walk.ledger.number, touched & set(walk.ledger.held) or touched, pose)

    def _begun(self, number: int, touched: frozenset[int], pose: Pose) -> Walk:
        """Begin a way where the robot is, and hold no more than it touches."""
        self._joint.leave()
        self._route_for = None
        head = self.cells.nearest_standable(pose.x, pose.y, touched)
        held = (*sorted(touched - {head}), head)
        return Walk(Ledger(held, (), number), (BESIDE,) * (len(held) - 1) + (ALONE,))

    def _floor_for_me_alone(
        self, walk: Walk, tick: int, body: int, pose: Pose, fresh: Mapping[str, Record]
    ) -> tuple[int, ...]:
        """List the cells to drive in beside those held, while nobody is so near that any of them could be asked for.

        The body then holds what it and its brake need, and nothing hems in the fuzzy tables. () where others are near,
        and where the goal is: it is come to rest at inside held cells.
        """
        if tick < self._listen_until or self._joint.frozen is not None or not walk.route or self.settings.in_sight:
            return ()
        cells, settings = self.cells, self.settings
        (x, y, _), alone = pose, settings.alone
        if min([hypot(record.x - x, record.y - y) for record in fresh.values()], default=alone) < alone:
            return ()
        theirs = {
            cell
            for record in self._hearsay.others.values()
            for cell in (*record.held, *(claim.cell for claim in record.claims))
        }
        about = cells.around(body, VIEW)
        return () if not theirs.isdisjoint(about) else tuple(cell for cell in about if cells.stands[cell])

    def _begun_anew(self, walk: Walk, tick: int, body: int, touched: frozenset[int], pose: Pose) -> Walk:
        """Begin the way anew where the robot is if it has been off it for long."""
        strayed = walk.strayed(body)
        self._fled = strayed and (self._fled or self._threat is not None)
        if not strayed or (walk.following and not self._fled and walk.is_beside(body, self.cells)):
            self._on_way = tick
        elif tick - self._on_way > 30 and body != OUTSIDE and self.cells.stands[body]:
            self._on_way = tick
            return self._begun(walk.ledger.number, touched, pose)
        return walk

    def _room(
        self, walk: Walk, inputs: TrafficInputs, fresh: Mapping[str, Record], floor: Collection[int]
    ) -> tuple[int, ...]:
        """List the cells to drive in beside the way, as far as nobody else needs them; before a threat, all round."""
        if floor or self._joint.frozen is not None or inputs.tick < self._listen_until:
            return ()
        body, threat = self.cells.cell_of(*inputs.pose[:2]), self._threat
        if threat is None and (not inputs.sweeps or walk.place(body) == len(walk.ledger.held) - 1):
            return ()
        needed = {
            cell
            for record in fresh.values()
            for cell in (*record.ahead, *[claim.cell for claim in record.claims], *record.held)
        }
        if threat is not None:
            near = distance(threat, inputs.pose)
            off = [cell for cell in self.cells.around(body, 1) if distance(threat, self.cells.centre(cell)) > near]
            return tuple([cell for cell in off if self.cells.stands[cell] and cell not in needed])
        way = [cell for cell, step in zip(walk.ledger.held, walk.steps, strict=True) if step != BESIDE]
        across = {cell + off for cell in way for off in (-1, 1, -self.cells.columns, self.cells.columns)}
        return tuple(cell for cell in inputs.sweeps if cell in across and cell not in needed)

    def _release(self, walk: Walk, touched: frozenset[int], body: int, tick: int, room: tuple[int, ...]) -> Walk:
        released = walk.released(touched, body, room)
        if released is not walk:
            self._moved = tick
        return released

    def _set_goal(self, goal: Point | None, walk: Walk, pose: Pose) -> None:
        """Turn the place wanted into a cell that can be stood in and reached by a way of the map."""
        if goal is None:
            if self._wish is not None or self._goal == OUTSIDE:
                self._goal = walk.head
        elif goal != self._wish or self._goal == OUTSIDE or self._way_out or not self.cells.stands[self._goal]:
            self._way_out = self._find_way_out(walk, pose)
            cell = self._way_out[0] if self._way_out else self.cells.cell_of(*goal)
            table = self.cells.distances(cell if self._way_out else walk.head)
            if cell == OUTSIDE or table[cell] >= FAR:
                reachable = [other for other, steps in enumerate(table) if steps < FAR]
                cell = min(reachable, key=lambda other: (distance(self.cells.centre(other), goal), other))
            if cell != self._goal:
                self._goal, self._wants = cell, self._last_tick
                self._joint.leave()
        self._wish = goal

    def _find_way_out(self, walk: Walk, pose: Pose) -> tuple[int, ...]:
        """Return the cell to drive to, as a way, where an edit has left the body in a cell that is none to stand in.

        No way of the map leads from there. () where it stands in a cell of the map, or every cell beside is shut off.
        """
        cells, head = self.cells, walk.head
        if cells.stands[head] or any(step != BESIDE for step in walk.steps[:-1]):
            return ()
        middles = {cell: cells.centre(cell) for cell in cells.around(head, 1) if cells.stands[cell]}
        near = sorted(middles, key=lambda cell: (distance(middles[cell], pose), cell))
        here = (pose.x, pose.y)
        return next(((cell,) for cell in near if cells.in_sight(here, middles[cell], self.settings.radius)), ())

    # ---- layer 0: unexpected obstacles

    def robot_at(self, tick: int) -> Callable[[Point], bool]:
        """Return the test whether another robot's body may be at a place [m] at a tick.

        While it listens for who is near, it may be anywhere.
        """
        if self._walk is None or tick < self._listen_until:
            return lambda place: True
        return robot_at(self._hearsay.others.values(), tick, self.cells, self.settings)

    def _halt(
        self, walk: Walk, inputs: TrafficInputs, touched: frozenset[int], events: list[Event]
    ) -> tuple[Walk, Halt]:
        """Stop before an unexpected obstacle; where it stays, give back what is ahead and plan round it."""
        if self.settings.learns and inputs.tick < self._listen_until:
            return walk, Halt(stopped=False)  # it has learned no walls yet, and stands
        mine = self._hearsay.alone_in(walk.ledger.held, inputs.tick)
        halt = self._halting.look(inputs, self._hearsay.others.values(), mine)
        if halt.found is not None:
            cell = self.cells.cell_of(*halt.found)
            events.append(Event("halted", (self.me,), f"{self.me} stopped: unexpected obstacle in cell {cell}"))
            if cell not in {OUTSIDE, self.cells.cell_of(*inputs.pose[:2])}:
                self._sightings.note(cell, empty=False, tick=inputs.tick)
            if len(walk.ledger.held) > 1 and halt.threat is None:
                walk = self._given_back(walk, touched, inputs.pose)
        return walk, halt

    def _given_back(self, walk: Walk, touched: frozenset[int], pose: Pose) -> Walk:
        if BESIDE in walk.steps:  # the one further back need not be one to stand in
            return self._begun(walk.ledger.number, touched & set(walk.ledger.held) or touched, pose)
        self._joint.leave()
        self._route_for = None
        return walk.given_back(touched)

    # ---- layer 2: which way

    def _find_way(self, walk: Walk, situation: Situation, path: Sequence[Point]) -> Walk:
        """Adopt a joint plan's way, or keep to it, or find one's own."""
        joint, tick = self._joint, situation.tick
        if joint.way is not None:
            way, joint.way = joint.way, None
            if situation.idle:
                self._goal = way[-1]
            self._moved = tick
            return self._without_stale_claims(walk.onto(way))
        if joint.epoch is not None and (walk.route or walk.head == self._goal):
            return walk
        if joint.makes_room(situation, under_way=len(walk.ledger.held) > 1):
            return walk
        if joint.epoch is not None and joint.first_at(self._goal, situation.fresh) is not None:
            return walk
        if joint.is_waited_for(walk.ledger.held[:-1], situation):
            return walk  # it was sent aside: to turn back before it has left would make room for nobody
        joint.leave()
        wanted = (self._goal, situation.blocked)
        complete = walk.route[-1] == self._goal if walk.route else walk.head == self._goal
        if self._route_for == wanted and not walk.following and (complete or tick < self._retry_at):
            return walk
        self._retry_at = tick + RETRY
        self._route_for = wanted
        route = self._way_out or own_way(self.cells, walk.head, self._goal, wanted[1] - {walk.head}, path)
        return self._without_stale_claims(walk.alone(route))

    @staticmethod
    def _without_stale_claims(walk: Walk) -> Walk:
        """Withdraw claims for cells that the route does not begin with."""
        claims = walk.ledger.claims
        good = 0
        while good < min(len(claims), len(walk.route)) and claims[good].cell == walk.route[good]:
            good += 1
        return walk._replace(ledger=walk.ledger.withdraw(claims[good:])) if good < len(claims) else walk

    # ---- silent robots

    def _look(self, walk: Walk, situation: Situation, waits: tuple[str, ...], inputs: TrafficInputs) -> Point | None:
        """Turn to the next cell when only robots long silent keep it, and judge it by what the rays see."""
        cell, pose = walk.route[0] if walk.route else OUTSIDE, inputs.pose
        wants = bool(waits) or self._leans_to == cell  # where it leans to look it may not be heard: it asks for nothing
        if not wants or len(walk.ledger.held) > 1 or not self._is_long_silent(cell, waits, situation):
            self._leans_to = None
            return None
        middle, leaning = self.cells.centre(walk.head), self.cells.leaning(walk.head, cell, self.settings.leaning_room)
        leans = distance(leaning, pose) <= LEANS
        if not (leans or distance(middle, pose) <= CENTRED):
            return None
        place = self._remembered_in(cell, situation, inputs)
        if place is not None:
            if abs(bearing(pose, place)) > FACING:
                return place
            if not leans and is_out_of_range(place, pose, self.settings):
                self._leans_to = cell
                return None
            return self._note(cell, empty=False, tick=inputs.tick)
        centre = self.cells.centre(cell)
        if abs(bearing(pose, centre)) > FACING:
            return centre if leans or self._leans_to != cell else None
        seen = view(inputs.scan.readings, pose, cell, self.cells, self.settings.radius)
        if seen is View.HIDDEN and not leans:
            self._leans_to = cell
            return None
        return self._note(cell, empty=seen is View.EMPTY, tick=inputs.tick)

    def _is_long_silent(self, cell: int, waits: tuple[str, ...], situation: Situation) -> bool:
        """Return True if robots keep a cell, and all of them, and all waited for, have been silent for long."""
        others, oldest = situation.others, situation.tick - self.settings.surmise
        if max([others[robot].stamp for robot in waits], default=-1) >= oldest:
            return False
        keepers = [
            record for robot, record in others.items() if keeps(record, cell) and (robot, cell) not in situation.cleared
        ]
        return bool(keepers) and all(record.stamp < oldest for record in keepers)

    def _note(self, cell: int, *, empty: bool, tick: int) -> Point:
        """Take down what was seen in a cell, and return its middle."""
        self._leans_to = None
        self._sightings.note(cell, empty=empty, tick=tick)
        if not empty:
            self._joint.leave()
        return self.cells.centre(cell)

    def _remembered(self, tick: int) -> frozenset[int]:
        """Return the cells that silent robots were in when they spoke last, but for those seen to have gone."""
        found: set[int] = set()
        for robot, record in self._hearsay.fallen_silent(tick).items():
            if self._gone.get(robot) != record.stamp:
                found.update(self.cells.touched(record.x, record.y, self.settings.radius))
        return frozenset(found)

    def _remembered_in(self, cell: int, situation: Situation, inputs: TrafficInputs) -> Point | None:
        """Return where a silent robot was last heard with a part of its body in a cell, unless it is seen to have gone.

        Who dies or falls asleep while driving comes to rest some way beyond the place that it last told.
        """
        reach = self.settings.radius + self.settings.margin
        for robot, record in situation.others.items():
            place = (record.x, record.y)
            if robot in situation.fresh or self._gone.get(robot) == record.stamp:
                continue
            if cell not in self.cells.touched(*place, reach):
                continue
            if not has_gone(place, inputs.pose, inputs.scan.readings, self.settings.radius):
                return place
            self._gone[robot] = record.stamp
        return None

    def _still_bodies(self, inputs: TrafficInputs) -> tuple[Point, ...]:
        """Return where bodies stand near the robot that nobody speaks for: silent robots, and things found [m]."""
        silent, found = self._hearsay.fallen_silent(inputs.tick), self._halting.places(inputs.tick)
        if not silent and not found:
            return ()
        near = 2 * self.cells.side
        told = [(record.x, record.y) for robot, record in silent.items() if self._gone.get(robot) != record.stamp]
        places = (*told, *found)
        return tuple([place for place in places if distance(place, inputs.pose) < near])

    def _place_to_stand(self, wish: Point) -> Point:
        """Return the place in the goal's cell that is nearest to where the robot wants to be [m]."""
        asked = (self.cells, self._goal, wish)
        if asked != self._stand_for:
            self._stand_for = asked
            self._stand = self.cells.moved_inside(self._goal, wish, self.settings.standing_room)
        return self._stand

    # ---- what it says

    def _own_record(self, inputs: TrafficInputs, waits: tuple[str, ...]) -> Record:
        walk, joint, tick = self._walk, self._joint, inputs.tick
        assert walk is not None
        return Record(
            robot=self.me,
            stamp=tick,
            x=inputs.pose.x,
            y=inputs.pose.y,
            goal=self._goal,
            idle=inputs.goal is None,
            done=inputs.done,
            wants=self._wants,
            held=walk.ledger.held,
            claims=walk.ledger.all_claims,
            acks=self._acks(walk.ledger),
            ahead=walk.route[: self.settings.ahead],
            waits=waits,
            moved=self._moved,
            epoch=joint.epoch,
            left=walk.left if joint.epoch is not None else 0,
            entered=max(0, walk.steps[-1]) if joint.epoch is not None else 0,
            frozen=joint.frozen,
            need=joint.need,
            collect=joint.collect,
            plan=joint.carried(tick),
            refusal=joint.refused(tick),
            listens=tick < self._listen_until,
            seen=self._sightings.told(),
        )

    def _acks(self, ledger: Ledger) -> Acks:
        """Return the claims of others that this robot acknowledges. Kept until its ledger or a record changes."""
        others = self._hearsay.others
        if self._agreed_for is None or self._agreed_for[0] is not ledger or self._agreed_for[1] is not others:
            self._agreed_for = (ledger, others)
            self._agreed = acknowledged(self.me, ledger, others)
        return self._agreed

    def _outputs(
        self,
        inputs: TrafficInputs,
        walk: Walk,
        place: int,
        waits: tuple[str, ...],
        face: Point | None,
        halt: Halt,
        events: list[Event],
        sends: bool,
        floor: tuple[int, ...],
        room: tuple[int, ...],
        threat: Point | None,
    ) -> TrafficOutputs:
        pose, held = inputs.pose, walk.ledger.held
        broadcast = None
        if sends:
            others = self._hearsay.passed_on(inputs.tick, pose.x, pose.y)
            broadcast = TrafficBroadcast(own=self._own_record(inputs, waits), others=others)
        way = (*held[place:], *walk.route)
        alone = self._hearsay.alone_in(held, inputs.tick)
        ahead = way[: 2 * VIEW + 1] if floor else held[place:]
        stops = self._stops_in(inputs, ahead)
        if stops:
            ahead = ahead[: ahead.index(self._goal) + 1]
        waypoints = [self.cells.centre(cell) for cell in ahead]
        if held[place] not in alone:  # not to the middle of a cell in which somebody else is too
            waypoints = waypoints[1:] or [(pose.x, pose.y)]
        if stops and self._wish is not None:
            waypoints[-1] = self._place_to_stand(self._wish)
        elif walk.route and (
            walk.route[0] == self._leans_to
            or (self.settings.in_sight and self.cells.is_blind(walk.head, walk.route[0]))
        ):
            waypoints.append(self.cells.leaning(walk.head, walk.route[0], self.settings.leaning_room))
        elif not walk.route and walk.head == self._goal and self._wish is not None:
            waypoints[-1] = self._place_to_stand(self._wish)
        return TrafficOutputs(
            broadcast=broadcast,
            held=held,
            drivable=tuple(dict.fromkeys((*alone, held[place], *floor))),
            at_large=bool(floor),
            waypoints=tuple(waypoints),
            beside=(*self._hearsay.holders_of(held[place], inputs.tick), *self._still_bodies(inputs)),
            may_drive=not halt.stopped,
            threat=threat,
            room=room,
            exactly=stops or self._looks(inputs, walk, waits),
            looks=not stops and self._looks(inputs, walk, waits),
            face=face,
            waits=waits,
            activity=self._activity(walk, waits, face, halt.stopped, inputs.tick),
            events=tuple(events),
            way=way,
            members=tuple(sorted(self._joint.plan.ways)) if self._joint.epoch and self._joint.plan else (),
        )

    def _stops_in(self, inputs: TrafficInputs, ahead: Sequence[int]) -> bool:
        """Return True if one of the cells ahead is that of its next stop: it is driven over, whatever comes then."""
        return self._goal in ahead and not inputs.done and inputs.goal is not None

    def _looks(self, inputs: TrafficInputs, walk: Walk, waits: tuple[str, ...]) -> bool:
        """Return True if it has to come to a certain place in its cell, where it claims or looks from."""
        fresh = self._hearsay.fresh(inputs.tick)
        silent = any(robot not in fresh for robot in waits)
        return bool(walk.route) and (self.settings.in_sight or self._leans_to is not None or silent)

    def _activity(
        self, walk: Walk, waits: tuple[str, ...], face: Point | None, stopped: bool, tick: int
    ) -> TrafficActivity:
        states = (
            (stopped, TrafficActivity.HALTED),
            (self._joint.collect is not None, TrafficActivity.LEADING),
            (self._joint.frozen is not None, TrafficActivity.STANDING),
            (tick < self._listen_until, TrafficActivity.LISTENING),
            (face is not None, TrafficActivity.LOOKING),
            (walk.head == self._goal and not walk.route, TrafficActivity.ARRIVED),
            (bool(waits) and len(walk.ledger.held) == 1, TrafficActivity.WAITING),
            (not walk.route and self._joint.epoch is None, TrafficActivity.CUT_OFF),
            (not walk.route, TrafficActivity.WAITING),
        )
        for holds, activity in states:
            if holds:
                return activity
        return TrafficActivity.DRIVING
