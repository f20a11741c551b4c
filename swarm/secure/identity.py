"""One member's certificate and key, as files in a folder, and the checks before they are used."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from stat import S_IMODE
from typing import Final

from swarm.errors import ConfigError
from swarm.secure.names import ACCESS, AUTHORITY, CERTIFICATE, KEY, ROUTER

OTHERS: Final = 0o077  # permissions of everybody but the owner


@dataclass(frozen=True, slots=True)
class Identity:
    """A member of a fleet, by its name in its certificate; its files are in the folder ``keys/name``."""

    keys: Path
    name: str

    @property
    def folder(self) -> Path:
        """The folder with the files of this member only."""
        return self.keys / self.name

    def check(self, now: datetime | None = None) -> None:
        """Check that all files are there, private, of this member, of one authority and valid now.

        Zenoh says only that no connection was made, whichever file is wrong.

        Raises:
            ConfigError: the first of these that is not so.
        """
        from swarm.secure.certificates import check  # takes 40 ms to import; an open fleet does not need it

        contents = {file: self._read(file) for file in (AUTHORITY, CERTIFICATE, KEY)}
        check(self.folder, self.name, contents, datetime.now(UTC) if now is None else now)

    def access_list(self) -> str:
        """Return the router's access list, JSON of Zenoh's form.

        Raises:
            ConfigError: the file is missing, or others may read or write it.
        """
        return self._read(ACCESS).decode(errors="replace")

    @property
    def joins(self) -> bool:
        """True if these are the keys of a router that may join others.

        Raises:
            ConfigError: as ``access_list``.
        """
        return f'"{ROUTER}"' in self.access_list()

    def _read(self, file: str) -> bytes:
        path = self.folder / file
        if not self.folder.is_dir():
            raise ConfigError(
                f"--secure: expected the keys of {self.name} in {self.folder}, found no such folder; "
                "make keys for the whole fleet with `swarm keys`, or copy that folder from where they were made"
            )
        try:
            mode, content = S_IMODE(path.stat().st_mode), path.read_bytes()
        except OSError as fault:
            raise ConfigError(
                f"{path}: expected a file that can be read, got {fault.strerror or fault}; copy it again from where "
                "`swarm keys` made it, or start this process as its owner"
            ) from None
        if mode & OTHERS:
            raise ConfigError(
                f"{path}: expected a file that only its owner may read, got mode {mode:04o}; anybody may have copied "
                f"it: make new keys, or run `chmod 600 {path}` if you know that nobody has"
            )
        return content
