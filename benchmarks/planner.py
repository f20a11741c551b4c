"""A* beside plain C and the planners of other libraries, one path a call: ``python -m benchmarks.planner [QUERIES]``.

Every planner answers the same queries in turn, query by query; ratios are of the same query. Peers run in an
environment of their own (.venv-peers-planner), made at the first run. Only planners with the same rule (8-connected,
no corner cutting) and right lengths are compared; each answer is checked.
"""

import base64
import ctypes
import json
import subprocess
import sys
from collections.abc import Callable
from math import hypot, sqrt
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
from swarm.planning.path import line_is_free, path_is_free, plan

ROOT = Path(__file__).parents[1]
YARDSTICK = ROOT.parent / "shared" / "yardsticks" / "astar.c"
ENVIRONMENT = ROOT / ".venv-peers-planner"
PEERS = {  # queries of a map each answers: the slow ones only the first few
    "tcod": ("tcod==21.2.2", 1000),
    "scipy": ("scipy==1.17.1", 1000),
    "rustworkx": ("rustworkx==0.18.1", 5),
    "networkx": ("networkx==3.6.1", 3),
    "pathfinding": ("pathfinding==1.0.23", 3),
}
ALLOWED_OF_C = 1.5  # times as long as C, at most
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
    """Draw connected starts and goals at least half the side apart."""
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
    """Compile the yardstick, to be called by ctypes; None, with a sentence, where it is not there."""
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
            assert path[0] == start  # also keeps ``path`` alive, which C knows by its address alone
            return seconds, length

        return solve

    return on


