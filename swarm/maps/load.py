"""Loads any map file; the file's suffix selects the loader."""

from pathlib import Path

from swarm.errors import ConfigError
from swarm.maps.files import read_text
from swarm.maps.limits import DRAWING_MAX
from swarm.maps.movingai import load_movingai
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.ros import load_ros
from swarm.maps.text import from_text


def load_map(path: Path, cell: float = 1.0) -> OccupancyMap:
    """Load a ROS ``.yaml``, a MovingAI ``.map`` or a drawing in a ``.txt``.

    ``cell`` is the side of a character [m]; a ROS map states its own.

    Raises:
        ConfigError: the file cannot be read or is not a valid map.
    """
    match path.suffix.lower():
        case ".yaml" | ".yml":
            return load_ros(path)
        case ".map":
            return load_movingai(path, cell)
        case ".txt":
            return from_text(read_text(path, DRAWING_MAX), cell, str(path))
        case suffix:
            raise ConfigError(
                f"{path}: expected a map: .yaml (ROS), .map (MovingAI) or .txt (a drawing), got {suffix!r}; an "
                "image alone does not say its scale, give its .yaml"
            )
