"""The physics of bodies that roll and walls that stop them. No other file imports pymunk.

Bodies are dynamic. Without a contact, a body ends every step exactly on the arc that its wheels describe, because its
velocity is set to the chord of that arc. In a contact, the solver keeps shapes apart. Metres, seconds, radians.
"""

from collections.abc import Iterable, Mapping, Sequence
from math import ceil, inf
from typing import Final

import numpy as np
import pymunk
from numpy.typing import NDArray

from swarm.geometry import Pose, Twist, displacement_of_twist, wrap
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, WALL, OccupancyMap, Point
from world.bodies import rays
from world.bodies.shapes import Contact, Motion, PhysicsState

Numbers = NDArray[np.float64]

ROBOT: Final = 10  # collision type of a robot; other shapes have the cell value of the map
STILL: Final = Twist(0.0, 0.0)
NOBODY: Final[Mapping[int, Pose]] = {}
KINDS: Final = {WALL: "wall", UNKNOWN: "wall", OBSTACLE: "obstacle", ROBOT: "robot"}


class Physics:
    """The floor and the bodies on it; robots are known by their number."""

    def __init__(
        self, floor: OccupancyMap, radii: Sequence[float], poses: Sequence[Pose], top_speeds: Sequence[float], dt: float
    ) -> None:
        """Put robots with these ``radii`` [m] and ``top_speeds`` [m/s] on a floor; ``dt`` [s] is a control step."""
        self._space = pymunk.Space()
        self._space.collision_slop = 1e-4  # m; pymunk's default of 0.1 is for pixels
        self._radii, self._fastest = list(radii), list(top_speeds)
        self._dt = dt
        self._substeps = self._count_substeps()
        self._contacts: list[Contact] = []
        self.touching: list[Contact] = []  # contacts that have begun and not ended
        self.touched_at: dict[Contact, Point] = {}  # m, of the contacts that began in the last step
        self._still: list[pymunk.Shape] = []
        self.set_floor(floor)
        self._bodies = [self._add(number, pose) for number, pose in enumerate(poses)]
        self._movers: list[pymunk.Body] = []
        self._outlines: list[tuple[float | None, tuple[float, float]]] = []  # of each mover: radius, or both sides
        self._renewed = False  # new bodies were made since the first of the present contacts began
        self._known: Sequence[Contact] = ()  # contacts from before that, until pymunk has found them again
        self._sort()
        self._discs = np.tile(np.array(self._radii)[:, None], 3)  # m, of each in ``_round``: place and radius
        self._boxes: Numbers = np.empty((0, 5))
        self._yaws: Numbers = np.empty(0)  # rad, of the robots, not wrapped
        self._poses: list[Pose] = []
        self._stale = True  # bodies have moved since ``_place`` read their poses
        self._rolled: list[Twist] = []  # twists of the last step
        self._disturbed = True  # a contact may have changed a body's velocity
        for kind in KINDS:
            self._space.on_collision(ROBOT, kind, begin=self._on_contact, separate=self._on_parting, data=kind)

    def set_floor(self, floor: OccupancyMap) -> None:
        """Replace everything that stands still."""
        self.floor = floor
        self._space.remove(*self._still)
        self._still = []
        for kind in (WALL, OBSTACLE, UNKNOWN):
            for low, high in floor.blocks(kind):
                shape = pymunk.Poly(self._space.static_body, floor.corners(low, high))
                shape.collision_type = kind
                self._still.append(shape)
        self._space.add(*self._still)
        solid = (floor.cells != FREE).astype(np.uint8)
        self._ground = (solid, floor.resolution, *floor.origin)

    def add_mover(self, pose: Pose, radius: float | None, size: tuple[float, float] | None) -> None:
        """Put a moving obstacle on the floor: a disc of ``radius`` [m] or a box of ``size`` [m], along and across."""
        length, width = size or (1.0, 1.0)
        self._outlines.append((radius, (length, width)))
        self._movers.append(self._add_mover(len(self._movers), pose))
        self._sort()
        if radius is not None:
            self._discs = np.vstack([self._discs, (pose.x, pose.y, radius)])
        else:
            self._boxes = np.vstack([self._boxes, (pose.x, pose.y, pose.yaw, length / 2, width / 2)])

    def _count_substeps(self) -> int:
        """Return the parts of a control step in which the fastest small body moves a quarter of its radius at most."""
        bodies = zip(self._radii, self._fastest, strict=True)
        return max([1, *(ceil(speed * self._dt / (radius / 4)) for radius, speed in bodies)])

    def add_robot(self, start: Pose, radius: float, top_speed: float) -> None:
        """Put one more robot on the floor."""
        number = len(self._bodies)
        self._radii.append(radius)
        self._fastest.append(top_speed)
        self._substeps = self._count_substeps()
        self._bodies.append(self._add(number, start))
        self._sort()
        self._discs = np.insert(self._discs, number, (start.x, start.y, radius), axis=0)
        self._rolled = [*self._rolled, STILL] if self._rolled else []
        self._stale = True

    def set_radius(self, number: int, radius: float) -> None:
        """Make a robot wider or narrower [m]: it has taken up a load, or put it down."""
        self._radii[number] = self._discs[number, 2] = radius
        self._substeps = self._count_substeps()
        for shape in self._bodies[number].shapes:
            assert isinstance(shape, pymunk.Circle)
            shape.unsafe_set_radius(radius)
        self._space.reindex_shapes_for_body(self._bodies[number])

    def _sort(self) -> None:
        """List what rays see as discs, robots first, and what they see as boxes."""
        movers = list(zip(self._movers, self._outlines, strict=True))
        self._round = [*self._bodies, *(body for body, (radius, _) in movers if radius is not None)]
        self._square = [body for body, (radius, _) in movers if radius is None]

    def _add_mover(self, number: int, pose: Pose) -> pymunk.Body:
        radius, size = self._outlines[number]
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position, body.angle = (pose.x, pose.y), pose.yaw
        shape = pymunk.Circle(body, radius) if radius is not None else pymunk.Poly.create_box(body, size)
        shape.collision_type = OBSTACLE
        self._space.add(body, shape)
        return body

    def _add(self, number: int, pose: Pose) -> pymunk.Body:
        body = pymunk.Body(mass=1.0, moment=inf)
        body.position, body.angle = (pose.x, pose.y), pose.yaw
        shape = pymunk.Circle(body, self._radii[number])
        shape.collision_type = ROBOT
        shape.filter = pymunk.ShapeFilter(group=number + 1)  # names the robot in a contact
        self._space.add(body, shape)
        return body

    def _on_contact(self, arbiter: pymunk.Arbiter, space: pymunk.Space, kind: int) -> None:
        begun = _both_ways(arbiter, kind)
        self.touched_at.update(dict.fromkeys(begun, _middle(arbiter)))
        self._contacts += [contact for contact in begun if contact not in self._known]
        self.touching += begun

    def _on_parting(self, arbiter: pymunk.Arbiter, space: pymunk.Space, kind: int) -> None:
        for contact in _both_ways(arbiter, kind):
            self.touching.remove(contact)

    def pose(self, robot: int) -> Pose:
        """Return the pose of a robot."""
        return self.poses()[robot]

    def poses(self) -> list[Pose]:
        """Return the pose of every robot."""
        self._place()
        return self._poses

    def roll(
        self,
        twists: Iterable[Twist],
        movers: Sequence[Pose] = (),
        placed: Mapping[int, Pose] = NOBODY,
        jumped: Iterable[int] = (),
    ) -> list[Contact]:
        """Move every robot along its twist for one control step, and every mover to its next pose.

        ``placed`` are robots that move to a given pose instead; those of them that ``jumped`` are just set down there.
        Return the contacts that began, in order.
        """
        self._contacts, self.touched_at = [], {}
        self._stale = True
        dt = self._dt / self._substeps
        for body, pose in zip(self._movers, movers, strict=True):
            x, y = body.position
            body.angle = pose.yaw
            body.velocity = ((pose.x - x) / self._dt, (pose.y - y) / self._dt)
        before, self._rolled = self._rolled or [STILL] * len(self._bodies), list(twists)
        everybody = [pair for pair in enumerate(self._rolled) if pair[0] not in placed]
        for number in jumped:
            self._bodies[number].position = placed[number][:2]
            self._space.reindex_shapes_for_body(self._bodies[number])
        goals = [(number, _towards(self._bodies[number], pose, self._dt)) for number, pose in placed.items()]
        moving = [pair for pair in everybody if pair[1] != STILL or before[pair[0]] != STILL]
        for _ in range(self._substeps):
            if not self.touching:
                self._renewed = False
            elif not self._renewed:
                self._renew(self.state)
            for number, twist in everybody if self._disturbed else moving:
                body = self._bodies[number]
                if twist.linear == 0.0:
                    body.velocity = (0.0, 0.0)
                else:
                    x, y = body.position
                    dx, dy = displacement_of_twist(body.angle, twist, dt)
                    body.velocity = ((x + dx - x) / dt, (y + dy - y) / dt)  # without what rounding loses in x + dx
                body.angular_velocity = twist.angular
            for number, (vx, vy, turning) in goals:
                self._bodies[number].velocity, self._bodies[number].angular_velocity = (vx, vy), turning
            self._disturbed = bool(self.touching)
            if self._disturbed:
                self._solve(dt)
            self._space.step(dt)
            self._disturbed |= bool(self.touching)
        for number, pose in placed.items():
            self._bodies[number].position = (pose.x, pose.y)  # whatever it touches: that is where it is
        return sorted(self._contacts, key=lambda contact: (contact.robot, contact.kind, contact.other or 0))

    def _solve(self, dt: float) -> None:
        """Take from the wanted velocities what would press shapes into each other; nothing moves.

        A step of pymunk moves bodies first and solves contacts for the next step, but ``roll`` sets all velocities
        again before that step.
        """
        if self._known:
            self.touching = []
        everybody = (*self._bodies, *self._movers)
        for body in everybody:
            body.position_func = _stay
        self._space.step(dt)
        for body in everybody:
            body.position_func = pymunk.Body.update_position
        self._known = ()

    @property
    def state(self) -> PhysicsState:
        """The state of all bodies, from which ``restore`` goes on bit for bit after ``settle``."""
        robots, movers = ([_moving(body) for body in bodies] for bodies in (self._bodies, self._movers))
        return PhysicsState(robots, movers, list(self._rolled), list(self.touching), self._disturbed)

    def restore(self, state: PhysicsState) -> None:
        """Continue from a state."""
        self.touching, self._rolled, self._disturbed = list(state.touching), list(state.rolled), state.disturbed
        self._renew(state)

    def settle(self) -> None:
        """Drop what pymunk remembers of contacts beside the state: what follows is a function of the state alone."""
        if self.touching:
            self._renew(self.state)

    def _renew(self, state: PhysicsState) -> None:
        """Make new bodies: the old ones carry impulses, and a tree of neighbours that has grown with the run."""
        for body in (*self._bodies, *self._movers):
            self._space.remove(*body.shapes, body)
        self.touching, self._known = list(state.touching), state.touching
        self._renewed, self._stale = bool(state.touching), True
        self._bodies = [self._add(number, _pose(body)) for number, body in enumerate(state.robots)]
        self._movers = [self._add_mover(number, _pose(body)) for number, body in enumerate(state.movers)]
        for made, was in zip((*self._bodies, *self._movers), (*state.robots, *state.movers), strict=True):
            made.velocity, made.angular_velocity = (was.vx, was.vy), was.turning
        self._sort()

    def cast_all(self, robots: NDArray[np.int64], angles: Numbers, reach: float) -> Numbers:
        """Measure the free distances [m] of some robots along the same rays: (robots, angles)."""
        self._place()
        measured: Numbers = rays.cast_all(*self._ground, robots, self._yaws, self._discs, self._boxes, angles, reach)
        return measured

    def sees(self, a: Point, b: Point) -> bool:
        """Return True if nothing that stands still lies between two points [m]."""
        return self.sees_each(a, np.array([b], np.float64))[0]

    def sees_each(self, here: Point, places: Numbers) -> list[bool]:
        """Return ``sees`` from a point to each place, (n, 2) [m]."""
        seen: list[bool] = rays.are_in_sight(*self._ground, *here, places).tolist()
        return seen

    def _place(self) -> None:
        """Read the poses of all bodies, if they have moved."""
        if self._stale:
            self._stale = False
            places = [body.position for body in self._round]
            self._discs[:, :2] = np.array(places, np.float64).reshape(-1, 2)
            for row, body in enumerate(self._square):
                self._boxes[row, :2] = body.position
                self._boxes[row, 2] = body.angle
            yaws = [body.angle for body in self._bodies]
            self._yaws = np.array(yaws, np.float64)
            self._poses = [Pose(x, y, wrap(yaw)) for (x, y), yaw in zip(places, yaws, strict=False)]  # robots are first


