"""Reads files of maps and scenarios; each way in which that can fail is a ``ConfigError`` of one sentence."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any, Final

import yaml

from swarm.errors import ConfigError
from swarm.maps.limits import FILE_MAX

EVENTS_LIMIT: Final = 60_000  # values, lists and ends of lists in YAML; a target is four; read in about a second
DEPTH_LIMIT: Final = 50  # lists in lists


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
    return decode_utf8(read_file(path, largest), str(path))


def decode_utf8(content: bytes, where: str) -> str:
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


def quote_value(value: str, most: int = 40) -> str:
    """Return a quoted value of a file, cut to ``most`` characters, for an error text."""
    return repr(value if len(value) <= most else value[:most] + "...")


def path_within(base: Path, name: str, where: str) -> Path:
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
            f"{where}: expected the name of a file in the folder {base} or below it, got {quote_value(name)}; "
            "put it there"
        )
    return path


class Loader(yaml.CSafeLoader):
    """A YAML loader that refuses a key given twice; the plain loader silently keeps the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return the values of a mapping."""
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if not isinstance(key, yaml.ScalarNode):
                raise yaml.constructor.ConstructorError(None, None, "a key that is not a text", key.start_mark)
            if key.value in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key.value!r} is given twice", key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)


def yaml_values(text: str, where: str) -> Any:  # noqa: ANN401, whatever the text says
    """Return the values in a YAML text.

    Raises:
        ConfigError: it is not YAML, gives a key twice, or has too many values.
    """
    try:
        depth = 0
        for number, event in enumerate(yaml.parse(text, Loader=Loader)):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if number > EVENTS_LIMIT or depth > DEPTH_LIMIT:
                raise ConfigError(
                    f"{where}: expected at most {EVENTS_LIMIT} values, {DEPTH_LIMIT} deep, got more; put a large map "
                    "into a file of its own, list fewer targets"
                )
        return yaml.load(text, Loader=Loader)
    except (yaml.YAMLError, RecursionError, ValueError) as fault:
        mark = getattr(fault, "problem_mark", None)
        at = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        said = getattr(fault, "problem", None) or str(fault).split("\n")[0]
        raise ConfigError(f"{where}: {at}expected YAML, got {said}; correct that line") from None
