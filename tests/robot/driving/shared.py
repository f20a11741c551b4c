"""A body that tests drive by hand: kinematics and the wheels' ramp in plain Python, and its clearance by shapely."""

from collections.abc import Iterable

import numpy as np
import shapely
from numpy.typing import NDArray

from swarm.geometry import Pose, integrate
from swarm.maps.occupancy import OBSTACLE, WALL, OccupancyMap
from swarm.messages import Sense
from swarm.motion.drive import DifferentialDrive, ramp
from swarm.planning.grid import Grid
from swarm.robot.driving.safety import NO_BODIES, Constraints, DriveState
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import CellMap
from tests.shared import scenario_of

SETTINGS: Settings = scenario_of().settings
ROBOT = SETTINGS.robot
RADIUS, ACCELERATION, DT = ROBOT.radius, ROBOT.wheel_acceleration, 1.0 / SETTINGS.rate
MOST = ACCELERATION * DT  # m/s, change of a rim speed in one tick
DRIVE = DifferentialDrive(ROBOT.track_width)
TOP = 4.0 * ROBOT.speed_scale  # m/s, the paper's fastest wheel
NOTHING = 1.6  # m, measured by a sensor that sees nothing
NO_BOXES = np.empty((0, 4))


def rolled(body: DriveState, wanted: tuple[float, float]) -> DriveState:
    """Let a tick pass, the rim speeds ramping."""
    left, right = ramp(body.left, wanted[0], MOST), ramp(body.right, wanted[1], MOST)
    return DriveState(integrate(body.pose, DRIVE.twist(left, right), DT), left, right)


def to_a_stand(body: DriveState) -> list[Pose]:
    """Brake: every pose from now until the wheels stand."""
    poses = [body.pose]
    while body.left or body.right:
        body = rolled(body, (0.0, 0.0))
        poses.append(body.pose)
    return poses


def told(body: DriveState, wanted: tuple[float, float], ticks: int) -> list[Pose]:
    """Drive with what the wheels are told for so many ticks, and brake: every pose after now."""
    poses = []
    for _ in range(ticks):
        body = rolled(body, wanted)
        poses.append(body.pose)
    return [*poses, *to_a_stand(body)[1:]]


def sense_of(
    body: DriveState, tick: int = 0, left: float = NOTHING, front: float = NOTHING, right: float = NOTHING
) -> Sense:
    """Make what a body senses; where nothing is given its distance sensors see nothing."""
    twist = DRIVE.twist(body.left, body.right)
    return Sense(
        world="local",
        run=0, tick=tick, time=tick * DT, lockstep=True, x=body.pose.x, y=body.pose.y, yaw=body.pose.yaw,
        linear=twist.linear, angular=twist.angular, left=left, front=front, right=right, bearings=[None, None],
        hears=[], rays=[],
    )  # fmt: skip


def constraints(
    grid: Grid,
    pose: Pose,
    shut: NDArray[np.float64] = NO_BOXES,
    bodies: NDArray[np.float64] = NO_BODIES,
) -> Constraints:
    """Make the constraints of a robot whose lattice lies as the map does."""
    return Constraints(grid, shut, pose, bodies)


def solid(floor: OccupancyMap) -> shapely.Geometry:
    """Join everything solid into one shape, made from the drawing alone; the map lies at the origin."""
    side, (rows, columns) = floor.resolution, floor.shape
    return shapely.union_all(
        [
            shapely.box(side * column, side * row, side * (column + 1), side * (row + 1))
            for row in range(rows)
            for column in range(columns)
            if floor.cells[row, column] in {WALL, OBSTACLE}
        ]
    )


def cells_as_shape(cells: CellMap, held: Iterable[int]) -> shapely.Geometry:
    """Join held cells into one shape."""
    half = cells.side / 2
    middles = [cells.centre(cell) for cell in held]
    return shapely.union_all([shapely.box(x - half, y - half, x + half, y + half) for x, y in middles])


def footprint(pose: Pose, radius: float = RADIUS) -> shapely.Geometry:
    """Return the disc under a robot."""
    return shapely.Point(pose.x, pose.y).buffer(radius, quad_segs=32)


def room(shape: shapely.Geometry, pose: Pose) -> float:
    """Measure the gap between the footprint and a shape [m]; below 0 they overlap."""
    return float(shapely.distance(shape, shapely.Point(pose.x, pose.y))) - RADIUS
