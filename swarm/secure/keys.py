"""`swarm keys`: the folder with the keys of a fleet. It appears whole or not at all."""

import json
import os
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Final

from swarm.errors import ConfigError
from swarm.secure.access import access_list
from swarm.secure.certificates import EARLIER, HERE, Authority, Files
from swarm.secure.names import ACCESS, AUTHORITY, CERTIFICATE, KEY, ROLES, ROUTER

PRIVATE: Final = 0o600


def make(folder: Path, robots: Sequence[str], hosts: Sequence[str], days: float, *, several: bool = False) -> None:
    """Write a new authority's certificates for all roles and robots, and the router's access list.

    With ``several`` routers they may join each other.

    The authority's own key is not kept: whoever finds the folder can use the certificates in it, but make no other.

    Raises:
        ConfigError: the folder is not empty or cannot be written, or a host's name is wrong.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError(
            f"{folder}: expected a new or empty folder, got one with content; keys are never overwritten, "
            "as processes may be using them: give another folder, or remove this one first"
        )
    now = datetime.now(UTC)
    authority = Authority(now - EARLIER, now + timedelta(days=days))
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))  # mode 0700
    except OSError as fault:
        raise _not_written(folder, fault) from None
    try:
        fill(made, authority, robots, hosts, several=several)
        made.rename(folder)
    except OSError as fault:
        raise _not_written(folder, fault) from None
    finally:
        rmtree(made, ignore_errors=True)


def fill(
    folder: Path, authority: Authority, robots: Sequence[str], hosts: Sequence[str], *, several: bool = False
) -> None:
    """Write the files of all members, each member's into a folder of its own."""
    for name in (*ROLES, *robots):
        files = authority.router(name, [*HERE, *hosts], joins=several) if name == ROUTER else authority.client(name)
        write_member(folder / name, authority.certificate, files)
    _write(folder / ROUTER / ACCESS, json.dumps(access_list(robots, several=several), indent=1).encode() + b"\n")


def _not_written(folder: Path, fault: OSError) -> ConfigError:
    return ConfigError(f"{folder}: expected a folder that can be written, got {fault.strerror}; choose another one")


def write_member(folder: Path, authority: bytes, files: Files) -> None:
    """Write the files of one member into a new folder."""
    folder.mkdir(mode=0o700)
    for file, content in ((AUTHORITY, authority), (CERTIFICATE, files.certificate), (KEY, files.key)):
        _write(folder / file, content)


def _write(path: Path, content: bytes) -> None:
    """Write a new file that nobody else could read at any moment."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE), "wb") as file:
        file.write(content)
