"""What the robots' planners say about a jam, and whether the world believes that it has no solution."""

from collections.abc import Collection
from math import isfinite
from typing import Final, NamedTuple

PROVEN: Final = 5.0  # s without progress of anybody, since the proof and by the world's own watch, that end a run


class VerdictState(NamedTuple):
    """The state of `Verdict`."""

    text: str
    proofs: dict[str, float]
    told: dict[str, str]


class Verdict:
    """The last verdict on a jam, and the proof that it has no solution.

    One robot's word ends no run: every robot that has stops left stands still by the world's watch, and a second one of
    them says that it cannot get on, because it proves the same or because it waits.
    """

    def __init__(self) -> None:
        self.text = ""
        self._proofs: dict[str, float] = {}  # robot -> when it first said that its jam has no solution [s]
        self._told: dict[str, str] = {}  # robot -> the last proof that it told, which is no news a second time

    @property
    def state(self) -> VerdictState:
        """The state, which shares its values with this object."""
        return VerdictState(self.text, self._proofs, self._told)

    def restore(self, state: VerdictState) -> None:
        """Continue from a state."""
        self.text, self._proofs, self._told = state

    def take(self, robot: str, kind: str, text: str, time: float) -> bool:
        """Take in a note of a robot; return False if it repeats a proof that this robot has told already."""
        repeated = kind == "unsolvable" and self._told.get(robot) == text
        if kind in {"unsolvable", "no_plan_found"}:
            self.text = text
        if kind == "unsolvable":
            self._told[robot] = text
            self._proofs.setdefault(robot, time)
        return not repeated

    def clear(self) -> None:
        """Forget the verdict: a robot has reached a stop. A proof that still holds is told again by its robot."""
        self.text, self._proofs = "", {}

    def ends(self, time: float, standing: dict[str, float], waiting: Collection[str]) -> bool:
        """Return True if the jam ends the run at a time [s].

        ``standing`` is how long [s] each robot has made no progress, infinite if it has no stop left; ``waiting`` are
        the robots that say that they wait.
        """
        if not self._proofs or time - min(self._proofs.values()) < PROVEN or min(standing.values()) < PROVEN:
            return False
        under_way = [robot for robot, seconds in standing.items() if isfinite(seconds)]
        voices = [robot for robot in under_way if robot in self._proofs or robot in waiting]
        return len(voices) >= min(2, len(under_way))
