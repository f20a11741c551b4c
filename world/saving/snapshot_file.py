"""The snapshot of a run, from which a world that was killed goes on bit for bit.

Its file is MessagePack behind a line with the format and a checksum; decoding it is strict.
"""

import hashlib
import os
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from swarm.errors import ConfigError
from swarm.maps.wire import pack
from swarm.messages import Event, Id, PackedMap, Phase, Plan, Seen, State
from swarm.scenario.load import Scenario
from world.fleet.single_world import new_identity
from world.tasks.places import Book
from world.world import World, WorldState

FORMAT: Final = b"zenoh-swarm snapshot "
Noise = np.random.Generator
HEAD: Final = FORMAT + b"7\n"  # the version of what follows
CHECK: Final = 16  # bytes of the checksum


class HostState(Struct, kw_only=True, forbid_unknown_fields=True):
    """The state of a world's process beside the world."""

    phase: Phase
    held: bool
    reason: str
    lost: list[str]
    wall_time: float  # s
    present: list[str]  # robots
    most_in_one: int
    late: int
    states: dict[str, State]
    plans: dict[str, Plan]
    events: list[Event]  # the last ones
    seen: dict[str, Seen]
    left: set[str]
    tick_bins: list[int]
    tick_longest: float  # s
    not_reproducible: list[str]
    pressed: dict[str, str]
    tape: int  # rows that the tape had


class Snapshot(Struct, kw_only=True, forbid_unknown_fields=True):
    """All that a world's process needs to go on with a run."""

    scenario: str  # hash of settings, profile and map at the start
    robots: int  # of the scenario
    places: Book  # of more robots
    seed: int
    identity: Id  # of the run's world
    run: int
    floor: PackedMap | None  # None: it is as in the scenario
    state: WorldState
    host: HostState


def fingerprint(scenario: Scenario) -> str:
    """Return a hash of a scenario's settings, profile and map."""
    return hashlib.blake2b(msgspec.msgpack.encode(scenario.to_wire()), digest_size=16).hexdigest()


def _to_plain(value: object) -> object:
    if isinstance(value, Noise):
        state: Any = value.bit_generator.state
        numbers = state["state"]
        return [numbers[name].to_bytes(16) for name in ("state", "inc")], state["has_uint32"], state["uinteger"]
    raise NotImplementedError(type(value))


def _from_plain(kind: Any, value: Any) -> object:  # noqa: ANN401
    if kind is Noise:
        (state, inc), has, last = value
        bits = np.random.PCG64()
        bits.state = {
            "bit_generator": "PCG64",
            "state": {"state": int.from_bytes(state), "inc": int.from_bytes(inc)},
            "has_uint32": int(has),
            "uinteger": int(last),
        }
        return Noise(bits)
    return Counter(msgspec.convert(value, dict[str, int]))


ENCODER: Final = msgspec.msgpack.Encoder(enc_hook=_to_plain)
DECODER: Final = msgspec.msgpack.Decoder(Snapshot, dec_hook=_from_plain)
STATE_DECODER: Final = msgspec.msgpack.Decoder(WorldState, dec_hook=_from_plain)


def pack_state(state: WorldState) -> bytes:
    """Return the state of a world as bytes: it shares its values with the world, and they change."""
    return ENCODER.encode(state)


def unpack_state(packed: bytes) -> WorldState:
    """Return a state of this process that was packed."""
    return STATE_DECODER.decode(packed)


def write(snapshot: Snapshot, path: Path) -> None:
    """Replace the file at once, and keep the one before: whoever reads finds a whole snapshot.

    For a moment the one before is no other file than this one, or there is none: then the one to come is whole.

    Raises:
        OSError: the file cannot be written.
    """
    packed = ENCODER.encode(snapshot)
    beside = _beside(path)
    beside.write_bytes(HEAD + checksum(packed) + packed)
    earlier_file(path).unlink(missing_ok=True)
    with suppress(OSError):  # there is none yet, or the file system has no links: then there is no one before
        os.link(path, earlier_file(path))
    os.replace(beside, path)


def earlier_file(path: Path) -> Path:
    """Return the file of the snapshot before."""
    return path.with_name(f".{path.name}.earlier")


def remove(path: Path) -> None:
    """Remove a snapshot and what is kept beside it."""
    path.unlink(missing_ok=True)
    make_room(path)


