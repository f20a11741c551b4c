"""Driving by holds: the robot enters a cell only when it holds it, and the fuzzy tables steer inside what it holds."""

from collections.abc import Callable, Iterable, Sequence
from math import pi
from typing import Final

import numpy as np

from swarm.fuzzy import Controller
from swarm.geometry import Twist, bearing, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import COMMAND, Activity, Sense
from swarm.motion.drive import DifferentialDrive
from swarm.motion.sweep import gap
from swarm.planning.rays import each_on_map
from swarm.robot.aim import Aiming, distance_along
from swarm.robot.detour import Detour
from swarm.robot.flight import Flight
from swarm.robot.ground import Block
from swarm.robot.lateness import Lateness
from swarm.robot.pilot import Move, Situation, fuzzy_speeds
from swarm.robot.rollout import Rollout
from swarm.robot.safety import NO_BODIES, STAND, Body, Constraints, SafetyFilter, WheelSpeeds
from swarm.robot.sectors import sectors
from swarm.settings import Settings
from swarm.traffic.cells import CellMap
from swarm.traffic.cells_of import cells_of, comes_near, traffic_settings
from swarm.traffic.look import Scan
from swarm.traffic.settings import NEAR
from swarm.traffic.traffic import Traffic, TrafficActivity, TrafficInputs, TrafficOutputs

STANDING = frozenset({TrafficActivity.WAITING, TrafficActivity.STANDING, TrafficActivity.LEADING})


IN_VIEW: Final = 5  # cells of the way that may be aimed at in thought
CIRCLES: Final = 5.0  # s in which its way has become no shorter
LONGER: Final = 6  # cells by which a way is longer than before because it is another one
LEAST_SCALE: Final = 0.15  # then
DETOUR_SCALE: Final = 0.02  # on a detour: what the safety filter keeps clear of anyway counts as far
TIGHT_SCALE: Final = 0.4  # where the floor that is granted ends close by,
PASSAGE: Final = 2  # ways out of a cell
TURNED: Final = 0.7  # share by which all is told farther still if the aim is behind: then the tables turn at once
ROOMY: Final = 0.8  # m off its end nothing is scaled
ROLLED_EVERY: Final = 4  # ticks
WELL_WITHIN: Final = 0.9  # share of the reach


