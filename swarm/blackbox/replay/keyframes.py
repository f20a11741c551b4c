"""Keyframes: states of a replay that this machine keeps, so that later questions about its tape go on from them.

They are pickles in a folder of this user, which nobody else may write to, and never part of a tape. One that does not
fit the tape and this code, or cannot be read, counts as none.
"""

import io
import os
import pickle
import zlib
from collections.abc import Mapping
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path
from shutil import rmtree
from typing import Any, Final, NamedTuple

from swarm.blackbox.replay.answer_values import SavedWorld
from swarm.blackbox.replay.outline import SPARE
from swarm.blackbox.replay.replay import Replay
from swarm.bus.codec import decode, encode
from swarm.fingerprint import fingerprint
from swarm.messages import Message
from swarm.tape.reader import TapeFile

FRAMES: Final = 800  # ticks between two keyframes, times robots
LEAST: Final = 20  # ticks between two keyframes
MOST_TAPES: Final = 12  # that have keyframes; those used longest ago go
ENDING: Final = ".keyframe"
DIGEST: Final = 16  # bytes


class Keyframe(NamedTuple):
    """A file with the state at the end of a tick."""

    ticks: int  # that the world had lived
    path: Path


def make_keyframe_folder() -> Path | None:
    """Return the folder for keyframes, made if there is none; None if it cannot be, or others may write to it."""
    base = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    path = Path(base) / "zenoh-swarm" / "keyframes"
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = path.stat()
    except (OSError, RuntimeError):
        return None
    return path if found.st_uid == os.getuid() and not found.st_mode & 0o022 else None


class Keyframes:
    """The keyframes of one tape."""

    def __init__(self, file: TapeFile, room: Path | None = None) -> None:
        self._file = file
        named = blake2b(_begin(file.path, file.begin.end) + fingerprint(left_out=()).encode(), digest_size=DIGEST)
        self._folder = None if room is None else room / named.hexdigest()
        self._every = max(LEAST, FRAMES // max(1, len(file.head.starts)))

    def nearest(self, ticks: int) -> Keyframe | None:
        """Return the newest keyframe that is not behind a number of ticks, and fits the tape; None: there is none."""
        if self._folder is None:
            return None
        found = [(int(path.name.split("-")[0]), path) for path in self._folder.glob(f"*{ENDING}")]
        for lived, path in sorted(found, reverse=True):
            _, end, digest = path.stem.split("-")
            if lived <= ticks and digest == _digest(_begin(self._file.path, int(end))):
                return Keyframe(lived, path)
        return None

    def is_due(self, replay: Replay) -> bool:
        """Return True if the state now is to be kept; where bodies touch each other, keeping it would change it."""
        return self._folder is not None and replay.done % self._every == 0 and not replay.world.bodies.physics.touching

    def keep(self, replay: Replay, state: object, **shared: object) -> None:
        """Keep a state at the end of the last tick; of what it refers to, what is ``shared`` is not kept."""
        assert self._folder is not None
        mark = replay.mark
        path = self._folder / f"{replay.done}-{mark.end}-{_digest(_begin(self._file.path, mark.end))}{ENDING}"
        if path.exists():
            return
        names = {id(one): name for name, one in (_shared_objects(replay) | shared).items()}
        file = io.BytesIO()
        pickler = _Pickler(file, names)
        try:
            pickler.dump((SavedWorld.of(replay.world), replay.outline.memory, _rows_resumed(replay), mark))
            pickler.clear_memo()
            pickler.dump(state)
            packed = zlib.compress(file.getvalue(), 1)
            if not self._folder.exists():
                self._folder.mkdir(mode=0o700)
                _make_room(self._folder.parent)
            part = path.with_suffix(".part")
            part.write_bytes(blake2b(packed, digest_size=DIGEST).digest() + packed)
            part.replace(path)
        except (OSError, pickle.PicklingError, TypeError, AttributeError):
            self._folder = None  # the disk is full: then each question begins anew

    def state(self, keyframe: Keyframe, replay: Replay, **shared: object) -> Any:  # noqa: ANN401, as it was kept
        """Return the state in a keyframe, with what is ``shared`` in place of that; None: it cannot be used."""
        try:
            content = keyframe.path.read_bytes()
            if blake2b(content[DIGEST:], digest_size=DIGEST).digest() != content[:DIGEST]:
                return None
            file = io.BytesIO(zlib.decompress(content[DIGEST:]))
            known = _shared_objects(replay) | shared
            saved, memory, resumed, mark = _Unpickler(file, known).load()
            if memory < replay.outline.memory - SPARE or resumed != _rows_resumed(replay, mark.number):
                return None  # the tape has grown, and what came tells that more has to be known
            os.utime(keyframe.path.parent)
            known |= {"world": replay.revive_world(saved), "rows": self._file.rows(mark)}
            return _Unpickler(file, known).load()
        except Exception:  # whatever is wrong with a file of the cache: the tape has it all
            return None


def _rows_resumed(replay: Replay, row: int | None = None) -> list[int]:
    """Return the rows up to one at which a world has saved that was killed later."""
    last = replay.mark.number if row is None else row
    return sorted(one for one in replay.outline.resumed if one <= last)


def _shared_objects(replay: Replay) -> dict[str, object]:
    """Return what the state of a replay refers to, and a keyframe does not have."""
    return {
        "file": replay.file, "head": replay.head, "outline": replay.outline, "scenario": replay.scenario,
        "world": replay.world, "rows": replay.rows, "sensed": replay.when_sensed,
    } | {f"controller {kind}": one for kind, one in replay.world.roster.controllers().items()}  # fmt: skip


class _Pickler(pickle.Pickler):
    """Writes what is not shared."""

    def __init__(self, file: io.BytesIO, names: Mapping[int, str]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._names = names

    def persistent_id(self, value: object) -> str | None:
        """Return the name of a value that is shared."""
        return self._names.get(id(value))

    def reducer_override(self, value: object) -> Any:  # noqa: ANN401, as `__reduce__` returns it
        """Return how a message is made again: as from the wire, which takes a third of the time."""
        return (_load_state, (type(value), encode(value))) if isinstance(value, Message) else NotImplemented


class _Unpickler(pickle.Unpickler):
    """Reads what a keyframe has, with what is shared."""

    def __init__(self, file: io.BytesIO, shared: Mapping[str, object]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, name: str) -> object:
        """Return the value of a name."""
        return self._shared[name]


def _load_state(kind: type[Message], packed: bytes) -> Message:
    return decode(packed, kind, len(packed))


def _begin(path: Path, length: int) -> bytes:
    with path.open("rb") as file:
        return file.read(length)


def _digest(content: bytes) -> str:
    return blake2b(content, digest_size=DIGEST).hexdigest()


def _make_room(room: Path) -> None:
    """Remove the keyframes of the tapes that were asked about longest ago."""
    with suppress(OSError):
        tapes = sorted(room.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
        for path in tapes[MOST_TAPES:]:
            rmtree(path, ignore_errors=True)
