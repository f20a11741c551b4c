"""A*, compared with independent solvers and with the published optimum of every row of three scenarios."""

import hashlib
import subprocess
import sys
from itertools import pairwise
from math import inf, isclose, sqrt

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from swarm.maps.movingai import from_movingai, from_scen
from swarm.maps.occupancy import FREE, Cell
from swarm.planning.astar import STAMPS, Lattice, shortest
from swarm.planning.path_check import check_cells
from swarm.planning.solve import solve_scen
from tests.planning.shared import grids
from tests.shared import DATA, needs_data


def legal_steps(free: NDArray[np.bool_]) -> list[tuple[int, int, float]]:
    """List every legal step by the plainest reading of the rule: (cell number, cell number, length)."""
    rows, columns = free.shape
    steps = []
    for row, column in np.argwhere(free).tolist():
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                r, c = row + dr, column + dc
                if (dr, dc) == (0, 0) or not (0 <= r < rows and 0 <= c < columns) or not free[r, c]:
                    continue
                if dr and dc and not (free[row, c] and free[r, column]):
                    continue
                steps.append((row * columns + column, r * columns + c, sqrt(2) if dr and dc else 1.0))
    return steps


@given(free=grids(), data=st.data())
def test_lengths_are_those_of_dijkstra(free: NDArray[np.bool_], data: st.DataObject) -> None:
    size, columns = free.size, free.shape[1]
    steps = legal_steps(free)
    graph = csr_array(([s[2] for s in steps], ([s[0] for s in steps], [s[1] for s in steps])), shape=(size, size))
    lattice = Lattice.of(free)
    for _ in range(4):
        start, goal = data.draw(st.integers(0, size - 1)), data.draw(st.integers(0, size - 1))
        found = shortest(lattice, divmod(start, columns), divmod(goal, columns))
        if not (free.flat[start] and free.flat[goal]):
            assert found is None
            continue
        expected = float(dijkstra(graph, indices=start)[goal])
        assert (inf if found is None else found[0]) == pytest.approx(expected, abs=1e-9)
        if found is not None:
            assert not check_cells(free, divmod(start, columns), divmod(goal, columns), found[1], found[0])


@given(free=grids(9), costs=st.lists(st.integers(64, 448), min_size=81, max_size=81), data=st.data())
def test_costs_are_those_of_networkx(free: NDArray[np.bool_], costs: list[int], data: st.DataObject) -> None:
    size, columns = free.size, free.shape[1]
    cost = np.array(costs[:size], np.int16).reshape(free.shape)
    flat = cost.reshape(-1).tolist()
    graph = nx.DiGraph()
    graph.add_nodes_from(range(size))
    for a, b, length in legal_steps(free):
        graph.add_edge(a, b, weight=(1393 if length > 1 else 985) * (flat[a] + flat[b]))
    start, goal = data.draw(st.integers(0, size - 1)), data.draw(st.integers(0, size - 1))
    found = Lattice.of(free).cheapest(cost, 64, divmod(start, columns), divmod(goal, columns))
    if not (free.flat[start] and free.flat[goal] and nx.has_path(graph, start, goal)):
        assert found is None
        return
    assert found is not None
    way = [row * columns + column for row, column in found[1]]
    paid = sum(graph[a][b]["weight"] for a, b in pairwise(way))
    assert paid == nx.dijkstra_path_length(graph, start, goal)


CORNERS = {
    "an open room": ("...\n...\n...", (0, 0), (2, 2), 2 * sqrt(2)),
    "a corner may not be cut": ("...\n.@.\n...", (0, 0), (2, 2), 4.0),
    "a diagonal gap is no gap": (".@\n@.", (0, 0), (1, 1), None),
    "one blocked side is enough to forbid a diagonal": ("..\n.@", (1, 0), (0, 1), 2.0),
    "the other side too": ("@.\n..", (1, 0), (0, 1), 2.0),
    "already there": ("...", (0, 1), (0, 1), 0.0),
    "start in solid": ("@..", (0, 0), (0, 2), None),
    "goal in solid": ("..@", (0, 0), (0, 2), None),
    "outside": ("...", (0, 0), (0, 3), None),
    "before the first cell": ("...", (-1, 0), (0, 2), None),
    "walled off": (".@.", (0, 0), (0, 2), None),
    "a single cell": (".", (0, 0), (0, 0), 0.0),
    "round a wall": ("....\n@@@.\n....", (0, 0), (2, 0), 8.0),
}


@pytest.mark.parametrize(("drawing", "start", "goal", "length"), CORNERS.values(), ids=CORNERS)
def test_rule(drawing: str, start: Cell, goal: Cell, length: float | None) -> None:
    free = np.array([[symbol == "." for symbol in line] for line in drawing.split("\n")])
    found = shortest(free, start, goal)
    if length is None:
        assert found is None
    else:
        assert found is not None
        assert isclose(found[0], length)
        assert not check_cells(free, start, goal, found[1], length)


