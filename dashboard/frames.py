"""The frames of a recording's file: who wrote it, and what of a file that is cut can still be read.

The file begins with ``RRF2``, the version of Rerun in four bytes, and four bytes of options. Then come messages, each
behind its kind and its length in eight bytes each, little-endian. The last one is of kind 0; behind it may be a footer.
It works without Rerun.
"""

import os
import shutil
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO, Final

MAGIC: Final = b"RRF2"
HEAD: Final = struct.Struct("<4s2B2x4x")  # magic, major and minor version
FRAME: Final = struct.Struct("<QQ")  # kind and length [bytes] of a message
LAST: Final = 0  # the kind of the last message
FOOTER: Final = b"RRF2FOOT"  # among the last bytes of a file that Rerun's program has written
FOOTER_ROOM: Final = 32  # bytes


def written_by(path: Path) -> tuple[int, int] | None:
    """Return the major and minor version of the Rerun that wrote a file; None if it is no recording.

    Raises:
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        begin = file.read(HEAD.size)
    if len(begin) < HEAD.size or not begin.startswith(MAGIC):
        return None
    _, major, minor = HEAD.unpack(begin)
    return major, minor


def is_whole(path: Path) -> bool:
    """Return True if a recording has its end: a file that is cut has none."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            size = path.stat().st_size
            file.seek(-min(FOOTER_ROOM, size), os.SEEK_END)
            tail = file.read(FOOTER_ROOM)
            return FOOTER in tail or (tail.endswith(bytes(FRAME.size)) and _ends(file, size))
    except OSError:
        return False


def finish(path: Path) -> None:
    """Write the end of a recording that has none, and whose messages are all there.

    Raises:
        OSError: the file cannot be written.
    """
    with path.open("ab") as file:
        file.write(FRAME.pack(LAST, 0))


@contextmanager
def readable(path: Path) -> Iterator[Path]:
    """Yield a file with all whole messages of a recording: the file itself if it has its end, else a copy that is cut.

    Raises:
        OSError: the file cannot be read, or there is no room for the copy.
    """
    if is_whole(path):
        yield path
        return
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        shutil.copyfile(path, copy)
        with copy.open("r+b") as file:
            file.truncate(_end_of_messages(file, copy.stat().st_size))
        yield copy


def _ends(file: BinaryIO, size: int) -> bool:
    """Return True if a file consists of whole messages, and the last one is of the kind for that."""
    if _end_of_messages(file, size) != size:
        return False
    file.seek(size - FRAME.size)
    return file.read() == FRAME.pack(LAST, 0)


def _end_of_messages(file: BinaryIO, size: int) -> int:
    """Return the length [bytes] of the part of a file that consists of whole messages."""
    end = HEAD.size
    while end + FRAME.size <= size:
        file.seek(end)
        _, length = FRAME.unpack(file.read(FRAME.size))
        if end + FRAME.size + length > size:
            break
        end += FRAME.size + length
    return end
