"""The list of fleets that run on this machine, in which `swarm go` and others find the fleet's router.

A fleet's launcher holds a lock on the fleet's card for as long as it lives: the card of a killed one is seen as that.
"""

import fcntl
import getpass
import os
import re
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree
from typing import Final

import msgspec

from swarm.bus import Endpoint
from swarm.errors import ConfigError
from swarm.settings import TAPE

CARD: Final = "fleet.json"
NAME: Final = r"[A-Za-z0-9_.:-]{1,60}\Z"


class Card(msgspec.Struct, frozen=True, omit_defaults=True):
    """The entry of a running fleet, a file in its folder."""

    fleet: str
    endpoint: str
    pid: int
    box: str | None = None  # address of its page, with the token: the card is for this user only; None: it has none
    tape: str | None = None  # the file of its run's tape


def folder() -> Path:
    """Return the folder with the cards and logs of this user's fleets; make it if there is none.

    Raises:
        ConfigError: it cannot be made, or somebody else could read or change it.
    """
    base = os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir()
    path = Path(base) / f"zenoh-swarm-{os.getuid()}"
    hint = "set XDG_RUNTIME_DIR to a folder of your own"
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        found = path.lstat()
    except OSError as fault:
        raise ConfigError(f"{path}: expected a folder for running fleets, got {fault.strerror}; {hint}") from None
    open_to = stat.S_IMODE(found.st_mode) & 0o077
    for wrong, got in (
        (not stat.S_ISDIR(found.st_mode), "a link or file"),
        (found.st_uid != os.getuid(), f"a folder of user {found.st_uid}"),
        (open_to, f"a folder that others may use (mode {stat.S_IMODE(found.st_mode):o})"),
    ):
        if wrong:
            raise ConfigError(f"{path}: expected a folder of your own with mode 700, got {got}; remove it, or {hint}")
    return path


def tape_of(fleet: str) -> Path:
    """Return the file with the tape of the last run of a fleet of this name."""
    return folder() / f"{fleet}{TAPE}"


class Listing:
    """The entry of a fleet in the list: its name, and its folder with the card, whose lock this process holds."""

    def __init__(self, name: str, home: Path, endpoint: Endpoint, card: int, tape: Path) -> None:
        self.name, self.home, self.tape = name, home, tape
        self._endpoint, self._card = endpoint, card  # card: the descriptor that holds the lock
        self._box: str | None = None
        self._said = ""

    def tell_box(self, address: str) -> None:
        """Note the address of the fleet's page on the card."""
        self._box = address
        with suppress(OSError):  # the disk is full
            os.pwrite(self._card, _written(self.name, self._endpoint, address, self.tape), 0)

    def keep(self) -> str:
        """Make the folder and the card again if somebody has removed them; return a sentence about news, "" for none.

        Another launcher may have taken the name meanwhile: then the folder is left alone.
        """
        before, self._said = self._said, self._is_kept()
        return self._said if self._said != before else ""

    def _is_kept(self) -> str:
        if self._is_ours():
            return ""
        try:
            with _lock_registry(folder()):
                card = _make_card(self.home, self.name, self._endpoint, self._box, self.tape)
        except (OSError, ConfigError) as fault:
            return f"{self.home}: was removed and cannot be made again, so the report may be lost: {fault}"
        os.close(self._card)
        self._card = card
        return f"{self.home}: was removed; it was made again, and the run goes on"

    def _is_ours(self) -> bool:
        """Return True if the card in the folder is the one whose lock this process holds."""
        try:
            return os.path.samestat((self.home / CARD).lstat(), os.fstat(self._card))
        except OSError:
            return False

    def close(self) -> None:
        """Remove the folder, unless it is another fleet's by now, and give up the lock."""
        if self._is_ours():
            rmtree(self.home, ignore_errors=True)
        os.close(self._card)


@contextmanager
def register_fleet(wanted: str, endpoint: Endpoint, tape: Path | None = None) -> Iterator[Listing]:
    """Take a free fleet name (``paper``, else ``paper-2``, ...) and a folder for it until the block ends.

    The folders of fleets whose launcher was killed are removed. The run's tape is the file ``tape``, or one beside the
    folder, which stays.

    Raises:
        ConfigError: the name has a character that is not allowed, no name like it is free, or no folder can be made.
    """
    if not re.match(NAME, wanted) or wanted in {".", ".."}:  # the name becomes a folder, which is emptied
        raise ConfigError(f"--fleet: expected letters, digits and _ . : - (at most 60), got {wanted!r}")
    all_fleets = folder()
    try:
        with _lock_registry(all_fleets):
            _remove_dead(all_fleets)
            name = _free(all_fleets, wanted)
            home = all_fleets / name
            try:
                file = tape or tape_of(name)
                entry = Listing(name, home, endpoint, _make_card(home, name, endpoint, None, file), file)
            except OSError:
                rmtree(home, ignore_errors=True)
                raise
    except OSError as fault:
        raise ConfigError(
            f"{all_fleets}: expected a folder for running fleets that can be written, got {fault.strerror}; make room "
            "in it, or set XDG_RUNTIME_DIR to another folder of your own"
        ) from None
    try:
        yield entry
    finally:
        entry.close()


