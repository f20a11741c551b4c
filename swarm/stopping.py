"""Clean shutdown: SIGTERM and Ctrl-C set a flag, so that a process can close its files and its session."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

SIGNALS: Final = (signal.SIGTERM, signal.SIGINT)


@contextmanager
def told_to_stop() -> Iterator[threading.Event]:
    """Yield a flag that ``SIGNALS`` set while the block runs.

    Only the main thread can receive signals: in another thread the flag is never set by a signal.
    """
    flag = threading.Event()

    def on_signal(number: int, frame: FrameType | None) -> None:
        flag.set()

    if threading.current_thread() is not threading.main_thread():
        yield flag
        return
    before = {number: signal.signal(number, on_signal) for number in SIGNALS}
    try:
        yield flag
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
