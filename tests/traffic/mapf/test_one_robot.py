"""Plans for one robot while the others make room: held against a search that keeps every configuration."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.traffic.lattice.distances import FAR
from swarm.traffic.mapf.check import list_plan_faults
from swarm.traffic.mapf.lacam import SearchState
from swarm.traffic.mapf.one_robot import OneRobot
from tests.traffic.maps import Drawn

FLOORS = (
    ("....", "#.#.", "...."),
    (".....", ".#.#.", ".#..."),
    ("#.#", "...", "#.#"),
    (".......", "###.###"),
    ("...#...", "#....##", "..#...."),
    ("..#..", ".....", "..#.."),
)


def searched(floor: Drawn, starts: tuple[int, ...], goal: int, robot: int = 0, share: int = 10**6) -> OneRobot:
    search = OneRobot(floor.cells.neighbours, floor.cells.distances(goal), starts, robot)
    while search.advance(share) is SearchState.RUNNING:
        pass
    return search


def reached(neighbours: Sequence[Sequence[int]], start: int, others: frozenset[int]) -> set[int]:
    """Return the cells that a robot gets to: every configuration is tried, the others being alike."""
    seen, waiting = {(start, others)}, [(start, others)]
    while waiting:
        here, rest = waiting.pop()
        moves = [(to, rest) for to in neighbours[here] if to not in rest]
        moves += [
            (here, rest - {cell} | {to}) for cell in rest for to in neighbours[cell] if to not in rest and to != here
        ]
        new = [move for move in set(moves) if move not in seen]
        seen.update(new)
        waiting += new
    return {here for here, _ in seen}


@given(floor=st.sampled_from(FLOORS), data=st.data())
def test_a_plan_is_found_exactly_where_one_robot_can_get(floor: tuple[str, ...], data: st.DataObject) -> None:
    drawn = Drawn(*floor)
    cells = [cell for cell in range(len(drawn.cells)) if drawn.cells.stands[cell]]
    count = data.draw(st.integers(1, min(7, len(cells) - 1)))
    starts = tuple(data.draw(st.permutations(cells))[:count])
    goal, robot = data.draw(st.sampled_from(cells)), data.draw(st.integers(0, count - 1))
    search = searched(drawn, starts, goal, robot)
    others = frozenset(starts) - {starts[robot]}
    if goal not in reached(drawn.cells.neighbours, starts[robot], others):
        assert search.state is SearchState.UNSOLVABLE
        return
    assert search.state is SearchState.SOLVED
    joined = {cell: drawn.cells.neighbours[cell] for cell in cells}
    assert list_plan_faults(search.steps, starts=starts, goals=search.steps[-1], joined=joined) == []
    assert search.steps[-1][robot] == goal


@pytest.mark.parametrize(
    ("pocket", "state"),
    [
        ("#########.#########", SearchState.SOLVED),  # the seven others pass it while it stands in the pocket
        ("###.###############", SearchState.UNSOLVABLE),  # only three of them find room on its other side
    ],
)
def test_it_ends_soon_where_configurations_are_a_million(pocket: str, state: SearchState) -> None:
    floor = Drawn("a.b.c.d.e.f.g.h...i", pocket)
    search = searched(floor, floor.at("abcdefgh"), floor.at("i")[0])
    assert search.state is state
    assert search.expansions < 2000


def test_the_share_of_a_step_does_not_change_the_plan() -> None:
    floor = Drawn("a.b.c", ".#.#.", "d...e")
    starts, goal = floor.at("abcde"), floor.at("e")[0]
    assert searched(floor, starts, goal, share=1).steps == searched(floor, starts, goal).steps


def test_a_goal_that_is_shut_off_is_proven_at_once() -> None:
    floor = Drawn("a.#b")
    assert floor.cells.distances(floor.at("b")[0])[floor.at("a")[0]] == FAR
    assert searched(floor, floor.at("a"), floor.at("b")[0]).state is SearchState.UNSOLVABLE
