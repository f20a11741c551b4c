"""The orders of one bridge that are under way, of any number of robots; each of them ends once. Pure."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial

from swarm.bridge.errand import OrderEnd, OrderErrand
from swarm.messages import Message, Status


class Errands:
    """The errands that have not ended yet. Whoever takes messages in for it asks the world when it ``asks``."""

    def __init__(self) -> None:
        self._open: list[OrderErrand] = []
        self._doubts = False
        self._world: str | None = None  # identity of the last one that was heard of

    def __iter__(self) -> Iterator[OrderErrand]:
        return iter(tuple(self._open))

    def __len__(self) -> int:
        return len(self._open)

    def add(self, errand: OrderErrand) -> None:
        """Follow one more, before any message is taken in that was sent after the order was accepted."""
        errand.world = self._world
        self._open.append(errand)

    def mark_all_unsure(self) -> None:
        """Ask the world about all of them: messages may have been lost."""
        self._doubts = True

    @property
    def has_to_ask(self) -> bool:
        """True if the world has to be asked for its clock, its status and its last events."""
        return bool(self._open) and (self._doubts or any(errand.asks for errand in self._open))

    def apply_messages(self, messages: Iterable[Message]) -> list[tuple[OrderErrand, OrderEnd]]:
        """Take in messages as they came; return the errands that have ended by them."""
        ended = []
        for message in messages:
            ended += self._drop_ended(partial(OrderErrand.apply_message, message=message))
            if isinstance(message, Status):
                self._world = message.world
        return ended

    def apply_answers(self, messages: Iterable[Message]) -> list[tuple[OrderErrand, OrderEnd]]:
        """Take in what the world has answered; return the errands that have ended, by that or without a word."""
        self._doubts = False
        asked = {id(errand) for errand in self._open if errand.asks}
        for errand in self._open:
            errand.asks = False
        return [
            *self.apply_messages(messages),
            *self._drop_ended(lambda one: one.end_of_lost_order() if id(one) in asked else None),
        ]

    def end_all_without_world(self, silence: float) -> list[tuple[OrderErrand, OrderEnd]]:
        """Return the end of all errands: the fleet has had no world for so long [s]."""
        return self._drop_ended(lambda one: one.end_without_world(silence))

    def _drop_ended(self, end_of: Callable[[OrderErrand], OrderEnd | None]) -> list[tuple[OrderErrand, OrderEnd]]:
        """Return the errands that have an end, and follow them no longer."""
        ends = [(errand, end) for errand in self._open if (end := end_of(errand)) is not None]
        self._open = [errand for errand in self._open if all(errand is not one for one, _ in ends)]
        return ends
