"""The requests that wait for the world, in a bounded line, and the share of the time that they get."""

from collections import deque
from collections.abc import Callable
from math import inf
from time import perf_counter, thread_time
from typing import Final

from swarm.bus import Request
from swarm.messages import (
    ACTION,
    EDIT,
    JOIN,
    LEAVE,
    ORDER,
    PLACES,
    POOL,
    ROBOT_ACTION,
    Order,
    Places,
    RobotAction,
    RobotDo,
)

WAIT: Final = 16  # requests that wait at most; an edit takes up to 0.1 s, and who asks waits 5 s
ANSWERED: Final = (ACTION, EDIT, JOIN, LEAVE, ORDER, ROBOT_ACTION, POOL, PLACES)
BETWEEN: Final = (EDIT, ORDER, ROBOT_ACTION, POOL, PLACES)  # requests that change what a tick in lockstep begins with
Closed = Callable[[Request], bool]
SHARE: Final = 0.2  # of the wall time; what a slow request took beyond that is taken from the next ones


def waits_in_tick(request: Request, *, lockstep: bool, is_there: Callable[[str], bool]) -> bool:
    """Return True if a request that came within a tick waits for its end. In real time robots sense changes later.

    ``is_there`` says whether a robot is at its next stop. It may have said so, and the world counts the stop at the end
    of the tick: other stops that came between the two would take the place of stops that are done.
    """
    if lockstep:
        return request.topic in BETWEEN
    match request.message:
        case Places():
            return True
        case Order() | RobotAction(do=RobotDo.HOME | RobotDo.CANCEL):
            return is_there(request.ids["robot"])
    return False


class Requests:
    """The line; who serves it says which requests are ``closed`` for now: they wait."""

    def __init__(self, dt: float) -> None:
        self._line: deque[Request] = deque()
        self._most = SHARE * dt  # s that can be saved up
        self._saved, self._at = self._most, perf_counter()

    def add(self, request: Request) -> None:
        """Put a request into the line, or refuse it if the line is full."""
        if len(self._line) < WAIT:
            self._line.append(request)
        else:
            request.refuse(f"{WAIT} requests are waiting already; ask again later")

    def idle(self) -> None:
        """Give them all of the time: the clock stands."""
        self._saved = self._most

    def wait(self, *, closed: Closed) -> float:
        """Return the seconds until the next request may be answered; infinity if none waits for its share alone."""
        return inf if self._next(closed=closed) is None else max(0.0, -self._time_earned() / SHARE)

    def serve(self, answer: Callable[[Request], None], *, closed: Closed) -> None:
        """Answer those who wait, first come first served, until their share is spent.

        Time in which the machine does something else, as saving to a disk, is not charged, but ends the turn.
        """
        until = perf_counter() + self._most
        while (request := self._next(closed=closed)) is not None and self._time_earned() >= 0.0:
            self._line.remove(request)
            began = thread_time()
            answer(request)
            self._saved -= thread_time() - began
            if perf_counter() > until:
                break

    def _next(self, *, closed: Closed) -> Request | None:
        return next((one for one in self._line if not closed(one)), None)

    def _time_earned(self) -> float:
        """Return the time [s] that they have left, negative if they took too much."""
        now = perf_counter()
        self._saved, self._at = min(self._most, self._saved + SHARE * (now - self._at)), now
        return self._saved