class CellPilot:
    """Follows the cells it is granted by ``swarm.traffic.traffic``.

    Where others are near, the driver keeps the body in the cells held. Where nobody is, the tables alone find the way
    to the aim, under the supervisor, which knows no aim.
    """

    def __init__(self, name: str, number: int, settings: Settings, cells: CellMap, controller: Controller) -> None:
        robot = settings.robot
        self._settings = settings
        self._cells = cells
        self._controller = controller
        self._drive = DifferentialDrive(robot.track_width, robot.wheel_radius)
        fans = sectors(settings.sensors)
        self._bearings = (*fans.left, *fans.front, *fans.right)
        self._constants = traffic_settings(settings)
        self._wanted = {cells.cell_of(*stop) for stop in _targets_of_others(settings, number)}
        self._traffic = Traffic(name, cells, self._constants, slot=number)
        self._filter = SafetyFilter(settings)
        self._detour = Detour(self._filter)
        self._flight = Flight(settings)
        self._rollout = Rollout(controller, settings)
        self._scale = 1.0  # of the distances that the tables are told
        self._drawn_to: Point | None = None  # where it would aim, had it all the floor
        self._swept: tuple[int, ...] = ()  # cells that the tables would drive over
        self._circles = False  # it has got nowhere for long
        self._lateness = Lateness(robot.wheel_acceleration, 1.0 / settings.rate)
        self._last = 0.0, 0.0  # m/s, rim speeds commanded last,
        self._rolls = 0  # and for how many ticks they would be carried out if it fell asleep now
        self._progress = (-1, 0, 0)  # the stop under way, the fewest cells left to it, and since which tick
        self._aiming = Aiming(cells, robot.radius)

    def drive(self, situation: Situation) -> Move:
        """Decide for one tick."""
        sense, pose = situation.sense, situation.pose
        idle = situation.done and self._cells.cell_of(*situation.goal) in self._wanted
        path = situation.navigator.path
        scan = self._scan(situation)
        body = Body(pose, *self._drive.rim_speeds(Twist(sense.linear, sense.angular)))
        granted = self._traffic.step(
            TrafficInputs(
                tick=sense.tick,
                pose=pose,
                goal=None if idle else situation.goal,
                sweeps=self._sweeps(situation, body),
                braking=self._filter.braking(body, self._under_way(sense, body)),
                scan=scan,
                done=situation.done,
                path=() if path is None or situation.done else path.points,
                heard=[broadcast.traffic for broadcast in situation.heard if broadcast.traffic is not None],
            )
        )
        speeds, heading = self._wheels(situation, granted, body)
        self._lateness.command((speeds.left, speeds.right))
        self._rolls = round(COMMAND.timeout * self._settings.rate) if granted.unconstrained else 0
        self._last = speeds.left, speeds.right
        return Move(
            speeds,
            heading,
            self._activity(situation, granted, idle=idle),
            held=granted.held,
            unconstrained=granted.unconstrained,
            scale=self._scale,
            waits=granted.waits,
            members=granted.members,
            notes=[(event.kind, event.text) for event in granted.events],
            traffic=granted.broadcast,
        )

    def _under_way(self, sense: Sense, body: Body) -> tuple[tuple[float, float], ...]:
        """Return the commands [m/s] that the wheels may still carry out before they brake, oldest first.

        Where others are near, the driver looks far enough ahead for a robot that falls asleep: its last command is
        carried out until it has expired.
        """
        late = self._lateness.under_way(sense.tick, (body.left, body.right))
        return (*late, *(self._last,) * self._rolls)

    def take_floor(self, floor: OccupancyMap) -> None:
        """Take another floor; what the robot holds and knows of others stays."""
        self._cells = cells_of(floor, self._settings)
        self._traffic.take_cells(self._cells)
        self._aiming.take_cells(self._cells)

    def learn(self, floor: OccupancyMap, blocks: Iterable[Block]) -> bool:
        """Take in blocks of a learned map that have changed; return True where cells or joins did."""
        before = self._cells
        for low, high in blocks:
            self._cells = self._cells.changed(floor, low, high)
        self._traffic.take_cells(self._cells)
        self._aiming.take_cells(self._cells)
        return self._cells.neighbours is not before.neighbours

    def robot_at(self, tick: int) -> Callable[[Point], bool]:
        """Return the test whether another robot's body may be at a place [m] at a tick."""
        return self._traffic.robot_at(tick)

    def can_reach(self, here: Point, goal: Point) -> bool:
        """Return True if cells lead from ``here`` to ``goal`` [m] too."""
        return comes_near(self._cells, here, goal, self._settings)

    def _wheels(self, situation: Situation, granted: TrafficOutputs, body: Body) -> tuple[WheelSpeeds, float]:
        """Choose the wheel speeds, and the heading error [rad] that the tables are asked to mend."""
        sense, pose, grid = situation.sense, situation.pose, situation.navigator.grid
        bodies = np.array(granted.beside, np.float64) if granted.beside else NO_BODIES
        if granted.face is not None and granted.threat is None:
            self._detour.end()
            error = bearing(pose, granted.face)
            return self._filter.face(body, error), error
        aim = self._aiming.choose(grid, pose, granted.drivable, granted.waypoints)
        seen = sense.bearings[situation.target] if distance(aim, situation.goal) < 1e-9 else None
        heading = bearing(pose, aim) if seen is None else seen
        self._drawn_to = aim if granted.exactly else self._aiming.beyond(grid, pose, granted.way[1:IN_VIEW], aim)
        shut, local = self._aiming.shut(granted.drivable), self._aiming.local(pose)
        away = self._away(sense, Constraints(grid, shut, local, bodies), granted)
        if away is not None:
            return away, heading
        self._scale = self._scaled(situation, granted, gap(shut, local.x, local.y), heading)
        within = distance_along(pose, granted.waypoints)
        if within <= NEAR or self._rests(situation, granted):
            if not self._turns_meanwhile(granted):
                self._detour.end()
                return STAND, heading
            within, heading, self._scale = 0.0, bearing(pose, self._cells.centre(granted.way[1])), LEAST_SCALE
        constraints = Constraints(grid, shut, local, bodies, within, granted.looks, granted.may_drive)
        aside = self._detour.heading(sense, constraints)
        if aside is not None:
            heading, self._scale = aside, DETOUR_SCALE
        tables = fuzzy_speeds(self._controller, self._settings.robot, sense, heading, self._scale)
        if granted.threat is not None and self._flight.threatens(sense, tables, constraints, granted.threat):
            constraints = constraints._replace(may_drive=False)
        return self._filter.check(sense, tables, constraints), heading

    def _away(self, sense: Sense, constraints: Constraints, granted: TrafficOutputs) -> WheelSpeeds | None:
        """Return the speeds to get out of the way of what comes; None if nothing does, or to stand is as good."""
        if granted.threat is None:
            return None
        wished = self._aiming.shut((*granted.drivable, *granted.room))
        out = self._flight.way_out(sense, constraints, wished, granted.threat)
        return None if out is None else self._filter.out(sense, out, constraints)

    def _turns_meanwhile(self, granted: TrafficOutputs) -> bool:
        """Return True if it turns to its way while it waits: a passage a cell wide leaves no room to do so later."""
        passage = len(self._cells.neighbours[granted.way[0]]) <= PASSAGE
        return passage and len(granted.way) > 1 and len(granted.held) == 1

    def _sweeps(self, situation: Situation, body: Body) -> tuple[int, ...]:
        """List the cells that the tables would drive the robot over in the next seconds, had they the floor."""
        if self._drawn_to is None or self._circles:
            return ()
        if situation.sense.tick % ROLLED_EVERY == 0:
            points = self._rollout(situation.sense, body, self._drawn_to, self._scale)
            self._swept = self._cells.swept_in_order(points, self._settings.robot.radius + self._constants.margin)
        return self._swept

    def _scaled(self, situation: Situation, granted: TrafficOutputs, room: float, heading: float) -> float:
        """Return what the tables take near and far relative to: the ``room`` [m] that is granted.

        Where it has got nowhere for long, the least: in some corners the tables turn to and fro for ever, and told that
        all is far they turn to the aim.
        """
        self._circles = self._gets_nowhere(situation, granted)
        if self._circles or (granted.exactly and len(granted.held) == 1):
            return LEAST_SCALE
        if granted.unconstrained:
            return 1.0
        return min(1.0, max(TIGHT_SCALE, room / ROOMY)) * (1.0 - TURNED * abs(heading) / pi)

    def _rests(self, situation: Situation, granted: TrafficOutputs) -> bool:
        """Stop once inside the last cell held, except at a stop, and where it has to be in a certain place."""
        if len(granted.held) > 1 or granted.unconstrained or granted.exactly:
            return False
        away = distance(situation.pose, situation.goal)
        if situation.done and not granted.waits and away > WELL_WITHIN * self._settings.reach:
            return False
        (x, y, _), room = situation.pose, self._settings.robot.radius + self._constants.margin
        return self._cells.fits(granted.held, x, y, room)

    def _gets_nowhere(self, situation: Situation, granted: TrafficOutputs) -> bool:
        """Return True if the robot has cells to drive over and its way has not become shorter for long.

        Standing before something unexplained does not count, nor a new way that is much longer.
        """
        left = (situation.target, len(granted.way))
        target, fewest, since = self._progress
        other = left[0] != target or left[1] < fewest or left[1] > fewest + LONGER
        if len(granted.held) <= 1 or other:
            self._progress = (*left, situation.sense.tick)
            return False
        if not granted.may_drive:
            self._progress = target, fewest, since + 1
        return (situation.sense.tick - since) / self._settings.rate > CIRCLES

    def _activity(self, situation: Situation, granted: TrafficOutputs, *, idle: bool) -> Activity:
        if idle or (situation.done and distance(situation.pose, situation.goal) <= self._settings.reach):
            return Activity.DONE
        if granted.activity is TrafficActivity.CUT_OFF:
            return Activity.BLOCKED
        return Activity.GIVE_WAY if granted.activity in STANDING else Activity.DRIVE

    def _scan(self, situation: Situation) -> Scan:
        """Set what each ray measures beside what the map alone would let it measure."""
        grid, pose = situation.navigator.grid, situation.pose
        radius, reach = self._settings.robot.radius, self._settings.sensors.range

        def expected(bearings: Sequence[float]) -> list[float]:
            found: list[float] = (each_on_map(grid, pose, bearings, radius + reach) - radius).tolist()
            return found

        return Scan(self._bearings, situation.sense.rays, expected)


def _targets_of_others(settings: Settings, number: int) -> list[Point]:
    """List where robots other than that number have to go, home left out: nobody may keep its last place there."""
    if not settings.own_targets:
        return settings.targets
    return [stop for other, stops in enumerate(settings.own_targets) if other != number for stop in stops]
