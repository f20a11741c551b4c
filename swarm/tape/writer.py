"""The writer of a tape: the world appends a row a tick, whatever becomes of it later."""

import fcntl
import os
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from swarm.bus.codec import encode
from swarm.errors import ConfigError
from swarm.fingerprint import fingerprint
from swarm.messages import Command, Message
from swarm.tape.reader import TapeFile, count_whole_rows
from swarm.tape.rows import (
    ASK,
    FORMAT,
    GIVEN,
    JOIN,
    PACKER,
    RESTART,
    RESUME,
    SAVE,
    SENSE,
    Head,
    answer,
    check_of,
    check_of_item,
    first_row,
    order_by_robot,
    plain_answers_of,
)


class Tape:
    """The tape that a world writes; without a file it does nothing. A full disk is logged once and costs no run."""

    def __init__(self, path: Path | None, log: Callable[[str], None]) -> None:
        self._path, self._log = path, log
        self._file: int | None = None
        self.rows = 0  # written so far, the head not counted
        self._items: list[Any] = []
        self._checks: list[bytes] = []
        self._plain: list[Any] = []  # the answers of the tick before, if they were all plain
        self._sensed, self._marked, self._parted = False, False, False  # of this tick
        self.foreign: set[int] = set()  # robots whose answers are kept whole

    @property
    def is_on(self) -> bool:
        """True if anything is written."""
        return self._file is not None

    def begin(self, **head: Any) -> None:  # noqa: ANN401
        """Begin a tape in a new file; the arguments are fields of its ``Head``."""
        if self._path is not None and self._open(0):
            made_by: dict[str, Any] = {"format": FORMAT, "version": version("zenoh-swarm"), "code": fingerprint()}
            self._write(first_row(Head(**made_by, **head)))

    def go_on(self, row: int, identity: str) -> None:
        """Go on with the tape of a killed world, which had saved its state at the end of a ``row``; 0: of none."""
        if self._path is None:
            return
        try:
            file = TapeFile(self._path)
            self.rows, size, self.foreign = count_whole_rows(file)
        except ConfigError as fault:
            self._log(f"{fault}; this run has no tape any more")
            return
        if file.head.identity != identity or not 0 < row <= self.rows:
            self._log(
                f"tape {self._path}: it is of another run, or ends before this one was saved; this run has no tape"
            )
        elif self._open(size):
            self._note([RESUME, row])
            self._flush(whole=False)

    def _open(self, size: int) -> bool:
        """Open the file, cut to some bytes; return False if it cannot be written, or another world writes it."""
        assert self._path is not None
        try:
            file = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.ftruncate(file, size)
            except OSError:
                os.close(file)
                raise
        except OSError as fault:
            why = "another world writes it" if isinstance(fault, BlockingIOError) else fault.strerror
            self._log(f"tape {self._path}: cannot be written ({why}); this run has no tape")
            return False
        self._file = file
        return True

    # --- what happens in a tick ---

    def note_senses(self) -> None:
        """Note that the senses of this tick are made now."""
        if self._items or self._parted:
            self._note(SENSE)
            self._marked = True
        self._sensed = True

    def note_join(self, number: int, *, ours: bool) -> None:
        """Note that a process without memory has taken a robot's place; ``ours``: it has the code of this world."""
        (self.foreign.discard if ours else self.foreign.add)(number)
        self._note([JOIN, number, ours])
        self._flush(whole=False)  # if this world is killed now, the robot goes on as one that has joined it

    def note_answer(self, number: int, command: Command, tick: int, numbers: Callable[[str], int]) -> None:
        """Note a command that was taken in at a tick of the world; ``numbers`` has the number of each robot."""
        if self._file is None:
            return
        if number in self.foreign:
            self.note_foreign_message(number, command)
            return
        self._items.append(answer(number, command, tick, numbers))
        self._checks.append(check_of(command))

    def note_foreign_message(self, number: int, message: Message) -> None:
        """Note a message that no replay can compute: of a robot of other code, or of a body outside."""
        if self._file is not None:
            self._note([GIVEN, number, type(message).__name__, encode(message)])

    def note_request(self, number: int | None, message: Message) -> None:
        """Note a request that was carried out."""
        if self._file is not None:
            self._note([ASK, number, type(message).__name__, encode(message)])

    def note_restart(self) -> None:
        """Note that a new run begins."""
        self._note(RESTART)
        self._flush(whole=False)
        self._sensed = self._marked = self._parted = False

    def note_save(self) -> int:
        """Note that the state is saved now, and write what there is; return the number of rows, 0 without a tape."""
        self._note(SAVE)
        self._flush(whole=False)
        return self.rows if self.is_on else 0

    def step(self) -> None:
        """Write the row of a tick: the world moves now."""
        self._flush(whole=True)
        self._sensed = self._marked = self._parted = False

    def close(self) -> None:
        """Write what there is, and close the file."""
        if self._file is not None:
            if self._items:
                self._flush(whole=False)
            os.close(self._file)
            self._file = None

    # --- inside ---

    def _note(self, item: Any) -> None:  # noqa: ANN401
        if self._file is not None:
            self._items.append(item)
            self._checks.append(check_of_item(item))

    def _flush(self, *, whole: bool) -> None:
        if self._file is None:
            return
        items: list[Any] | None = self._items
        checks = self._checks
        before, self._plain = self._plain, plain_answers_of(self._items)
        if whole and not self._parted and len(self._plain) == len(self._items):
            order = sorted(range(len(self._items)), key=lambda place: order_by_robot(self._items[place]))
            checks = [checks[place] for place in order]
            items = None if self._plain == before else self._plain
        elif not whole and self._sensed and not self._marked and not self._parted:
            items, checks = [SENSE, *self._items], [check_of_item(SENSE), *checks]
            self._marked = True
        packed = b"".join(checks)
        self._write(PACKER.encode([items, packed] if whole else [items, packed, 0]))
        self._items, self._checks, self._parted = [], [], self._parted or not whole
        self.rows += 1

    def _write(self, packed: bytes) -> None:
        if self._file is not None:
            try:
                whole, why = os.write(self._file, packed) == len(packed), "no room"
            except OSError as fault:
                whole, why = False, str(fault.strerror)
            if not whole:
                self._log(f"tape {self._path}: cannot be written ({why}); it ends here")
                os.close(self._file)
                self._file = None
