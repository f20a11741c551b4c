"""The name of a process, by which `ps -e` and `top` tell one robot from another, from the world and from the router."""

import ctypes
from contextlib import suppress
from typing import Final

SET_NAME: Final = 15  # PR_SET_NAME of Linux's prctl
LONGEST: Final = 15  # bytes; Linux cuts the rest


def name_process(name: str) -> None:
    """Name this process ``swarm NAME``; call it in the main thread. Another system keeps the name it gave."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(SET_NAME, f"swarm {name}".encode()[:LONGEST], 0, 0, 0)
