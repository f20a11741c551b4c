"""The state of bodies and their contacts, as physics tells it."""

from typing import NamedTuple

from swarm.geometry import Twist


class Contact(NamedTuple):
    """The beginning of a robot's contact with something."""

    robot: int
    kind: str  # robot, wall, obstacle
    other: int | None  # the other robot


class Motion(NamedTuple):
    """The state of one body."""

    x: float  # m
    y: float
    angle: float  # rad, not wrapped
    vx: float  # m/s
    vy: float
    turning: float  # rad/s


class PhysicsState(NamedTuple):
    """The state of all bodies."""

    robots: list[Motion]
    movers: list[Motion]
    rolled: list[Twist]
    touching: list[Contact]
    disturbed: bool
