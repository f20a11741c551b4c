"""The messages that go out many times a second, as CDR, without an object for each of their parts.

With rosbags' objects a robot's odometry, scan and frames take five times as long (``python -m benchmarks bridge``).
Everything is little-endian, and a number stands at a multiple of its size, counted from the end of the 4 bytes of
``CDR_HEADER`` (OMG DDS-XTypes 1.3, 7.4.1). The tests compare each message with what rosbags makes.
"""

import struct
from collections.abc import Iterable
from functools import lru_cache
from math import cos, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose

CDR_HEADER: Final = b"\x00\x01\x00\x00"  # little-endian XCDR1 (OMG DDS-XTypes 1.3, 7.6.3.1.2): all that rmw_zenoh sends
SECOND: Final = 10**9  # ns
STAMP: Final = struct.Struct("<iI")  # s, ns
COUNT: Final = struct.Struct("<I")
POSED: Final = struct.Struct("<7d")  # x, y, z [m]; a turn as a quaternion x, y, z, w
TWIST: Final = struct.Struct("<6d")  # linear, angular
BEAMS: Final = struct.Struct("<7f")  # first and last angle, step, s between rays and scans, nearest and farthest range
SURE: Final = bytes(36 * 8)  # the covariance of a pose or a twist that is exact
ALIGNED: Final = 8  # bytes; the largest number


def write_time(at: int) -> bytes:
    """Return a builtin_interfaces/msg/Time."""
    return STAMP.pack(*divmod(at, SECOND))


@lru_cache(maxsize=4096)
def write_texts(begin: int, to: int, *given: str) -> bytes:
    """Return texts that begin at an offset, with the gap after them until a number of ``to`` bytes may follow."""
    found = bytearray(begin)
    for one in given:
        found += bytes(-len(found) % COUNT.size)
        data = one.encode()
        found += COUNT.pack(len(data) + 1) + data + b"\0"
    found += bytes(-len(found) % to)
    return bytes(found[begin:])


def write_pose(pose: Pose) -> bytes:
    """Return a geometry_msgs/msg/Pose on the floor; a geometry_msgs/msg/Transform has the same bytes."""
    return POSED.pack(pose.x, pose.y, 0.0, 0.0, 0.0, sin(pose.yaw / 2), cos(pose.yaw / 2))


def write_clock(at: int) -> bytes:
    """Return a rosgraph_msgs/msg/Clock."""
    return CDR_HEADER + write_time(at)


def write_transforms(at: int, found: Iterable[tuple[str, str, Pose]]) -> bytes:
    """Return a tf2_msgs/msg/TFMessage: where child frames are in frames."""
    time, parts, size, count = write_time(at), [b""], COUNT.size, 0
    for frame, child, pose in found:
        gap = -size % COUNT.size
        names = write_texts((size + gap + STAMP.size) % ALIGNED, ALIGNED, frame, child)
        parts.append(bytes(gap) + time + names + write_pose(pose))
        size += len(parts[-1])
        count += 1
    parts[0] = CDR_HEADER + COUNT.pack(count)
    return b"".join(parts)


def write_pose_with_covariance(at: int, frame: str, pose: Pose) -> bytes:
    """Return a geometry_msgs/msg/PoseWithCovarianceStamped of a pose that is exact."""
    return CDR_HEADER + write_time(at) + write_texts(0, ALIGNED, frame) + write_pose(pose) + SURE


def write_odometry(at: int, frame: str, child: str, pose: Pose, linear: float, angular: float) -> bytes:
    """Return a nav_msgs/msg/Odometry: an exact pose in a frame, and the twist [m/s, rad/s] in the child's frame."""
    names = write_texts(0, ALIGNED, frame, child)
    twist = TWIST.pack(linear, 0.0, 0.0, 0.0, 0.0, angular)
    return CDR_HEADER + write_time(at) + names + write_pose(pose) + SURE + twist + SURE


def write_laser_scan(at: int, frame: str, beams: bytes, ranges: NDArray[np.float32]) -> bytes:
    """Return a sensor_msgs/msg/LaserScan without intensities; ``beams`` are what ``BEAMS`` packs."""
    head = CDR_HEADER + write_time(at) + write_texts(0, COUNT.size, frame) + beams
    return head + COUNT.pack(len(ranges)) + ranges.tobytes() + COUNT.pack(0)
