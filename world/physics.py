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
        ground = self._space.static_body
        for kind in (WALL, OBSTACLE, UNKNOWN):
            for low, high in floor.blocks(kind):
                shape = pymunk.Poly(ground, floor.corners(low, high))
                shape.collision_type = kind
                shape.filter = pymunk.ShapeFilter(categories=STILL)
                self._space.add(shape)
        self._bodies = [self._add(number, pose) for number, pose in enumerate(poses)]
        for kind in KINDS:
            self._space.on_collision(ROBOT, kind, begin=self._on_contact, data=kind)
        self._filters = [shape.filter for body in self._bodies for shape in body.shapes]

    def _add(self, number: int, pose: Pose) -> pymunk.Body:
        body = pymunk.Body(mass=1.0, moment=inf)
        body.position, body.angle = (pose.x, pose.y), pose.yaw
        shape = pymunk.Circle(body, self._radius)
        shape.collision_type = ROBOT
        shape.filter = pymunk.ShapeFilter(group=number + 1, categories=MOVING)  # a robot's own rays pass it by group
        self._space.add(body, shape)
        return body

    def _on_contact(self, arbiter: pymunk.Arbiter, space: pymunk.Space, kind: int) -> None:
        a, b = (shape.filter.group - 1 for shape in arbiter.shapes)
        if kind == ROBOT:
            self._contacts += [Contact(a, "robot", b), Contact(b, "robot", a)]
        else:
            self._contacts.append(Contact(a, KINDS[kind], None))

    def pose(self, robot: int) -> Pose:
        """Where a robot stands."""
        body = self._bodies[robot]
        x, y = body.position
        return Pose(x, y, wrap(body.angle))

    def roll(self, twists: Iterable[Twist]) -> list[Contact]:
        """Let every robot follow its twist for one control step; return the contacts that began, in order."""
        self._contacts = []
        dt = self._dt / self._substeps
        twists = list(twists)
        for _ in range(self._substeps):
            for body, twist in zip(self._bodies, twists, strict=True):
                x, y = body.position
                end = integrate(Pose(x, y, body.angle), twist, dt)
                body.velocity = ((end.x - x) / dt, (end.y - y) / dt)
                body.angular_velocity = twist.angular
            self._space.step(dt)
        return sorted(self._contacts, key=lambda contact: (contact.robot, contact.kind, contact.other or 0))

    def nearest(self, robot: int, angles: Iterable[float], reach: float) -> float:
        """Measure from a robot's edge to the nearest hit [m, 0..reach] of rays at body angles [rad]."""
        x, y = self._bodies[robot].position
        yaw = self._bodies[robot].angle
        whole = self._radius + reach
        share = 1.0
        query, own = self._space.segment_query_first, self._filters[robot]
        for angle in angles:
            heading = yaw + angle
            hit = query((x, y), (x + whole * cos(heading), y + whole * sin(heading)), 0.0, own)
            if hit is not None and hit.alpha < share:
                share = hit.alpha
        return min(reach, max(0.0, share * whole - self._radius))

    def sees(self, a: Point, b: Point) -> bool:
        """Tell whether nothing that stands still lies between two points."""
        return self._space.segment_query_first(a, b, 0.0, SIGHT) is None


def fan(middle: float, half_width: float, rays: int) -> tuple[float, ...]:
    """Spread rays evenly over a sector: body angles [rad], right to left.

    >>> [round(a, 2) for a in fan(0.0, 0.5, 3)]
    [-0.5, 0.0, 0.5]
    """
    if rays == 1:
        return (middle,)
    return tuple(wrap(middle - half_width + 2 * half_width * k / (rays - 1)) for k in range(rays))
