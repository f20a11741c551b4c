"""The reasons why a run cannot be repeated bit for bit, for its report."""

from collections.abc import Sequence
from typing import Final

from swarm.messages import Event

MOST: Final = 20  # reasons that are kept
REAL_TIME: Final = "in real time, what happens depends on the wall clock"


class Repeatable:
    """The reasons that a run has given so far; none: the same scenario, robots and seed give the same run again."""

    def __init__(self, *, lockstep: bool, outside: Sequence[str] = ()) -> None:
        self._always = [] if lockstep else [REAL_TIME]
        self._always += [f"the body of {name} is outside, and nobody knows what it does" for name in outside]
        self.begin()

    def begin(self) -> None:
        """Begin a run."""
        self.reasons: list[str] = [*self._always]

    def no_longer(self, reason: str, time: float) -> None:
        """Record what cannot be repeated and happened at a time [s]; before the first tick, everything can be."""
        if time > 0.0 and len(self.reasons) < MOST:
            self.reasons.append(f"{reason} at {time:.2f} s")

    def hear(self, event: Event) -> None:
        """Take in an event of the run."""
        if event.kind == "overdue":
            self.no_longer(f"{event.robot} {event.text}", event.time)
