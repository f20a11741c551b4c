"""Packs a map for the wire, and unpacks it with every number checked."""

import zlib

import numpy as np

from swarm.errors import ConfigError, PeerError
from swarm.geometry import Pose
from swarm.maps.limits import COORDINATE_MAX, check_cell, check_size
from swarm.maps.occupancy import UNKNOWN, OccupancyMap
from swarm.messages import PackedMap


def pack(map: OccupancyMap) -> PackedMap:  # noqa: A002
    """Return a map for the wire."""
    rows, columns = map.shape
    return PackedMap(
        rows=rows,
        columns=columns,
        resolution=map.resolution,
        origin=(map.origin.x, map.origin.y, map.origin.yaw),
        cells=zlib.compress(np.ascontiguousarray(map.cells).tobytes(), 6),
    )


def unpack(packed: PackedMap) -> OccupancyMap:
    """Return the map that ``pack`` packed; never inflate more bytes than its rows and columns need.

    Raises:
        PeerError: the packed map is not valid.
    """
    rows, columns = packed.rows, packed.columns
    try:
        check_size(rows, columns, "map")
        check_cell(packed.resolution, "map: resolution")
    except ConfigError as error:
        raise PeerError(str(error)) from error
    if not all(abs(each) <= COORDINATE_MAX for each in packed.origin):
        raise PeerError("map: origin: expected [x, y, yaw], finite, got something else; the sender is at fault")
    return OccupancyMap(_cells(packed.cells, rows, columns), float(packed.resolution), Pose(*packed.origin))


def _cells(cells: bytes, rows: int, columns: int) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    expected = rows * columns
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
