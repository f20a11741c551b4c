"""The queue on which a process waits for what comes, from Zenoh's threads to the one that works."""

from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

from swarm.stop_signal import wakers

T = TypeVar("T")


class Mailbox(Generic[T]):
    """A queue; a wait for its next item also ends when this process is told to stop, from ``open`` to ``close``.

    Without that it may last for ever: CPython 3.11 goes on with the wait when a signal's handler returns, and if the
    time has run out meanwhile, it takes what is left, less than nothing, for no limit.
    """

    def __init__(self) -> None:
        self._items: SimpleQueue[T | None] = SimpleQueue()  # None: wake up
        self.put = self._items.put
        self.size = self._items.qsize

    def open(self) -> None:
        """Wake up whoever waits when this process is told to stop."""
        wakers.add(self.wake)

    def close(self) -> None:
        """Do so no more."""
        wakers.discard(self.wake)

    def next(self, timeout: float | None) -> T | None:
        """Return the next item; None if none comes within ``timeout`` [s] (None: wait for ever), or to wake up."""
        try:
            return self._items.get(timeout=timeout) if timeout is None or timeout > 0 else self._items.get_nowait()
        except Empty:
            return None

    def wake(self) -> None:
        """End the wait of whoever waits."""
        self.put(None)
