"""The test vectors of lattices: cells, where one can stand, and joins."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Final

import msgspec
import numpy as np

from docs.vectors.writing import Json, metres
from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.text import from_text
from swarm.messages import Edit, Kind
from swarm.robot.ground import KINDS
from swarm.scenario.load import load
from swarm.settings import MapSettings, Settings, StartSettings, TrafficSettings
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of
from swarm.traffic.lattice_choice import with_lattice

SCENARIO: Final = Path(__file__).parents[2] / "scenarios" / "paper.yaml"


def settings_of(floor: OccupancyMap, cell: float | None = None, offset: tuple[float, float] | None = None) -> Settings:
    """Return the settings of a drawn floor, its lattice placed."""
    place = TrafficSettings(cell=cell, offset=offset)
    start, source = StartSettings(poses=[]), MapSettings(cell=floor.resolution)
    return with_lattice(Settings(name="drawn", map=source, start=start, traffic=place), floor)


def drawn(*rows: str, resolution: float, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> OccupancyMap:
    """Return a map drawn from the top down."""
    return replace(from_text("\n".join(rows), resolution), origin=Pose(*origin))


SQUARES: Final = drawn("..........", "....##....", "..........", resolution=1.2)  # cell = 10 * row + column


def squares() -> tuple[CellMap, Settings]:
    """Return the cells on which what robots say is judged, and their settings."""
    settings = settings_of(SQUARES)
    return cells_of(SQUARES, settings), settings


def given(settings: Settings) -> Json:
    """Return the part of the settings that the vectors depend on, as a ``Welcome`` has it."""
    raw = msgspec.to_builtins(settings)
    return {
        "rate": raw["rate"],
        "robot": {name: raw["robot"][name] for name in ("radius", "speed_scale")},
        "radio": {name: raw["radio"][name] for name in ("range", "loss", "every", "line_of_sight")},
        "traffic": {name: raw["traffic"][name] for name in ("cell", "offset")},
    }


def lattice(
    about: str,
    floor: OccupancyMap,
    settings: Settings,
    edits: Sequence[Edit] = (),
    points: Sequence[tuple[float, float]] = (),
    discs: Sequence[tuple[float, float, float]] = (),
) -> Json:
    """Return the vector of one lattice; points and discs [m, the map's own frame] are those to find the cells of."""
    rows, columns = floor.shape
    vector: dict[str, Json] = {
        "description": about,
        "map": {
            "rows": rows,
            "columns": columns,
            "resolution": floor.resolution,
            "origin": [*floor.origin],
            "cells": ["".join(map(str, row)) for row in floor.cells.tolist()],
        },
        "settings": given(settings),
    }
    if edits:
        vector["edits"] = []
    for edit in edits:
        floor, low, high = floor.edit_rectangle(KINDS[edit.kind], edit.low, edit.high)
        changes = {"kind": edit.kind.value, "low": [*edit.low], "high": [*edit.high]}
        vector["edits"].append(changes | {"rows": [low[0], high[0]], "columns": [low[1], high[1]]})
    cells = cells_of(floor, settings)
    joins = sorted((a, b) for a, near in enumerate(cells.neighbours) for b in near if a < b)
    vector["lattice"] = {
        "rows": cells.rows,
        "columns": cells.columns,
        "middles": [metres(*cells.centre(cell)) for cell in range(len(cells))],
        "stands": [cell for cell in range(len(cells)) if cells.stands[cell]],
        "joins": [[a, b] for a, b in joins],
    }
    vector["points"] = [{"at": [x, y], "cell": cells.cell_of(x, y)} for x, y in points]
    vector["discs"] = [
        {"at": [x, y], "radius": r, "reaches_into": [cell for cell in cells.cells_under_disc(x, y, r) if cell >= 0]}
        for x, y, r in discs
    ]
    return vector


@cache
def paper() -> tuple[OccupancyMap, Settings]:
    """Return the floor and the settings of the paper's scenario."""
    scenario = load(SCENARIO)
    return scenario.map, with_lattice(scenario.settings, scenario.map)


def of_the_paper() -> Json:
    """Return the lattice of the paper's scenario."""
    floor, settings = paper()
    return lattice(
        "The floor of `swarm run paper`, drawn in squares of 0.5 m; the lattice's cells are of 1.2 m.",
        floor,
        settings,
        points=[(10.0, 2.0), (16.5, 11.5), (2.5, 11.5), (19.9, 13.9), (-0.1, 2.0)],
        discs=[(10.0, 2.0, 0.23), (2.5, 11.5, 0.23), (0.6, 0.6, 0.4), (19.9, 13.9, 0.23)],
    )


def of_squares() -> Json:
    """Return a lattice whose cells are those of the map."""
    return lattice(
        "A map of squares of 1.2 m that is its own lattice: cell = 10 * row + column, row 0 at the bottom. "
        "records.json, plan.json and calls.json are on this floor.",
        SQUARES,
        squares()[1],
        points=[(0.6, 0.6), (11.9, 3.5), (12.1, 0.6)],
        discs=[(1.0, 0.6, 0.23), (1.0, 1.0, 0.23), (1.0, 1.0, 0.29), (0.1, 0.1, 0.23)],
    )


def turned() -> Json:
    """Return the lattice of a map that is turned in the world."""
    floor = drawn("....#...", "........", "..#.....", "........", resolution=0.75, origin=(2.0, -1.0, 0.5))
    settings = settings_of(floor, 1.0, (-0.25, 0.0))
    edit = Edit(kind=Kind.WALL, low=(2.2, 1.2), high=(2.6, 1.5))
    return lattice(
        "A map turned by 0.5 rad about its corner at (2, -1); the lattice begins 0.25 m left of it. The edit is a "
        "rectangle along the axes of the world: the cells between its corners' extremes in the map's own frame change.",
        floor,
        settings,
        [edit],
        points=[(2.5, 0.5), (4.1, 1.9), (2.0, -1.1)],
        discs=[(4.0, 1.0, 0.23), (4.0, 1.0, 0.9)],
    )  # fmt: skip


def edited() -> Json:
    """Return a lattice after edits with corners on the edges of cells."""
    floor = drawn(*["." * 60] * 30, resolution=0.1)
    edits = [
        Edit(kind=Kind.WALL, low=(1.2, 0.3), high=(1.3, 1.1)),  # 0.3 / 0.1 is a little less than 3
        Edit(kind=Kind.OBSTACLE, low=(3.0, 1.5), high=(3.0, 2.5)),
        Edit(kind=Kind.WALL, low=(5.9, 0.6), high=(4.9, 0.3)),
        Edit(kind=Kind.FREE, low=(4.9, 0.3), high=(5.5, 0.6)),
        Edit(kind=Kind.WALL, low=(-1.0, 2.95), high=(0.05, 9.0)),
    ]
    return lattice(
        "An empty floor after five edits: corners on cells' edges, a wall without width, corners the other way round, "
        "a part taken away again, and one that is partly off the map. `map` is the floor before them; `rows` and "
        "`columns` are those that each edit touches, the last one excluded; `lattice` is that of the floor after all.",
        floor,
        settings_of(floor, 1.0, (0.0, 0.0)),
        edits,
        points=[(1.0, 0.5), (0.5, 2.0), (3.0, 1.0), (6.0, 0.5), (0.0, 0.0)],
        discs=[(0.75, 0.5, 0.25), (0.75, 0.5, 0.2501), (1.75, 1.75, 0.25)],
    )


def touching() -> Json:
    """Return a lattice with walls at just the radius of the disc that has to be clear."""
    grid = np.zeros((48, 96), np.uint8)
    for row, column in ((11, 6), (11, 89), (35, 7), (35, 88), (6, 39), (5, 64)):
        grid[row, column] = 1
    floor = OccupancyMap(grid, 0.05)
    return lattice(
        "Six squares of wall about 0.25 m, the radius of the disc, from middles and from the lines between them. Those "
        "beside cells 0 and 3 touch the disc at 0.25 m: one can stand there. Those beside cells 4 and 7 are 0.2 m off: "
        "nobody can. One ends 0.249 m below the line from 1 to 2, but farther than 0.25 m from points on it that are "
        "0.12 m apart: no join. One ends 0.299 m below the line from 2 to 3: a join.",
        floor,
        settings_of(floor, 1.2, (0.0, -0.001)),
    )  # fmt: skip


VECTORS: Final[dict[str, Callable[[], Json]]] = {
    "lattice-paper": of_the_paper,
    "lattice-squares": of_squares,
    "lattice-turned": turned,
    "lattice-edited": edited,
    "lattice-touching": touching,
}
