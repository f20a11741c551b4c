"""The command ``swarm plan``: one path, drawn and in numbers, or all rows of a MovingAI scenario, each path checked."""

from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Final, NamedTuple

import numpy as np

from swarm.maps.movingai import load_movingai, load_scen
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, OccupancyMap, Point
from swarm.planning.astar import Lattice, shortest
from swarm.planning.grid import Grid
from swarm.planning.path import plan
from swarm.planning.path_check import Judge, check_cells

WIDE, HIGH = 100, 50  # characters: the largest drawing


class Solution(NamedTuple):
    """One planned path, for people and for programs."""

    drawing: str
    numbers: dict[str, object]  # only values that JSON has


def solve_scen(map_path: Path, scen_path: Path) -> dict[str, float | int]:
    """Solve every row of a MovingAI scenario; return the number of rows and mismatches and the median search time [ms].

    A mismatch is a row without a path, with another length than stated, or with a fault that ``path_check`` finds.

    Raises:
        ConfigError: one of the files is not valid.
    """
    map = load_movingai(map_path)  # noqa: A001
    rows = load_scen(scen_path, map)
    free = map.cells == FREE
    lattice = Lattice.of(free)
    mismatches, times = 0, []
    for start, goal, optimal in rows:
        began = perf_counter()
        found = shortest(lattice, start, goal)
        times.append(perf_counter() - began)
        if found is None:
            mismatches += 1
            continue
        length, cells = found
        stated = length if optimal is None else optimal
        wrong = abs(length - stated) > max(1e-4, 1e-5 * stated)
        mismatches += wrong or bool(check_cells(free, start, goal, cells, length))
    return {"rows": len(rows), "mismatches": mismatches, "median_ms": round(median(times) * 1e3, 4)}


def solve_one(
    map: OccupancyMap,  # noqa: A002
    start: Point,
    goal: Point,
    radius: float = 0.2,
    margin: float = 0.1,
    resolution: float | None = 0.1,
    unknown_free: bool = False,
) -> Solution:
    """Plan one path [m, map frame] for a disc of ``radius`` [m], check it, and draw it.

    Raises:
        ConfigError: a length is not valid.
    """
    began = perf_counter()
    grid = Grid.grown(map, radius, margin, resolution, unknown_free)
    grown = perf_counter()
    path = plan(grid, start, goal)
    planned = perf_counter()
    faults = Judge(map, radius, unknown_free).faults(start, goal, path.points, path.length) if path else []
    reason = None if path else _reason(grid, start, goal)
    points = [list(point) for point in path.points] if path else []
    numbers: dict[str, object] = {
        "from": list(start),
        "to": list(goal),
        "found": path is not None,
        "length": path.length if path else None,  # m
        "points": points,  # m, map
        "reason": reason,
        "faults": [f"{fault}: {where}" for fault, where in faults],
        "radius": radius,
        "margin": margin,
        "grid": {"rows": grid.shape[0], "columns": grid.shape[1], "resolution": grid.resolution},
        "grow_ms": round((grown - began) * 1e3, 3),
        "plan_ms": round((planned - grown) * 1e3, 3),
    }
    said = f"{path.length:.3f} m over {len(path.points)} points" if path else f"no path: {reason}"
    line = [path.point_at(s) for s in np.arange(0.0, path.length, grid.resolution / 2)] if path else []
    return Solution(f"{draw(map, [(line, '*'), ([start], 'A'), ([goal], 'B')])}\n{said}", numbers)


def draw(map: OccupancyMap, marks: list[tuple[list[Point], str]]) -> str:  # noqa: A002
    """Draw a map with the top first: '#' wall, 'o' obstacle, '?' unknown, '.' free; marks are drawn over it."""
    shown = np.argwhere(map.cells != UNKNOWN)
    low, high = (shown.min(axis=0), shown.max(axis=0) + 1) if len(shown) else (np.zeros(2, int), np.array(map.shape))
    step = max(1, -(-int(high[1] - low[1]) // WIDE), -(-int(high[0] - low[0]) // HIGH))
    symbols: Final = {FREE: ".", OBSTACLE: "o", UNKNOWN: "?"}
    canvas = []
    for row in range(low[0], high[0], step):
        line = []
        for column in range(low[1], high[1], step):
            kinds, counts = np.unique(map.cells[row : row + step, column : column + step], return_counts=True)
            solid = [kind for kind in kinds.tolist() if kind not in (FREE, UNKNOWN)]
            kind = solid[0] if solid else int(kinds[counts.argmax()])
            line.append(symbols.get(kind, "#"))
        canvas.append(line)
    for points, symbol in marks:
        for x, y in points:
            row, column = map.cell_of(x, y)
            if low[0] <= row < high[0] and low[1] <= column < high[1]:
                canvas[(row - low[0]) // step][(column - low[1]) // step] = symbol
    return "\n".join("".join(line) for line in reversed(canvas))


def _reason(grid: Grid, start: Point, goal: Point) -> str:
    for name, point in (("start", start), ("goal", goal)):
        row, column = grid.cell_of(*point)
        if not (0 <= row < grid.shape[0] and 0 <= column < grid.shape[1]):
            return f"the {name} ({point[0]:g}, {point[1]:g}) is outside the map"
        if grid.solid[row, column]:
            return f"the {name} ({point[0]:g}, {point[1]:g}) is in a solid cell"
    room = grid.room_at(*goal)
    if room < grid.radius:
        return f"the goal is {room:.3f} m from a solid cell, less than the robot's radius of {grid.radius:g} m"
    return f"no passage from start to goal is wide enough for a robot with a radius of {grid.radius:g} m"
