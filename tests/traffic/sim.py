"""Robots that drive by ``Traffic`` alone, in one process: discs, a lossy radio, and every kind of hold-up.

Bodies are kinematic: contacts are counted, they do not block, so "all arrived" means something only without any. The
drive is plain pursuit inside the held cells, so that traffic is proven apart from the fuzzy controller.
"""

from dataclasses import dataclass, field
from math import atan2, ceil, cos, hypot, inf, pi, radians, sin, sqrt
from random import Random

from swarm.geometry import Pose, Twist, bearing, integrate, wrap
from swarm.maps.occupancy import Point
from swarm.traffic.cells import CellMap
from swarm.traffic.hearsay import Event
from swarm.traffic.look import Reading
from swarm.traffic.record import TrafficBroadcast
from swarm.traffic.settings import TrafficSettings
from swarm.traffic.traffic import Traffic, TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.watch import Seen, Watch

DT = 0.05  # s
SPEED = 0.6  # m/s
TURN = 2.0  # rad/s
BRAKE = 2.0  # m/s2
SECTORS = ((radians(30), radians(10)), (0.0, radians(10)), (-radians(30), radians(10)))  # middle, half width


@dataclass
class Faults:
    """What goes wrong, and how often. Times in s."""

    loss: float = 0.0  # share of broadcasts that do not arrive
    held_up: float = 0.0  # each robot's motors stop for 5 s, on average this often; 0: never
    suspended: float = 0.0  # the same for the whole process: brain, radio and motors
    killed: dict[str, float] = field(default_factory=dict)  # robot -> when its process dies
    kill_leader_at: float = inf  # the first robot that leads a joint plan after this dies


@dataclass
class Body:
    """One robot in the simulation."""

    pose: Pose
    goals: list[Point]
    traffic: Traffic
    speed: float = 0.0  # m/s
    held_until: int = 0
    asleep_until: int = 0
    dead: bool = False
    reached: int = 0
    driven: float = 0.0  # m
    outputs: TrafficOutputs | None = None
    inbox: list[TrafficBroadcast] = field(default_factory=list)
    arrived_at: float = inf

    @property
    def goal(self) -> Point:
        return self.goals[min(self.reached, len(self.goals) - 1)]


