"""Driving in cells: a robot enters only cells that it holds, and the fuzzy tables steer inside held cells."""

from collections.abc import Callable, Iterable
from functools import partial
from math import inf
from typing import Final

import numpy as np
from msgspec.structs import replace

from swarm.fuzzy import Controller
from swarm.geometry import Pose, Twist, bearing, distance, wrap
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import COMMAND, Activity, Broadcast, Sense
from swarm.motion.drive import DifferentialDrive, gap_to_boxes
from swarm.planning.rays import free_on_map, least_free_on_map
from swarm.robot.driving.aim import Aiming, distance_along
from swarm.robot.driving.evasion import Evasion
from swarm.robot.driving.last_tick import Assignment, Driven, LastTick
from swarm.robot.driving.lateness import LateLimiter, Lateness
from swarm.robot.driving.pilot import PilotInputs, PilotOutputs
from swarm.robot.driving.pose_limiter import PoseLimit, PoseLimiter
from swarm.robot.driving.safety import (
    NO_BODIES,
    STAND,
    Constraints,
    DriveState,
    RimSpeeds,
    SafetyFilter,
    WheelSpeeds,
)
from swarm.robot.driving.tables import Detour, LaneTurn, Rollout, fuzzy_speeds, must_drive_straight, scale_of
from swarm.robot.ground import Block
from swarm.robot.mission import targets_of_others
from swarm.robot.sectors import sectors
from swarm.robot.tuning import PILOT, SAFETY, SCALE
from swarm.settings import Settings
from swarm.traffic.interface import TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of, comes_near
from swarm.traffic.obstacles.detector import WATCH
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.outputs import StepResult
from swarm.traffic.peers.uncooperative import MuteBroadcast
from swarm.traffic.progress_checker import ProgressChecker, make_way_length_test
from swarm.traffic.settings import NEAR
from swarm.traffic.step import Traffic

RESTS: Final = frozenset({Activity.READY, Activity.STOPPED, Activity.DONE})  # a robot wants to go nowhere
SHUT_OFF: Final = frozenset({TrafficActivity.CUT_OFF, TrafficActivity.LOOKING})  # by walls, or by who is silent
ROLLS_UP: Final = frozenset({TrafficActivity.DRIVING, TrafficActivity.WAITING})  # in its last cell, to the next one
GIVES_WAY: Final = frozenset({TrafficActivity.WAITING, TrafficActivity.STANDING, TrafficActivity.LEADING})


