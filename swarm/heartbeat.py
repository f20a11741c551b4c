"""A file that a process touches as long as its main loop turns: engines of containers look at its age.

Only the process of a container beats, not those that it starts, nor commands that somebody runs beside it.
"""

import os
from collections.abc import MutableMapping
from pathlib import Path
from time import monotonic
from typing import Final

from swarm.errors import ConfigError

NAMED_BY: Final = "SWARM_ALIVE"  # the variable with the file's path; images set it
EVERY: Final = 1.0  # s between two touches


class Heartbeat:
    """Touches the file that ``SWARM_ALIVE`` names, if it names one; processes that are started later do not get it."""

    def __init__(self, environment: MutableMapping[str, str] = os.environ) -> None:
        named = environment.pop(NAMED_BY, None)
        self._file = Path(named) if named else None
        self._due = float("-inf")

    def beat(self) -> None:
        """Touch the file, if a second has passed since the last time.

        Raises:
            ConfigError: the file cannot be written.
        """
        if self._file is None or (now := monotonic()) < self._due:
            return
        self._due = now + EVERY
        try:
            self._file.touch()
        except OSError as fault:
            raise ConfigError(
                f"{NAMED_BY}={self._file}: expected a file that can be written, got {fault.strerror}; name another one"
            ) from None
