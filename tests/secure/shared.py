"""Keys for tests: those of a fleet of two robots, and keys that something is wrong with."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

from swarm.secure.certificates import Authority
from swarm.secure.keys import fill, write_member

NOW = datetime.now(UTC)
DAY = timedelta(days=1)
ROBOTS = ("r1", "r2")


def fleet_keys(folder: Path) -> Authority:
    """Write the keys of a fleet into a new folder; return its authority, which can issue more."""
    authority = Authority(NOW - DAY, NOW + DAY)
    folder.mkdir()
    fill(folder, authority, ROBOTS, ())
    return authority


def member(folder: Path, trusted: Authority, issuer: Authority, name: str, begin: datetime, end: datetime) -> Path:
    """Write a folder of keys with one member, whose certificate one authority has issued and who trusts another."""
    folder.mkdir()
    write_member(folder / name, trusted.certificate, issuer.client(name, (begin, end)))
    return folder
