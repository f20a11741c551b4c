"""ROS maps: a ``.yaml`` of map_server (also of Nav2) and the image it names.

Pixels become free, occupied or unknown as in Nav2's map_io.cpp (nav2_map_server).
"""

from math import isfinite, pi
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray

from swarm.errors import ConfigError, nearest
from swarm.geometry import Pose, wrap
from swarm.maps.files import decoded, read_file, shown, within
from swarm.maps.images import Pixels, load_image
from swarm.maps.limits import COORDINATE_MAX, check_cell
from swarm.maps.occupancy import FREE, UNKNOWN, WALL, OccupancyMap

YAML_MAX: Final = 1 << 16  # bytes
REQUIRED: Final = ("image", "resolution", "origin", "occupied_thresh", "free_thresh")
OPTIONAL: Final = ("negate", "mode")
MODES: Final = ("trinary", "scale", "raw")
TRUTHS: Final = {"0": False, "1": True, "false": False, "true": True, "no": False, "yes": True}


class Description(NamedTuple):
    """The content of the ``.yaml``."""

    image: str  # path of the image, from the .yaml's folder
    resolution: float  # m, the side of a pixel
    origin: Pose  # of the lower left pixel's outer corner
    occupied: float  # above it a cell is occupied, 0 to 1
    free: float  # below it a cell is free, 0 to 1
    negate: bool  # white is occupied
    mode: str  # one of MODES


def load_ros(path: Path) -> OccupancyMap:
    """Load a map_server ``.yaml`` and its image, which must be in the same folder or below it.

    Raises:
        ConfigError: one of the two files is not valid.
    """
    description = from_yaml(read_file(path, YAML_MAX), str(path))
    image = within(path.parent, description.image, f"{path}: image")
    return from_pixels(load_image(image), description)


def from_yaml(content: bytes, where: str = "map.yaml") -> Description:
    """Read the bytes of a map_server ``.yaml``.

    Raises:
        ConfigError: a key is missing, unknown or has a wrong value.
    """
    fields = _fields(content, where)
    origin = fields["origin"]
    if not isinstance(origin, list) or len(origin) != 3:
        raise ConfigError(f"{where}: origin: expected [x, y, yaw], got {_said(origin)}; write three numbers")
    x, y, yaw = (_number(each, f"{where}: origin") for each in origin)
    if max(abs(x), abs(y), abs(yaw)) > COORDINATE_MAX:
        raise ConfigError(f"{where}: origin: expected numbers up to {COORDINATE_MAX:.0f}, got {origin}; correct it")
    resolution = _number(fields["resolution"], f"{where}: resolution")
    check_cell(resolution, f"{where}: resolution")
    free, occupied = (_number(fields[key], f"{where}: {key}") for key in ("free_thresh", "occupied_thresh"))
    if not 0.0 <= free <= occupied <= 1.0:
        raise ConfigError(
            f"{where}: expected 0 <= free_thresh <= occupied_thresh <= 1, got {free} and {occupied}; correct them"
        )
    negate, mode, image = fields.get("negate", "0"), fields.get("mode", "trinary"), fields["image"]
    if not isinstance(negate, str) or negate.lower() not in TRUTHS:
        raise ConfigError(f"{where}: negate: expected 0 or 1, got {_said(negate)}; correct it")
    if not isinstance(mode, str) or mode not in MODES:
        raise ConfigError(f"{where}: mode: expected one of {', '.join(MODES)}, got {_said(mode)}; correct it")
    if not isinstance(image, str) or not image:
        raise ConfigError(f"{where}: image: expected a file's name, got {_said(image)}; name the .pgm or .png")
    return Description(
        image,
        resolution,
        Pose(x, y, yaw if -pi < yaw <= pi else wrap(yaw)),
        occupied,
        free,
        TRUTHS[negate.lower()],
        mode,
    )


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
    cells[known & (occupied < description.free)] = FREE
    cells[known & (occupied > description.occupied)] = WALL
    return OccupancyMap(np.ascontiguousarray(cells[::-1]), description.resolution, description.origin)


def _fields(content: bytes, where: str) -> dict[str, str | list[str]]:
    """Read a mapping of words and lists of words; anything else is an error."""
    try:
        node = yaml.compose(decoded(content, where), Loader=yaml.BaseLoader)
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}: " if mark else ""
        problem = " ".join(str(getattr(error, "problem", None) or "too deep or no text").split())[:80]
        raise ConfigError(f"{where}: {line}expected YAML, got {problem}; correct it") from error
    if not isinstance(node, yaml.MappingNode):
        raise ConfigError(
            f"{where}: expected keys and values such as 'image: map.pgm', got none; is this a map's .yaml?"
        )
    fields: dict[str, str | list[str]] = {}
    for key, value in node.value:
        at = f"{where}: line {key.start_mark.line + 1}"
        name = key.value if isinstance(key, yaml.ScalarNode) else ""
        if name not in REQUIRED + OPTIONAL:
            raise ConfigError(f"{at}: unknown key {shown(name)}; {nearest(name[:40], REQUIRED + OPTIONAL)}")
        if name in fields:
            raise ConfigError(f"{at}: expected each key once, got {name!r} again; remove one")
        if isinstance(value, yaml.ScalarNode):
            fields[name] = value.value
        elif isinstance(value, yaml.SequenceNode) and all(isinstance(each, yaml.ScalarNode) for each in value.value):
            fields[name] = [each.value for each in value.value]
        else:
            raise ConfigError(f"{at}: {name}: expected a word, a number or a list of numbers, got more; correct it")
    missing = [key for key in REQUIRED if key not in fields]
    if missing:
        raise ConfigError(f"{where}: expected the keys {', '.join(REQUIRED)}, got no {missing[0]!r}; add it")
    return fields


def _number(value: str | list[str], where: str) -> float:
    try:
        number = float(value) if isinstance(value, str) else float("nan")
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise ConfigError(f"{where}: expected a number, got {_said(value)}; correct it")
    return number


def _said(value: str | list[str]) -> str:
    return shown(value) if isinstance(value, str) else f"a list of {len(value)}"
