"""Driving by holds: the robot enters a cell only when it holds it, and the fuzzy tables steer inside what it holds."""

from math import inf, sqrt

import numpy as np

from swarm.geometry import Pose, Twist, bearing, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Activity, Steering
from swarm.planning.rays import each_on_map
from swarm.robot.fuzzy import Controller
from swarm.robot.kinematics import DifferentialDrive
from swarm.robot.lateness import Lateness
from swarm.robot.pilot import Move, Situation, fuzzy_speeds
from swarm.robot.sectors import half_width, sectors
from swarm.robot.filter import WheelSpeeds
from swarm.robot.surprise import Surprise
from swarm.scenario.schema import Settings
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.cells_of import cells_of, comes_near, traffic_settings
from swarm.traffic.driver import NO_BODIES, Body, Driver, Wheels, Whose, distance_along
from swarm.robot.rollout import rollout
from swarm.robot.filter import Filter, Limits, SLOW_BRAKE, GAP
from swarm.traffic.settings import NEAR
from swarm.traffic.look import Scan
from swarm.traffic.traffic import Traffic, TrafficActivity, TrafficInputs, TrafficOutputs

STEERING = {
    Whose.TABLES: Steering.FUZZY,
    Whose.BLEND: Steering.SUPERVISOR,
    Whose.TURN: Steering.SUPERVISOR,
    Whose.REST: Steering.REST,
}
STANDING = frozenset({TrafficActivity.WAITING, TrafficActivity.STANDING, TrafficActivity.LEADING})


