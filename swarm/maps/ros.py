"""ROS maps: a ``.yaml`` of map_server (also of Nav2) and the image it names.

Pixels become free, occupied or unknown as in Nav2's map_io.cpp (nav2_map_server).
"""

from math import pi
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from swarm.errors import ConfigError
from swarm.geometry import Pose, wrap
from swarm.maps.files import decode_utf8, path_within, read_file, yaml_values
from swarm.maps.images import Pixels, load_image
from swarm.maps.limits import COORDINATE_MAX, RESOLUTION_MAX, RESOLUTION_MIN
from swarm.maps.occupancy import FREE, UNKNOWN, WALL, OccupancyMap
from swarm.messages.faults import in_words

YAML_MAX: Final = 1 << 16  # bytes
Share = Annotated[float, Meta(ge=0, le=1)]
Far = Annotated[float, Meta(ge=-COORDINATE_MAX, le=COORDINATE_MAX)]


class Description(Struct, frozen=True, forbid_unknown_fields=True):
    """The content of the ``.yaml``."""

    image: Annotated[str, Meta(min_length=1, description="path from the .yaml's folder")]
    resolution: Annotated[float, Meta(ge=RESOLUTION_MIN, le=RESOLUTION_MAX, description="m, the side of a pixel")]
    origin: Annotated[tuple[Far, Far, Far], Meta(description="m, m, rad; of the lower left pixel's outer corner")]
    occupied_thresh: Annotated[Share, Meta(description="above it a cell is occupied")]
    free_thresh: Annotated[Share, Meta(description="below it a cell is free")]
    negate: Annotated[bool, Meta(description="white is occupied")] = False
    mode: Annotated[Literal["trinary", "scale", "raw"], Meta(description="trinary, scale or raw")] = "trinary"


def load_ros(path: Path) -> OccupancyMap:
    """Load a map_server ``.yaml`` and its image, which must be in the same folder or below it.

    Raises:
        ConfigError: one of the two files is not valid.
    """
    description = from_yaml(read_file(path, YAML_MAX), str(path))
    image = path_within(path.parent, description.image, f"{path}: image")
    return from_pixels(load_image(image), description)


def from_yaml(content: bytes, where: str = "map.yaml") -> Description:
    """Read the bytes of a map_server ``.yaml``.

    Raises:
        ConfigError: a key is missing, unknown or has a wrong value.
    """
    raw = yaml_values(decode_utf8(content, where), where)
    try:
        found = msgspec.convert(raw, Description, strict=False)  # YAML 1.1 takes 1e3 for a text, map_server does not
    except msgspec.ValidationError as fault:
        raise ConfigError(f"{where}: {in_words(str(fault), raw, Description)}") from None
    if found.free_thresh > found.occupied_thresh:
        raise ConfigError(
            f"{where}: expected free_thresh <= occupied_thresh, got {found.free_thresh} and {found.occupied_thresh}; "
            "correct them"
        )
    return found


def from_pixels(pixels: Pixels, description: Description) -> OccupancyMap:
    """Return the map of an image; the image's last row becomes row 0.

    ``trinary``: an alpha channel is averaged with the colours, as map_server does. ``scale``: a pixel that is not
    opaque is unknown; between the thresholds map_server gives a probability, here the cell is unknown. ``raw``: a
    brightness of 0 to 100 (of 255) is the occupancy in percent, anything above is unknown, ``negate`` has no effect.
    """
    brightness, opacity = pixels
    known = np.ones(brightness.shape, np.bool_)
    if description.mode == "raw":
        percent = np.rint(brightness * 255)
        known = percent <= 100
        occupied = percent / 100
    else:
        if opacity is not None and description.mode == "trinary":
            brightness = (3 * brightness + opacity) / 4
        elif opacity is not None:
            known = opacity == 1.0
        occupied = brightness if description.negate else 1.0 - brightness
    cells: NDArray[np.uint8] = np.full(brightness.shape, UNKNOWN, np.uint8)
    cells[known & (occupied < description.free_thresh)] = FREE
    cells[known & (occupied > description.occupied_thresh)] = WALL
    x, y, yaw = description.origin
    origin = Pose(x, y, yaw if -pi < yaw <= pi else wrap(yaw))
    return OccupancyMap(np.ascontiguousarray(cells[::-1]), description.resolution, origin)