class Peer:
    """A peer library on one map, in a process of its own."""

    def __init__(self, name: str, lattice: Lattice) -> None:
        self.columns = lattice.shape[1]
        self.process = subprocess.Popen(
            [ENVIRONMENT / "bin" / "python", Path(__file__).with_name("planner_peer.py"), name],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        packed = base64.b64encode(lattice.moves.tobytes()).decode()
        self._ask({"rows": lattice.shape[0], "columns": self.columns, "moves": packed})

    def _ask(self, message: object) -> list:  # type: ignore[type-arg]
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        print(json.dumps(message), file=self.process.stdin, flush=True)
        answer: list = json.loads(self.process.stdout.readline())  # type: ignore[type-arg]
        return answer

    def solve(self, start: int, goal: int) -> tuple[float, float]:
        """Have it find one path; its length is measured here."""
        seconds, path = self._ask([start, goal])
        cells = np.stack(np.divmod(np.array(path), self.columns), axis=1)
        steps = np.abs(np.diff(cells, axis=0))
        assert path[0] == start and path[-1] == goal and (steps.max(axis=1) == 1).all()  # noqa: PT018
        return seconds, float(np.where(steps.sum(axis=1) == 2, sqrt(2), 1.0).sum())

    def close(self) -> None:
        """Let it go."""
        self.process.stdin.close()  # type: ignore[union-attr]
        self.process.wait(timeout=60)


def install() -> bool:
    """Make the peers' environment where it is missing; False, with a sentence, where that does not work."""
    if (ENVIRONMENT / ".ready").exists():
        return True
    print("installing the peers ...", file=sys.stderr)
    subprocess.run([sys.executable, "-m", "venv", ENVIRONMENT], check=True)
    pip = [ENVIRONMENT / "bin" / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if subprocess.run(
        [*pip, *(requirement for requirement, _ in PEERS.values())], stderr=subprocess.DEVNULL
    ).returncode:
        print("left out: the peers, for they could not be installed")
        return False
    (ENVIRONMENT / ".ready").touch()
    return True


def compare(
    name: str, free: NDArray[np.bool_], count: int, c_on: Callable[[NDArray[np.bool_]], Solve] | None, peers: bool
) -> bool:
    """Print one map's table; tell whether ours is as fast as it has to be."""
    lattice = Lattice.of(free)
    queries = queries_of(lattice, count, seed=7)
    running = {each: Peer(each, lattice) for each in PEERS} if peers else {}
    solvers: dict[str, tuple[Solve, int]] = {"ours": (ours(lattice), count)}
    if c_on is not None:
        solvers["C"] = (c_on(free), count)
    solvers |= {each: (peer.solve, PEERS[each][1]) for each, peer in running.items()}
    seconds: dict[str, list[float]] = {each: [] for each in solvers}
    right = dict.fromkeys(solvers, True)
    for number, query in enumerate([queries[0], *queries]):  # the first one once more, untimed
        lengths = {}
        for each, (solve, most) in solvers.items():
            if number <= most:
                took, lengths[each] = solve(*query)
                if number:
                    seconds[each].append(took)
        for each, length in lengths.items():
            right[each] &= abs(length - lengths["ours"]) <= max(1e-4, 1e-5 * length)
    for peer in running.values():
        peer.close()
    rows = [["map " + name, "ms", "x C", "ours is faster by", "queries", "lengths agree"]]
    for each, times in seconds.items():
        of_c = [a / b for a, b in zip(times, seconds.get("C", []), strict=False)]
        of_ours = [a / b for a, b in zip(times, seconds["ours"], strict=False)]
        ratio_of_c = f"{median(of_c):.2f}" if of_c else "-"
        rows.append([each, f"{median(times) * 1e3:.2f}", ratio_of_c, f"{median(of_ours):.2f}", str(len(times)),
                     "yes" if right[each] else "NO"])  # fmt: skip
    print(table(rows), flush=True)
    fast = all(median(a / b for a, b in zip(times, seconds["ours"], strict=False)) > 1
               for each, times in seconds.items() if each not in ("ours", "C") and right[each])  # fmt: skip
    if "C" in seconds:
        fast &= median(a / b for a, b in zip(seconds["ours"], seconds["C"], strict=True)) <= ALLOWED_OF_C
    return fast and right["ours"] and right.get("C", True)


def floor_plan(metres: int, seed: int) -> OccupancyMap:
    """Return a square floor of half-metre cells: scattered shelves and walls, 7 % of all."""
    draw = np.random.default_rng(seed)
    cells = np.full((2 * metres, 2 * metres), FREE, np.uint8)
    for row, column in draw.integers(0, 2 * metres, (metres * metres // 12, 2)).tolist():
        tall, wide = ((1, 5), (5, 1), (2, 2))[int(draw.integers(3))]
        cells[row : row + tall, column : column + wide] = WALL
    return OccupancyMap(cells, 0.5)


def robot_grid(metres: int, rounds: int) -> list[str]:
    """Time what a robot does on its own grid: the first plan, and one after a wall appeared on its way."""
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
    assert plan(grid.changed(edited, low, high), start, goal) not in (None, path)
    cases: dict[str, Callable[[], object]] = {
        "grow": lambda: Grid.grown(floor, radius, margin, resolution),
        "plan": lambda: plan(Grid.grown(floor, radius, margin, resolution), start, goal),
        "again": lambda: plan(grown, start, goal),
        "changed": lambda: grown.changed(edited, low, high),
        "replan": lambda: plan(grown.changed(edited, low, high), start, goal),
        "discs": lambda: plan(grown.with_discs([path.point_at(path.length / 2)], radius), start, goal),
        "check": lambda: path_is_free(grown, path),
        "line": lambda: [line_is_free(grown, start, ahead) for _ in range(100)],
    }
    seconds = interleave(cases, rounds)
    ms = {name: median(times) * 1e3 for name, times in seconds.items()}
    share = median(a / b for a, b in zip(seconds["replan"], seconds["plan"], strict=True))
    round_discs = median(a / b for a, b in zip(seconds["discs"], seconds["plan"], strict=True))
    return [f"{metres} m, {grid.shape[0]} x {grid.shape[1]}", f"{ms['grow']:.2f}", f"{ms['again']:.2f}",
            f"{ms['plan']:.2f}", f"{ms['changed']:.2f}", f"{ms['replan']:.2f}", f"{share:.2f}", f"{round_discs:.2f}",
            f"{ms['check'] * 1e3:.0f}", f"{ms['line'] * 10:.1f}"]  # fmt: skip


def main(count: int = 15) -> int:
    """Print every table; the exit status is 1 where ours is not as fast as it has to be."""
    print(machine())
    peers = install()
    fast = True
    with TemporaryDirectory() as folder:
        c_on = yardstick(Path(folder))
        for side in (512, 1024):
            fast &= compare(f"random {side}", random_map(side, side), count, c_on, peers)
            fast &= compare(f"maze {side}", maze_map(side, side), count, c_on, peers)
    head = ["robot's grid, ms", "grow", "plan", "grow + plan", "change", "change + plan", "share of the first",
            "round a disc, share", "path_is_free, us", "line_is_free, us"]  # fmt: skip
    print(table([head, *(robot_grid(metres, 9) for metres in (10, 20, 50))]))
    return 0 if fast else 1


if __name__ == "__main__":
    sys.exit(main(*(int(argument) for argument in sys.argv[1:2])))