def make_room(path: Path) -> None:
    """Remove what is kept beside a snapshot."""
    for file in (earlier_file(path), _beside(path)):
        file.unlink(missing_ok=True)


def _beside(path: Path) -> Path:
    return path.with_name(f".{path.name}.new")


def newest(path: Path, scenario: Scenario, robots: int, seed: int, log: Callable[[str], None]) -> Snapshot | None:
    """Return the snapshot in a file, or the one beside it if that file is spoilt; None if there is no file.

    If the fleet takes orders, the world of the one beside it has another identity. Its robots may know later stops than
    it does, so they have to join it again.

    Raises:
        ConfigError: none can be read, is whole and belongs to this run.
    """
    if not path.exists():
        return None
    try:
        return read(path, scenario, robots, seed)
    except ConfigError as fault:
        spoilt = fault
    for file, name in ((_beside(path), "that was being written"), (earlier_file(path), "before")):
        with suppress(ConfigError):
            found = read(file, scenario, robots, seed)
            log(f"{spoilt}; went on from the snapshot {name}")
            ordered = scenario.settings.serve or found.state.tasks.missions.orders.last > 0
            return replace(found, identity=new_identity()) if ordered else found
    raise spoilt


def read(path: Path, scenario: Scenario, robots: int, seed: int) -> Snapshot:
    """Return the snapshot in a file.

    Raises:
        ConfigError: the file cannot be read, is no whole snapshot, or belongs to another run.
    """
    otherwise = "give another file, or remove it to begin a new run"
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise ConfigError(f"snapshot {path}: expected a file that can be read, got {fault.strerror}") from None
    if not content.startswith(HEAD):
        found = content[: len(HEAD)]
        what = f"one of version {found[len(FORMAT) :]!r}" if found.startswith(FORMAT) else "another file"
        raise ConfigError(f"snapshot {path}: expected a snapshot of this version, got {what}; {otherwise}")
    check, packed = content[len(HEAD) :][:CHECK], content[len(HEAD) + CHECK :]
    if check != checksum(packed):
        raise ConfigError(f"snapshot {path}: expected a whole file, got one that is cut or changed; {otherwise}")
    try:
        snapshot = DECODER.decode(packed)
    except (msgspec.DecodeError, TypeError, ValueError, RecursionError) as fault:
        raise ConfigError(f"snapshot {path}: expected a snapshot, got one with {fault}; {otherwise}") from None
    mine = {"scenario": fingerprint(scenario), "robots": robots, "seed": seed}
    for name, wanted in mine.items():
        if (got := getattr(snapshot, name)) != wanted:
            raise ConfigError(f"snapshot {path}: {name}: expected {wanted!r}, got {got!r}; {otherwise}")
    return snapshot


def checksum(packed: bytes) -> bytes:
    """Return what the head of a file is followed by."""
    return hashlib.blake2b(packed, digest_size=CHECK).digest()


class Saver:
    """Writes snapshots of one world's process; a file that cannot be written is logged once and costs no run."""

    def __init__(self, path: Path | None, scenario: Scenario, seed: int, log: Callable[[str], None]) -> None:
        self._path, self._log = path, log
        self._scenario = fingerprint(scenario) if path is not None else ""
        self._seed = seed
        self._floor: tuple[int, PackedMap] | None = None  # number of edits, map
        self.failed = False

    @property
    def is_on(self) -> bool:
        """True if anything is saved."""
        return self._path is not None

    def save(self, world: World, host: Callable[[], HostState]) -> None:
        """Write a snapshot between two ticks."""
        if self._path is None:
            return
        if world.bodies.edits and (self._floor is None or self._floor[0] != world.bodies.edits):
            self._floor = world.bodies.edits, pack(world.bodies.floor)
        snapshot = Snapshot(
            scenario=self._scenario,
            robots=len(world.robots) - len(world.tasks.places.starts),
            places=world.tasks.places,
            seed=self._seed,
            identity=world.identity,
            run=world.run,
            floor=self._floor[1] if self._floor is not None else None,
            state=world.save(),
            host=host(),
        )
        try:
            write(snapshot, self._path)
        except OSError as fault:
            if not self.failed:
                self.failed = True
                self._log(f"snapshot {self._path}: cannot be written ({fault.strerror}); a killed world is lost")
        else:
            self.failed = False
