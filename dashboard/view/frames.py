"""The frames of a recording's file: who wrote it, and what of a file that is cut can still be read.

The file begins with ``RRF2``, the version of Rerun in four bytes, and four bytes of options. Then come messages, each
behind its kind and its length in eight bytes each, little-endian.
"""

import shutil
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO, Final

from dashboard.mode import is_whole

MAGIC: Final = b"RRF2"
HEAD: Final = struct.Struct("<4s2B2x4x")  # magic, major and minor version
FRAME: Final = struct.Struct("<QQ")  # kind and length [bytes] of a message


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
