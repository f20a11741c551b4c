"""A writer of CDR: each number at a multiple of its size, texts with their length and a zero after them."""

import struct
from math import cos, sin
from typing import Final

from swarm.bridge.cdr.layouts import CDR_HEADER, write_time
from swarm.geometry import Pose

SIZES: Final = {"B": 1, "i": 4, "I": 4, "f": 4, "d": 8}


class CdrWriter:
    """A message of ROS that is being written, part by part."""

    def __init__(self) -> None:
        self._out = bytearray()

    def write_numbers(self, kind: str, *values: float) -> None:
        """Append numbers of one kind, as ``struct`` names it."""
        self.write_padding(SIZES[kind])
        self._out += struct.pack(f"<{len(values)}{kind}", *values)

    def write_text(self, *given: str) -> None:
        """Append texts."""
        for one in given:
            data = one.encode()
            self.write_numbers("I", len(data) + 1)
            self._out += data + b"\0"

    def write_header(self, at: int, frame: str) -> None:
        """Append a std_msgs/msg/Header of a time [ns] and a frame."""
        self.write_stamp(at)
        self.write_text(frame)

    def write_stamp(self, at: int) -> None:
        """Append a builtin_interfaces/msg/Time of a time [ns]."""
        self.write_padding(4)
        self._out += write_time(at)

    def write_pose(self, pose: Pose, height: float = 0.0) -> None:
        """Append a geometry_msgs/msg/Pose."""
        self.write_numbers("d", pose.x, pose.y, height, 0.0, 0.0, sin(pose.yaw / 2), cos(pose.yaw / 2))

    def write_sequence(self, count: int, size: int, data: bytes) -> None:
        """Append a sequence of ``count`` elements that begin at a multiple of ``size``, from their bytes."""
        self.write_numbers("I", count)
        if count:
            self.write_padding(size)
            self._out += data

    def write_padding(self, size: int) -> None:
        """Append zeros until a number of ``size`` bytes may follow."""
        self._out += bytes(-len(self._out) % size)

    def to_bytes(self) -> bytes:
        """Return the message."""
        return CDR_HEADER + bytes(self._out)
