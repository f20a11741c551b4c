"""Records of traffic as the bytes they came in: each is opened once, and passed on without being packed again.

A robot hears the newest record of another one many times: from itself, and from everybody who relays it. The bytes are
the same each time, since nobody packs a record again to relay it.
"""

from typing import Final

from msgspec import Raw
from msgspec.msgpack import Decoder

from swarm.messages import Record

# bytes of records that are kept, in memory about ten times as much; those heard least lately are dropped
# (32 robots close together: 97 of 100 repeated records come within 32 kB of new ones)
ROOM: Final = 128_000


class OpenedRecords:
    """The records opened lately, found by their bytes, and their bytes, found by the record."""

    def __init__(self) -> None:
        self._decoder = Decoder(Record)
        self._opened: dict[bytes, Record] = {}  # the one heard least lately first
        self._packed: dict[int, Raw] = {}  # by the identity of a record in ``_decode_body``
        self._size = 0

    def open(self, packed: Raw) -> Record:
        """Return the record in some bytes; equal bytes give the same object.

        Raises:
            msgspec.DecodeError: the bytes are no valid record.
        """
        content = bytes(packed)
        record = self._opened.pop(content, None)
        if record is None:
            record = self._decoder.decode(content)
            self._packed[id(record)] = Raw(content)
            self._size += len(content)
            while self._size > ROOM and self._opened:
                self._drop_oldest()
        self._opened[content] = record
        return record

    def packed_record(self, record: Record) -> Raw | Record:
        """Return the bytes that a record came in, or the record itself if it did not come in bytes lately."""
        return self._packed.get(id(record), record)

    def _drop_oldest(self) -> None:
        content = next(iter(self._opened))
        del self._packed[id(self._opened.pop(content))]
        self._size -= len(content)
