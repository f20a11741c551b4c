"""The kinematic simulation again, driven by the paper's fuzzy controller with wheels that take time to follow."""

from math import degrees, inf, radians

from swarm.geometry import Twist, bearing, integrate
from swarm.maps.occupancy import Point
from swarm.robot.fuzzy import Controller, load_profile
from swarm.robot.kinematics import DifferentialDrive
from swarm.traffic import driver
from swarm.traffic.cells import CellMap
from swarm.traffic.driver import Driver, Wheels, Whose, distance_along
from swarm.traffic.look import Reading
from swarm.traffic.settings import TrafficSettings
from swarm.traffic.traffic import TrafficOutputs
from tests.traffic.sim import DT, Body, Faults, Simulation, apart, ray_to_disc

SCALE = 0.4  # of the paper's wheel speeds
ACCELERATION = 2.0  # m/s2, of a rim speed
DRIVE = DifferentialDrive(track_width=0.4, wheel_radius=0.05)
SECTORS = ((radians(60), radians(25)), (0.0, radians(25)), (-radians(60), radians(25)))


class FuzzySimulation(Simulation):
    """Bodies with wheels, and the controller of ``swarm.robot.fuzzy`` under the driver."""

    def __init__(
        self,
        cells: CellMap,
        starts: list[Point],
        goals: list[list[Point]],
        *,
        settings: TrafficSettings,
        faults: Faults | None = None,
        seed: int = 0,
        near: float = 0.3,
    ) -> None:
        super().__init__(cells, starts, goals, settings=settings, faults=faults, seed=seed, near=near)
        self._controller = Controller(load_profile("paper"))
        self.ticks = dict.fromkeys(Whose, 0)
        self._wheels = dict.fromkeys(self.bodies, (0.0, 0.0))
        self._drivers = {
            name: Driver(
                self.cells, DRIVE, radius=self.settings.radius, margin=self.settings.margin,
                acceleration=ACCELERATION, dt=DT, fastest=0.6,
            )
            for name in self.bodies
        }  # fmt: skip

    @property
    def fuzzy_share(self) -> float:
        """Share of moving ticks in which the ratio of the wheel speeds was the tables' own."""
        moving = sum(count for whose, count in self.ticks.items() if whose is not Whose.REST)
        return self.ticks[Whose.TABLES] / max(1, moving)

    def _body(self, body: Body) -> driver.Body:
        return driver.Body(body.pose, *self._wheels[body.traffic.me])

    def _braking(self, body: Body) -> tuple[Point, ...]:
        return self._drivers[body.traffic.me].braking(self._body(body))

    def _drive(self, body: Body, out: TrafficOutputs) -> None:
        name = body.traffic.me
        wheels = Wheels(0.0, 0.0, Whose.REST) if self.tick < body.held_until else self._steer(name, body, out)
        self.ticks[wheels.whose] += 1
        most, (left, right) = ACCELERATION * DT, self._wheels[name]
        left = min(left + most, max(left - most, wheels.left))
        right = min(right + most, max(right - most, wheels.right))
        self._wheels[name] = (left, right)
        twist: Twist = DRIVE.twist(left, right)
        body.pose, body.speed = integrate(body.pose, twist, DT), twist.linear

    def _steer(self, name: str, body: Body, out: TrafficOutputs) -> Wheels:
        driving = self._drivers[name]
        if out.face is not None:
            return driving.face(self._body(body), out.face)
        aim = driving.aim(body.pose, out.drivable, out.waypoints)
        left, front, right = (reading.measured for reading in self._readings(name))
        tables = self._controller.wheel_speeds(left, front, right, -degrees(bearing(body.pose, aim)))
        return driving.wheels(
            self._body(body),
            out.drivable,
            aim,
            stop_at=distance_along(body.pose, out.waypoints),
            tables=(SCALE * tables[0], SCALE * tables[1]),
            may_drive=out.may_drive,
        )

    def _readings(self, name: str) -> tuple[Reading, ...]:
        """Measure walls and bodies, since the tables steer by both."""
        body, radius, reach = self.bodies[name], self.settings.radius, self.settings.sensor_range
        pose = body.pose
        near = [other.pose for key, other in self.bodies.items() if key != name and apart(other.pose, pose) < 2 * reach]
        readings = []
        for middle, half in SECTORS:
            angles = [pose.yaw + middle + share * half for share in (-1.0, -0.5, 0.0, 0.5, 1.0)]
            wall = min(self.walls.distance(pose.x, pose.y, angle, reach + radius) for angle in angles) - radius
            hit = min((ray_to_disc(pose, angle, other, radius) for angle in angles for other in near), default=inf)
            readings.append(Reading(max(0.0, min(hit - radius, wall, reach)), max(0.0, min(wall, reach)), middle, half))
        return tuple(readings)
