"""The reader of a tape: the head and the rows of a file, each checked, up to the last whole one if the file is cut."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple
from zlib import crc32

import msgpack
import msgspec

from swarm.bus.codec import decode
from swarm.errors import ConfigError, PeerError
from swarm.messages import Message
from swarm.settings import MOST_ROBOTS
from swarm.tape.rows import (
    ASK,
    ASKED,
    CHECK,
    FORMAT,
    GIVEN,
    MESSAGES,
    RESTART,
    SAVE,
    SENSE,
    Head,
    check_of_item,
    is_plain,
    plain_answers_of,
)

LARGEST_HEAD: Final = 1 << 24  # bytes; the wire takes half of that for a map
LARGEST: Final = 1 << 21  # bytes of a later row; opened, bad ones are up to 70 times as large
MOST_ITEMS: Final = 100_000  # of a row
MOST_TICKS: Final = 10_000_000
MARKS: Final = (SENSE, SAVE, RESTART)
HEAD: Final = msgspec.msgpack.Decoder(Head)
TOO_LARGE: Final = "one that is too large or too deep"
OTHERWISE: Final = "give the tape of a run: the end of `swarm run` and `swarm status` say where it is"


Heard = list[tuple[int, int]]  # robots, and the ages [ticks] of their broadcasts at a sense


class Earlier(NamedTuple):
    """A step of a robot whose answer may be lost."""

    lag: int  # ticks since the sense that it answered
    heard: Heard
    edits: int | None  # of the map that it fetched before


class Answered(NamedTuple):
    """An answer of a robot of our code."""

    robot: int
    lag: int  # ticks since the sense that it answers
    heard: Heard | None  # None: what that sense lists
    edits: int | None  # of the map that it fetched before
    again: bool  # it had answered that sense before
    before: Sequence[Earlier]  # its last steps, if it says so, oldest first
    check: bytes


class Mark(NamedTuple):
    """The end of a row, from which the file can be read on."""

    number: int  # of the row, from 1; 0: the head
    end: int  # bytes of the file up to here
    ticks: int  # that end up to here
    plain: list[Any]  # plain answers of the row


class TapeRow(NamedTuple):
    """A row: what happened in a tick, or in a part of it."""

    mark: Mark
    items: list[Any]  # `Answered`, or the item as in the table of `rows`
    whole: bool  # the tick ends here

    @property
    def number(self) -> int:
        """The number of the row, from 1."""
        return self.mark.number


class TapeFile:
    """The file of a tape.

    Raises:
        ConfigError: it cannot be read, or is no tape.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.left_out = 0  # bytes behind the last whole row, once the rows were read
        self.size = 0  # bytes up to there
        self.ticks = 0  # whole ones that were read
        self.head = self._read_head()
        self.begin = Mark(0, self.size, 0, [])

    def _values(self, begin: int, largest: int) -> Iterator[Any]:
        """Yield each MessagePack value from a byte on."""
        try:
            with self.path.open("rb") as file:
                file.seek(begin)
                values = msgpack.Unpacker(
                    file, max_buffer_size=largest, max_bin_len=largest, max_array_len=MOST_ITEMS, max_str_len=1000,
                    max_map_len=0, max_ext_len=0, read_size=1 << 16,
                )  # fmt: skip
                for value in values:
                    self.size = begin + values.tell()
                    yield value
                self.left_out = os.fstat(file.fileno()).st_size - self.size
        except OSError as fault:
            raise ConfigError(f"{self.path}: expected a tape, got {fault.strerror}; {OTHERWISE}") from None

    def _fault(self, row: int, text: str) -> ConfigError:
        where = f"row {row}, tick {self.ticks}" if row else "the head"
        return ConfigError(f"tape {self.path}: {where}: {text}; the file was changed or is no tape: {OTHERWISE}")

    def _read_head(self) -> Head:
        try:
            first = next(self._values(0, LARGEST_HEAD), None)
        except (ValueError, msgpack.UnpackException, RecursionError) as fault:
            raise self._fault(0, f"expected the head of a tape, got {str(fault) or TOO_LARGE}") from None
        match first:
            case [bytes(packed), int(check)] if crc32(packed) == check:
                pass
            case _:
                raise self._fault(0, "expected the head of a tape with its check, got something else")
        try:
            head: Head = HEAD.decode(packed)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as fault:
            raise self._fault(0, str(fault)) from None
        if head.format != FORMAT:
            raise self._fault(0, f"expected {FORMAT!r}, got {head.format!r}")
        return head

    def rows(self, after: Mark | None = None) -> Iterator[TapeRow]:
        """Yield the rows of the file up to the last whole one; by default from the first on.

        Raises:
            ConfigError: a row is none.
        """
        before, end, ticks, plain = after or self.begin
        for number, (noted, checks, *rest) in enumerate(self.iterate_rows(before, end), before + 1):
            items = plain if noted is None else noted
            self.ticks = ticks
            if len(checks) != CHECK * len(items):
                raise self._fault(number, f"expected {CHECK * len(items)} bytes of checks, got {len(checks)}")
            pieces = [checks[at : at + CHECK] for at in range(0, len(checks), CHECK)]
            plain = plain_answers_of([item for item in items if is_plain(item)])
            found = [self._item(number, item, check) for item, check in zip(items, pieces, strict=True)]
            self.ticks = ticks = ticks + (not rest)
            if ticks > MOST_TICKS:
                raise self._fault(number, f"expected at most {MOST_TICKS} ticks")
            yield TapeRow(Mark(number, self.size, ticks, plain), found, not rest)

    def iterate_rows(self, number: int = 0, end: int | None = None) -> Iterator[list[Any]]:
        """Yield the rows of the file as they are, up to the last whole one; their items are not checked.

        ``number`` and ``end`` are those of the row before the first one, by default of the head.

        Raises:
            ConfigError: a row is none.
        """
        values = self._values(self.begin.end if end is None else end, LARGEST)
        while True:
            number += 1
            try:
                row = next(values)
            except StopIteration:
                return
            except (ValueError, msgpack.UnpackException, RecursionError) as fault:
                raise self._fault(number, f"expected a row, got {str(fault) or TOO_LARGE}") from None
            match row:
                case [None | list(), bytes(), *rest] if rest in ([], [0]):
                    yield row
                case _:
                    raise self._fault(number, "expected items and checks, got something else")

    def _item(self, row: int, item: Any, check: bytes) -> Any:  # noqa: ANN401
        """Return a checked item; an answer as ``Answered``."""

        def fits(robot: object) -> bool:
            return type(robot) is int and 0 <= robot < MOST_ROBOTS

        match item:
            case int(robot) if fits(robot):
                return Answered(robot, 0, None, None, False, (), check)
            case [int(robot), int(lag)] if fits(robot) and lag >= 0:
                return Answered(robot, lag, None, None, False, (), check)
            case [int(robot), lag, heard, edits, bool(again), *rest] if fits(robot):
                first = _earlier([lag, heard, edits])
                before = [_earlier(one) for one in rest[0]] if len(rest) == 1 and isinstance(rest[0], list) else []
                if first is not None and None not in before and len(rest) == bool(before):
                    return Answered(robot, *first, again, [one for one in before if one is not None], check)
        if check != check_of_item(item):
            raise self._fault(row, "expected the check of the item, got another")
        match item:
            case str() if item in MARKS:
                return item
            case ["resume", int(target)] if 0 <= target < row:
                return item
            case ["join", robot, bool()] if fits(robot):
                return item
            case ["given", robot, str(kind), bytes(packed)] if fits(robot) and kind in MESSAGES:
                return [GIVEN, robot, self._message(row, MESSAGES[kind], packed)]
            case ["ask", robot, str(kind), bytes(packed)] if (robot is None or fits(robot)) and kind in ASKED:
                return [ASK, robot, self._message(row, ASKED[kind], packed)]
        raise self._fault(row, f"expected an item of a tape, got {str(item)[:60]}")

    def _message(self, row: int, kind: type[Message], packed: bytes) -> Message:
        try:
            return decode(packed, kind, LARGEST)
        except PeerError as fault:
            raise self._fault(row, str(fault)) from None


def _earlier(item: object) -> Earlier | None:
    """Return a step in an item, None if it is none."""
    match item:
        case [int(lag), list(heard), int() | None as edits] if lag >= 0 and len(heard) % 2 == 0:
            if all(type(part) is int for part in heard):
                return Earlier(lag, list(zip(heard[::2], heard[1::2], strict=True)), edits)
    return None


def count_whole_rows(file: TapeFile) -> tuple[int, int, set[int]]:
    """Return the number of whole rows, the bytes up to their end, and the robots whose answers are kept whole.

    Raises:
        ConfigError: a row is none.
    """
    foreign, number = set[int](), 0
    for number, (items, *_) in enumerate(file.iterate_rows(), 1):  # noqa: B007, the last one counts
        for item in items or ():
            match item:
                case ["join", int(robot), bool(ours)]:
                    (foreign.discard if ours else foreign.add)(robot)
    return number, file.size, foreign
