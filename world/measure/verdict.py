"""What the robots' planners say about a jam, and whether the world believes that it has no solution."""

from collections.abc import Collection
from math import isfinite
from typing import Final

from world.measure.state import VerdictState

PROVEN: Final = 5.0  # s without progress of anybody, since the proof and by the world's own watch, that end a run


class Verdict:
    """The last verdict on a jam, and the proof that it has no solution.

    One robot's word ends no run: every robot that has stops left stands still by the world's watch, and a second one of
    them says that it cannot get on, because it proves the same or because it waits.
    """

    def __init__(self) -> None:
        self.state = VerdictState()

    def take(self, robot: str, kind: str, text: str, time: float) -> bool:
        """Take in a note of a robot; return False if it repeats a proof that this robot has told already."""
        state = self.state
        repeated = kind == "unsolvable" and state.told.get(robot) == text
        if kind in {"unsolvable", "no_plan_found"}:
            state.text = text
        if kind == "unsolvable":
            state.told[robot] = text
            state.proofs.setdefault(robot, time)
        return not repeated

    def clear(self) -> None:
        """Forget the verdict: a robot has reached a stop. A proof that still holds is told again by its robot."""
        self.state.text, self.state.proofs = "", {}

    def ends(self, time: float, standing: dict[str, float], waiting: Collection[str]) -> bool:
        """Return True if the jam ends the run at a time [s].

        ``standing`` is how long [s] each robot has made no progress, infinite if it has no stop left; ``waiting`` are
        the robots that say that they wait.
        """
        proofs = self.state.proofs
        if not proofs or time - min(proofs.values()) < PROVEN or min(standing.values()) < PROVEN:
            return False
        under_way = [robot for robot, seconds in standing.items() if isfinite(seconds)]
        voices = [robot for robot in under_way if robot in proofs or robot in waiting]
        return len(voices) >= min(2, len(under_way))
