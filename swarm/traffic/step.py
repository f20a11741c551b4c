"""One robot's part in traffic: from what it senses and hears in a tick, to what it holds and where it may drive.

Three layers, each safe without the one above. Layer 0: the body stays in the held cells, and stops before unexpected
obstacles (``route``, ``obstacles``). Layer 1: a cell is held only once all robots near have acknowledged the claim
(``claims``, ``rules``). Layer 2: which way to go, alone (``own_route``) or by a joint plan (``joint``). The state is
pure: no clock, no I/O, no randomness of its own.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from swarm.errors import ConfigError
from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record, TrafficBroadcast
from swarm.traffic.interface import TrafficInputs, TrafficOutputs
from swarm.traffic.joint.protocol import JointPlanning
from swarm.traffic.joint.states import BroadcastTurn, PlanDrop, PlanningStop, WakeUp
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.obstacles.detector import BlockageChecker, ObstacleDetector, ProtectiveStop, robot_at
from swarm.traffic.obstacles.inspection import Inspector
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.outputs import RecordWriter, StepResult, outputs_of
from swarm.traffic.own_route import GoalCell, OwnRoute, Wish, cell_on_way, cells_at_dock, is_docked
from swarm.traffic.peers.records import PeerRecords, TrafficNote
from swarm.traffic.peers.sightings import Sightings
from swarm.traffic.peers.situation import Situation
from swarm.traffic.peers.uncooperative import StepAsideRecovery
from swarm.traffic.reservations.claims import CellClaimer, ClaimResult, list_room_cells
from swarm.traffic.reservations.route import (
    Footprint,
    OffRouteChecker,
    RouteProgress,
    bring_to_rest,
    footprint_of,
    free_drive_cells,
    give_back,
    hold_free_drive_cells,
    hold_under_body,
    resume_after_sleep,
)  # fmt: skip
from swarm.traffic.settings import LEAST_CLAIM, TrafficConstants
from swarm.traffic.step_values import HaltResult, LastStep, ListenResult


class Traffic:
    """The traffic of one robot. ``slot`` is its place in the round of broadcasts."""

    def __init__(self, me: str, cells: CellMap, settings: TrafficConstants, *, slot: int = 0) -> None:
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
        self._presence = OffRouteChecker()
        self._detector = ObstacleDetector(settings)
        self._joint = JointPlanning(me, settings)
        self._own_route = OwnRoute()
        self._claiming = CellClaimer(me, settings)
        self._inspector = Inspector(settings)
        self._record_writer = RecordWriter(me, settings, slot, cells.side)
        self._goal, self._step_aside, self._kept = GoalCell(), StepAsideRecovery(), BlockageChecker()
        self._before: LastStep | None = None
        self.decided: StepResult | None = None  # in the last step, for explanations
        self._joins = cells.neighbours  # of the last tick

    def is_due(self, tick: int, scan: Scan) -> bool:
        """Return True if a step is due at ``tick``, where the rays show ``scan``.

        Coordination has a rate of its own, below that of the control. A robot steps in every tick while it searches for
        a joint plan, while an obstacle is near it, and while it or a robot that it hears listens.
        """
        before, settings = self._before, self.settings
        if before is None or before.busy or tick - before.tick >= settings.step or tick < before.listen_until:
            return True
        speaks = self._peers.somebody_listens(tick) or self._record_writer.is_due(tick, often=True)
        return speaks or bool(scan.body_readings(settings, settings.stop_distance))

    def step(self, inputs: TrafficInputs, cells: CellMap) -> TrafficOutputs:
        """Compute the outputs of one tick; call it before the motors run, in each tick in which a step is due.

        The ``cells`` may be those of another floor than in the last tick, but on the same lattice. Held cells and what
        is known of others stay then; claims, the way and a joint plan are void. If robots learn the floor, only what
        the new cells break is void.
        """
        heard = self._update_knowledge(inputs, cells)
        result = self._decide(inputs, heard, cells)
        self._before = LastStep(inputs.tick, result.progress, result.moved, heard.listen_until, result.halt.threats,
                              result.situation.then, result.busy)  # fmt: skip
        self._joins = cells.neighbours
        self.decided = result
        return self._speak(result)

    def robot_at(self, tick: int, cells: CellMap) -> Callable[[Point], bool]:
        """Return a test: True if another robot's body may be at a point [m] at ``tick``.

        While this robot listens, others may be anywhere.
        """
        if self._before is None or tick < self._before.listen_until:
            return lambda place: True
        return robot_at(self._peers.others.values(), tick, cells, self.settings)

    # ---- listen: where it is, and what the others say

    def _update_knowledge(self, inputs: TrafficInputs, cells: CellMap) -> ListenResult:
        tick, settings, before = inputs.tick, self.settings, self._before
        body = footprint_of(inputs, settings.radius + settings.margin + inputs.uncertainty, cells)
        if before is None or tick - before.tick > settings.gap:  # it has just started, or was away
            here = resume_after_sleep(before.progress if before is not None else None, body, cells)
            moved, listen_until = tick, tick + settings.listen
            self._joint.handle_occasion(WakeUp(tick))
            self._peers.note_wake(tick)
        else:
            # where it is surely, or, after a jump, where it may be at all
            off = inputs.uncertainty if inputs.jumped else -inputs.uncertainty
            under = max(0.0, settings.radius + off)
            theirs = {cell for record in self._peers.others.values() for cell in record.held} if inputs.jumped else ()
            here = hold_under_body(before.progress, body, cells, under, theirs)
            moved, listen_until = before.moved, before.listen_until
        if cells.neighbours is not self._joins:
            here = self._adapt_to_new_cells(here, body, cells)
        events = self._peers.merge_broadcasts(tick, cells, inputs.heard, inputs.mute)
        fresh = self._peers.fresh_records(tick)
        self._sightings.merge_sightings(tick, fresh.values())
        threats = before.threats if before is not None else ()
        return ListenResult(body, here, moved, listen_until, tick < listen_until, threats, fresh, events)

    def _adapt_to_new_cells(self, progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
        """Return the progress on new cells. What is ahead is void; on a learned floor, only if a join is shut."""
        self._goal.reset_wish()
        if self.settings.learns:
            if not progress.joins_shut_ahead(cells, body.cell):
                return progress._replace(sought=False)
            if not progress.joins_shut_ahead(cells, body.cell, route=False):
                return progress.without_way()
        self._joint.handle_occasion(PlanningStop())
        self._goal.forget()
        return progress.on_new_floor(cells, body.touched, body.cell)

    # ---- decide: layer 0, then which way (layer 2), then which of its cells (layer 1)

    def _decide(self, inputs: TrafficInputs, heard: ListenResult, cells: CellMap) -> StepResult:
        tick, settings, joint = inputs.tick, self.settings, self._joint
        wish = self._wish(inputs, heard.progress.head, cells)

        # layer 0: the cells that the body needs, and unexpected obstacles
        free_drive = self._free_drive_cells(inputs, heard, cells)
        needed, body = (
            hold_free_drive_cells(heard.progress, inputs, cells, settings)
            if free_drive
            else (heard.progress, heard.body)
        )
        on_way = (
            needed
            if self._goal.is_between(needed, body.cell)
            else self._presence.keep_on_way(needed, body, cells, threatened=bool(heard.threats))
        )
        asks = not free_drive and joint.call_epoch is None and not heard.listens
        cleared = self._sightings.clear(self._peers.others, self._peers.recent_records(tick))
        dock = cells_at_dock(
            self._goal, wish, on_way, body.cell, self._peers.others, cleared, cells, settings, inputs.uncertainty
        )
        needs = dock.kept if dock.owners else dock.wanted or dock.kept  # who waits for some of them keeps none
        room = list_room_cells(on_way, inputs.pose, inputs.sweeps, heard.fresh, heard.threats, cells) if asks else ()
        docking = () if heard.threats else needs
        room = docking or room
        here = cell_on_way(self._goal, dock, on_way, body, cells, settings)
        released = on_way.release_behind(body.touched, here, room, self._goal.stop_to_visit(wish), docking)
        moved = tick if released.way_cell_count < on_way.way_cell_count else heard.moved
        occupied, off = self._sightings.occupied_cells(), inputs.uncertainty
        other_goal = self._goal.set_wish(wish.goal, released, body, cells, settings, occupied, off)
        beyond = tuple([cell for cell in released.reservations.held if cell not in body.touched])
        shared = len(self._peers.cells_held_alone(beyond, tick)) < len(
            beyond
        )  # two may start or be pushed into one cell
        shut_ahead = shared or not self._peers.mutes.long_covered_cells(tick).isdisjoint(beyond)
        yielded = give_back(released, body, cells) if shut_ahead else released
        halted = self._stop_before_obstacle(yielded, inputs, body, cells, listens=heard.listens)

        # layer 2: which way
        told = self._before.then if self._before is not None else OUTSIDE
        leads_on = joint.following is not None and joint.following.leads_on(halted.progress, self._goal.cell, told)
        if (other_goal and not leads_on) or not halted.progress.following:
            joint.handle_occasion(PlanDrop())
        situation = self._situation(tick, wish, halted.progress, moved, heard.fresh, cells)._replace(
            cleared=cleared, docking=dock.wanted, by_dock=self._goal.dock is not None
        )
        decision = joint.handle_occasion(PlanningStop() if inputs.stands else situation)
        routed = (
            bring_to_rest(halted.progress, body, cells)
            if inputs.stands
            else self._find_way(halted.progress, situation, decision.way, wish.path)
        )

        # layer 1: which of its cells
        may_claim = joint.call_epoch is None and not inputs.stands and not heard.listens
        claimed = (
            self._claiming.step(routed, joint.following, situation, body, room, dock.owners)
            if may_claim
            else ClaimResult(routed.without_claims(), (), took=False)
        )
        face = self._inspect(claimed, situation, inputs) if may_claim else None
        moved_now = tick if decision.way is not None or claimed.took else moved
        complaint = self._peers.mutes.check_wait(tick, claimed.waits)
        complaints = [TrafficNote("mute_in_the_way", (self.me, *claimed.waits), complaint)] if complaint else []

        # whom it asks to lead, if it speaks now
        speaks = self._record_writer.is_due(tick, often=heard.listens or self._peers.somebody_listens(tick))
        if speaks and not inputs.stands:
            held = claimed.progress.reservations.held
            ahead = (*claimed.progress.route, *dock.wanted)[: settings.ahead]
            joint.handle_occasion(BroadcastTurn(self.me, held, ahead, claimed.waits, joint.epoch, moved_now, situation))
        return StepResult(
            inputs, body, situation, claimed.progress, self._goal, joint, claimed.waits, heard.listens, halted.halt,
            face, self._inspector.leans_to, free_drive, moved_now, room, heard.threats, speaks,
            (*heard.events, *halted.events, *decision.events, *complaints),
            docked=is_docked(self._goal, dock, claimed.progress.reservations.held, body, cells, settings),
        )  # fmt: skip

    def _wish(self, inputs: TrafficInputs, head: int, cells: CellMap) -> Wish:
        """Return where the robot wants to be: for a while aside, if it has long stood beside a mute robot."""
        if self._peers.mutes:
            taken = {cell for record in self._peers.others.values() for cell in record.held}
            aside = self._step_aside.decide(
                inputs.tick, inputs.pose, self._peers.mutes, head, taken, cells, stands=inputs.stands
            )
            if aside is not None:
                return Wish(aside, (), done=False)
        return Wish(inputs.goal, inputs.path, inputs.done, inputs.then)

    def _free_drive_cells(self, inputs: TrafficInputs, heard: ListenResult, cells: CellMap) -> tuple[int, ...]:
        """List the free-drive cells; there are none for a robot that comes to rest in held cells."""
        waits_here = heard.listens or self._joint.call_epoch is not None or not heard.progress.route or inputs.stands
        if waits_here or self.settings.in_sight:
            return ()
        return free_drive_cells(heard.body, self._peers.others, heard.fresh, cells, self.settings)

    def _stop_before_obstacle(
        self, progress: RouteProgress, inputs: TrafficInputs, body: Footprint, cells: CellMap, *, listens: bool
    ) -> HaltResult:
        """Stop before an unexpected obstacle; if it stays, give back the cells ahead and plan round it."""
        if self.settings.learns and listens:
            return HaltResult(progress, ProtectiveStop(stopped=False))  # it has learned no walls yet, and stands still
        mine = self._peers.cells_held_alone(progress.reservations.held, inputs.tick)
        halt = self._detector.detect(inputs, self._peers.records_expected(), mine, cells)
        kept_from = self._kept.check(progress, body.cell, self._goal.cell, threatened=bool(halt.threats))
        if kept_from is not None:
            self._sightings.note(kept_from, empty=False, tick=inputs.tick)
            text = f"gave up cell {kept_from}: a moving obstacle blocks the way into it"
            return HaltResult(give_back(progress, body, cells), halt, (TrafficNote("halted", (self.me,), text),))
        if halt.found is None:
            return HaltResult(progress, halt)
        cell = cells.cell_of(*halt.found)
        if cell not in {OUTSIDE, body.cell}:
            self._sightings.note(cell, empty=False, tick=inputs.tick)
        gives_back = len(progress.reservations.held) > 1 and not halt.threats
        gap = max(0.0, distance(halt.found, inputs.pose) - self.settings.radius)
        text = f"stopped: unexpected obstacle {gap:.1f} m ahead, in cell {cell}"
        kept = give_back(progress, body, cells) if gives_back else progress
        return HaltResult(kept, halt, (TrafficNote("halted", (self.me,), text),))

    def _situation(
        self, tick: int, wish: Wish, progress: RouteProgress, moved: int, fresh: Mapping[str, Record], cells: CellMap
    ) -> Situation:
        others = self._peers.others
        # a way leads round robots that were told to stop, as round an obstacle: no plan moves them
        stopped = {cell for record in fresh.values() if record.stands for cell in record.held}
        return Situation(
            tick=tick,
            cells=cells,
            head=progress.head,
            goal=self._goal.cell,
            idle=wish.goal is None,
            moved=moved,
            blocked=self._sightings.occupied_cells() | stopped,
            others=others,
            fresh=fresh,
            then=cells.cell_of(*wish.then) if wish.then is not None and self._goal.dock is None else OUTSIDE,
            done=wish.done,
            wants=self._goal.since,
            bodies=partial(self._inspector.cells_of_silent, self._peers.silent_records(tick), cells),
            mutes=self._peers.mutes.names,
            stays=self._peers.mutes.long_covered_cells(tick),
        )

    def _find_way(
        self, progress: RouteProgress, situation: Situation, adopted: tuple[int, ...] | None, path: Sequence[Point]
    ) -> RouteProgress:
        """Take the way of the joint plan adopted in this step, or keep to the plan, or find a way of its own."""
        if adopted is not None:
            if situation.idle:
                self._goal.stay_at(adopted[-1])
            return progress.on_joint_way(adopted).without_stale_claims()
        plan = self._joint.following
        if plan is not None and plan.keeps(progress, situation) and situation.stays.isdisjoint(progress.route[:1]):
            return progress
        self._joint.handle_occasion(PlanDrop())
        return self._own_route.find(progress, situation, path, self._goal.way_out)

    def _inspect(self, claimed: ClaimResult, situation: Situation, inputs: TrafficInputs) -> Point | None:
        """Look at the next cell if only silent robots keep it; return the point to turn to [m], or None."""
        progress = claimed.progress
        if situation.docking:  # the cells that it needs at its stop are what it wants next
            progress = progress._replace(route=situation.docking)
        face, seen = self._inspector.inspect(progress, situation, claimed.waits, inputs)
        if seen is not None:
            self._sightings.note(seen.cell, empty=seen.empty, tick=seen.tick)
            if not seen.empty:
                self._joint.handle_occasion(PlanDrop())
        return face

    # ---- speak: what it tells, and where it may drive

    def _speak(self, result: StepResult) -> TrafficOutputs:
        tick, pose = result.inputs.tick, result.inputs.pose
        silent, found = self._peers.silent_records(tick), self._detector.obstacle_places(tick)
        still = self._inspector.still_bodies(silent, found, pose, result.situation.cells)
        broadcast: TrafficBroadcast | None = None
        if result.speaks:
            own = self._record_writer.record(
                result, self._sightings.sightings_to_tell(), self._detector.moving_obstacles()
            )
            broadcast = TrafficBroadcast(own=own, others=self._peers.relay(tick, pose.x, pose.y))
        return outputs_of(result, self._peers, still, broadcast, self.settings)
