"""All runs of the claim protocol for a few robots and cells: which states are reachable, and do holds overlap?

A state is each robot's reservations, the newest notice it has of each other, and what is on its way on each channel. Notices
travel as slowly as they like, overtake each other (then the older is dropped on arrival) and get lost. Stamps of
claims are picked freely, so that clocks may disagree.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple, TypeVar

from swarm.messages.traffic import Claim, Notice
from swarm.traffic.reservations.rules import (
    ASK,
    GRANT,
    TAKE,
    Acks,
    ClaimCase,
    Reservations,
    Rule,
    acknowledgements,
    find_violated_rule,
)

T = TypeVar("T")


class Told(NamedTuple):
    """The content of a notice."""

    held: tuple[int, ...] = ()
    claims: tuple[Claim, ...] = ()
    acks: Acks = ()


Views = tuple[tuple[Told, ...], ...]  # [receiver][sender]
Channels = tuple[tuple[tuple[Told, ...], ...], ...]  # [receiver][sender] -> what is under way, in the order sent


class State(NamedTuple):
    ledgers: tuple[Reservations, ...]
    views: Views
    channels: Channels


@dataclass(frozen=True)
class Model:
    robots: int
    cells: int
    claims: int  # each robot makes at most so many
    in_flight: int = 1  # notices under way on one channel; 0: they arrive at once or never
    stamps: tuple[int, ...] = (0, 1)
    grant: Mapping[str, Rule] = field(default_factory=lambda: GRANT)
    ask: Mapping[str, Rule] = field(default_factory=lambda: ASK)
    take: Mapping[str, Rule] = field(default_factory=lambda: TAKE)

    def start(self) -> State:
        """Nobody holds anything, and everybody is known to everybody."""
        row = tuple(Told() for _ in range(self.robots))
        return State((Reservations(),) * self.robots, (row,) * self.robots, (((),) * self.robots,) * self.robots)

    def successors(self, state: State) -> Iterator[tuple[str, State]]:
        """Everything that can happen next, with its name."""
        for robot in range(self.robots):
            for name, reservations in self._own_moves(robot, state.ledgers[robot], state.views[robot]):
                yield f"{robot} {name}", state._replace(ledgers=_with(state.ledgers, robot, reservations))
        for sender in range(self.robots):
            told = self._told(sender, state.ledgers[sender], state.views[sender])
            for receiver in range(self.robots):
                if receiver != sender:
                    yield from self._messages(state, told, sender, receiver)

    def _messages(self, state: State, told: Told, sender: int, receiver: int) -> Iterator[tuple[str, State]]:
        """Send (the notice may overtake or lose others), and let any of those under way arrive."""
        name = f"{sender} to {receiver}"
        queue = state.channels[receiver][sender]
        if not self.in_flight:
            yield f"{name} at once", self._arrive(state, told, sender, receiver, ())
            return
        if not queue or queue[-1] != told:
            yield f"{name} sends", _queued(state, (*queue, told)[-self.in_flight :], sender, receiver)
        for place, arriving in enumerate(queue):
            yield f"{name} arrives", self._arrive(state, arriving, sender, receiver, queue[place + 1 :])

    @staticmethod
    def _arrive(state: State, told: Told, sender: int, receiver: int, rest: tuple[Told, ...]) -> State:
        row = _with(state.views[receiver], sender, told)
        return _queued(state._replace(views=_with(state.views, receiver, row)), rest, sender, receiver)

    def _own_moves(self, robot: int, own: Reservations, view: tuple[Told, ...]) -> Iterator[tuple[str, Reservations]]:
        others = _others(robot, view)
        me = str(robot)
        if own.number <= self.claims:
            for cell in range(self.cells):
                wanted = cell not in own.held and all(claim.cell != cell for claim in own.claims)
                for stamp in self.stamps if wanted else ():
                    case = ClaimCase(Claim(cell, own.number, stamp), me, me, own, others)
                    if find_violated_rule(self.ask, case) is None:
                        yield f"claims {cell} at {stamp}", own.claim(cell, stamp)
        for claim in own.claims:
            yield f"withdraws {claim.cell}", own.withdraw([claim])
            case = ClaimCase(claim, me, me, own, others, near=frozenset(others))
            if find_violated_rule(self.take, case) is None:
                yield f"takes {claim.cell}", own.hold_claimed(claim)
        for cell in own.held:
            yield f"releases {cell}", own.keep_only(tuple(other for other in own.held if other != cell))

    def _told(self, robot: int, own: Reservations, view: tuple[Told, ...]) -> Told:
        return Told(own.held, own.claims, acknowledgements(str(robot), own, _others(robot, view), self.grant))

    def explore(self, depth: int = 1 << 30, states: int = 1 << 30) -> tuple[list[str] | None, int, bool]:
        """Visit every state, breadth first; give the shortest run to an overlap, the count, whether all was seen."""
        first = self.start()
        came: dict[State, tuple[State, str] | None] = {first: None}
        layer = [first]
        for _ in range(depth):
            following = []
            for state in layer:
                for name, new in self.successors(state):
                    if new in came:
                        continue
                    came[new] = (state, name)
                    if overlaps(new):
                        return _run_to(new, came), len(came), False
                    following.append(new)
                if len(came) > states:
                    return None, len(came), False
            layer = following
            if not layer:
                return None, len(came), True
        return None, len(came), False


def overlaps(state: State) -> bool:
    """Return True if a cell is held twice."""
    held = [cell for reservations in state.ledgers for cell in reservations.held]
    return len(held) > len(set(held))


@cache
def _others(robot: int, view: tuple[Told, ...]) -> dict[str, Notice]:
    return {
        str(other): Notice(robot=str(other), stamp=0, held=told.held, claims=told.claims, acks=told.acks)
        for other, told in enumerate(view)
        if other != robot
    }


def _with(row: tuple[T, ...], index: int, value: T) -> tuple[T, ...]:
    return (*row[:index], value, *row[index + 1 :])


def _queued(state: State, queue: tuple[Told, ...], sender: int, receiver: int) -> State:
    row = _with(state.channels[receiver], sender, queue)
    return state._replace(channels=_with(state.channels, receiver, row))


def _run_to(state: State, came: Mapping[State, tuple[State, str] | None]) -> list[str]:
    names: list[str] = []
    step = came[state]
    while step is not None:
        names.append(step[1])
        step = came[step[0]]
    return names[::-1]
