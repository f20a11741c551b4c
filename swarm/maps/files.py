"""Reads a map file; each way in which that can fail is a ``ConfigError`` of one sentence."""

from pathlib import Path

from swarm.errors import ConfigError
from swarm.maps.limits import FILE_MAX


def read_file(path: Path, largest: int = FILE_MAX) -> bytes:
    """Read a whole file of at most ``largest`` bytes.

    Raises:
        ConfigError: the file is missing, not a regular file, not readable, or too large.
    """
    try:
        if not path.is_file():
            raise ConfigError(f"{path}: expected a file, found none; check the path")
        with path.open("rb") as file:
            content = file.read(largest + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise ConfigError(f"{path}: expected a readable file, got {str(reason).lower()}; check it") from error
    if len(content) > largest:
        raise ConfigError(f"{path}: expected at most {largest} bytes, got more; is this the right file?")
    return content


def read_text(path: Path, largest: int = FILE_MAX) -> str:
    """Read a whole file as UTF-8 text; line ends are kept.

    Raises:
        ConfigError: as ``read_file``, or the file is not UTF-8.
    """
    return decoded(read_file(path, largest), str(path))


def decoded(content: bytes, where: str) -> str:
    """Decode bytes as UTF-8, without the byte order mark.

    Raises:
        ConfigError: the bytes are not UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"{where}: expected text (UTF-8), got byte {content[error.start]:#04x} at {error.start}; "
            "is this the right file?"
        ) from error


def shown(value: str, most: int = 40) -> str:
    """Return a quoted value of a file, cut to ``most`` characters, for an error text."""
    return repr(value if len(value) <= most else value[:most] + "...")


def within(base: Path, name: str, where: str) -> Path:
    """Return the path of a file that another file names: it is in the folder ``base`` or below it, links followed.

    So a foreign file can make a program read only what came with it.

    Raises:
        ConfigError: the path is absolute, leads out of the folder, or is no path.
    """
    try:
        path = (base / name).resolve()
        inside = not Path(name).is_absolute() and path.is_relative_to(base.resolve())
    except (OSError, ValueError, RuntimeError):  # a NUL in the name; links in a circle
        inside = False
    if not inside:
        raise ConfigError(
            f"{where}: expected the name of a file in the folder {base} or below it, got {shown(name)}; put it there"
        )
    return path
