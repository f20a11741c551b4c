"""How far a robot is on its way: the cells it holds, those to come, and what it has left behind."""

from collections.abc import Collection, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

from swarm.messages.traffic import Claim
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.reservations.rules import Reservations

ALONE: Final = -1  # step of a cell that belongs to no joint plan
BESIDE: Final = -2  # step of a cell that is not on the way: the body or its brake reaches into it, or it is room


Join = tuple[int, int]  # two cells between which a robot passes


def shut_joins(way: Sequence[int], cells: CellMap) -> tuple[Join, ...]:
    """List the joins of a way that a floor does not have."""
    return tuple((a, b) for a, b in pairwise(way) if a != b and b not in cells.neighbours[a])


class RouteProgress(NamedTuple):
    """A way over the cells: ``reservations.held`` is under the robot and ahead of it, ``route`` follows.

    ``steps`` holds the step of each held cell in the joint plan followed: ALONE without a plan, BESIDE off the way.
    """

    reservations: Reservations
    steps: tuple[int, ...]
    route: tuple[int, ...] = ()
    following: bool = False
    sought: bool = False  # the route, even if it is empty, comes from a search for a way of its own

    @property
    def head(self) -> int:
        """The last cell held."""
        return self.reservations.held[-1]

    @property
    def left(self) -> int:
        """The number of cells of the joint plan that lie behind."""
        for step in self.steps:
            if step != BESIDE:
                return max(0, step)
        return 0

    @property
    def on_way(self) -> int:
        """The number of held cells that are on the way."""
        return len(self.steps) - self.steps.count(BESIDE)

    @property
    def next_step(self) -> int:
        """The step in the joint plan of the first cell of the route."""
        return self.steps[-1] + 1

    def place(self, body: int) -> int:
        """Return the index of the body's cell in the held cells, the last one if it is there twice; 0 if it is not."""
        held = self.reservations.held
        return len(held) - 1 - held[::-1].index(body) if body in held else 0

    def onto(self, way: tuple[int, ...]) -> "RouteProgress":
        """Return the progress on the way of a joint plan, which begins at the head."""
        return self._replace(steps=(*self._as_if_alone()[:-1], 0), route=way[1:], following=True, sought=False)

    def alone(self, route: tuple[int, ...]) -> "RouteProgress":
        """Return the progress on a way of its own, as a search found it."""
        return self._replace(steps=self._as_if_alone(), route=route, following=False, sought=True)

    def nowhere(self) -> "RouteProgress":
        """Return the progress without a way."""
        return self._replace(steps=self._as_if_alone(), route=(), following=False, sought=False)

    def _as_if_alone(self) -> tuple[int, ...]:
        return tuple(min(step, ALONE) for step in self.steps)

    def strayed(self, body: int) -> bool:
        """Return True if the body is off the way."""
        return self.steps[self.place(body)] == BESIDE

    def is_beside(self, body: int, cells: CellMap) -> bool:
        """Return True if a cell is next to a held cell of the way."""
        way = {cell for cell, step in zip(self.reservations.held, self.steps, strict=True) if step != BESIDE}
        return body != OUTSIDE and not way.isdisjoint(cells.neighbours[body])

    def grown(self, reservations: Reservations) -> "RouteProgress":
        """Go on to the first cell of the route, which is now the head in ``reservations``."""
        step = self.next_step if self.following else ALONE
        return self._replace(reservations=reservations, steps=(*self.steps, step), route=self.route[1:])

    def widened(self, cells: Collection[int]) -> "RouteProgress":
        """Hold these cells too, beside the way."""
        extra = tuple(sorted(set(cells).difference(self.reservations.held)))
        if not extra:
            return self
        return self._replace(
            reservations=self.reservations.keep((*extra, *self.reservations.held)),
            steps=(BESIDE,) * len(extra) + self.steps,
        )

    def without_claims(self) -> "RouteProgress":
        """Withdraw every claim."""
        reservations = self.reservations.withdraw(self.reservations.all_claims)
        return self if reservations is self.reservations else self._replace(reservations=reservations)

    def without_stale_claims(self) -> "RouteProgress":
        """Withdraw the claims that do not match the beginning of the route."""
        claims = self.reservations.claims
        good = 0
        while good < min(len(claims), len(self.route)) and claims[good].cell == self.route[good]:
            good += 1
        return self._replace(reservations=self.reservations.withdraw(claims[good:])) if good < len(claims) else self

    def with_room(self, claim: Claim) -> "RouteProgress":
        """Hold a cell beside the way whose claim was granted."""
        reservations = self.reservations.withdraw([claim])
        return self._replace(
            reservations=reservations.keep((claim.cell, *reservations.held)), steps=(BESIDE, *self.steps)
        )

    def released(self, touched: Collection[int], body: int, room: Collection[int] = ()) -> "RouteProgress":
        """Release the cells behind the body, once the braking path is clear of them or they are held again further on.

        Cells beside the way stay while they are in ``room``.
        """
        held = self.reservations.held
        place = self.place(body)
        if place == 0:
            return self
        keep = [
            index
            for index, cell in enumerate(held)
            if (index >= place and (self.steps[index] != BESIDE or index == place))
            or ((cell in touched or (cell in room and self.steps[index] == BESIDE)) and cell not in held[index + 1 :])
        ]
        if len(keep) == len(held):
            return self
        reservations = self.reservations.keep(tuple(held[index] for index in keep))
        return self._replace(reservations=reservations, steps=tuple(self.steps[index] for index in keep))

    def over(self, cells: CellMap, touched: Collection[int], body: int) -> "RouteProgress":
        """Return the progress on another floor: held cells stay as far as they are joined; all that is ahead is void.

        Cells that the body and its brake are in stay in any case. No new cell is held.
        """
        held, place = self.reservations.held, self.place(body)
        end = place + 1
        while end < len(held) and held[end] in cells.neighbours[held[end - 1]]:
            end += 1
        kept = [index for index, cell in enumerate(held) if index < end or cell in touched]
        order = [index for index in kept if index != end - 1] + [end - 1]
        steps = tuple(BESIDE if index >= end else min(self.steps[index], ALONE) for index in order)
        return RouteProgress(Reservations(tuple(held[index] for index in order), (), self.reservations.number), steps)

    def shut(self, cells: CellMap, body: int, *, route: bool = True) -> tuple[Join, ...]:
        """List the joins ahead that a floor does not have; those beyond the held cells only if ``route``."""
        held, place = self.reservations.held, self.place(body)
        ahead = [cell for cell, step in zip(held[place:], self.steps[place:], strict=True) if step != BESIDE]
        return shut_joins((*ahead, *(self.route if route else ())), cells)

    def awoken(self, touched: Collection[int]) -> "RouteProgress":
        """Drop the claims and the held cells ahead of the body, to be claimed again; the way stays the same."""
        held = self.reservations.held
        end = 1 + max(index for index, cell in enumerate(held) if cell in touched)
        reservations = Reservations(held[:end], (), self.reservations.number)
        return self._replace(reservations=reservations, steps=self.steps[:end], route=(*held[end:], *self.route))

    def given_back(self, touched: Collection[int]) -> "RouteProgress":
        """Drop the plan, the claims, and the held cells ahead of the braking path; then turn round if that helps.

        A robot that has stopped across two cells drives back: the cell further back becomes the head.
        """
        held = self.reservations.held
        last = max((index for index, cell in enumerate(held) if cell in touched), default=0)
        kept = tuple(dict.fromkeys(held[: last + 1]))[::-1]
        return RouteProgress(Reservations(kept, (), self.reservations.number), (ALONE,) * len(kept))
