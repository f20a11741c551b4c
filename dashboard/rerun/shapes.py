"""The shapes of a batch of frames as arrays, without Rerun. K frames, N robots, metres in the map frame."""

from collections.abc import Callable, Sequence
from math import cos, radians, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dashboard.fold import palette
from dashboard.fold.overlays import Learned
from swarm.geometry import Pose, from_frame
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, WALL, OccupancyMap
from swarm.messages import Body, Mover, Truth
from swarm.settings import SensorSettings

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

ARC: Final = 5  # points on a sector's arc
NEAR: Final = 0.8  # m; the paper's `near`
TRAIL_STEP: Final = 0.15  # m between two points of a trail
TRAIL_LENGTH: Final = 100  # points of a trail
COLUMNS: Final = ("x", "y", "yaw", "left", "front", "right", "left_v", "right_v", "radius")  # of a body


def table(frames: list[Truth], robots: tuple[str, ...]) -> Floats:
    """Return the frames as an array (K, N, len(COLUMNS)); a robot that is not in a frame has not-a-number."""
    place = {name: number for number, name in enumerate(robots)}
    values = np.full((len(frames), len(robots), len(COLUMNS)), np.nan, dtype=np.float32)
    for k, frame in enumerate(frames):
        for body in frame.bodies:
            number = place.get(body.robot)
            if number is not None:
                values[k, number] = [getattr(body, column) for column in COLUMNS]
    return values


def radii_now(values: Floats, own: Sequence[float]) -> Floats:
    """Return the radius of each robot in each frame (K, N): with its load, or its ``own`` (N)."""
    told = values[..., 8]
    return np.where(told > 0.0, told, np.array(own, dtype=np.float32))


def heading_strips(values: Floats, radii: Floats) -> Floats:
    """Return the headings of the robots: strips (K*N, 2, 2) from the centre to a little beyond the edge."""
    reach = radii[..., None] * np.array([0.0, 1.6], dtype=np.float32)
    yaw = values[..., 2, None]
    points = values[..., None, :2] + reach[..., None] * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    strips: Floats = points.reshape(-1, 2, 2).astype(np.float32)
    return strips


def sectors(values: Floats, radii: Floats, sensors: Sequence[SensorSettings]) -> Floats:
    """Return the three measured sectors of each robot: closed strips (K*N*3, ARC + 2, 2).

    ``radii`` are (K, N), ``sensors`` those of each robot.
    """
    fans = {one: _fan(one) for one in set(sensors)}
    middle = np.array([fans[one][0] for one in sensors], dtype=np.float32).reshape(-1, 3)
    fan = np.array([fans[one][1] for one in sensors], dtype=np.float32).reshape(-1, 3, ARC)
    angle = values[..., 2, None, None] + fan  # (K, N, 3, ARC)
    reach = (values[..., 3:6] + radii[..., None])[..., None, None]
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * reach
    base = values[..., 2, None] + middle
    tip = (np.stack([np.cos(base), np.sin(base)], axis=-1) * radii[..., None, None])[..., None, :]
    ring = np.concatenate([tip, arc, tip], axis=-2) + values[..., None, None, :2]
    return ring.reshape(-1, ARC + 2, 2).astype(np.float32)


def _fan(sensors: SensorSettings) -> tuple[list[float], list[Floats]]:
    """Return the middle of each sector, and the angles of its arc [rad, from ahead]."""
    side, half = radians(sensors.side_deg), radians(sensors.side_half_width_deg)
    front = radians(sensors.front_half_width_deg)
    edges = ((side - half, side + half), (-front, front), (-side - half, half - side))
    return [side, 0.0, -side], [np.linspace(low, high, ARC, dtype=np.float32) for low, high in edges]


def sector_colours(values: Floats, sensors: Sequence[SensorSettings]) -> Bytes:
    """Return the colours of the sectors (K*N*3, 4): faint if nothing is in range, else brighter, red within `near`."""
    seen = values[..., 3:6]
    in_range = np.array([one.range - 1e-3 for one in sensors], dtype=np.float32)[:, None]
    near = np.array([min(NEAR, one.range) for one in sensors], dtype=np.float32)[:, None]
    colours = np.empty((seen.size, 4), dtype=np.uint8)
    colours[:, :3] = palette.WHITE
    colours[:, 3] = np.where(seen < in_range, 110, 28).reshape(-1)
    colours[(seen < near).reshape(-1)] = (*palette.BLOCKED, 200)
    return colours


