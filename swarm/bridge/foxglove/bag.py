"""Bags of ROS 2 as MCAP files, which are whole at every moment: also if this process is killed.

A reader of MCAP wants a file to end with a footer. The SDK writes one when it closes the file, so one that was killed
leaves a file that readers refuse. Here a file gets an end whenever a chunk is written, and the next chunk overwrites
it, in an order that leaves a whole file after every step: first the new footer, far behind; then all between it and the
old end; then, over the few bytes of the old end, the beginning of the chunk. Until that last step a reader that begins
in front stops at the old end. (rosbags does not: it reads such a file before and after these steps only.)

Source: the specification of MCAP (mcap.dev/spec), 0.
"""

import os
import struct
from io import SEEK_CUR
from pathlib import Path
from time import monotonic
from typing import Any, Final

import foxglove
from foxglove.mcap import MCAPWriteOptions

from swarm.bridge.foxglove.channels import Channels
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.errors import ConfigError

EVERY: Final = 2.0  # s between two chunks, which is most that a killed process loses
MAGIC: Final = b"\x89MCAP0\r\n"
# records are an opcode, a length and the content: a DataEnd without checksum, and a Footer that knows no summary
FOOT: Final = struct.pack("<BQQQI", 0x02, 20, 0, 0, 0) + MAGIC
END: Final = struct.pack("<BQI", 0x0F, 4, 0) + FOOT
PROFILE: Final = "ros2"


class WriteBuffer:
    """What the SDK has written and the disk has not; it stands in for a file."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.taken = 0  # bytes that were taken

    def write(self, data: bytes) -> int:
        """Keep bytes for later: the SDK has no use for an error."""
        self.data += data
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Return the place of the next byte; the SDK asks for no other, as it is told not to seek."""
        assert (offset, whence) == (0, SEEK_CUR), "the SDK is told not to seek"
        return self.taken + len(self.data)

    def flush(self) -> None:
        """Do nothing: ``Bag`` writes."""

    def take_bytes(self) -> bytes:
        """Return what waits: it is going to be in the file."""
        data = bytes(self.data)
        self.data.clear()
        self.taken += len(data)
        return data


class Bag:
    """The messages of a run as a bag of ROS 2, one file for each run: the second is in ``FILE-run2.mcap``."""

    def __init__(self, path: Path, ros: Types) -> None:
        self._path, self._ros = path, ros
        self._number = 0
        self._file: int | None = None
        self._offered: dict[str, RosTopic] = {}

    def __enter__(self) -> "Bag":
        self.begin_run()
        return self

    def __exit__(self, *fault: object) -> None:
        self.close()

    def begin_run(self) -> None:
        """Begin a file for a run; that of the run before gets its end.

        Raises:
            ConfigError: it cannot be written.
        """
        self.close()
        self._number += 1
        path = self._path if self._number == 1 else self._path.with_stem(f"{self._path.stem}-run{self._number}")
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        except OSError as fault:
            raise self._make_write_error(fault) from None
        context = foxglove.Context()
        self._channels = Channels(self._ros, context)
        self._waiting = WriteBuffer()
        self._writer: Any = foxglove.open_mcap(
            self._waiting,  # type: ignore[arg-type]  # the SDK asks for no more of a file than it has
            context=context,
            writer_options=MCAPWriteOptions(profile=PROFILE, disable_seeking=True, compression_threads=0),
        )
        for name, topic in self._offered.items():
            self._channels.offer_topic(name, topic)
        self.flush()

    def offer_topic(self, name: str, topic: RosTopic) -> None:
        """Add a topic; a name begins with a slash."""
        self._offered[name] = topic
        self._channels.offer_topic(name, topic)

    def withdraw_topic(self, name: str) -> None:
        """Take a topic away; the file keeps it."""
        del self._offered[name]
        self._channels.withdraw_topic(name)

    def is_topic_wanted(self, name: str) -> bool:
        """Return True: a bag has all topics."""
        return True

    def send_payload(self, name: str, payload: bytes, at: int) -> None:
        """Write a message that was sent at a time [ns].

        Raises:
            ConfigError: the file cannot be written.
        """
        self._channels.log_message(name, payload, at)
        if monotonic() - self._flushed >= EVERY:
            self.flush()

    def flush(self) -> None:
        """Write what waits, as a chunk, and an end behind it.

        Raises:
            ConfigError: the file cannot be written.
        """
        self._writer.flush()
        if self._waiting.data:
            self._append_chunk(END)
        self._flushed = monotonic()

    def close(self) -> None:
        """Write what waits, the index and the end.

        Raises:
            ConfigError: the file cannot be written.
        """
        if self._file is None:
            return
        try:
            self.flush()
            self._writer.close()
            self._append_chunk(b"")
        finally:
            os.close(self._file)
            self._file = None

    def _append_chunk(self, end: bytes) -> None:
        """Write what waits and an end over the old end, so that the file is whole after each step."""
        at = self._waiting.taken
        data = self._waiting.take_bytes() + end
        data, foot = data[: -len(FOOT)], data[-len(FOOT) :]
        self._write_bytes(FOOT, at + len(data))
        self._write_bytes(data[len(END) :], at + len(END))
        self._write_bytes(data[: len(END)], at)
        self._write_bytes(foot, at + len(data))

    def _write_bytes(self, part: bytes, begin: int) -> None:
        assert self._file is not None, "it is open"
        try:
            while part:
                written = os.pwrite(self._file, part, begin)
                part, begin = part[written:], begin + written
        except OSError as fault:
            raise self._make_write_error(fault) from None

    def _make_write_error(self, fault: OSError) -> ConfigError:
        return ConfigError(f"--record {self._path}: expected to write it, got: {fault.strerror}; name another file")
