"""Whether a robot may drive. Pure: what is seen comes in, and why the robot stands comes out.

The faults are a table; the first that holds is told. While one holds the robot gets twists of 0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from swarm.messages import BODY, COMMAND

SCAN_TIMEOUT: Final = 0.5  # s; lidars turn 5 to 10 times a second
STAND: Final = 1.0  # s without a jump, after one
FIRST_TRY: Final = 2.0  # s that a robot stands whose wheels did not do what they were told; then twice as long, ...
LAST_TRY: Final = 16.0  # s, ... up to this


class Seen(NamedTuple):
    """What this process knows at one moment. Ages are in s; None: never came."""

    odometry_age: float | None
    known: bool  # where the robot is
    lost: str  # why that is not known any more
    jump: str  # of the last time that it was known, or nothing
    jump_age: float
    scan_age: float | None  # of the last one with all rays; 0 if none is asked for
    scan_lacks: str
    stop: bool
    wheels: str  # what is wrong with them
    wheels_age: float  # since that was found
    command_age: float | None


class Fault(NamedTuple):
    """A reason to stand."""

    name: str
    holds: Callable[[Seen, "Guard"], bool]
    text: Callable[[Seen, "Guard"], str]


@dataclass
class Guard:
    """What is asked for, and for how long a robot stands after its wheels' last fault."""

    odometry: str  # name of the topic
    localisation: str
    scan: str
    tries: float = FIRST_TRY  # s

    def fault(self, seen: Seen) -> tuple[str, str] | None:
        """Return the name and the text of the first fault that holds; None: the robot may drive."""
        found = next((fault for fault in FAULTS if fault.holds(seen, self)), None)
        return None if found is None else (found.name, found.text(seen, self))

    def is_blind(self, seen: Seen) -> bool:
        """Return True if the scan is too old to be told."""
        return _old(seen.scan_age, SCAN_TIMEOUT)


def _old(age: float | None, most: float) -> bool:
    return age is None or age > most


# fmt: off
FAULTS: Final = (
    Fault("stop",      lambda seen, _: seen.stop,
          lambda seen, _: "an emergency stop is pressed"),
    Fault("odometry",  lambda seen, _: _old(seen.odometry_age, BODY.timeout),
          lambda seen, guard: _silent("odometry", guard.odometry, seen.odometry_age, BODY.timeout)),
    Fault("lost",      lambda seen, _: bool(seen.lost),
          lambda seen, guard: f"{seen.lost}: nobody knows where it is until " + (
              f"{guard.localisation} says it" if guard.localisation
              else "it stands where the fleet shows it and this program is started again; --pose would tell")),
    Fault("unknown",   lambda seen, _: not seen.known,
          lambda seen, guard: f"there is no localisation on {guard.localisation} yet" if guard.localisation
              else "the fleet has not said yet where it stands"),
    Fault("jump",      lambda seen, _: bool(seen.jump) and seen.jump_age < STAND,
          lambda seen, _: f"its localisation {seen.jump}"),
    Fault("scan",      lambda seen, _: _old(seen.scan_age, SCAN_TIMEOUT),
          lambda seen, guard: f"the scan on {guard.scan} {seen.scan_lacks}" if seen.scan_lacks
              else _silent("scan", guard.scan, seen.scan_age, SCAN_TIMEOUT)),
    Fault("wheels",    lambda seen, guard: bool(seen.wheels) and seen.wheels_age < guard.tries,
          lambda seen, guard: f"{seen.wheels}; it tries again in {guard.tries:g} s"),
    Fault("command",   lambda seen, _: _old(seen.command_age, COMMAND.timeout),
          lambda seen, _: _silent("command", "its brain", seen.command_age, COMMAND.timeout)),
)
# fmt: on


def _silent(what: str, where: str, age: float | None, timeout: float) -> str:
    return (
        f"there is no {what} from {where} yet" if age is None else f"there was no {what} from {where} for {timeout:g} s"
    )
