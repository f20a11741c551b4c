"""Bodies that roll, walls that stop them, rays that see both. The one file that touches pymunk.

Bodies are dynamic: between contacts each one ends every step exactly on the arc its wheels describe, since its
velocity is set to the chord of that arc; in a contact the solver keeps shapes apart. Metres, seconds, radians.
"""

from collections.abc import Iterable, Sequence
from math import ceil, cos, inf, sin
from typing import Final, NamedTuple

import pymunk

from swarm.geometry import Pose, Twist, integrate, wrap
from swarm.maps.occupancy import OBSTACLE, UNKNOWN, WALL, OccupancyMap, Point

ROBOT: Final = 10  # collision types: this, and the map's kinds of cell
KINDS: Final = {WALL: "wall", UNKNOWN: "wall", OBSTACLE: "obstacle", ROBOT: "robot"}

STILL: Final = 0b01  # categories: what never moves, and robots
MOVING: Final = 0b10
SIGHT: Final = pymunk.ShapeFilter(mask=STILL)


class Contact(NamedTuple):
    """A robot began to touch something."""

    robot: int
    kind: str  # robot, wall, obstacle
    other: int | None  # the other robot


class Physics:
    """The floor and the bodies on it; robots go by their number."""

    def __init__(self, floor: OccupancyMap, radius: float, poses: Sequence[Pose], top_speed: float, dt: float) -> None:
        self._space = pymunk.Space()
        self._space.collision_slop = 1e-4  # m; pymunk's default of 0.1 is for pixels
        self._radius = radius
        self._dt = dt
        self._substeps = max(1, ceil(top_speed * dt / (radius / 4)))  # no body moves a quarter radius unchecked
        self._contacts: list[Contact] = []
        self._touching = 0  # pairs of shapes in contact
        self._still: list[pymunk.Shape] = []
        self.set_floor(floor)
        self._movers: list[pymunk.Body] = []
        self._bodies = [self._add(number, pose) for number, pose in enumerate(poses)]
        for kind in KINDS:
            self._space.on_collision(ROBOT, kind, begin=self._on_contact, separate=self._on_parting, data=kind)
        self._filters = [shape.filter for body in self._bodies for shape in body.shapes]

    def set_floor(self, floor: OccupancyMap) -> None:
        """Let what stands still be this."""
        self._space.remove(*self._still)
        self._still = []
        for kind in (WALL, OBSTACLE, UNKNOWN):
            for low, high in floor.blocks(kind):
                shape = pymunk.Poly(self._space.static_body, floor.corners(low, high))
                shape.collision_type = kind
                shape.filter = pymunk.ShapeFilter(categories=STILL)
                self._still.append(shape)
        self._space.add(*self._still)

    def add_mover(self, pose: Pose, radius: float | None, size: tuple[float, float] | None) -> None:
        """Put a moving obstacle on the floor: a disc of ``radius`` [m] or a box of ``size`` [m], along and across."""
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position, body.angle = (pose.x, pose.y), pose.yaw
        shape = pymunk.Circle(body, radius) if radius is not None else pymunk.Poly.create_box(body, size or (1.0, 1.0))
        shape.collision_type = OBSTACLE
        shape.filter = pymunk.ShapeFilter(categories=MOVING)
        self._space.add(body, shape)
        self._movers.append(body)

    def _add(self, number: int, pose: Pose) -> pymunk.Body:
        body = pymunk.Body(mass=1.0, moment=inf)
        body.position, body.angle = (pose.x, pose.y), pose.yaw
        shape = pymunk.Circle(body, self._radius)
        shape.collision_type = ROBOT
        shape.filter = pymunk.ShapeFilter(group=number + 1, categories=MOVING)  # a robot's own rays pass it by group
        self._space.add(body, shape)
        return body

    def _on_contact(self, arbiter: pymunk.Arbiter, space: pymunk.Space, kind: int) -> None:
        self._touching += 1
        a, b = (shape.filter.group - 1 for shape in arbiter.shapes)
        if kind == ROBOT:
            self._contacts += [Contact(a, "robot", b), Contact(b, "robot", a)]
        else:
            self._contacts.append(Contact(a, KINDS[kind], None))

    def _on_parting(self, arbiter: pymunk.Arbiter, space: pymunk.Space, kind: int) -> None:
        self._touching -= 1

    def pose(self, robot: int) -> Pose:
        """Where a robot stands."""
        body = self._bodies[robot]
        x, y = body.position
        return Pose(x, y, wrap(body.angle))

    def roll(self, twists: Iterable[Twist], movers: Sequence[Pose] = ()) -> list[Contact]:
        """Let every robot follow its twist for one control step, and every mover come to its next pose.

        Returns the contacts that began, in order.
        """
        self._contacts = []
        dt = self._dt / self._substeps
        for body, pose in zip(self._movers, movers, strict=True):
            x, y = body.position
            body.angle = pose.yaw
            body.velocity = ((pose.x - x) / self._dt, (pose.y - y) / self._dt)
        twists = list(twists)
        for _ in range(self._substeps):
            for body, twist in zip(self._bodies, twists, strict=True):
                x, y = body.position
                end = integrate(Pose(x, y, body.angle), twist, dt)
                body.velocity = ((end.x - x) / dt, (end.y - y) / dt)
                body.angular_velocity = twist.angular
            if self._touching:
                self._solve(dt)
            self._space.step(dt)
        return sorted(self._contacts, key=lambda contact: (contact.robot, contact.kind, contact.other or 0))

    def _solve(self, dt: float) -> None:
        """Let contacts take from the wished velocities what would press shapes into each other; nothing moves.

        A step of pymunk moves first and solves then, for the next one; the next one's velocities are wished anew.
        """
        everybody = (*self._bodies, *self._movers)
        for body in everybody:
            body.position_func = _stay
        self._space.step(dt)
        for body in everybody:
            body.position_func = pymunk.Body.update_position

    def cast(self, robot: int, angles: Iterable[float], reach: float) -> list[float]:
        """Measure the free distance [m, 0..reach] from a robot's edge along rays at body angles [rad]."""
        x, y = self._bodies[robot].position
        yaw = self._bodies[robot].angle
        whole = self._radius + reach
        query, own = self._space.segment_query_first, self._filters[robot]
        free = []
        for angle in angles:
            heading = yaw + angle
            hit = query((x, y), (x + whole * cos(heading), y + whole * sin(heading)), 0.0, own)
            free.append(reach if hit is None else min(reach, max(0.0, hit.alpha * whole - self._radius)))
        return free

    def sees(self, a: Point, b: Point) -> bool:
        """Tell whether nothing that stands still lies between two points."""
        return self._space.segment_query_first(a, b, 0.0, SIGHT) is None


def _stay(body: pymunk.Body, dt: float) -> None:
    """Move nowhere."""
