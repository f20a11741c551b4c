"""The output of ``swarm plan``."""

import json
from pathlib import Path

import pytest

from swarm.errors import ConfigError
from swarm.maps.text import from_text
from swarm.planning.solve import draw, solve_one, solve_scen

ROOM = from_text("########\n#......#\n#..#...#\n#..#...#\n########", 0.5)


def test_one_path_is_drawn_and_fits_json() -> None:
    answer = solve_one(ROOM, (1.0, 1.0), (3.0, 1.0))
    numbers = json.loads(json.dumps(answer.numbers))
    assert numbers["found"] is True
    assert numbers["faults"] == []
    assert numbers["points"][0] == [1.0, 1.0]
    assert numbers["length"] > 2.0
    lines = answer.drawing.split("\n")
    assert len(lines) == 6
    assert lines[2][1:7].count("*") == 0 or "A" in answer.drawing
    assert {"A", "B", "*", "#"} <= set(answer.drawing)
    assert lines[-1].startswith(f"{numbers['length']:.3f} m over")


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ((9.0, 9.0), (3.0, 1.0), "the start (9, 9) is outside"),
        ((1.0, 1.0), (0.1, 0.1), "the goal (0.1, 0.1) is in a solid cell"),
        ((1.0, 1.0), (1.0, 0.6), "0.100 m from a solid cell"),
    ],
)
def test_why_there_is_no_path(start: tuple[float, float], goal: tuple[float, float], reason: str) -> None:
    answer = solve_one(ROOM, start, goal)
    assert reason in str(answer.numbers["reason"])
    assert "no path: " in answer.drawing
    assert answer.numbers["found"] is False


def test_a_passage_too_narrow_is_said_so() -> None:
    answer = solve_one(from_text("...#...\n.......\n...#...", 0.5), (0.75, 0.75), (2.75, 0.75), radius=0.3)
    assert "with a radius of 0.3 m" in str(answer.numbers["reason"])


def test_large_maps_are_drawn_coarser() -> None:
    drawing = draw(from_text("\n".join(["." * 250] * 30 + ["#" * 250]), 0.1), [([(1.0, 1.0)], "A")]).split("\n")
    assert max(map(len, drawing)) <= 100
    assert drawing[0] == "." * 84 or drawing[-1] == "#" * 84 or "#" in drawing[0]
    assert any("A" in line for line in drawing)


def test_mismatches_of_a_scenario_are_counted(tmp_path: Path) -> None:
    grid, scen = tmp_path / "small.map", tmp_path / "small.scen"
    grid.write_text("type octile\nheight 2\nwidth 3\nmap\n...\n.@.\n")
    rows = [(0, 0, 2, 0, 2.0), (0, 1, 2, 1, 4.0), (0, 0, 2, 0, 2.5), (0, 0, 1, 1, 1.0), (0, 0, 2, 0, 0.0)]
    scen.write_text("version 1\n" + "\n".join("0\tx\t3\t2\t" + "\t".join(map(str, row)) for row in rows))
    result = solve_scen(grid, scen)
    assert (result["rows"], result["mismatches"]) == (5, 2)
    assert result["median_ms"] > 0
    with pytest.raises(ConfigError):
        solve_scen(grid, tmp_path / "none.scen")
