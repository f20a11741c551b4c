"""The check that a fleet has no other world."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from secrets import token_hex
from typing import Final

from swarm.bus import Bus
from swarm.errors import ConfigError
from swarm.messages import CLOCK

ANSWERS: Final = 2.0  # s in which a world that lives answers


def new_identity() -> str:
    """Return the identity of a world that begins its first run."""
    return token_hex(8)


@contextmanager
def check_alone(bus: Bus, fleet: str, log: Callable[[str], None]) -> Iterator[set[str]]:
    """Check that the fleet has no other world; the caller announces its own in the block.

    A world is a token and an answer: nobody else keeps the clock. Of two that start at once, the one with the larger
    session id gives way. The block gets the sessions that announce a world and do not answer.

    Raises:
        ConfigError: the fleet has another world.
    """
    fault = ConfigError(
        f"fleet {fleet}: expected no world, got one that runs already; stop it, or give another --fleet"
    )
    before = bus.sessions("world")
    if before and bus.fetch(CLOCK, timeout=ANSWERS):
        raise fault
    if before:
        log(f"fleet {fleet}: ignored the token of a world that does not answer")
    yield before
    if any(other < bus.id for other in bus.sessions("world") - before - {bus.id}):
        raise fault
