"""Processes and threads around a dashboard under test: a router, and a world that only repeats a rehearsal."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from swarm.bus import Bus, Endpoint
from swarm.bus.router import run as route
from swarm.messages import CLOCK, MAP, PLAN, STATE, STATUS, Message
from tests.dashboard.drawn import floor
from tests.dashboard.rehearsal import Rehearsal


@contextmanager
def router() -> Iterator[Endpoint]:
    """Run a router in a thread as long as the block lasts; give where it listens."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    over = threading.Event()
    thread = threading.Thread(target=route, args=(endpoint, over.wait))
    thread.start()
    try:
        yield endpoint
    finally:
        over.set()
        thread.join()


M = TypeVar("M", bound=Message)


class World:
    """Keeps what late joiners ask for, and sends a rehearsal."""

    def __init__(self, bus: Bus, rehearsal: Rehearsal) -> None:
        self._bus = bus
        self._rehearsal = rehearsal
        self._tick = 0

    def serve(self) -> None:
        """Answer late joiners from now on."""
        self._bus.keep(CLOCK, lambda: {CLOCK.key: self._rehearsal.clock(self._tick)})
        self._bus.keep(MAP, lambda: {MAP.key: floor(self._rehearsal)})
        self._bus.keep(STATUS, lambda: {STATUS.key: self._rehearsal.status(self._tick)})
        self._bus.keep(STATE, lambda: self._each(STATE.key, self._rehearsal.state))
        self._bus.keep(PLAN, lambda: self._each(PLAN.key, self._rehearsal.plan))

    def send(self, rehearsal: Rehearsal, tick: int) -> None:
        """Send everything of a tick; a rehearsal is faster than real time, so a full queue is waited for."""
        self._rehearsal, self._tick = rehearsal, tick
        for topic, message, ids in rehearsal.messages(tick):
            self._bus.send(topic, message, sure=True, **ids)

    def _each(self, key: str, message: Callable[[int, int], M]) -> dict[str, M]:
        names = self._rehearsal.names
        return {key.format(robot=name): message(number, self._tick) for number, name in enumerate(names)}
