"""The pool: a book of errands, targets that any robot may take. Each is waiting, taken by one robot, or done.

The book is pure: it knows no clock, no map and no bus. It keeps all errands that are open, and the last that are done.
"""

from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from typing import Final

from msgspec import Struct

from swarm.errors import PeerError
from swarm.maps.occupancy import Point
from swarm.messages import PoolCounts, PoolTargets
from swarm.messages.short_ids import find_long_id
from world.tasks.orders import REMEMBERED, OrderChange

MOST_TARGETS: Final = 100  # of a request; each is checked between two ticks
MOST_OPEN: Final = 1000  # errands that are not done; each snapshot has them all
SCENARIO: Final = "scenario"  # name of the request that stands in the scenario


class TaskStage(StrEnum):
    """What has become of an errand."""

    WAITING = "waiting"
    TAKEN = "taken"
    DONE = "done"


class TaskChange(StrEnum):
    """What changes the stage of an errand. The texts say why an errand goes back."""

    TAKEN = "a robot takes it"
    REACHED = "the robot is there"
    GIVEN_UP = "it finds no path"
    REPLACED = "it has other targets now"
    LOST = "it has not answered for long"
    STUCK = "it got no nearer for long, and another one waits"


# fmt: off
TRANSITIONS: Final[dict[TaskStage, dict[TaskChange, TaskStage]]] = {
    TaskStage.WAITING: {TaskChange.TAKEN: TaskStage.TAKEN},
    TaskStage.TAKEN:   {TaskChange.REACHED: TaskStage.DONE, TaskChange.GIVEN_UP: TaskStage.WAITING,
                        TaskChange.REPLACED: TaskStage.WAITING, TaskChange.LOST: TaskStage.WAITING,
                        TaskChange.STUCK: TaskStage.WAITING},
    TaskStage.DONE:    {},
}
# fmt: on


class Errand(Struct, kw_only=True, forbid_unknown_fields=True):
    """One target of the pool."""

    request: str  # name of the request that gave it
    number: int  # in that request, from 1
    at: Point  # m
    given: float  # s
    stage: TaskStage = TaskStage.WAITING
    robot: int | None = None  # who has it, or has done it
    assignment: int = 0  # number of the robot's stops while it has this errand
    ended: float | None = None  # s, when it was done
    refused: list[int] = []  # robots that found no path to it on the floor as it is
    last: list[int] = []  # robots that got stuck on the way to it: they take any other one first

    @property
    def name(self) -> str:
        """The name of the errand for people."""
        return f"{self.request}/{self.number}"


