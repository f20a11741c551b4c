"""What the fork server computes before it forks is what each process would compute, and is found by them."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm.errors import SwarmError
from swarm.launch.supervise.fleet import SOURCE
from swarm.launch.supervise.rehearsal import rehearse_mission
from swarm.planning.grid import Grid
from swarm.scenario import prepare
from swarm.scenario.load import Scenario, load
from swarm.scenario.source import Source
from swarm.traffic.lattice import placement as cells_of
from tests.shared import PAPER, ROOT

SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))
MIXED = ROOT / "scenarios" / "mixed.yaml"
STATE = """
import gc, json, os, sys
import swarm.launch.supervise.preload
from swarm.scenario import prepare
print(json.dumps([prepare.grid_of_floor.cache_info().currsize, gc.get_freeze_count() > 0, "SWARM_SOURCE" in os.environ]))
"""


def welcomed(source: Source, number: int) -> Scenario:
    """Return a scenario as a robot gets it from the world."""
    scenario = prepare.settle_lattice(source.read()).of_robot(number)
    return Scenario.from_wire(*scenario.to_wire())


@pytest.mark.parametrize(
    ("file", "number"), [*((file, 0) for file in SCENARIOS), (MIXED, 2)], ids=lambda one: getattr(one, "stem", None)
)
def test_a_robot_gets_the_grid_and_the_cells_of_the_rehearsal_and_they_are_its_own(file: Path, number: int) -> None:
    prepare.grid_of_floor.cache_clear()
    cells_of.build_lattice.cache_clear()
    rehearse_mission(Source(file))
    known = welcomed(Source(file), number)
    computed = prepare.grid_of_floor.cache_info().misses
    grid, cells = prepare.planning_grid(known), cells_of.cells_of(known.map, known.settings)
    assert prepare.grid_of_floor.cache_info().misses == computed, "nothing was computed again"
    prepare.grid_of_floor.cache_clear()
    cells_of.build_lattice.cache_clear()
    own, own_cells = prepare.planning_grid(known), cells_of.cells_of(known.map, known.settings)
    assert own is not grid
    assert (own_cells.stands, own_cells.neighbours) == (cells.stands, cells.neighbours)
    for name in ("free", "clearance", "solid", "moves", "cost", "pieces", "discs"):
        mine: NDArray[np.generic] = getattr(own, name)
        np.testing.assert_array_equal(getattr(grid, name), mine, err_msg=name)
    for name in ("resolution", "origin", "radius", "margin", "factor", "unknown_free"):
        assert getattr(grid, name) == getattr(own, name), name


def test_an_edited_map_gets_a_grid_of_its_own(paper: Scenario) -> None:
    floor, _, _ = paper.map.edit_rectangle(1, (2.0, 2.0), (2.5, 2.5))
    edited = replace(paper, map=floor)
    shared, own = prepare.planning_grid(paper), prepare.planning_grid(edited)
    assert (shared.solid != own.solid).any()
    computed = Grid.grown(floor, own.radius, own.margin, prepare.RESOLUTION)
    np.testing.assert_array_equal(own.moves, computed.moves)


def test_what_cannot_be_driven_is_refused_before_it_is_driven(tmp_path: Path) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text(PAPER.read_text(encoding="utf-8").replace("targets:", "targets: [[-50.0, 0.0]]\nwere:"))
    for source in (Source(broken), Source(tmp_path / "none.yaml"), Source(PAPER, tmp_path / "none.scen", 3)):
        with pytest.raises(SwarmError):
            rehearse_mission(source)


@pytest.mark.parametrize(("file", "grids"), [(str(PAPER), 1), ("none.yaml", 0)])
def test_the_fork_server_rehearses_and_survives_a_bad_file(file: str, grids: int) -> None:
    given = os.environ | {SOURCE: json.dumps(Source(Path(file)), default=str)}
    answer = subprocess.run([sys.executable, "-c", STATE], env=given, capture_output=True, text=True, check=True)
    assert json.loads(answer.stdout) == [grids, True, False]
    assert not answer.stderr


def test_a_source_is_read_as_its_file_says(paper: Scenario) -> None:
    assert prepare.settle_lattice(Source(PAPER).read()).settings == paper.settings
    assert load(PAPER).map == paper.map
