"""The requests that wait for the world, in a bounded line, and the share of the time that they get."""

from collections import deque
from collections.abc import Callable, Collection
from math import inf
from time import perf_counter, thread_time
from typing import Any, Final

from swarm.bus import Request
from swarm.messages import ACTION, EDIT, JOIN, LEAVE, ORDER, PLACES, POOL, ROBOT_ACTION, Topic

WAIT: Final = 16  # requests that wait at most; an edit takes up to 0.1 s, and who asks waits 5 s
ANSWERED: Final = (ACTION, EDIT, JOIN, LEAVE, ORDER, ROBOT_ACTION, POOL, PLACES)
BETWEEN: Final = (EDIT, ORDER, ROBOT_ACTION, POOL, PLACES)  # requests that change what a tick in lockstep begins with
SHARE: Final = 0.2  # of the wall time; what a slow request took beyond that is taken from the next ones


def closed(*, in_tick: bool, lockstep: bool) -> Collection[Topic[Any]]:
    """Return the requests that wait for the end of the tick. In real time robots sense what changes in it later."""
    if not in_tick:
        return ()
    return BETWEEN if lockstep else (PLACES,)


class Requests:
    """The line; who serves it says which topics are ``closed`` for now: their requests wait."""

    def __init__(self, dt: float) -> None:
        self._line: deque[Request] = deque()
        self._most = SHARE * dt  # s that can be saved up
        self._saved, self._at = self._most, perf_counter()

    def __len__(self) -> int:
        return len(self._line)

    def add(self, request: Request) -> None:
        """Put a request into the line, or refuse it if the line is full."""
        if len(self._line) < WAIT:
            self._line.append(request)
        else:
            request.refuse(f"{WAIT} requests are waiting already; ask again later")

    def idle(self) -> None:
        """Give them all of the time: the clock stands."""
        self._saved = self._most

    def wait(self, *, closed: Collection[Topic[Any]]) -> float:
        """Return the seconds until the next request may be answered; infinity if none waits for its share alone."""
        return inf if self._next(closed=closed) is None else max(0.0, -self._earned() / SHARE)

    def serve(self, answer: Callable[[Request], None], *, closed: Collection[Topic[Any]]) -> None:
        """Answer those who wait, first come first served, until their share is spent."""
        while (request := self._next(closed=closed)) is not None and self._earned() >= 0.0:
            self._line.remove(request)
            began = thread_time()  # time in which the machine did something else is not theirs
            answer(request)
            self._saved -= thread_time() - began

    def _next(self, *, closed: Collection[Topic[Any]]) -> Request | None:
        return next((one for one in self._line if one.topic not in closed), None)

    def _earned(self) -> float:
        """Return the time [s] that they have left, negative if they took too much."""
        now = perf_counter()
        self._saved, self._at = min(self._most, self._saved + SHARE * (now - self._at)), now
        return self._saved