class Simulation:
    """A world of discs on the cells of one map."""

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
        self.cells = cells
        self.settings = settings
        self.faults = faults or Faults()
        self.random = Random(seed)
        self.near = near  # m, so near a goal counts as reached
        self.tick = 0
        self.bodies: dict[str, Body] = {}
        for index, (start, ends) in enumerate(zip(starts, goals, strict=True)):
            name = f"r{index:03d}"
            yaw = self.random.uniform(-pi, pi)
            traffic = Traffic(name, cells, settings, slot=index)
            self.bodies[name] = Body(Pose(*start, wrap(yaw)), list(ends), traffic)
        self.watch = Watch(cells, settings.radius, DT)
        self.events: list[tuple[int, Event]] = []
        self.walls = Walls(cells)

    # ---- running

    def run(self, seconds: float) -> bool:
        """Run until all the living are where they want to be at the same moment; tell whether they are."""
        end = self.tick + ceil(seconds / DT)
        while self.tick < end:
            self.step()
            if self.done():
                return True
        return False

    def done(self) -> bool:
        """Tell whether every living robot stands at its last goal."""
        return all(
            body.dead or (body.reached >= len(body.goals) - 1 and apart(body.pose, body.goal) <= self.near)
            for body in self.bodies.values()
        )

    def step(self) -> None:
        """One tick: sense, decide, move, speak."""
        sent: list[tuple[str, TrafficBroadcast]] = []
        events: list[Event] = []
        moved: dict[str, bool] = {}
        readings = {name: self._readings(name) for name in self.bodies}
        for name, body in self.bodies.items():
            self._strike(name, body)
            before = body.pose
            if not body.dead and self.tick >= body.asleep_until:
                outputs = body.traffic.step(
                    TrafficInputs(
                        tick=self.tick,
                        pose=body.pose,
                        goal=body.goal,
                        braking=self._braking(body),
                        readings=readings[name],
                        heard=tuple(body.inbox),
                    )
                )
                body.inbox = []
                body.outputs = outputs
                events += outputs.events
                if outputs.broadcast is not None:
                    sent.append((name, outputs.broadcast))
                self._drive(body, outputs)
            else:
                body.speed = 0.0
                body.inbox = []
            moved[name] = body.pose != before
            body.driven += apart(body.pose, before)
            while body.reached < len(body.goals) - 1 and apart(body.pose, body.goal) <= self.near:
                body.reached += 1
            if body.reached == len(body.goals) - 1 and apart(body.pose, body.goal) <= self.near:
                body.arrived_at = min(body.arrived_at, self.tick * DT)
        self._radio(sent)
        self.events += [(self.tick, event) for event in events]
        self.watch.look(
            self.tick,
            {
                name: self._seen(body, body.outputs, moved[name])
                for name, body in self.bodies.items()
                if body.outputs is not None
            },
            events,
        )
        self.tick += 1

    def _seen(self, body: Body, out: TrafficOutputs, moved: bool) -> Seen:
        live = not body.dead and self.tick >= body.asleep_until
        busy = out.activity is not TrafficActivity.ARRIVED and not body.dead
        return Seen(body.pose, out.held, busy, moved, out.waits, live)

    def _strike(self, name: str, body: Body) -> None:
        """Let fate act."""
        faults, now = self.faults, self.tick * DT
        if faults.killed.get(name, inf) <= now:
            body.dead = True
        leads = body.outputs is not None and body.outputs.activity is TrafficActivity.LEADING
        if leads and faults.kill_leader_at <= now:
            body.dead = True
            faults.kill_leader_at = inf
        if faults.held_up and self.random.random() < DT / faults.held_up:
            body.held_until = max(body.held_until, self.tick + round(5 / DT))
        if faults.suspended and self.random.random() < DT / faults.suspended:
            body.asleep_until = max(body.asleep_until, self.tick + round(5 / DT))

    def _radio(self, sent: list[tuple[str, TrafficBroadcast]]) -> None:
        for name, broadcast in sent:
            here = self.bodies[name].pose
            for other, body in self.bodies.items():
                if (
                    other != name
                    and apart(here, body.pose) <= self.settings.radio_range
                    and self.random.random() >= self.faults.loss
                ):
                    body.inbox.append(broadcast)

    # ---- driving

    def _braking(self, body: Body) -> tuple[Point, ...]:
        return tuple(braking_path(body.pose, body.speed))

    def _drive(self, body: Body, out: TrafficOutputs) -> None:
        if self.tick < body.held_until:
            body.speed = 0.0
            return
        aim = out.face or self._aim(body, out)
        error = bearing(body.pose, aim)
        far = apart(body.pose, aim)
        turn = max(-TURN, min(TURN, 4.0 * error))
        if out.face is not None or not out.may_drive or far < 0.03:
            wanted = 0.0
            turn = turn if far >= 0.03 else 0.0
        else:
            wanted = 0.0 if abs(error) > radians(40) else min(SPEED, sqrt(2 * 1.0 * far)) * cos(error)
        for share in (1.0, 0.6, 0.3, 0.0):
            speed = min(wanted * share, body.speed + BRAKE * DT)
            pose = integrate(body.pose, Twist(speed, turn), DT)
            path = [(pose.x, pose.y), *braking_path(pose, speed)]
            if speed == 0.0 or all(self.cells.fits(out.held, *point, self.settings.radius + 0.02) for point in path):
                body.pose, body.speed = pose, speed
                return

    def _aim(self, body: Body, out: TrafficOutputs) -> Point:
        """Choose the farthest waypoint that the disc reaches straight through held cells."""
        for point in reversed(out.waypoints):
            length = apart(body.pose, point)
            count = max(1, ceil(length / 0.1))
            if all(
                self.cells.fits(
                    out.held,
                    body.pose.x + (point[0] - body.pose.x) * k / count,
                    body.pose.y + (point[1] - body.pose.y) * k / count,
                    self.settings.radius + 0.04,
                )
                for k in range(1, count + 1)
            ):
                return point
        return out.waypoints[0]

    # ---- sensing

    def _readings(self, name: str) -> tuple[Reading, ...]:
        body = self.bodies[name]
        pose, radius, reach = body.pose, self.settings.radius, self.settings.sensor_range
        near = [
            other.pose
            for key, other in self.bodies.items()
            if key != name and apart(other.pose, pose) < reach + 2 * radius
        ]
        looks = body.outputs is not None and body.outputs.activity is TrafficActivity.LOOKING
        if not near and not looks:
            return tuple(Reading(reach, reach, middle, half) for middle, half in SECTORS)
        readings = []
        for middle, half in SECTORS:
            angles = [pose.yaw + middle + share * half for share in (-1.0, -0.5, 0.0, 0.5, 1.0)]
            wall = min(self.walls.distance(pose.x, pose.y, angle, reach + radius) for angle in angles) - radius
            hit = min((ray_to_disc(pose, angle, other, radius) for angle in angles for other in near), default=inf)
            readings.append(Reading(min(hit - radius, wall, reach), min(wall, reach), middle, half))
        return tuple(readings)


class Walls:
    """Distances to what the map shows, by walking along the ray."""

    def __init__(self, cells: CellMap) -> None:
        self._occupancy = cells.occupancy

    def distance(self, x: float, y: float, angle: float, reach: float) -> float:
        """Measure along a ray [m], to within 2 cm."""
        dx, dy = cos(angle), sin(angle)
        along = 0.0
        while along < reach:
            if self._occupancy.at(x + along * dx, y + along * dy):
                return along
            along += 0.1
        return reach


def braking_path(pose: Pose, speed: float) -> list[Point]:
    """Points on the way to a stop, straight ahead [m]."""
    length = speed * speed / (2 * BRAKE) + speed * DT
    return [(pose.x + share * length * cos(pose.yaw), pose.y + share * length * sin(pose.yaw)) for share in (0.5, 1.0)]


def apart(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Measure between two points or poses [m]."""
    return hypot(a[0] - b[0], a[1] - b[1])


def ray_to_disc(pose: Pose, angle: float, centre: Pose, radius: float) -> float:
    """Measure along a ray from a pose to a disc [m]; inf where it passes by."""
    along = (centre.x - pose.x) * cos(angle) + (centre.y - pose.y) * sin(angle)
    aside = abs(wrap(atan2(centre.y - pose.y, centre.x - pose.x) - angle))
    off = sin(min(aside, pi / 2)) * apart(pose, centre)
    if along <= 0 or off >= radius:
        return inf
    return along - sqrt(radius * radius - off * off)
