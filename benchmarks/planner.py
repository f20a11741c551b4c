"""A* beside plain C, one path a call: ``python -m benchmarks.planner [QUERIES]``.

Both answer the same queries in turn, by the same rule (8-connected, no corner cutting); each length is checked. Ratios
compare times of the same query.
"""

import ctypes
import subprocess
import sys
from collections.abc import Callable
from math import hypot
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from benchmarks.measure import interleave, machine, table
from swarm.maps.occupancy import FREE, WALL, OccupancyMap
from swarm.planning.astar import Lattice, shortest
from swarm.planning.grid import Grid
from swarm.planning.path import line_is_free, plan

ROOT = Path(__file__).parents[1]
YARDSTICK = ROOT.parent / "shared" / "yardsticks" / "astar.c"
ALLOWED_OF_C = 1.5  # the largest ratio of our time to C's time
Solve = Callable[[int, int], tuple[float, float]]  # start and goal as cell numbers, to seconds and length


def random_map(side: int, seed: int) -> NDArray[np.bool_]:
    """Return a map of single solid cells, 20 % of all."""
    free: NDArray[np.bool_] = np.random.default_rng(seed).random((side, side)) >= 0.2
    return free


def maze_map(side: int, seed: int) -> NDArray[np.bool_]:
    """Return a maze without loops, its corridors three cells wide, its walls one."""
    rooms = side // 4
    free = np.zeros((side, side), np.bool_)
    draw = np.random.default_rng(seed)
    seen = np.zeros((rooms, rooms), np.bool_)
    seen[0, 0] = True
    free[:3, :3] = True
    trail = [(0, 0)]
    while trail:
        row, column = trail[-1]
        around = [
            (r, c)
            for r, c in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1))
            if 0 <= r < rooms and 0 <= c < rooms and not seen[r, c]
        ]
        if not around:
            trail.pop()
            continue
        r, c = around[int(draw.integers(len(around)))]
        seen[r, c] = True
        free[4 * min(r, row) : 4 * max(r, row) + 3, 4 * min(c, column) : 4 * max(c, column) + 3] = True
        trail.append((r, c))
    return free


def queries_of(lattice: Lattice, count: int, seed: int) -> list[tuple[int, int]]:
    """Draw starts and goals that are connected and at least half the map's side apart."""
    draw, queries = np.random.default_rng(seed), []
    cells, columns = np.flatnonzero(lattice.free), lattice.shape[1]
    while len(queries) < count:
        start, goal = draw.choice(cells, 2).tolist()
        (r0, c0), (r1, c1) = divmod(start, columns), divmod(goal, columns)
        if hypot(r0 - r1, c0 - c1) >= columns / 2 and lattice.shortest((r0, c0), (r1, c1)) is not None:
            queries.append((start, goal))
    return queries


def ours(lattice: Lattice) -> Solve:
    columns = lattice.shape[1]

    def solve(start: int, goal: int) -> tuple[float, float]:
        ends = divmod(start, columns), divmod(goal, columns)
        began = perf_counter()
        found = shortest(lattice, *ends)
        seconds = perf_counter() - began
        assert found is not None
        return seconds, found[0]

    return solve


