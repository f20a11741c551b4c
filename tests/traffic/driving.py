"""A driver with the constants that its tests share."""

from swarm.planning.grid import Grid
from swarm.robot.kinematics import DifferentialDrive
from swarm.traffic.cells import CellMap
from swarm.traffic.driver import Driver
from tests.traffic.maps import Drawn

DT = 0.05  # s
ACCELERATION = 2.0  # m/s2, of a rim speed
DRIVE = DifferentialDrive(track_width=0.4, wheel_radius=0.05)
RADIUS, MARGIN = 0.2, 0.03


def driver(drawn: Drawn, grid: Grid | None = None) -> Driver:
    return driver_on(drawn.cells, grid)


def driver_on(cells: CellMap, grid: Grid | None = None) -> Driver:
    return Driver(cells, DRIVE, radius=RADIUS, margin=MARGIN, acceleration=ACCELERATION, dt=DT, fastest=0.6, grid=grid)
