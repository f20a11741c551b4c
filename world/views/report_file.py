"""The file of a report, which the world and the launcher write alike."""

import json
import os
from math import isfinite
from pathlib import Path
from typing import Any

from swarm.errors import ConfigError


def write(summary: dict[str, Any], path: Path) -> None:
    """Write a report as JSON, all of it or nothing; a number that is not finite becomes null.

    Raises:
        ConfigError: the file cannot be written.
    """
    text = json.dumps(_plain(summary), indent=1, allow_nan=False) + "\n"
    part = path.with_name(f".{path.name}.part")
    try:
        if path.exists() and not path.is_file():  # a device or a pipe cannot be replaced
            path.write_text(text, encoding="utf-8")
            return
        try:
            part.write_text(text, encoding="utf-8")
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as fault:
        raise ConfigError(
            f"--report {path}: expected to write the report, got: {fault.strerror}; make room or choose another file"
        ) from None


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value if not isinstance(value, float) or isfinite(value) else None