def floor_image(floor: OccupancyMap) -> Bytes:
    """Return the map as an image, one pixel per cell, row 0 at the lowest y: (rows, columns, 3)."""
    colours = np.zeros((256, 3), dtype=np.uint8)
    colours[:] = palette.UNKNOWN
    for kind, colour in (
        (FREE, palette.FLOOR),
        (WALL, palette.WALL),
        (OBSTACLE, palette.OBSTACLE),
        (UNKNOWN, palette.UNKNOWN),
    ):
        colours[kind] = colour
    return colours[floor.cells]


def border(floor: OccupancyMap) -> Floats:
    """Return the border of the map: a closed strip (5, 2)."""
    corners = floor.corners((0, 0), floor.shape)
    return np.array([*corners, corners[0]], dtype=np.float32)


def image_of_learned_floor(learned: Learned) -> Bytes:
    """Return the learned floor as an image of kinds of cells, row 0 at the lowest y: (rows, columns)."""
    kinds = np.full(learned.rows * learned.columns, FREE, dtype=np.uint8)
    cells = np.array(learned.cells, dtype=np.int64)
    kinds[cells[cells < kinds.size]] = WALL
    return kinds.reshape(learned.rows, learned.columns)


def bounds(floor: OccupancyMap, margin: float) -> tuple[float, float, float, float]:
    """Return the lowest and highest x, then y, of the map, with a margin [m]."""
    low, high = border(floor).min(axis=0) - margin, border(floor).max(axis=0) + margin
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def frame_matrix(yaw: float, scale: float) -> list[list[float]]:
    """Return the 3 x 3 matrix that turns [rad] and scales a map's own frame into ``map``."""
    c, s = cos(yaw) * scale, sin(yaw) * scale
    return [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]


def outlines(movers: list[Mover]) -> list[Floats]:
    """Return the outlines of moving obstacles: a circle for a disc, a turned box for a box."""
    found = []
    for mover in movers:
        if mover.radius:
            found.append(circle_strips([(mover.x, mover.y)], mover.radius)[0])
            continue
        along, across = mover.size[0] / 2, mover.size[1] / 2
        corners = ((along, across), (-along, across), (-along, -across), (along, -across), (along, across))
        pose = Pose(mover.x, mover.y, mover.yaw)
        found.append(np.array([from_frame(pose, x, y) for x, y in corners], dtype=np.float32))
    return found


def beliefs(bodies: list[Body], radius_now: Callable[[Body], float]) -> list[Floats]:
    """Return a ring for each robot that knows its pose only nearly: its body is in it, wherever in its error it is."""
    found = [(radius_now(body), body.believed) for body in bodies if body.believed is not None]
    return [circle_strips([(x, y)], radius + off)[0] for radius, (x, y, _, off) in found]


def loads(bodies: list[Body]) -> list[Floats]:
    """Return a ring around each robot that carries a load: the footprint that it has with it."""
    return [circle_strips([(body.x, body.y)], body.radius)[0] for body in bodies if body.radius]


class Trails:
    """The last metres that each robot drove."""

    def __init__(self, robots: int) -> None:
        self._points: list[list[tuple[float, float]]] = [[] for _ in range(robots)]

    def add(self, xy: Floats) -> None:
        """Take in the positions of all robots: (N, 2)."""
        for points, (x, y) in zip(self._points, xy.tolist(), strict=True):
            if x == x and (not points or abs(x - points[-1][0]) + abs(y - points[-1][1]) >= TRAIL_STEP):
                points.append((x, y))
                del points[:-TRAIL_LENGTH]

    def strips(self) -> list[Floats]:
        """Return one strip per robot; it has no points if the robot was not seen yet."""
        return [np.array(points, dtype=np.float32).reshape(-1, 2) for points in self._points]


def circle_strips(spots: Sequence[tuple[float, float]], radii: float | Sequence[float]) -> Floats:
    """Return a circle around each spot: (M, 33, 2); ``radii`` are one for all, or one for each."""
    angle = np.linspace(0.0, 2 * np.pi, 33, dtype=np.float32)
    return _around(spots, radii, np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def square_strips(spots: Sequence[tuple[float, float]], halves: float | Sequence[float]) -> Floats:
    """Return a square around each spot: (M, 5, 2); ``halves`` of their sides are one for all, or one for each."""
    return _around(spots, halves, np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]], dtype=np.float32))


def _around(spots: Sequence[tuple[float, float]], sizes: float | Sequence[float], ring: Floats) -> Floats:
    places, scales = np.array(spots, dtype=np.float32), np.array(sizes, dtype=np.float32)
    return (places.reshape(-1, 1, 2) + scales.reshape(-1, 1, 1) * ring).astype(np.float32)