class CellPilot:
    """The driver of one robot: it follows the cells that traffic grants.

    While others are near, the body stays in the held cells. While nobody is near, the cells around the body are
    drivable too. The fuzzy tables steer to the aim, which the safety filter does not know.
    """

    def __init__(
        self, traffic: Traffic, cells: CellMap, number: int, settings: Settings, controller: Controller
    ) -> None:
        robot = settings.robot
        self._traffic, self._cells = traffic, cells
        self._settings = settings
        self._controller = controller
        self._room = robot.radius + traffic.settings.margin  # m, from its centre to the edge of the held cells
        self._drive = DifferentialDrive(robot.track_width)
        fans = sectors(settings.sensors)
        self._bearings = (*fans.left, *fans.front, *fans.right)
        self._wanted = {cells.cell_of(*stop) for stop in targets_of_others(settings, number)}
        self._filter = SafetyFilter(settings)
        self._detour = Detour(self._filter)
        self._evasion = Evasion(settings)
        self._rollout = Rollout(controller, settings)
        self._late_limiter = LateLimiter(self._filter, settings)
        self._lateness = Lateness(robot.wheel_acceleration, 1.0 / settings.rate)
        self._pose_limiter = PoseLimiter(cells.side / 2 - self._room, robot.top_speed)
        self._before = LastTick()
        self._progress = ProgressChecker(make_way_length_test(round(PILOT.longer / cells.side)))
        self._could_drive = 0  # ticks
        self._lane_turn = LaneTurn(cells.side, robot.radius)
        self._aiming = Aiming(cells, robot.radius)

    @property
    def last_decision(self) -> StepResult | None:
        """The decisions of its last step of coordination; None: it has made none."""
        return self._traffic.decided

    def drive(self, inputs: PilotInputs) -> PilotOutputs:
        """Return what the robot does at one tick."""
        sense, pose, before = inputs.sense, inputs.pose, self._before
        kept_away = self._ticks_kept_away(inputs, before)
        settles = kept_away > PILOT.settles_after * self._settings.rate
        idle = inputs.done and (settles or inputs.anywhere or self._cells.cell_of(*inputs.goal) in self._wanted)
        scan = self._scan(inputs)
        limit, uncertainty = self._pose_limiter.check(inputs.estimate), self._uncertainty(inputs)
        stands = sense.stopped or limit.stands
        body = DriveState(pose, *self._drive.rim_speeds(Twist(sense.linear, sense.angular)))
        late = self._lateness.compare(sense.tick, (body.left, body.right))
        rolled = self._rollout_cells(inputs, body, before)
        unheard = (*before.unheard, *inputs.heard)
        asked = Assignment(None if idle else inputs.goal, stands, self._cells)
        if before.granted is None or asked != before.asked or self._traffic.is_due(sense.tick, scan):
            sweeps = () if before.driven.drawn_to is None or before.driven.circles else rolled
            braking = self._filter.braking(body, self._under_way(late, before))
            asks = self._traffic_inputs(inputs, unheard, asked.goal, scan)._replace(
                braking=braking, sweeps=sweeps, stands=stands, lost=limit.stands, uncertainty=uncertainty
            )
            granted, unheard = self._traffic.step(asks, self._cells), ()
        else:
            granted = before.granted.without_messages()
        driven = (
            before.driven._replace(speeds=STAND, heading=0.0)
            if stands
            else self._wheels(inputs, granted, body, scan, late, before.driven, limit, uncertainty)
        )
        self._lateness.command(driven.speeds)
        self._before = LastTick(driven, rolled, kept_away, granted, asked, unheard)
        return PilotOutputs(
            driven.speeds,
            driven.heading,
            self._activity(inputs, granted, idle=idle, lost=limit.stands),
            held=granted.held,
            unconstrained=granted.unconstrained,
            scale=driven.scale,
            waits=granted.waits,
            members=granted.members,
            notes=[*limit.notes, *((event.kind, event.text) for event in granted.events)],
            traffic=granted.broadcast,
        )

    def _traffic_inputs(
        self, inputs: PilotInputs, heard: Iterable[Broadcast], goal: Point | None, scan: Scan
    ) -> TrafficInputs:
        """Return the inputs of a step of coordination, without what the brake and the tables need of the floor."""
        sense, path = inputs.sense, inputs.navigator.path
        return TrafficInputs(
            tick=sense.tick,
            pose=inputs.pose,
            goal=goal,
            then=inputs.then,
            speed=abs(sense.linear),
            scan=scan,
            done=inputs.done,
            path=() if path is None or inputs.done else path.points,
            heard=[broadcast.traffic for broadcast in heard if broadcast.traffic is not None],
            jumped=inputs.estimate.jumped > 0.0,
            mute=[
                MuteBroadcast(said.robot, said.tick, Pose(said.x, said.y, said.yaw), said.activity in RESTS)
                for said in heard
                if said.traffic is None and said.run == sense.run and said.robot != self._traffic.me
            ],
        )

    def _under_way(self, late: tuple[RimSpeeds, ...], before: LastTick) -> tuple[RimSpeeds, ...]:
        """Return the commands [m/s] that the wheels may still carry out before they brake, oldest first.

        If the process falls asleep, the wheels obey its last command until the command expires. Only an unconstrained
        robot needs these ticks here: between others, the safety filter looks further ahead than that.
        """
        unconstrained = before.granted is not None and before.granted.unconstrained
        return (*late, *(before.driven.speeds,) * (unconstrained * round(COMMAND.timeout * self._settings.rate)))

    def take_floor(self, floor: OccupancyMap) -> None:
        """Replace the map; reservations and peer records stay."""
        self._cells = cells_of(floor, self._settings)

    def learn(self, floor: OccupancyMap, blocks: Iterable[Block]) -> bool:
        """Update the cells from changed blocks of a learned map; return True if cells or their joins changed."""
        before = self._cells
        for low, high in blocks:
            self._cells = self._cells.update_cells(floor, low, high)
        return self._cells.neighbours is not before.neighbours

    def robot_at(self, tick: int) -> Callable[[Point], bool]:
        """Return a function that says of a point [m] whether another robot's body may be there at a tick."""
        return self._traffic.robot_at(tick, self._cells)

    def can_reach(self, here: Point, goal: Point) -> bool:
        """Return True if joined cells lead from ``here`` to ``goal`` [m]."""
        return comes_near(self._cells, here, goal, self._settings)

    def _wheels(
        self,
        inputs: PilotInputs,
        granted: TrafficOutputs,
        body: DriveState,
        scan: Scan,
        late: tuple[RimSpeeds, ...],
        before: Driven,
        limit: PoseLimit,
        uncertainty: float,
    ) -> Driven:
        """Choose the wheel speeds; the body may be off by ``uncertainty`` [m].

        ``late`` are the commands [m/s] that the wheels have not carried out yet.
        """
        sense, pose, grid = inputs.sense, inputs.pose, inputs.navigator.grid
        bodies = np.array(granted.beside, np.float64) if granted.beside else NO_BODIES
        if granted.face is not None and not granted.threats:
            self._detour.end()
            error = bearing(pose, granted.face)
            return before._replace(speeds=self._filter.face(body, error), heading=error)
        if inputs.heading is not None and not granted.threats and inputs.is_at_goal(self._settings.reach):
            self._detour.end()
            then = self._filter.state_after(body, self._lateness.expected_commands())
            error = wrap(inputs.heading - then.pose.yaw)
            return before._replace(speeds=self._filter.face(then, error), heading=error)
        aim = self._aiming.choose(grid, pose, granted.drivable, granted.waypoints, uncertainty)
        seen = sense.bearings[inputs.target] if inputs.target >= 0 and distance(aim, inputs.goal) < 1e-9 else None
        heading = bearing(pose, aim) if seen is None else seen
        drawn_to = aim if granted.exactly else self._aiming.beyond(grid, pose, granted.way[1 : PILOT.in_view], aim)
        shut, local = self._aiming.shut_boxes(granted.drivable), self._aiming.to_lattice_frame(pose)
        near = scan.body_readings(self._traffic.settings, WATCH) if late and granted.threats else ()
        nearest = min((reading.measured for reading in near), default=inf)
        fastest = min(limit.fastest, self._filter.near_threats(body, late, granted.threats, nearest))
        clear = Constraints(grid, shut, local, bodies, fastest=fastest, uncertainty=uncertainty)
        if (away := self._speeds_out_of_way(sense, clear, granted)) is not None:
            return before._replace(speeds=away, heading=heading, drawn_to=drawn_to)
        nowhere = self._count_nowhere(inputs, granted, before.target)
        room = gap_to_boxes(shut, local.x, local.y)
        scale = scale_of(granted, room, heading, nowhere, lane=self._lane_turn.is_lane)
        circles, target = nowhere > PILOT.nowhere_after, inputs.target
        within = distance_along(pose, granted.waypoints)
        sticks_out = within <= PILOT.pulls_in and self._aiming.sticks_out(pose, granted, self._room)
        if (within <= (PILOT.docks_near if granted.docks else NEAR) and not sticks_out) or self._rests(inputs, granted):
            if not self._turns_meanwhile(granted):
                self._detour.end()
                return Driven(STAND, heading, scale, drawn_to, circles, target)
            within, heading, scale = 0.0, bearing(pose, self._cells.centre(granted.way[1])), SCALE.turning
        turns = self._lane_turn.check(sense, heading, between_others=not (granted.threats or granted.unconstrained))
        if straight := sticks_out or must_drive_straight(granted, self._settings):
            self._detour.end()
            turns, clear = abs(heading) > PILOT.docks_straight, clear._replace(front_gap=SAFETY.gap)
        constraints = clear._replace(stop_within=within, slowly=granted.looks, may_drive=granted.may_drive)
        if not straight and (aside := self._detour.heading(sense, constraints)) is not None:
            heading, scale = aside, SCALE.detour
        elif turns:
            return Driven(self._filter.face(body, heading), heading, scale, drawn_to, circles, target)
        tables = fuzzy_speeds(self._controller, self._settings.robot, sense, heading, scale, straight=straight)
        if granted.threats and self._evasion.threatens(sense, tables, constraints, granted.threats):
            constraints = constraints._replace(may_drive=False)
        if expected := self._lateness.expected_commands():
            sense, constraints = self._when_obeyed(sense, constraints, body, expected)
        speeds = self._filter.check(sense, tables, constraints)
        speeds = self._late_limiter.limit(speeds, body, late, grid, self._cells, {*granted.held, *granted.drivable})
        return Driven(speeds, heading, scale, drawn_to, circles, target)

    def _when_obeyed(
        self, sense: Sense, constraints: Constraints, body: DriveState, expected: tuple[RimSpeeds, ...]
    ) -> tuple[Sense, Constraints]:
        """Return both as they are expected to be when the wheels obey the next command [m/s], after ``expected``."""
        pose, left, right = self._filter.state_after(body, expected)
        linear, angular = self._drive.twist(left, right)
        front = max(0.0, sense.front - distance(body.pose, pose))
        then = replace(sense, x=pose.x, y=pose.y, yaw=pose.yaw, linear=linear, angular=angular, front=front)
        return then, constraints._replace(local=self._aiming.to_lattice_frame(pose))

    def _speeds_out_of_way(self, sense: Sense, constraints: Constraints, granted: TrafficOutputs) -> WheelSpeeds | None:
        """Return the speeds that take the robot out of a threat's way; None: no threat, or standing is as good."""
        if not granted.threats:
            return None
        wished = self._aiming.shut_boxes((*granted.drivable, *granted.room))
        out = self._evasion.way_out(sense, constraints, wished, granted.threats)
        return None if out is None else self._filter.limit_way_out(sense, out, constraints)

    def _turns_meanwhile(self, granted: TrafficOutputs) -> bool:
        """Return True if the robot turns towards its way while it waits, in a passage too narrow to turn in later."""
        passage = len(self._cells.neighbours[granted.way[0]]) <= PILOT.passage
        return passage and len(granted.way) > 1 and len(granted.held) == 1

    def _rollout_cells(self, inputs: PilotInputs, body: DriveState, before: LastTick) -> tuple[int, ...]:
        """Return the cells that the tables would drive over in the next seconds if all the floor were granted."""
        last = before.driven
        if last.drawn_to is None or last.circles or inputs.sense.tick % PILOT.rolled_every:
            return before.rolled
        points = self._rollout(inputs.sense, body, last.drawn_to, last.scale)
        return self._cells.swept_in_order(points, self._room + inputs.estimate.error)

    def _uncertainty(self, inputs: PilotInputs) -> float:
        """Return how far [m] the body may be from where it is expected until it has stopped."""
        if not inputs.estimate.error and not inputs.estimate.yaw_error:
            return 0.0
        speed = abs(inputs.sense.linear)
        return inputs.estimate.allowance(SAFETY.look * speed + speed**2 / (2 * self._settings.robot.wheel_acceleration))

    def _rests(self, inputs: PilotInputs, granted: TrafficOutputs) -> bool:
        """Return True if the robot may stand where it is in its last held cell: it need not reach a certain point."""
        if len(granted.held) > 1 or granted.unconstrained or granted.exactly:
            return False
        rolls_up = granted.activity in ROLLS_UP and len(granted.way) > 1
        if rolls_up and distance_along(inputs.pose, granted.waypoints) > PILOT.queued:
            return False
        if inputs.done and not granted.waits and not inputs.is_at_goal(PILOT.well_within * self._settings.reach):
            return False
        return self._cells.can_fit_disc(granted.held, inputs.pose.x, inputs.pose.y, self._room + inputs.estimate.error)

    def _count_nowhere(self, inputs: PilotInputs, granted: TrafficOutputs, target: int) -> float:
        """Count on; return for how long [s] the robot has had cells to drive over but its way did not become shorter.

        Time before an unexpected obstacle does not count. Another stop than ``target`` starts again.
        """
        self._could_drive += granted.may_drive
        if len(granted.held) <= 1 or inputs.target != target:
            self._progress.forget()
        return self._progress.check(len(granted.way), self._could_drive) / self._settings.rate

    def _ticks_kept_away(self, inputs: PilotInputs, before: LastTick) -> int:
        """Return for how many ticks the robot has been kept from its place since it is done.

        If that is long, it stays where it is in no way. All times away count together: robots that drive each other
        away in turn are at their places now and then.
        """
        return before.kept_away + (not inputs.is_at_goal(self._settings.reach)) if inputs.done else 0

    def _activity(self, inputs: PilotInputs, granted: TrafficOutputs, *, idle: bool, lost: bool) -> Activity:
        if idle or (inputs.done and inputs.is_at_goal(self._settings.reach)):
            return Activity.DONE
        if inputs.sense.stopped:
            return Activity.STOPPED
        if lost or granted.activity in SHUT_OFF:
            return Activity.BLOCKED
        return Activity.GIVE_WAY if granted.activity in GIVES_WAY else Activity.DRIVE

    def _scan(self, inputs: PilotInputs) -> Scan:
        """Return the rays' bearings and readings, and a function that gives the readings expected from the map."""
        radius, reach, off = self._settings.robot.radius, self._settings.sensors.range, inputs.estimate
        grid = inputs.navigator.grid
        expected = (
            partial(least_free_on_map, grid, inputs.pose, off.error, off.yaw_error, radius, reach)
            if off.error or off.yaw_error
            else partial(free_on_map, grid, inputs.pose, radius, reach)
        )
        return Scan(self._bearings, inputs.sense.rays, expected)
