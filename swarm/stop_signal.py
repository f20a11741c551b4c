"""Clean shutdown: SIGTERM, SIGHUP and Ctrl-C set a flag, so that a process can close its files and its session."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

SIGNALS: Final = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
FROM_TERMINAL: Final = (signal.SIGINT, signal.SIGHUP)  # they reach all processes of a terminal at once

wakers: Final[set[Callable[[], object]]] = set()  # end the waits of this process when it is told to stop
_left_alone: set[signal.Signals] = set()


def leave_terminal_to_parent() -> None:
    """Ignore in this process what the terminal sends to all: the launcher gets it too, and ends them in order."""
    for number in FROM_TERMINAL:
        signal.signal(number, signal.SIG_IGN)
        _left_alone.add(number)


@contextmanager
def stop_flag() -> Iterator[threading.Event]:
    """Yield a flag that ``SIGNALS`` set while the block runs; a hang-up that ``nohup`` ignores stays ignored.

    Only the main thread can receive signals: in another thread the flag is never set by a signal.
    """
    flag = threading.Event()

    def on_signal(number: int, frame: FrameType | None) -> None:
        flag.set()
        for wake in tuple(wakers):
            wake()

    if threading.current_thread() is not threading.main_thread():
        yield flag
        return
    ignored = {signal.SIGHUP} if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else set()
    before = {number: signal.signal(number, on_signal) for number in SIGNALS if number not in _left_alone | ignored}
    try:
        yield flag
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
