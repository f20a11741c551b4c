"""A writer of CDR: each number at a multiple of its size, texts with their length and a zero after them."""

import struct
from math import cos, sin
from typing import Final

from swarm.bridge.cdr.layouts import CDR_HEADER, stamped
from swarm.geometry import Pose

SIZES: Final = {"B": 1, "i": 4, "I": 4, "f": 4, "d": 8}


class Cdr:
    """A message of ROS that is being written, part by part."""

    def __init__(self) -> None:
        self._out = bytearray()

    def put(self, kind: str, *values: float) -> None:
        """Append numbers of one kind, as ``struct`` names it."""
        self.align(SIZES[kind])
        self._out += struct.pack(f"<{len(values)}{kind}", *values)

    def text(self, *given: str) -> None:
        """Append texts."""
        for one in given:
            data = one.encode()
            self.put("I", len(data) + 1)
            self._out += data + b"\0"

    def head(self, at: int, frame: str) -> None:
        """Append a std_msgs/msg/Header of a time [ns] and a frame."""
        self.time(at)
        self.text(frame)

    def time(self, at: int) -> None:
        """Append a builtin_interfaces/msg/Time of a time [ns]."""
        self.align(4)
        self._out += stamped(at)

    def pose(self, pose: Pose, height: float = 0.0) -> None:
        """Append a geometry_msgs/msg/Pose."""
        self.put("d", pose.x, pose.y, height, 0.0, 0.0, sin(pose.yaw / 2), cos(pose.yaw / 2))

    def raw(self, count: int, size: int, data: bytes) -> None:
        """Append a sequence of ``count`` elements that begin at a multiple of ``size``, from their bytes."""
        self.put("I", count)
        if count:
            self.align(size)
            self._out += data

    def align(self, size: int) -> None:
        """Append zeros until a number of ``size`` bytes may follow."""
        self._out += bytes(-len(self._out) % size)

    def finish(self) -> bytes:
        """Return the message."""
        return CDR_HEADER + bytes(self._out)
