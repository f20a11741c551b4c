"""The end of programs that a dashboard has started: they end with it, whatever ended it."""

import ctypes
import signal
from contextlib import suppress
from typing import Final

SET_DEATH_SIGNAL: Final = 1  # PR_SET_PDEATHSIG of Linux's prctl


def end_with_us() -> None:
    """Let Linux end this process, a child, when the thread ends that started it."""
    with suppress(OSError, AttributeError):  # another system
        ctypes.CDLL(None).prctl(SET_DEATH_SIGNAL, signal.SIGTERM)
