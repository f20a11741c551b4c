"""A map as builtins, as it crosses the network, and back with every number checked."""

import zlib
from typing import Final

import numpy as np

from swarm.errors import ConfigError, PeerError
from swarm.geometry import Pose
from swarm.maps.limits import COORDINATE_MAX, check_cell, check_size
from swarm.maps.occupancy import UNKNOWN, OccupancyMap

KEYS: Final = frozenset({"rows", "columns", "resolution", "origin", "cells"})


def pack(map: OccupancyMap) -> dict[str, object]:  # noqa: A002
    """Return a map as builtins: ``cells`` are bytes row by row from the bottom, compressed with zlib."""
    rows, columns = map.shape
    return {
        "rows": rows,
        "columns": columns,
        "resolution": map.resolution,
        "origin": [map.origin.x, map.origin.y, map.origin.yaw],
        "cells": zlib.compress(np.ascontiguousarray(map.cells).tobytes(), 6),
    }


def unpack(packed: object) -> OccupancyMap:
    """Read what ``pack`` gave; unpacks no more bytes than its rows and columns promise.

    Raises:
        PeerError: the map is not as it has to be.
    """
    if not isinstance(packed, dict) or packed.keys() != KEYS:
        raise PeerError(f"map: expected the keys {', '.join(sorted(KEYS))}, got others; the sender's version differs")
    rows, columns, resolution, cells = (packed[key] for key in ("rows", "columns", "resolution", "cells"))
    if type(rows) is not int or type(columns) is not int:
        raise PeerError("map: expected whole numbers of rows and columns, got others; the sender is at fault")
    try:
        check_size(rows, columns, "map")
        check_cell(resolution, "map: resolution")
    except ConfigError as error:
        raise PeerError(str(error)) from error
    return OccupancyMap(_cells(cells, rows, columns), float(resolution), _origin(packed["origin"]))


def _origin(origin: object) -> Pose:
    numbers = [each for each in origin if type(each) in (int, float)] if isinstance(origin, list | tuple) else []
    # compared before anything is converted: an int may be too large for a float
    if len(numbers) != 3 or len(origin) != 3 or not all(abs(each) <= COORDINATE_MAX for each in numbers):  # type: ignore[arg-type]
        raise PeerError("map: origin: expected [x, y, yaw], finite, got something else; the sender is at fault")
    x, y, yaw = (float(each) for each in numbers)
    return Pose(x, y, yaw)


def _cells(cells: object, rows: int, columns: int) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    expected = rows * columns
    if not isinstance(cells, bytes):
        raise PeerError("map: cells: expected bytes, got something else; the sender is at fault")
    inflater = zlib.decompressobj()
    try:
        content = inflater.decompress(cells, expected + 1)
    except zlib.error as error:
        raise PeerError(
            f"map: cells: expected zlib bytes, got broken ones ({error}); the sender is at fault"
        ) from error
    if len(content) != expected or not inflater.eof or inflater.unused_data:
        raise PeerError(f"map: cells: expected exactly {expected} bytes, got another number; the sender is at fault")
    array = np.frombuffer(content, np.uint8).reshape(rows, columns).copy()
    if array.max() > UNKNOWN:
        raise PeerError(f"map: cells: expected values up to {UNKNOWN}, got {array.max()}; the sender is at fault")
    return array
