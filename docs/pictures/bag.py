"""Draws a moment of a bag, from its messages alone: what RViz or Foxglove show of it, without either.

    swarm run paper --robots 8 --pace 4 --dashboard off --record run.mcap
    python -m docs.pictures.bag run.mcap 12 docs/pictures/markers.png

rosbags reads the bag and matplotlib (`pip install matplotlib`) draws it: nothing of this project is imported, so the
picture shows what others find in the messages.
"""

import sys
from math import atan2
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Circle, Rectangle
from rosbags.highlevel import AnyReader

mpl.use("Agg")
LINE_LIST, CUBE_LIST, CYLINDER, TEXT = 5, 6, 3, 9  # visualization_msgs/msg/Marker


def newest(path: Path, until: float) -> tuple[dict[str, Any], dict[Any, Any], dict[str, tuple[float, float, float]]]:
    """Return the last messages by topic, markers by namespace and id, and frames in the map, at a time [s]."""
    last: dict[str, Any] = {}
    markers: dict[Any, Any] = {}
    frames: dict[str, tuple[float, float, float]] = {}
    with AnyReader([path]) as reader:
        for connection, at, raw in reader.messages():
            if at > until * 1e9:
                break
            message: Any = reader.deserialize(raw, connection.msgtype)
            last[connection.topic] = message
            if connection.topic == "/markers":
                markers |= {(one.ns, one.id): one for one in message.markers}
            if connection.topic == "/tf":
                for one in message.transforms:
                    to, turn = one.transform.translation, one.transform.rotation
                    frames[one.child_frame_id] = to.x, to.y, 2 * atan2(turn.z, turn.w)
    return last, markers, frames


def rgba(colour: Any) -> tuple[float, float, float, float]:  # noqa: ANN401
    """Return a std_msgs/msg/ColorRGBA as matplotlib's."""
    return colour.r, colour.g, colour.b, colour.a


def draw(path: Path, until: float, to: Path) -> None:
    """Draw the moment ``until`` [s] of a bag into a file."""
    last, markers, frames = newest(path, until)
    floor = last["/map"]
    info = floor.info
    cells = np.array(floor.data).reshape(info.height, info.width)
    wide, high = info.width * info.resolution, info.height * info.resolution
    left, low = info.origin.position.x, info.origin.position.y
    figure, axes = plt.subplots(figsize=(9, 9 * high / wide), dpi=100)
    axes.imshow(
        np.where(cells < 0, 50, cells), cmap="Greys", origin="lower", vmin=0, vmax=130,
        extent=(left, left + wide, low, low + high),
    )  # fmt: skip
    colours = {one.id: rgba(one.color) for one in markers.values() if one.type == CYLINDER}
    for one in markers.values():
        x, y, _ = frames.get(one.header.frame_id, (0.0, 0.0, 0.0))
        if one.action:
            continue
        if one.type == CUBE_LIST:
            for at, colour in zip(one.points, one.colors, strict=True):
                corner = at.x - one.scale.x / 2, at.y - one.scale.y / 2
                axes.add_patch(Rectangle(corner, one.scale.x, one.scale.y, color=rgba(colour), linewidth=0))
        elif one.type == LINE_LIST:
            for begin, end in zip(one.points[::2], one.points[1::2], strict=True):
                axes.plot([begin.x, end.x], [begin.y, end.y], color="black", linewidth=1.5, linestyle=":")
        elif one.type == CYLINDER:
            axes.add_patch(Circle((x, y), one.scale.x / 2, color=rgba(one.color)))
        elif one.type == TEXT:
            axes.text(x, y + 0.35, one.text, ha="center", fontsize=9)
    for number, colour in colours.items():
        robot = markers["names", number].text
        if (plan := last.get(f"/{robot}/plan")) is not None:
            way = [(pose.pose.position.x, pose.pose.position.y) for pose in plan.poses]
            axes.plot(*zip(*way, strict=True), color=colour, linewidth=1.2) if way else None
        if (scan := last.get(f"/{robot}/scan")) is not None:
            x, y, yaw = frames[f"{robot}/base_footprint"]
            met = np.isfinite(scan.ranges)
            angles = yaw + scan.angle_min + scan.angle_increment * np.flatnonzero(met)
            reach = np.array(scan.ranges)[met]
            axes.plot(x + reach * np.cos(angles), y + reach * np.sin(angles), ".", color="crimson", markersize=3)
    axes.set_xlim(left, left + wide)
    axes.set_ylim(low, low + high)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    figure.tight_layout()
    figure.savefig(to, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    draw(Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]))
