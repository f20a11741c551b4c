"""Whether a robot may drive. Pure: what is seen comes in, and why the robot stands comes out.

The faults are a table; the first that holds is told. While one holds the robot gets twists of 0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from swarm.messages import BODY, COMMAND

SCAN_TIMEOUT: Final = 0.5  # s; lidars turn 5 to 10 times a second
STAND: Final = 1.0  # s without a jump, after one; and for which the fleet may have the robot elsewhere
ALONE: Final = 2.0  # m of way without a localisation: AMCL tells it every 0.25 m (its update_min_d)
FIRST_TRY: Final = 2.0  # s that a robot stands whose wheels did not do what they were told; then twice as long, ...
LAST_TRY: Final = 16.0  # s, ... up to this


class GuardInputs(NamedTuple):
    """What this process knows at one moment. Ages are in s; None: never came."""

    odometry_age: float | None
    known: bool  # where the robot is
    lost: str  # why that is not known any more
    jump: str  # of the last time that it was known, or nothing
    jump_age: float
    apart_for: float  # s, for how long the fleet has had it elsewhere than it was reported
    scan_age: float | None  # of the last one with all rays; 0 if none is asked for
    scan_lacks: str
    alone: float  # m, driven since the last localisation
    stop: bool | None  # None: not known
    wheels: str  # what is wrong with them
    wheels_age: float  # since that was found
    command_age: float | None


class StandReason(NamedTuple):
    """A reason to stand."""

    name: str
    holds: Callable[[GuardInputs, "Guard"], bool]
    text: Callable[[GuardInputs, "Guard"], str]


@dataclass
class Guard:
    """The topics that are asked for, and for how long a robot stands after its wheels' last fault."""

    robot: str
    odometry: str | None
    localisation: str | None
    scan: str | None
    stop: str | None
    tries: float = FIRST_TRY  # s

    def find_fault(self, seen: GuardInputs) -> tuple[str, str] | None:
        """Return the name and the text of the first fault that holds; None: the robot may drive."""
        found = next((fault for fault in FAULTS if fault.holds(seen, self)), None)
        return None if found is None else (found.name, found.text(seen, self))

    def has_old_scan(self, seen: GuardInputs) -> bool:
        """Return True if the scan is too old to be told."""
        return _is_old(seen.scan_age, SCAN_TIMEOUT)


def _is_old(age: float | None, most: float) -> bool:
    return age is None or age > most


# fmt: off
FAULTS: Final = (
    StandReason("stop",     lambda seen, _: bool(seen.stop),
          lambda seen, guard: f"an emergency stop is pressed, by {guard.stop}"),
    StandReason("no stop",  lambda seen, _: seen.stop is None,
          lambda seen, guard: f"nothing usable has come on {guard.stop} yet, which tells of the emergency stop"),
    StandReason("odometry", lambda seen, _: _is_old(seen.odometry_age, BODY.timeout),
          lambda seen, guard: _format_silence(guard.odometry or guard.localisation, seen.odometry_age, BODY.timeout)),
    StandReason("lost",     lambda seen, _: bool(seen.lost),
          lambda seen, guard: f"{seen.lost}; nobody knows where it is until " + (
              f"{guard.localisation} tells" if guard.localisation
              else "it stands where the fleet shows it and this program is started again")),
    StandReason("unknown",  lambda seen, _: not seen.known,
          lambda seen, guard: _format_silence(guard.localisation, None, 0.0) if guard.localisation
              else "the fleet has not told yet where it begins"),
    StandReason("alone",    lambda seen, _: seen.alone > ALONE,
          lambda seen, guard: f"nothing usable has come on {guard.localisation} for {ALONE:g} m of its way"),
    StandReason("jump",     lambda seen, _: bool(seen.jump) and seen.jump_age < STAND,
          lambda seen, _: seen.jump),
    StandReason("apart",    lambda seen, _: seen.apart_for > STAND,
          lambda seen, guard: "the fleet has it elsewhere than it is; is it on the map, and was the world started "
              f"with --body {guard.robot}?"),
    StandReason("rays",     lambda seen, guard: bool(seen.scan_lacks) and guard.has_old_scan(seen),
          lambda seen, guard: f"the scan on {guard.scan} {seen.scan_lacks}"),
    StandReason("scan",     lambda seen, guard: guard.has_old_scan(seen),
          lambda seen, guard: _format_silence(guard.scan, seen.scan_age, SCAN_TIMEOUT)),
    StandReason("wheels",   lambda seen, guard: bool(seen.wheels) and seen.wheels_age < guard.tries,
          lambda seen, guard: f"{seen.wheels}; it tries again in {guard.tries:g} s"),
    StandReason("command",  lambda seen, _: _is_old(seen.command_age, COMMAND.timeout),
          lambda seen, _: "its brain has not commanded anything yet" if seen.command_age is None
              else f"its brain has commanded nothing for {COMMAND.timeout:g} s"),
)
# fmt: on


def _format_silence(topic: str | None, age: float | None, timeout: float) -> str:
    return f"nothing usable has come on {topic} " + ("yet" if age is None else f"for {timeout:g} s")
