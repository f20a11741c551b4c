"""Whether a robot's wheels do what they are told: both wheels of what is asked and what is measured, smoothed. Pure."""

from dataclasses import dataclass, replace
from typing import Final

from swarm.motion.drive import ramp_wheels

SMOOTH: Final = 1.0  # s; a robot that accelerates less than the scenario says is late for less than that
LEAST: Final = 0.1  # m/s; slower wheels are not judged: many motors do not turn so slowly
SHARE: Final = 0.7  # of the speed that is asked; a wheel below it is too slow
NOTHING: Final = 0.1  # of that speed; a wheel below it does not turn
LONG: Final = 2.0  # s; for so long a wheel may be too slow

RimSpeeds = tuple[float, float]  # m/s: left, right


@dataclass(frozen=True, slots=True)
class Wheels:
    """What was asked of the wheels and what they did."""

    fastest: float  # m/s, the robot's top rim speed
    acceleration: float  # m/s2, largest change of a rim speed
    wanted: RimSpeeds = (0.0, 0.0)  # as a robot's wheels follow their commands that is as the scenario says
    asked: RimSpeeds = (0.0, 0.0)  # smoothed, without direction
    did: RimSpeeds = (0.0, 0.0)  # smoothed, in the direction that was asked for
    slow: float = 0.0  # s, for how long a wheel has been too slow
    well: float = 0.0  # s, for how long both have done what they were told

    def advance_wheels(self, command: RimSpeeds, measured: RimSpeeds, dt: float) -> "Wheels":
        """Return the state ``dt`` [s] later, in which the wheels were commanded and measured."""
        wanted = ramp_wheels(self.wanted, command, self.fastest, self.acceleration * dt)
        part = min(1.0, dt / SMOOTH)
        asked = [was + part * (abs(speed) - was) for was, speed in zip(self.asked, wanted, strict=True)]
        did = [
            was + part * ((seen if speed >= 0.0 else -seen) - was)
            for was, speed, seen in zip(self.did, wanted, measured, strict=True)
        ]
        judged = [(told, done) for told, done in zip(asked, did, strict=True) if told > LEAST]
        late = any(done < SHARE * told for told, done in judged)
        return replace(
            self,
            wanted=wanted,
            asked=(asked[0], asked[1]),
            did=(did[0], did[1]),
            slow=self.slow + dt if late else 0.0,
            well=self.well + dt if judged and not late else self.well * (not late),
        )

    def make_idle(self) -> "Wheels":
        """Return the state of wheels of which nothing is asked."""
        return Wheels(self.fastest, self.acceleration)

    @property
    def fault(self) -> str:
        """What is wrong with the wheels, or nothing."""
        if self.slow < LONG:
            return ""
        told, done, name = max(
            zip(self.asked, self.did, ("left", "right"), strict=True), key=lambda wheel: wheel[0] - wheel[1]
        )
        if done < NOTHING * told:
            return f"its {name} wheel does not turn though it was told {told:.2f} m/s; is an emergency stop pressed?"
        return f"its {name} wheel does {done:.2f} m/s and was told {told:.2f} m/s"
