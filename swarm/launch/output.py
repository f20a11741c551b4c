"""The standard output of a launcher."""

from threading import Event as Flag
from typing import Any, TextIO


class Output:
    """The standard output of a launcher. When its reader or its terminal is gone, the run is told to stop."""

    def __init__(self, inner: TextIO, stop: Flag) -> None:
        self._inner, self._stop = inner, stop

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401, all else is that of the standard output
        return getattr(self._inner, name)

    def write(self, text: str) -> int:
        """Write a text if that is still possible."""
        try:
            return self._inner.write(text)
        except OSError:
            self._stop.set()
            return len(text)

    def flush(self) -> None:
        """Pass on what was written if that is still possible."""
        try:
            self._inner.flush()
        except OSError:
            self._stop.set()
