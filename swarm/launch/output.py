"""The standard output of a launcher."""

from threading import Event as Flag
from typing import TextIO


class Output:
    """The standard output of a launcher. When its reader or its terminal is gone, the run is told to stop."""

    def __init__(self, inner: TextIO, stop: Flag) -> None:
        self._inner, self._stop = inner, stop

    @property
    def encoding(self) -> str:
        """That of the standard output."""
        return self._inner.encoding

    def isatty(self) -> bool:
        """Return True if people read it on a terminal."""
        return self._inner.isatty()

    def fileno(self) -> int:
        """Return the descriptor of the standard output."""
        return self._inner.fileno()

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
