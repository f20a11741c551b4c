"""The list of fleets that run on this machine, in which `swarm go` and others find the fleet's router."""

import fcntl
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import rmtree
from typing import Final

import msgspec

from swarm.bus import Endpoint
from swarm.errors import ConfigError, nearest

CARD: Final = "fleet.json"
NAME: Final = r"[A-Za-z0-9_.:-]{1,60}\Z"


class Card(msgspec.Struct, frozen=True):
    """The entry of a running fleet, a file in its folder."""

    fleet: str
    endpoint: str
    pid: int


def folder() -> Path:
    """Return the folder with the cards and logs of this user's fleets."""
    base = os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir()
    return Path(base) / f"zenoh-swarm-{os.getuid()}"


@contextmanager
def registered(wanted: str, endpoint: Endpoint) -> Iterator[tuple[str, Path]]:
    """Take a free fleet name (``paper``, else ``paper-2``, ...) and a folder for it until the block ends.

    Raises:
        ConfigError: the name has a character that is not allowed, or no name like it is free.
    """
    if not re.match(NAME, wanted) or wanted in {".", ".."}:  # the name becomes a folder, which is emptied
        raise ConfigError(f"--fleet: expected letters, digits and _ . : - (at most 60), got {wanted!r}")
    folder().mkdir(mode=0o700, exist_ok=True)
    with (folder() / "lock").open("w") as lock:  # keeps two launchers from taking the same name
        fcntl.flock(lock, fcntl.LOCK_EX)
        name = _free(wanted)
        home = folder() / name
        rmtree(home, ignore_errors=True)
        home.mkdir(mode=0o700)
        (home / CARD).write_bytes(msgspec.json.encode(Card(name, str(endpoint), os.getpid())))
    try:
        yield name, home
    finally:
        rmtree(home, ignore_errors=True)


def _free(wanted: str) -> str:
    for number in range(1, 1000):
        name = wanted if number == 1 else f"{wanted}-{number}"
        card = _read(folder() / name)
        if card is None or not _alive(card.pid):
            return name
    raise ConfigError(f"fleet: expected a free name like {wanted!r}, found none; give another one with --fleet")


def find(fleet: str | None) -> Card:
    """Return the card of the fleet with that name, or of the only fleet that runs.

    Raises:
        ConfigError: no such fleet runs, or several fleets run and none is named.
    """
    cards = [card for home in sorted(folder().glob("*/")) if (card := _read(home)) and _alive(card.pid)]
    names = [card.fleet for card in cards]
    if fleet is not None:
        if fleet not in names:
            hint = nearest(fleet, names) if names else "start one with `swarm run`"
            raise ConfigError(f"--fleet: expected a running fleet, got {fleet!r}; {hint}")
        return cards[names.index(fleet)]
    if not cards:
        raise ConfigError(
            "expected a fleet running on this machine, found none; start one, or give --connect and --fleet"
        )
    if len(cards) > 1:
        raise ConfigError(f"expected one running fleet, found {', '.join(names)}; name one with --fleet")
    return cards[0]


def _read(home: Path) -> Card | None:
    try:
        return msgspec.json.decode((home / CARD).read_bytes(), type=Card)
    except (OSError, msgspec.DecodeError):
        return None


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
