"""The requests that wait for the world, in a bounded line, and the share of each tick that they get."""

from collections import deque
from collections.abc import Callable
from time import perf_counter
from typing import Final

from swarm.bus import Request
from swarm.messages import EDIT, ORDER, PLACES, POOL, ROBOT_ACTION

WAIT: Final = 16  # requests that wait at most; an edit takes up to 0.1 s, and who asks waits 5 s
FEW: Final = 4  # requests that are answered in one tick
BETWEEN: Final = (EDIT, ORDER, ROBOT_ACTION, POOL, PLACES)  # requests that are carried out between ticks
SHARE: Final = 0.2  # of a tick's time; what a slow request took beyond that is taken from the next ticks


class Requests:
    """The line. Those of ``BETWEEN`` are carried out between ticks, all other requests also within one."""

    def __init__(self, dt: float) -> None:
        self._line: deque[Request] = deque()
        self._share = SHARE * dt  # s
        self._count, self._seconds = FEW, self._share

    def add(self, request: Request) -> None:
        """Put a request into the line, or refuse it if the line is full."""
        if len(self._line) < WAIT:
            self._line.append(request)
        else:
            request.refuse(f"{WAIT} requests are waiting already; ask again later")

    def renew(self, *, idle: bool) -> None:
        """Begin a tick; while the clock stands, ``idle``, all of the time is theirs."""
        self._count = FEW
        self._seconds = self._share if idle else min(self._share, self._seconds + self._share)

    def serve(self, answer: Callable[[Request], None], *, between: bool) -> None:
        """Answer those who wait, first come first served, until this tick's share is spent."""
        while self._count > 0 and self._seconds > 0.0:
            request = next((one for one in self._line if between or one.topic not in BETWEEN), None)
            if request is None:
                return
            self._line.remove(request)
            began = perf_counter()
            answer(request)
            self._count -= 1
            self._seconds -= perf_counter() - began
