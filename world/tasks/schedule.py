"""What a scenario plans for its run, and when its time has come: edits of the floor, and requests to robots."""

from collections.abc import Iterator, Sequence
from typing import Generic, TypeVar

from swarm.messages import Edit, Kind, Order, RobotAction, RobotDo
from swarm.settings import EditSettings, OrderSettings

T = TypeVar("T", EditSettings, OrderSettings)


class Planned(Generic[T]):
    """The plans of one kind, in the order of their times."""

    def __init__(self, plans: Sequence[T]) -> None:
        self._plans: list[T] = sorted(plans, key=lambda plan: plan.at)
        self.passed = 0  # plans whose time has come

    @property
    def plans_left(self) -> Sequence[T]:
        """The plans whose time has not come."""
        return self._plans[self.passed :]

    def due(self, time: float) -> Iterator[T]:
        """Yield each plan whose time [s] has come, once."""
        while self.passed < len(self._plans) and self._plans[self.passed].at <= time + 1e-9:
            self.passed += 1
            yield self._plans[self.passed - 1]


def as_edit(planned: EditSettings) -> Edit:
    """Return an edit of a scenario in the form of a message."""
    return Edit(kind=Kind(planned.kind), low=planned.low, high=planned.high)


def as_request(planned: OrderSettings) -> Order | RobotAction:
    """Return a request of a scenario to a robot in the form of a message."""
    if planned.do is not None:
        return RobotAction(do=RobotDo(planned.do), radius=planned.radius)
    return Order(
        id=planned.id, update=planned.update, targets=planned.targets or [], home=planned.home,
        headings=planned.headings,
    )  # fmt: skip
