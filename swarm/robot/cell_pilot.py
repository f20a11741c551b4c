"""Driving by holds: the robot enters a cell only when it holds it, and the fuzzy tables steer inside what it holds."""

from collections.abc import Callable, Iterable
from math import inf

import numpy as np

from swarm.geometry import Pose, Twist, bearing, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import COMMAND, Activity, Sense
from swarm.planning.rays import each_on_map
from swarm.robot.fuzzy import Controller
from swarm.robot.ground import Block
from swarm.robot.kinematics import DifferentialDrive
from swarm.robot.lateness import Lateness
from swarm.robot.pilot import Move, Situation, fuzzy_speeds
from swarm.robot.sectors import half_width, sectors
from swarm.robot.supervisor import Supervisor, WheelSpeeds
from swarm.robot.surprise import Surprise
from swarm.scenario.schema import Settings
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.cells_of import cells_of, comes_near, traffic_settings
from swarm.traffic.driver import NO_BODIES, Body, Driver, Wheels, distance_along
from swarm.traffic.look import Scan
from swarm.traffic.traffic import Traffic, TrafficActivity, TrafficInputs, TrafficOutputs

STANDING = frozenset({TrafficActivity.WAITING, TrafficActivity.STANDING, TrafficActivity.LEADING})


CIRCLES = 8.0  # s in which a robot that drives unconstrained has come no nearer to its goal
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
        self._supervisor = Supervisor(settings)
        self._surprise = Surprise(settings)
        self._lateness = Lateness(robot.wheel_acceleration, 1.0 / settings.rate)
        self._last = 0.0, 0.0  # m/s, rim speeds commanded last,
        self._rolls = 0  # and for how many ticks they would be carried out if it fell asleep now
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
                braking=self._driver.braking(body, self._under_way(sense, body)),
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
        self._rolls = round(COMMAND.timeout * self._settings.rate) if granted.at_large else 0
        self._last = speeds.left, speeds.right
        return Move(
            speeds,
            heading,
            self._activity(situation, granted, idle=idle),
            held=granted.held,
            unconstrained=granted.at_large,
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
        self._driver.take_cells(self._cells)

    def learn(self, floor: OccupancyMap, blocks: Iterable[Block]) -> bool:
        """Take in blocks of a learned map that have changed; return True where cells or joins did."""
        before = self._cells
        for low, high in blocks:
            self._cells = self._cells.changed(floor, low, high)
        self._traffic.take_cells(self._cells)
        self._driver.take_cells(self._cells)
        return self._cells.neighbours is not before.neighbours

    def robot_at(self, tick: int) -> Callable[[Point], bool]:
        """Return the test whether another robot's body may be at a place [m] at a tick."""
        return self._traffic.robot_at(tick)

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
        seen = sense.bearings[situation.target] if distance(aim, situation.goal) < 1e-9 else None
        heading = bearing(pose, aim) if seen is None else seen
        tables = fuzzy_speeds(self._controller, self._settings.robot, sense, heading)
        circles = self._gets_nowhere(situation, granted, halt)
        if not granted.at_large or circles or (self._hemmed_in(pose) and driver.faces_away(heading)):
            ahead = [one.measured for one in scan.bodies(self._constants) if abs(one.bearing) <= self._front]
            free = min(ahead, default=inf)
            stop_at = distance_along(pose, granted.waypoints)
            may_drive = granted.may_drive
            return _by(
                driver.wheels(
                    body, granted.drivable, aim, stop_at=stop_at, tables=tables, free=free, may_drive=may_drive
                )
            ), heading
        if situation.done and distance(pose, aim) <= AT_REST:
            return self._supervisor.stop(), heading
        room = driver.room_in(pose, granted.drivable)
        return self._supervisor.check(
            sense, situation.navigator.grid, self._surprise.obstacles, halt, *tables, room
        ), heading

    def _gets_nowhere(self, situation: Situation, granted: TrafficOutputs, halt: bool) -> bool:
        """Return True if the robot drives unconstrained and its way has not become shorter for long.

        Standing before something unexplained does not count. In some corners the tables turn to and fro for ever; the
        driver then leads it out.
        """
        left = (situation.target, len(granted.way))
        target, fewest, since = self._progress
        if halt or not granted.at_large or left[0] != target or left[1] < fewest:
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
    return WheelSpeeds(wheels.left, wheels.right)
