"""Peer path planners, run by `benchmarks.planner` in their own environment: this imports nothing of the project.

The argument is a peer's name. The program reads a line of JSON with rows, columns and the legal moves of every cell
(base64, one byte per cell, bit k is set where a step in direction k is legal). It builds its graph and prints "ready".
Then it answers each line [start, goal] (cell numbers) with [seconds, path as cell numbers].
"""

import base64
import json
import sys
from collections.abc import Callable
from math import sqrt
from time import perf_counter

import numpy as np

ROWS, COLUMNS = (0, 1, 1, 1, 0, -1, -1, -1), (1, 1, 0, -1, -1, -1, 0, 1)
Moves = np.ndarray
Solve = Callable[[int, int], list[int]]


def edges_of(moves: Moves) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return all legal steps as three arrays: from, to, length."""
    columns = moves.shape[1]
    sources, targets, lengths = [], [], []
    for k in range(8):
        source = np.flatnonzero(moves >> k & 1)
        sources.append(source)
        targets.append(source + ROWS[k] * columns + COLUMNS[k])
        lengths.append(np.full(len(source), sqrt(2) if k % 2 else 1.0))
    return np.concatenate(sources), np.concatenate(targets), np.concatenate(lengths)


def octile_to(goal: int, columns: int) -> Callable[[int], float]:
    """Return the heuristic towards one goal."""
    goal_row, goal_column = divmod(goal, columns)

    def octile(cell: int) -> float:
        row, column = divmod(cell, columns)
        down, across = abs(row - goal_row), abs(column - goal_column)
        return down + (sqrt(2) - 1) * across if down > across else across + (sqrt(2) - 1) * down

    return octile


def tcod(moves: Moves) -> Solve:
    from tcod.path import CustomGraph, Pathfinder

    graph = CustomGraph(moves.shape)
    for k in range(8):
        legal = np.ascontiguousarray(moves >> k & 1, dtype=np.int8)
        # tcod reads the cost at a step's target, and the condition at its source
        graph.add_edge((ROWS[k], COLUMNS[k]), 99 if k % 2 else 70, cost=np.ones(moves.shape, np.int8), condition=legal)
    graph.set_heuristic(cardinal=70, diagonal=99)
    columns = moves.shape[1]

    def solve(start: int, goal: int) -> list[int]:
        pathfinder = Pathfinder(graph)
        pathfinder.add_root(divmod(start, columns))
        return [int(row) * columns + int(column) for row, column in pathfinder.path_to(divmod(goal, columns))]

    return solve


def scipy(moves: Moves) -> Solve:
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    sources, targets, lengths = edges_of(moves)
    graph = csr_array((lengths, (sources, targets)), shape=(moves.size, moves.size))

    def solve(start: int, goal: int) -> list[int]:
        _, before = dijkstra(graph, indices=start, return_predecessors=True)
        path = [goal]
        while path[-1] != start:
            path.append(int(before[path[-1]]))
        return path[::-1]

    return solve


def rustworkx(moves: Moves) -> Solve:
    import rustworkx as rx

    graph = rx.PyDiGraph(multigraph=False)
    graph.add_nodes_from(range(moves.size))
    graph.add_edges_from(list(zip(*(each.tolist() for each in edges_of(moves)), strict=True)))

    def solve(start: int, goal: int) -> list[int]:
        way = rx.astar_shortest_path(graph, start, goal.__eq__, float, octile_to(goal, moves.shape[1]))
        return list(way)

    return solve


def networkx(moves: Moves) -> Solve:
    import networkx as nx

    graph = nx.DiGraph()
    graph.add_weighted_edges_from(zip(*(each.tolist() for each in edges_of(moves)), strict=True))

    def solve(start: int, goal: int) -> list[int]:
        octile = octile_to(goal, moves.shape[1])
        return nx.astar_path(graph, start, goal, lambda cell, _: octile(cell))

    return solve


def pathfinding(moves: Moves) -> Solve:
    from pathfinding.core.diagonal_movement import DiagonalMovement
    from pathfinding.core.grid import Grid
    from pathfinding.finder.a_star import AStarFinder

    # on these maps every free cell has a move, except isolated cells
    grid = Grid(matrix=(moves > 0).astype(int).tolist())
    finder = AStarFinder(diagonal_movement=DiagonalMovement.only_when_no_obstacle)
    columns = moves.shape[1]

    def solve(start: int, goal: int) -> list[int]:
        grid.cleanup()
        ends = [grid.node(cell % columns, cell // columns) for cell in (start, goal)]
        path, _ = finder.find_path(*ends, grid)
        return [node.y * columns + node.x for node in path]

    return solve


PEERS = {each.__name__: each for each in (tcod, scipy, rustworkx, networkx, pathfinding)}


def main() -> None:
    header = json.loads(sys.stdin.readline())
    moves = np.frombuffer(base64.b64decode(header["moves"]), np.uint8).reshape(header["rows"], header["columns"])
    solve = PEERS[sys.argv[1]](moves)
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        start, goal = json.loads(line)
        began = perf_counter()
        path = solve(start, goal)
        print(json.dumps([perf_counter() - began, path]), flush=True)


if __name__ == "__main__":
    main()
