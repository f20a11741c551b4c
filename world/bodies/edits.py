"""Edits of the floor while robots drive. An edit is refused if a robot could not stop before it."""

from collections.abc import Iterable

from shapely import Point as ShapelyPoint
from shapely import Polygon

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, OccupancyMap
from swarm.messages import Edit
from swarm.robot.ground import KINDS
from swarm.robot.tuning import SAFETY
from swarm.settings import RobotSettings


def apply_edit(
    floor: OccupancyMap,
    edit: Edit,
    bodies: Iterable[tuple[str, Pose, tuple[float, float], RobotSettings]],
    dt: float,
    late: int = 0,
) -> OccupancyMap:
    """Return the edited floor; ``bodies`` are name, pose, rim speeds [m/s] and settings, ``dt`` is a tick [s].

    Robots sense it ``late`` ticks later than now.

    Raises:
        ConfigError: the edit is outside the map, or a robot stands there or could not stop before it.
    """
    kind = KINDS[edit.kind]
    changed, low, high = floor.edit_rectangle(kind, edit.low, edit.high)
    if low[0] >= high[0] or low[1] >= high[1]:
        raise ConfigError(f"edit: expected a rectangle on the map, got {edit.low} to {edit.high}; move it")
    if kind == FREE:
        return changed
    block = Polygon(changed.corners(low, high))
    for name, pose, wheels, robot in bodies:
        gap = block.distance(ShapelyPoint(pose.x, pose.y)) - robot.radius
        if gap <= 0.0:
            raise ConfigError(f"edit: expected a free place for a {edit.kind.value}, {name} stands there; wait")
        if not can_stop_before(gap, wheels, robot, dt, late):
            raise ConfigError(
                f"edit: expected a place for a {edit.kind.value} that {name} can stop before, "
                f"it drives {gap:.2f} m away; wait"
            )
    return changed


def can_stop_before(gap: float, wheels: tuple[float, float], robot: RobotSettings, dt: float, late: int = 0) -> bool:
    """Return True if a robot with these rim speeds [m/s] stands, or can stop before what is put ``gap`` [m] away.

    It senses that ``late`` ticks later than now.
    """
    speed = max(abs(wheel) for wheel in wheels) + robot.wheel_acceleration * dt
    return not any(wheels) or gap > speed**2 / (2 * robot.wheel_acceleration) + (2 + late) * speed * dt + SAFETY.gap
