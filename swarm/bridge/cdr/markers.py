"""What RViz and Foxglove draw of a fleet beside maps and scans, as visualization_msgs/msg/MarkerArray.

Held cells and joint plans are in the map. A robot's footprint and name are in its frame: the viewer moves them.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dashboard.fold import palette
from swarm.bridge.cdr.writer import CdrWriter
from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Body
from swarm.settings import Settings
from swarm.traffic.lattice.extent import lattice_shape

CYLINDER, LINE_LIST, CUBE_LIST, TEXT = 3, 5, 6, 9  # visualization_msgs/msg/Marker
ADD, DELETE = 0, 2
LASTS: Final = 3  # s after which a viewer drops what nobody says again
OPAQUE, CLEAR = 1.0, 0.35
FLAT: Final = 0.02  # m, the height of what lies on the floor
TALL: Final = 0.3  # m, the height of a robot
FILLED: Final = 0.92  # of a cell's side, so that neighbours are told apart
LINE: Final = 0.06  # m, the width of a line
LETTERS: Final = 0.35  # m, the height of a name
ABOVE: Final = 0.55  # m, where a name is
HERE: Final = Pose(0.0, 0.0, 0.0)
WHITE: Final = palette.WHITE


class Marker(NamedTuple):
    """A visualization_msgs/msg/Marker. If it has points, they are in the frame of its pose."""

    frame: str
    kind: str  # its namespace, which a viewer can hide
    number: int
    type: int
    scale: tuple[float, float, float]  # m
    colour: palette.Colour = WHITE
    alpha: float = OPAQUE
    pose: Pose = HERE
    height: float = 0.0  # m, of the pose
    points: "NDArray[np.float64] | None" = None  # m, shape (n, 3)
    colours: "NDArray[np.float32] | None" = None  # red, green, blue, alpha from 0 to 1, shape (n, 4)
    text: str = ""


class CellLattice(NamedTuple):
    """Where the cells of traffic are: all robots and ``CellMap`` have the same."""

    origin: Pose  # of the map
    side: float  # m, of a cell
    offset: Point  # m, from the map's origin to the outer corner of cell 0
    rows: int
    columns: int


def build_cell_lattice(floor: OccupancyMap, settings: Settings) -> CellLattice | None:
    """Return the lattice over a floor; None if the world does not tell where it is."""
    side, offset = settings.traffic.cell, settings.traffic.offset
    if side is None or offset is None:
        return None
    return CellLattice(floor.origin, side, offset, *lattice_shape(floor, side, offset))


def make_held_cells_marker(
    frame: str, bodies: Sequence[Body], numbers: Mapping[str, int], cells: CellLattice
) -> Marker:
    """Return the cells that robots hold, each in its robot's colour."""
    most = cells.rows * cells.columns
    pairs = [(cell, numbers[body.robot]) for body in bodies for cell in body.held if cell < most]
    rows, columns = np.divmod(np.array([cell for cell, _ in pairs], np.int64), cells.columns)
    points = np.zeros((len(pairs), 3))
    points[:, 0] = cells.offset[0] + (columns + 0.5) * cells.side
    points[:, 1] = cells.offset[1] + (rows + 0.5) * cells.side
    side = cells.side * FILLED
    colours = [to_rgba(palette.robot(number), CLEAR) for _, number in pairs]
    return Marker(
        frame, "held", 0, CUBE_LIST, (side, side, FLAT), pose=cells.origin, points=points,
        colours=np.array(colours, np.float32),
    )  # fmt: skip


def make_joint_plan_marker(frame: str, bodies: Iterable[Body]) -> Marker:
    """Return a line through the members of each joint plan, in the order of their names."""
    at = {body.robot: (body.x, body.y, ABOVE / 2) for body in bodies}
    plans = {tuple(sorted({body.robot, *body.members} & at.keys())) for body in bodies if body.members}
    ends = [at[name] for plan in sorted(plans) for pair in pairwise(plan) for name in pair]
    return Marker(
        frame, "joint plans", 0, LINE_LIST, (LINE, 0.0, 0.0), points=np.array(ends, np.float64).reshape(-1, 3)
    )


def make_robot_markers(
    frames: Mapping[str, str], numbers: Mapping[str, int], radii: Mapping[str, float]
) -> list[Marker]:
    """Return the footprint and the name of each robot, in its frame of ``frames``; ``radii`` [m] are the robots'."""
    found = []
    for robot, frame in frames.items():
        colour, wide = palette.robot(numbers[robot]), 2 * radii[robot]
        found += [
            Marker(frame, "footprints", numbers[robot], CYLINDER, (wide, wide, TALL), colour, height=TALL / 2),
            Marker(frame, "names", numbers[robot], TEXT, (0.0, 0.0, LETTERS), height=ABOVE, text=robot),
        ]
    return found


def write_marker_array(at: int, found: Sequence[Marker]) -> bytes:
    """Return markers as a visualization_msgs/msg/MarkerArray, stamped ``at`` [ns]."""
    out = CdrWriter()
    out.write_numbers("I", len(found))
    for one in found:
        _write_marker(out, at, one)
    return out.to_bytes()


def to_rgba(colour: palette.Colour, alpha: float) -> tuple[float, float, float, float]:
    """Return a colour as ROS has it, from 0 to 1."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255, alpha


def _write_marker(out: CdrWriter, at: int, one: Marker) -> None:
    out.write_header(at, one.frame)
    out.write_text(one.kind)
    empty = one.points is not None and not len(one.points)
    out.write_numbers("i", one.number, one.type, DELETE if empty else ADD)  # RViz complains about a list of nothing
    out.write_pose(one.pose, one.height)
    out.write_numbers("d", *one.scale)
    out.write_numbers("f", *to_rgba(one.colour, one.alpha))
    out.write_numbers("I", LASTS, 0)
    out.write_numbers("B", 1)  # locked to its frame: the viewer moves it
    for values, size in ((one.points, 8), (one.colours, 4)):
        rows: NDArray[Any] = np.zeros((0, 0)) if values is None else values
        out.write_sequence(len(rows), size, rows.tobytes())
    out.write_text("")  # no texture: its name, and an image
    out.write_header(0, "")
    out.write_text("")
    out.write_numbers("I", 0, 0)
    out.write_text(one.text, "", "")  # the text; no mesh: its name, and a file
    out.write_numbers("I", 0)
    out.write_numbers("B", 0)
