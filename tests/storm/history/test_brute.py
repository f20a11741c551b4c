"""The brute-force search that judges joint plans is judged itself: by a plainer search, and by floors known by heart."""

from collections.abc import Collection, Sequence
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.storm.history.brute import can_all_arrive

Floor = Sequence[Collection[int]]
Stops = Sequence[Sequence[Collection[int]]]
Jam = tuple[Floor, list[int], Stops]

LINE = ((1,), (0, 2), (1, 3), (2,))  # 0 - 1 - 2 - 3
SIDING = ((1,), (0, 2, 4), (1, 3), (2,), (1,))  # the same with a siding, 4, beside 1


def all_states(neighbours: Floor, starts: Sequence[int], stops: Stops) -> bool:
    """Return True if all can arrive: every state is visited, and every robot is told from every other one."""
    todo = [tuple((cell, 0) for cell in starts)]
    seen: set[tuple[tuple[int, int], ...]] = set()
    while todo:
        state = tuple(
            (cell, done + 1) if done < len(row) and cell in row[done] else (cell, done)
            for (cell, done), row in zip(todo.pop(), stops, strict=True)
        )
        if state in seen:
            continue
        seen.add(state)
        if all(done == len(row) for (_, done), row in zip(state, stops, strict=True)):
            return True
        taken = {cell for cell, _ in state}
        todo.append(state)  # a second stop in the same cell
        for robot, (cell, done) in enumerate(state):
            free = set(neighbours[cell]) - taken
            todo.extend((*state[:robot], (other, done), *state[robot + 1 :]) for other in free)
    return False


@pytest.mark.parametrize(
    ("floor", "starts", "stops", "possible"),
    [
        (LINE, [0, 3], [[{3}], []], False),
        (LINE, [0, 3], [[{2}], [{2}]], True),
        (SIDING, [0, 3], [[{3}], [{0}]], True),
        (SIDING, [0, 4, 2], [[{3}], [{4}], [{0}]], False),
        (LINE, [0], [[{3}, {0}]], True),
        (LINE, [0, 1], [[], []], True),
    ],
)
def test_floors_known_by_heart(floor: Floor, starts: list[int], stops: Stops, possible: bool) -> None:
    assert can_all_arrive(floor, starts, stops) is possible


@st.composite
def jams(draw: st.DrawFn) -> Jam:
    cells = draw(st.integers(3, 6))
    joins = draw(st.sets(st.tuples(st.integers(0, cells - 1), st.integers(0, cells - 1)), max_size=3))
    joins |= set(pairwise(range(cells)))
    floor = [tuple({b for a, b in joins if a == c} | {a for a, b in joins if b == c} - {c}) for c in range(cells)]
    starts = draw(st.permutations(range(cells)))[: draw(st.integers(1, min(4, cells - 1)))]
    stop = st.integers(0, cells - 1).map(lambda cell: {cell})
    return floor, starts, [draw(st.lists(stop, max_size=2)) for _ in starts]


@given(jams())
def test_robots_that_are_alike_change_no_answer(jam: Jam) -> None:
    assert can_all_arrive(*jam) is all_states(*jam)


def test_a_jam_of_seven_is_proven_by_one_robot_that_cannot_get_out() -> None:
    """Nine cells, seven robots: the innermost one of a dead end stays there, since the others fill all the rest."""
    joins = {(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (5, 7), (7, 8), (8, 9), (9, 10), (10, 7)}
    floor = [tuple({b for a, b in joins if a == c} | {a for a, b in joins if b == c}) for c in range(11)]
    starts = [1, 2, 3, 7, 8, 9, 10]
    alone: Stops = [[{10}], *([] for _ in starts[1:])]
    assert can_all_arrive(floor, starts, alone) is False
    assert can_all_arrive(floor, starts[:-2], alone[:-2]) is True