@contextmanager
def _lock_registry(all_fleets: Path) -> Iterator[None]:
    """Keep other launchers from taking a name, or removing what seems dead, until the block ends."""
    lock = _open_card(all_fleets / "lock", os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def _make_card(home: Path, name: str, endpoint: Endpoint, box: str | None, tape: Path) -> int:
    """Make the card of a fleet, and its folder if there is none; return the descriptor that holds the card's lock.

    The caller holds the lock of the list.
    """
    if home.is_symlink() or not home.is_dir():
        home.mkdir(mode=0o700)
    card = _open_card(home / CARD, os.O_RDWR | os.O_CREAT | os.O_EXCL)
    try:
        fcntl.flock(card, fcntl.LOCK_EX)
        os.write(card, _written(name, endpoint, box, tape))
    except OSError:
        os.close(card)
        raise
    return card


def _written(name: str, endpoint: Endpoint, box: str | None, tape: Path) -> bytes:
    return msgspec.json.encode(Card(name, str(endpoint), os.getpid(), box, str(tape)))


def _open_card(path: Path, flags: int) -> int:
    """Return the descriptor of a file that is opened only if it is no link."""
    return os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)


def _remove_dead(all_fleets: Path) -> None:
    """Remove everything here that belongs to no living launcher; the caller holds the lock."""
    for home in all_fleets.iterdir():
        if home.is_symlink():
            home.unlink()
        elif home.is_dir() and _read(home) is None:
            rmtree(home, ignore_errors=True)  # what its processes still write stays; its name is not free then


def _free(all_fleets: Path, wanted: str) -> str:
    for number in range(1, 1000):
        name = wanted if number == 1 else f"{wanted}-{number}"
        if not (all_fleets / name).exists():
            return name
    raise ConfigError(f"fleet: expected a free name like {wanted!r}, found none; give another one with --fleet")


def find(fleet: str | None) -> Card:
    """Return the card of the fleet with that name, or of the only fleet that runs.

    Raises:
        ConfigError: no such fleet runs, or several fleets run and none is named.
    """
    found = {card.fleet: card for card in cards()}
    return found[select_fleet(fleet, list(found), "on this machine")]


def cards() -> list[Card]:
    """Return the cards of all fleets that this user runs on this machine, by name."""
    return [card for home in sorted(folder().glob("*/")) if (card := _read(home))]


def select_fleet(wanted: str | None, names: Sequence[str], where: str) -> str:
    """Return the wanted fleet if it is among the names of those that run, or the only one if none is wanted.

    Raises:
        ConfigError: it is not, none runs, or several run and none is wanted.
    """
    known = ", ".join(names)
    if wanted is not None:
        if wanted not in names:
            hint = f"running {where}: {known}" if names else f"none runs {where}; start one with `swarm run`"
            raise ConfigError(f"--fleet: expected a running fleet, got {wanted!r}; {hint}")
        return wanted
    if not names:
        raise ConfigError(f"expected a fleet running {where}, found none; start one, or give --connect and --fleet")
    if len(names) > 1:
        raise ConfigError(f"expected one running fleet {where}, found {known}; name one with --fleet")
    return names[0]


def default_fleet_name(scenario: str, user: str | None = None) -> str:
    """Return the name of a fleet that is told none: user and scenario, so that two users of a router do not meet.

    It is the same each time: a world that is started again, and its robots, find each other under it.

    >>> default_fleet_name("paper", "Anna Meier")
    'Anna-Meier-paper'
    """
    if user is None:
        try:
            user = getpass.getuser()
        except (KeyError, OSError):  # a container may run as a number that has no name
            user = str(os.getuid())
    return f"{re.sub(r'[^A-Za-z0-9_.:]+', '-', user)[:20] or 'user'}-{scenario}"[:56]


def _read(home: Path) -> Card | None:
    """Return the card of a fleet whose launcher lives, which holds a lock on it; else None."""
    try:
        card = _open_card(home / CARD, os.O_RDONLY)
    except OSError:
        return None
    with open(card, "rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            pass
        else:
            return None  # nobody holds it: its launcher is dead
        try:
            return msgspec.json.decode(file.read(10_000), type=Card)
        except msgspec.DecodeError:
            return None