class TaskPool(Struct, array_like=True, forbid_unknown_fields=True):
    """The targets that any free robot may take, in one run, as a snapshot saves them."""

    given: int = 0
    done: int = 0
    open: dict[str, Errand] = {}  # by name, oldest first
    closed: dict[str, Errand] = {}  # those done last, the newest last
    requests: dict[str, list[Point]] = {}  # the targets of each request, the newest last

    @classmethod
    def pool_of(cls, targets: Sequence[Point]) -> "TaskPool":
        """Return a pool that begins with the ``targets`` [m] of the scenario."""
        pool = cls()
        if targets:
            pool._enter(SCENARIO, targets, 0.0)
        return pool

    @property
    def waiting(self) -> list[Errand]:
        """Errands that no robot has, oldest first."""
        return [errand for errand in self.open.values() if errand.stage is TaskStage.WAITING]

    @property
    def taken_errands(self) -> list[Errand]:
        """Errands that robots have, oldest first."""
        return [errand for errand in self.open.values() if errand.stage is TaskStage.TAKEN]

    @property
    def counts(self) -> PoolCounts | None:
        """How far the pool is; None if nothing was ever put in."""
        if not self.given:
            return None
        return PoolCounts(given=self.given, done=self.done, taken=len(self.taken_errands), waiting=len(self.waiting))

    def add(self, request: PoolTargets, time: float, check: Callable[[Sequence[Point]], None]) -> OrderChange:
        """Put targets into the pool at a time [s]; ``check`` raises for targets that no robot can reach.

        The same request said again changes nothing and has the same answer.

        Raises:
            PeerError: the id was given with other targets, the targets are wrong, or too many are open.
        """
        name, targets = find_long_id(request.id, self.requests), list(request.targets)
        known = self.requests.get(name)
        if known is not None:
            if known != targets:
                raise PeerError(
                    f"pool {name}: expected the targets that were accepted with it, got others; use a new id"
                )
            return OrderChange(_accept_targets(name, known))
        if not 1 <= len(targets) <= MOST_TARGETS:
            raise PeerError(
                f"pool {name}: expected 1 to {MOST_TARGETS} targets, got {len(targets)}; send the others later"
            )
        if len(self.open) + len(targets) > MOST_OPEN:
            raise PeerError(
                f"pool {name}: expected at most {MOST_OPEN} targets that are not done, got {len(targets)} beside the "
                f"{len(self.open)} that there are; send them later"
            )
        check(targets)
        self._enter(name, targets, time)
        text = _accept_targets(name, targets)
        return OrderChange(text, changed=True, events=(("pool", text.removeprefix("pool ")),))

    def _enter(self, name: str, targets: Sequence[Point], time: float) -> None:
        for number, at in enumerate(targets, start=1):
            errand = Errand(request=name, number=number, at=at, given=time)
            self.open[errand.name] = errand
        self.given += len(targets)
        self.requests[name] = list(targets)
        still = {errand.request for errand in self.open.values()}
        over = [one for one in self.requests if one not in still]
        for one in over[: max(0, len(self.requests) - REMEMBERED)]:
            del self.requests[one]

    def take(self, errand: Errand, occasion: TaskChange) -> None:
        """Change the stage of an errand as the table says.

        Raises:
            ValueError: the table has no such row; nothing has changed.
        """
        row = TRANSITIONS[errand.stage]
        if occasion not in row:
            allowed = ", ".join(row) or "none"
            raise ValueError(
                f"pool target {errand.name}: expected one of ({allowed}) while {errand.stage}, got {occasion}"
            )
        errand.stage = row[occasion]

    def hand_to(self, errand: Errand, robot: int, assignment: int) -> None:
        """Record that a robot has an errand, as the stops of that number."""
        self.take(errand, TaskChange.TAKEN)
        errand.robot, errand.assignment = robot, assignment

    def put_back(self, errand: Errand, why: TaskChange) -> None:
        """Record that an errand waits again."""
        robot = errand.robot
        self.take(errand, why)
        if why is TaskChange.GIVEN_UP and robot is not None:
            errand.refused.append(robot)
        if why is TaskChange.STUCK and robot is not None and robot not in errand.last:
            errand.last.append(robot)
        errand.robot, errand.assignment = None, 0

    def close(self, errand: Errand, time: float) -> None:
        """Record that an errand was done at a time [s]."""
        self.take(errand, TaskChange.REACHED)
        errand.ended = time
        del self.open[errand.name]
        self.closed[errand.name] = errand
        self.done += 1
        if len(self.closed) > REMEMBERED:
            del self.closed[next(iter(self.closed))]

    def offer_all_again(self) -> None:
        """Offer all errands to all robots again: the floor has changed."""
        for errand in self.open.values():
            errand.refused.clear()
            errand.last.clear()

    def describe_left(self) -> Iterator[str]:
        """Yield a few words on each errand that is not done."""
        for errand in self.open.values():
            yield f"pool target {errand.name} at ({errand.at[0]:g}, {errand.at[1]:g})"


def _accept_targets(name: str, targets: Sequence[Point]) -> str:
    count = len(targets)
    return f"pool {name}: {count} target{'s' * (count > 1)} for any robot"
