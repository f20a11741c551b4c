"""MovingAI maps and scenarios."""

from pathlib import Path

import numpy as np
import pytest

from swarm.errors import ConfigError
from swarm.maps.load import load_map
from swarm.maps.movingai import PlanningTask, from_movingai, from_scen, load_movingai, load_scen
from swarm.maps.occupancy import FREE, WALL, OccupancyMap
from tests.maps.drawings import MOVINGAI
from tests.shared import DATA, needs_data

CELLS = [[FREE, WALL, FREE, FREE], [FREE, WALL, FREE, WALL], [FREE, FREE, WALL, FREE]]


@pytest.mark.parametrize(
    "text",
    [
        MOVINGAI,
        MOVINGAI.replace("\n", "\r\n"),
        MOVINGAI.removesuffix("\n"),
        MOVINGAI.removeprefix("type octile\n"),
        MOVINGAI.replace("height 3\nwidth 4", "width 4\nheight 3"),
        MOVINGAI + "\n\n",
    ],
    ids=["plain", "CRLF", "no final newline", "no type", "width first", "blank lines after"],
)
def test_variants_are_the_same_map(text: str) -> None:
    assert from_movingai(text).cells.tolist() == CELLS


BAD = {
    "nothing": ("", "line 1: expected one of 'type octile'"),
    "no map line": ("height 3\nwidth 4", "expected a line 'map'"),
    "no height": (MOVINGAI.replace("height 3\n", ""), "expected a line 'height N'"),
    "another type": (MOVINGAI.replace("octile", "tile"), "expected 'type octile', got 'tile'"),
    "an unknown key": (MOVINGAI.replace("width", "breadth"), "line 3: expected one of .*got 'breadth 4'"),
    "swapped": (MOVINGAI.replace("height 3\nwidth 4", "height 4\nwidth 3"), "line 5: expected 3 characters.*got 4"),
    "too few rows": (MOVINGAI.replace("height 3", "height 4"), "line 8: expected 4 characters|expected 4 rows"),
    "too many rows": (MOVINGAI.replace("height 3", "height 2"), "expected 2 rows .*got more"),
    "truncated": (MOVINGAI[:-3], "line 7: expected 4 characters as 'width' says, got 2"),
    "an unknown symbol": (MOVINGAI.replace("T", "x"), "line 6, column 2: expected one of .*got 'x'"),
    "a negative side": (MOVINGAI.replace("height 3", "height -3"), "height: expected a whole number"),
    "no side": (MOVINGAI.replace("height 3", "height 0"), "expected 1 to"),
}


@pytest.mark.parametrize(("text", "sentence"), BAD.values(), ids=BAD)
def test_what_is_wrong_is_said(text: str, sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        from_movingai(text)


FLAT = OccupancyMap(np.zeros((2, 4), np.uint8), 1.0)
ROW = "0\tx.map\t4\t2\t0\t0\t3\t1\t3.5"


def test_rows_count_y_from_the_top() -> None:
    expected = [PlanningTask((1, 0), (0, 3), 3.5)]
    for text in (ROW, f"version 1\n{ROW}\n", f"version 1.0\r\n{ROW}\r\n\r\n", ROW.replace("\t", " ")):
        assert from_scen(text, FLAT) == expected


def test_names_of_maps_may_be_paths_and_sizes_zero() -> None:
    assert from_scen("0\tmaps/far away/x.map\t0\t0\t0\t0\t0\t0\t0.0", FLAT) == [PlanningTask((1, 0), (1, 0), 0.0)]
    assert from_scen("0 x 0 0 0 0 1 0 0.0", FLAT) == [PlanningTask((1, 0), (1, 1), None)]


BAD_ROWS = {
    "nothing": ("version 1\n", "at least one row"),
    "a column missing": (ROW.rpartition("\t")[0], "line 1: expected 9 columns .*got 8"),
    "another map": (ROW.replace("4\t2", "5\t2"), "expected a map 4 wide and 2 high, got 5 by 2"),
    "swapped": (ROW.replace("4\t2", "2\t4"), "got 2 by 4"),
    "outside": (ROW.replace("3\t1", "4\t1"), r"inside 4 by 2, got \(0, 0\) and \(4, 1\)"),
    "negative": (ROW.replace("3\t1", "-3\t1"), "whole number"),
    "no length": (ROW.replace("3.5", "nan"), "expected a length"),
    "a word": (ROW.replace("3.5", "far"), "expected a length in cells, 0 or more, got 'far'"),
}


@pytest.mark.parametrize(("text", "sentence"), BAD_ROWS.values(), ids=BAD_ROWS)
def test_what_is_wrong_with_a_row_is_said(text: str, sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        from_scen(text, FLAT)


def test_files_are_found_by_their_suffix(tmp_path: Path) -> None:
    (tmp_path / "small.map").write_bytes(MOVINGAI.encode())
    (tmp_path / "drawn.txt").write_text("#.\n")
    assert load_map(tmp_path / "small.map", cell=0.5).resolution == 0.5
    assert load_map(tmp_path / "drawn.txt", cell=0.25).cells.tolist() == [[WALL, FREE]]
    for name, sentence in (("none.map", "found none"), ("map.pgm", "give its .yaml"), ("map", "expected a map")):
        with pytest.raises(ConfigError, match=sentence):
            load_map(tmp_path / name)
    (tmp_path / "binary.map").write_bytes(b"type octile\n\xff\xfe")
    with pytest.raises(ConfigError, match="expected text"):
        load_movingai(tmp_path / "binary.map")
    (tmp_path / "folder.map").mkdir()
    with pytest.raises(ConfigError, match="found none"):
        load_map(tmp_path / "folder.map")


@needs_data
def test_public_maps_have_their_sizes() -> None:
    for file in sorted((DATA / "mapf").rglob("*.map")) + sorted((DATA / "movingai").glob("*.map")):
        loaded = load_movingai(file)
        assert (loaded.cells <= WALL).all()
        for scen in file.parent.glob(f"{file.stem}*.scen"):
            for row in load_scen(scen, loaded)[:50]:
                assert loaded.cells[row.start] == FREE
                assert loaded.cells[row.goal] == FREE