def _towards(body: pymunk.Body, pose: Pose, dt: float) -> tuple[float, float, float]:
    """Return the velocity [m/s, m/s, rad/s] that brings a body to a pose in a time [s]."""
    x, y = body.position
    return (pose.x - x) / dt, (pose.y - y) / dt, wrap(pose.yaw - body.angle) / dt


def _stay(body: pymunk.Body, dt: float) -> None:
    """Leave the body where it is."""


def _moving(body: pymunk.Body) -> Motion:
    return Motion(*body.position, body.angle, *body.velocity, body.angular_velocity)


def _pose(body: Motion) -> Pose:
    return Pose(body.x, body.y, body.angle)


def _both_ways(arbiter: pymunk.Arbiter, kind: int) -> list[Contact]:
    """Return a contact as each robot in it sees it.

    The shapes come in either order. A shape that is not a robot has the group 0.
    """
    a, b = (shape.filter.group - 1 for shape in arbiter.shapes)
    if kind == ROBOT:
        return [Contact(a, "robot", b), Contact(b, "robot", a)]
    return [Contact(max(a, b), KINDS[kind], None)]


def _middle(arbiter: pymunk.Arbiter) -> Point:
    """Return the point [m] in the middle of where two shapes overlap."""
    overlap = arbiter.contact_point_set.points[0]  # one of the shapes is a disc: there is one
    x, y = (overlap.point_a + overlap.point_b) / 2
    return x, y