def yardstick(folder: Path) -> Callable[[NDArray[np.bool_]], Solve] | None:
    """Compile the yardstick in C for ctypes; print a sentence and return None if its source is not there."""
    if not YARDSTICK.exists():
        print(f"left out: C, for {YARDSTICK} is not there")
        return None
    library = folder / "astar.so"
    command = ["cc", "-O3", "-march=native", "-shared", "-fPIC", str(YARDSTICK), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    compiled = ctypes.CDLL(str(library))
    compiled.astar.restype = ctypes.c_double

    def on(free: NDArray[np.bool_]) -> Solve:
        cells = np.ascontiguousarray(free).view(np.uint8)
        path, count = np.empty(cells.size, np.int32), ctypes.c_int()
        address = ctypes.c_void_p(cells.ctypes.data)
        room = ctypes.c_void_p(path.ctypes.data)

        def solve(start: int, goal: int) -> tuple[float, float]:
            began = perf_counter()
            length = compiled.astar(*cells.shape, address, start, goal, room, ctypes.byref(count))
            seconds = perf_counter() - began
            assert path[0] == start  # also keeps ``path`` alive: C only has its address
            return seconds, length

        return solve

    return on


def compare(name: str, free: NDArray[np.bool_], count: int, c_on: Callable[[NDArray[np.bool_]], Solve] | None) -> bool:
    """Print one map's table; return True if ours is fast enough and the lengths agree."""
    lattice = Lattice.of(free)
    queries = queries_of(lattice, count, seed=7)
    solvers: dict[str, Solve] = {"ours": ours(lattice)} | ({} if c_on is None else {"C": c_on(free)})
    seconds: dict[str, list[float]] = {each: [] for each in solvers}
    agree = dict.fromkeys(solvers, True)
    for number, query in enumerate([queries[0], *queries]):  # the first query runs twice, the first time untimed
        lengths = {}
        for each, solve in solvers.items():
            took, lengths[each] = solve(*query)
            if number:
                seconds[each].append(took)
        for each, length in lengths.items():
            agree[each] &= abs(length - lengths["ours"]) <= max(1e-4, 1e-5 * length)
    of_c = {each: [a / b for a, b in zip(times, seconds.get("C", []), strict=False)] for each, times in seconds.items()}
    rows = [["map " + name, "ms", "x C", "queries", "lengths agree"]]
    for each, times in seconds.items():
        ratio = f"{median(of_c[each]):.2f}" if of_c[each] else "-"
        rows.append([each, f"{median(times) * 1e3:.2f}", ratio, str(count), "yes" if agree[each] else "NO"])
    print(table(rows), flush=True)
    return all(agree.values()) and (not of_c["ours"] or median(of_c["ours"]) <= ALLOWED_OF_C)


def floor_plan(metres: int, seed: int) -> OccupancyMap:
    """Return a square floor of half-metre cells: scattered shelves and walls, 7 % of all."""
    draw = np.random.default_rng(seed)
    cells = np.full((2 * metres, 2 * metres), FREE, np.uint8)
    for row, column in draw.integers(0, 2 * metres, (metres * metres // 12, 2)).tolist():
        tall, wide = ((1, 5), (5, 1), (2, 2))[int(draw.integers(3))]
        cells[row : row + tall, column : column + wide] = WALL
    return OccupancyMap(cells, 0.5)


def robot_grid(metres: int, rounds: int) -> list[str]:
    """Time a robot's planning on its own grid: the first plan, and a new plan after a wall appears on its way."""
    floor = floor_plan(metres, seed=5)
    radius, margin, resolution = 0.2, 0.1, 0.1
    grid = Grid.grown(floor, radius, margin, resolution)
    cells = np.argwhere(grid.free)
    start, goal = grid.centre_of(tuple(cells[0].tolist())), grid.centre_of(tuple(cells[-1].tolist()))
    path = plan(grid, start, goal)
    assert path is not None
    row, column = floor.cell_of(*path.point_at(path.length / 2))
    low, high = (row, column), (row + 1, column + 3)
    walled = floor.cells.copy()
    walled[low[0] : high[0], low[1] : high[1]] = WALL
    edited = OccupancyMap(walled, floor.resolution)
    grown, ahead = grid, path.point_at(2.0)
    assert plan(grid.update_cells(edited, low, high), start, goal) not in (None, path)
    cases: dict[str, Callable[[], object]] = {
        "grow": lambda: Grid.grown(floor, radius, margin, resolution),
        "plan": lambda: plan(Grid.grown(floor, radius, margin, resolution), start, goal),
        "again": lambda: plan(grown, start, goal),
        "changed": lambda: grown.update_cells(edited, low, high),
        "replan": lambda: plan(grown.update_cells(edited, low, high), start, goal),
        "discs": lambda: plan(grown.with_discs([path.point_at(path.length / 2)], radius), start, goal),
        "line": lambda: [line_is_free(grown, start, ahead) for _ in range(100)],
    }
    seconds = interleave(cases, rounds)
    ms = {name: median(times) * 1e3 for name, times in seconds.items()}
    share = median(a / b for a, b in zip(seconds["replan"], seconds["plan"], strict=True))
    round_discs = median(a / b for a, b in zip(seconds["discs"], seconds["plan"], strict=True))
    return [f"{metres} m, {grid.shape[0]} x {grid.shape[1]}", f"{ms['grow']:.2f}", f"{ms['again']:.2f}",
            f"{ms['plan']:.2f}", f"{ms['changed']:.2f}", f"{ms['replan']:.2f}", f"{share:.2f}", f"{round_discs:.2f}",
            f"{ms['line'] * 10:.1f}"]  # fmt: skip


def main(count: int = 15) -> int:
    """Print all tables; return exit status 1 if ours is too slow somewhere or a length is wrong."""
    print(machine())
    fast = True
    with TemporaryDirectory() as folder:
        c_on = yardstick(Path(folder))
        for side in (512, 1024):
            fast &= compare(f"random {side}", random_map(side, side), count, c_on)
            fast &= compare(f"maze {side}", maze_map(side, side), count, c_on)
    head = ["robot's grid, ms", "grow", "plan", "grow + plan", "change", "change + plan", "share of the first",
            "round a disc, share", "line_is_free, us"]  # fmt: skip
    print(table([head, *(robot_grid(metres, 9) for metres in (10, 20, 50))]))
    return 0 if fast else 1


if __name__ == "__main__":
    sys.exit(main(*(int(argument) for argument in sys.argv[1:2])))