LEAST = 0.15
CIRCLES = 5.0  # s in which a robot that drives unconstrained has come no nearer to its goal
AT_REST = 0.1  # m, from where it wants to stand when nothing is left to do


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
        self._front = half_width(fans.front)
        self._constants = traffic_settings(settings)
        self._wanted = {cells.cell_of(*stop) for stop in _targets_of_others(settings, number)}
        self._traffic = Traffic(name, cells, self._constants, slot=number)
        self._filter = Filter(settings)
        self.scale = 1.0
        self._aim = None
        self._swept: tuple[int, ...] = ()
        self._surprise = Surprise(settings)
        self._lateness = Lateness(robot.wheel_acceleration, 1.0 / settings.rate)
        self._progress = (-1, 0, 0)  # the stop under way, the fewest cells left to it, and since which tick
        self._driver = Driver(
            cells, self._drive, radius=robot.radius, margin=self._constants.margin,
            acceleration=robot.wheel_acceleration, dt=1.0 / settings.rate, fastest=1.5 * robot.speed_scale,
        )  # fmt: skip

    def drive(self, situation: Situation) -> Move:
        """Decide for one tick."""
        sense, pose = situation.sense, situation.pose
        idle = situation.done and self._cells.cell_of(*situation.goal) in self._wanted
        path = situation.navigator.path
        self._driver.grid = situation.navigator.grid
        scan = self._scan(situation)
        body = Body(pose, *self._drive.rim_speeds(Twist(sense.linear, sense.angular)))
        granted = self._traffic.step(
            TrafficInputs(
                tick=sense.tick,
                pose=pose,
                goal=None if idle else situation.goal,
                sweeps=self._sweeps(situation, body),
                braking=self._driver.braking(body, self._lateness.under_way(sense.tick, (body.left, body.right))),
                scan=scan,
                done=situation.done,
                path=() if path is None or situation.done else path.points,
                heard=[broadcast.traffic for broadcast in situation.heard if broadcast.traffic is not None],
            )
        )
        others = [(other.x, other.y) for other in situation.others.values()]
        halt = self._surprise.watch(sense, situation.navigator.grid, others) or not granted.may_drive
        speeds, heading = self._wheels(situation, granted, body, scan, halt)
        self._lateness.command((speeds.left, speeds.right))
        return Move(
            speeds,
            heading,
            self._activity(situation, granted, idle=idle),
            held=granted.held,
            unconstrained=granted.at_large,
            scale=self.scale,
            waits=granted.waits,
            members=granted.members,
            notes=[(event.kind, event.text) for event in granted.events],
            traffic=granted.broadcast,
        )

    def take_floor(self, floor: OccupancyMap) -> None:
        """Take another floor; what the robot holds and knows of others stays."""
        self._cells = cells_of(floor, self._settings)
        self._traffic.take_cells(self._cells)
        self._driver.take_cells(self._cells)

    def can_reach(self, here: Point, goal: Point) -> bool:
        """Tell whether cells lead from ``here`` to ``goal`` [m] too."""
        return comes_near(self._cells, here, goal, self._settings)

    def _wheels(
        self, situation: Situation, granted: TrafficOutputs, body: Body, scan: Scan, halt: bool
    ) -> tuple[WheelSpeeds, float]:
        """Choose the wheel speeds, and the heading error [rad] that the tables are asked to mend.

        ``halt``: something unexplained is near. It counts only where the robot is at large: there what traffic found
        once is no explanation, for it may move.
        """
        sense, pose, driver = situation.sense, situation.pose, self._driver
        driver.bodies = np.array(granted.beside, np.float64) if granted.beside else NO_BODIES
        if granted.face is not None:
            return _by(driver.face(body, granted.face)), bearing(pose, granted.face)
        aim = driver.aim(pose, granted.drivable, granted.waypoints)
        self._aim = aim
        seen = sense.bearings[situation.target] if distance(aim, situation.goal) < 1e-9 else None
        heading = bearing(pose, aim) if seen is None else seen
        shut = driver.shut(granted.drivable)
        circles = self._gets_nowhere(situation, granted, halt)
        if circles:
            self._swept = ()
        self.scale = LEAST if circles else 1.0 if granted.at_large else self._scale(driver.gap(pose, shut))
        tables = fuzzy_speeds(self._controller, self._settings.robot, sense, heading, self.scale)
        stop_at = distance_along(pose, granted.waypoints)
        if stop_at <= NEAR or self._rests(situation, granted):
            return self._filter.stop(), heading
        ahead = [one.measured for one in scan.bodies(self._constants) if abs(one.bearing) <= self._front]
        limits = Limits(
            situation.navigator.grid, shut, driver.local(pose), driver.bodies,
            fastest=sqrt(2 * SLOW_BRAKE * self._settings.robot.wheel_acceleration * max(0.0, min([stop_at, *((m - GAP) / SLOW_BRAKE for m in ahead)]))),
            may_drive=not halt,
        )
        return self._filter.check(sense, tables, limits), heading

    def _sweeps(self, situation: Situation, body: Body) -> tuple[int, ...]:
        """List the cells that the tables would drive the robot over in the next seconds."""
        if situation.sense.tick % 4 == 0 and self._aim is not None:
            sense, robot = situation.sense, self._settings.robot
            k = robot.distance_scale * self.scale
            points = rollout(
                self._controller, *situation.pose, body.left, body.right, sense.left / k, sense.front / k, sense.right / k, *self._aim, robot.speed_scale,
                robot.track_width, robot.wheel_acceleration, 1.0 / self._settings.rate, round(2.5 * self._settings.rate))
            self._swept = tuple(self._cells.swept_in_order(points, robot.radius + self._constants.margin)) if len(points) else ()
        return self._swept

    def _scale(self, gap: float) -> float:
        return min(1.0, max(0.4, gap / 0.8))

    def _rests(self, situation: Situation, granted: TrafficOutputs) -> bool:
        """Stop once inside the last cell held, except at a stop, and where it has to be in a certain place to look."""
        if len(granted.held) > 1 or granted.at_large or granted.exactly:
            return False
        if situation.done and not granted.waits and distance(situation.pose, situation.goal) > 0.9 * self._settings.reach:
            return False
        (x, y, _), room = situation.pose, self._settings.robot.radius + self._constants.margin
        return self._cells.fits(granted.held, x, y, room)

    def _gets_nowhere(self, situation: Situation, granted: TrafficOutputs, halt: bool) -> bool:
        """Return True if the robot drives unconstrained and its way has not become shorter for long.

        Standing before something unexplained does not count. In some corners the tables turn to and fro for ever; the
        driver then leads it out.
        """
        left = (situation.target, len(granted.way))
        target, fewest, since = self._progress
        if halt or len(granted.held) <= 1 or left[0] != target or left[1] < fewest or left[1] > fewest + 6:
            self._progress = (*left, situation.sense.tick)
            return False
        return (situation.sense.tick - since) / self._settings.rate > CIRCLES

    def _hemmed_in(self, pose: Pose) -> bool:
        """Tell whether it is in a passage one cell wide: there the paper's tables find no room to turn round."""
        cell = self._cells.cell_of(pose.x, pose.y)
        joined = set() if cell == OUTSIDE else {abs(other - cell) for other in self._cells.neighbours[cell]}
        return joined != {1, self._cells.columns}

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

        def expected() -> list[float]:
            found: list[float] = (each_on_map(grid, pose, self._bearings, radius + reach) - radius).tolist()
            return found

        return Scan(self._bearings, situation.sense.rays, expected)


def _targets_of_others(settings: Settings, number: int) -> list[Point]:
    """List where robots other than that number have to go, home left out: nobody may keep its last place there."""
    if not settings.own_targets:
        return settings.targets
    return [stop for other, stops in enumerate(settings.own_targets) if other != number for stop in stops]


def _by(wheels: Wheels) -> WheelSpeeds:
    return WheelSpeeds(wheels.left, wheels.right, STEERING[wheels.whose])