SMALL = """type octile
height 6
width 8
map
........
.@@@@@T.
.@....O.
.@.@@.W.
...@...G
@@@@SSSS
"""


def test_small_scenario_of_our_own() -> None:
    rows = "version 1\n" + "\n".join(
        f"0\tsmall.map\t8\t6\t{x0}\t{y0}\t{x1}\t{y1}\t{length}"
        for x0, y0, x1, y1, length in (
            (0, 0, 7, 0, 7),
            (2, 2, 5, 4, 5.0),
            (0, 4, 4, 5, 10.414213562),
            (0, 4, 7, 0, 11),
            (0, 0, 7, 4, 11),
        )
    )
    grid = from_movingai(SMALL)
    free = grid.cells == FREE
    for start, goal, optimal in from_scen(rows, grid):
        found = shortest(free, start, goal)
        assert found is not None
        steps = legal_steps(free)
        graph = csr_array(([s[2] for s in steps], ([s[0] for s in steps], [s[1] for s in steps])), shape=(48, 48))
        by_dijkstra = float(dijkstra(graph, indices=start[0] * 8 + start[1])[goal[0] * 8 + goal[1]])
        assert optimal == pytest.approx(by_dijkstra, abs=1e-6)
        assert not check_cells(free, start, goal, found[1], optimal)


def test_answers_stay_right_when_the_stamps_run_out() -> None:
    free = np.random.default_rng(3).random((12, 12)) > 0.2
    free[0, 0] = free[11, 11] = free[0, 11] = True
    free[0, 10] = free[1, 10] = free[1, 11] = False
    lattice = Lattice.of(free)
    expected = lattice.shortest((0, 0), (11, 11))
    assert expected is not None
    for _ in range(STAMPS - 2):
        lattice.shortest((0, 11), (0, 11))  # no other cell is touched
    for _ in range(3):
        assert lattice.shortest((0, 0), (11, 11)) == expected
        assert lattice.shortest((11, 11), (0, 0)) is not None


def test_queue_grows_when_it_has_to() -> None:
    """Costs that vary make many cells worth a look at once: 1672 entries, and then there is room for them."""
    free = np.ones((300, 300), dtype=bool)
    cost = np.random.default_rng(0).integers(64, 300, free.shape, np.int16)
    lattice, rows = Lattice.of(free), np.arange(300)
    first, again = (lattice.cheapest(cost, 64, (0, 150), (299, 150)) for _ in range(2))
    assert first is not None
    assert first == again
    assert not check_cells(free, (0, 150), (299, 150), first[1], first[0])
    paid = [float(cost[cell]) for cell in first[1]]
    assert sum(paid) < cost[rows, 150].sum(), "it pays less than straight on"


DIGEST = """
import hashlib, numpy as np
from swarm.planning.astar import Lattice
free = np.random.default_rng(1).random((80, 90)) > 0.25
lattice, digest = Lattice.of(free), hashlib.sha256()
cost = np.random.default_rng(2).integers(64, 300, free.shape, np.int16)
cells = [tuple(c) for c in np.argwhere(free).tolist()]
for start, goal in zip(cells[::40], reversed(cells[::40])):
    digest.update(repr((lattice.shortest(start, goal), lattice.cheapest(cost, 64, start, goal))).encode())
print(digest.hexdigest())
"""


def test_two_processes_find_the_same_paths() -> None:
    digests = {
        subprocess.run([sys.executable, "-c", DIGEST], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    }
    assert len(digests) == 1
    assert len(digests.pop().strip()) == len(hashlib.sha256().hexdigest())


@needs_data
@pytest.mark.parametrize("name", ["random512-20-0", "Berlin_0_256"])
def test_every_row_of_a_scenario_gives_the_stated_optimum(name: str) -> None:
    result = solve_scen(DATA / "movingai" / f"{name}.map", DATA / "movingai" / f"{name}.map.scen")
    assert result["rows"] in (1780, 930)
    assert result["mismatches"] == 0


@needs_data
@pytest.mark.long("9,730 paths of a maze of 512 x 512 squares")
def test_every_row_of_the_maze_gives_the_stated_optimum() -> None:
    result = solve_scen(DATA / "movingai" / "maze512-4-0.map", DATA / "movingai" / "maze512-4-0.map.scen")
    assert result["rows"] == 9730
    assert result["mismatches"] == 0


@needs_data
@pytest.mark.parametrize("name", ["tree", "corners", "tunnel", "string"])
def test_hard_scenarios_without_lengths_are_solved(name: str) -> None:
    folder = DATA / "mapf" / "hard"
    assert solve_scen(folder / f"{name}.map", folder / f"{name}.scen")["mismatches"] == 0
