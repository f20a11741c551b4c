"""What a fleet of any size sends, computed from the messages of a measured one.

Robots stand as dense as in the measured fleet, on a floor that grows with them: so a robot has as many neighbours in a
large fleet as in a small one, and messages grow with the fleet, not with its square. Bytes are those of payloads; keys
and the headers of Zenoh and TCP come on top.
"""

from collections.abc import Callable
from math import ceil
from typing import Final, NamedTuple

from swarm.messages import SENSE

FLEETS: Final = (10, 100, 1_000, 10_000)  # robots
CORES: Final = 8  # of a host
FILLED: Final = 0.5  # of a core that a fleet may take on average: a tick in a thousand takes twice as long
KINDS: Final = ("robots", "world", "router")  # of processes


class Measured(NamedTuple):
    """What one robot sends and gets in a tick, and what it costs, in a measured fleet."""

    spoken: float  # broadcasts that it sends
    delivered: float  # broadcasts that it is sent: of all in its radio zone and the eight round it
    length: float  # bytes of a broadcast
    sense: float  # bytes of a sense
    command: float  # bytes of a command


class Load(NamedTuple):
    """What a whole fleet sends in a second."""

    said: float  # broadcasts
    delivered: float  # broadcasts, each counted once for every robot it is sent to
    asked: float  # senses and commands
    into: float  # bytes into the routers
    out_of: float  # bytes out of the routers


def load(robots: int, measured: Measured, rate: float = SENSE.rate) -> Load:
    """Compute the messages of a fleet at ``rate`` [Hz]; a robot of a small fleet gets what the others say, at most."""
    said = robots * rate * measured.spoken
    delivered = robots * rate * min(measured.delivered, (robots - 1) * measured.spoken)
    ticks = robots * rate
    return Load(
        said,
        delivered,
        2 * ticks,
        said * measured.length + ticks * (measured.sense + measured.command),
        delivered * measured.length + ticks * (measured.sense + measured.command),
    )


def line(robots: int, measure: Callable[[], tuple[Measured, dict[str, float], float]]) -> tuple[str, ...]:
    """Return a row of the table.

    ``measure`` returns the messages, the CPU time of a robot-tick [s] by kind, and the own memory of a robot [MB].
    """
    measured, cost, memory = measure()
    of = load(robots, measured)
    cores = {kind: robots * SENSE.rate * cost[kind] for kind in KINDS}
    return (
        f"{of.said:,.0f}",
        f"{of.delivered:,.0f}",
        f"{of.asked:,.0f}",
        f"{of.into * 8e-6:,.1f}",
        f"{of.out_of * 8e-6:,.1f}",
        f"{(of.into + of.out_of) * 8e-3 / robots:,.0f}",
        *(f"{cores[kind]:,.1f}" for kind in KINDS),
        f"{robots * memory / 1000:,.1f}",
        f"{ceil(cores['world'] / FILLED):,}",
        f"{ceil(sum(cores.values()) / (CORES * FILLED)):,}",
    )


HEAD: Final = (
    "a fleet as dense as", "broadcasts sent [1/s]", "delivered [1/s]", "senses and commands [1/s]",
    "into the routers [Mbit/s]", "out of them [Mbit/s]", "a robot, both ways [kbit/s]",
    "cores for robots", "for the world", "for routers", "robots' own memory [GB]",
    f"worlds, {FILLED:.0%} of a core each", f"hosts of {CORES} cores, {FILLED:.0%} of each",
)  # fmt: skip
