"""The path checker: it names the fault of every bad path and finds none in good ones."""

import numpy as np
import pytest

from swarm.maps.occupancy import Cell, Point
from swarm.maps.text import from_text
from swarm.planning.path_check import Judge, PathFault, check_cells

FREE = np.array([[symbol == "." for symbol in line] for line in ("....", ".##.", "....", "...#")])
ALONG_THE_TOP: list[Cell] = [(0, 0), (0, 1), (0, 2), (0, 3)]

CELLS = {
    "good": (ALONG_THE_TOP, 3.0, set()),
    "good, length not claimed": (ALONG_THE_TOP, None, set()),
    "good, within tolerance": (ALONG_THE_TOP, 3.00009, set()),
    "no cells": ([], None, {PathFault.NO_PATH}),
    "starts elsewhere": (ALONG_THE_TOP[1:], 2.0, {PathFault.WRONG_START}),
    "ends elsewhere": (ALONG_THE_TOP[:-1], 2.0, {PathFault.WRONG_GOAL}),
    "backwards": (ALONG_THE_TOP[::-1], 3.0, {PathFault.WRONG_START, PathFault.WRONG_GOAL}),
    "a cell left out": ([(0, 0), (0, 1), (0, 3)], 3.0, {PathFault.JUMPS}),
    "a cell twice": ([(0, 0), (0, 0), *ALONG_THE_TOP[1:]], 3.0, {PathFault.JUMPS}),
    "through the wall": (
        [(0, 0), (0, 1), (1, 1), (0, 2), (0, 3)],
        None,
        {PathFault.ENTERS_SOLID, PathFault.CUTS_CORNER},
    ),
    "over the edge": ([(0, 0), (-1, 0), (-1, 1), (0, 1), (0, 2), (0, 3)], None, {PathFault.LEAVES_MAP}),
    "past the corner": ([(0, 0), (0, 1), (0, 2), (1, 3), (0, 3)], None, {PathFault.CUTS_CORNER}),
    "claims to be shorter": (ALONG_THE_TOP, 2.9, {PathFault.WRONG_LENGTH}),
    "claims straight for diagonal": (
        [(2, 0), (3, 1)],
        1.0,
        {PathFault.WRONG_START, PathFault.WRONG_GOAL, PathFault.WRONG_LENGTH},
    ),
}


@pytest.mark.parametrize(("cells", "length", "faults"), CELLS.values(), ids=CELLS)
def test_cells(cells: list[Cell], length: float | None, faults: set[PathFault]) -> None:
    assert {finding.fault for finding in check_cells(FREE, (0, 0), (0, 3), cells, length)} == faults


def test_start_and_goal_in_one_cell_are_a_path() -> None:
    assert check_cells(FREE, (0, 0), (0, 0), [(0, 0)], 0.0) == []


MAP = from_text("......\n..##..\n......", 1.0)
START, GOAL = (0.5, 0.5), (5.5, 0.5)

POINTS: dict[str, tuple[list[Point], float | None, set[PathFault]]] = {
    "good": ([START, GOAL], 5.0, set()),
    "one point": ([START], None, {PathFault.NO_PATH}),
    "no number": ([START, (float("nan"), 0.5), GOAL], None, {PathFault.NO_PATH}),
    "starts elsewhere": ([(0.6, 0.5), GOAL], None, {PathFault.WRONG_START}),
    "ends elsewhere": ([START, (5.4, 0.5)], None, {PathFault.WRONG_GOAL}),
    "through the wall": ([START, (3.0, 1.5), GOAL], None, {PathFault.ENTERS_SOLID}),
    "grazes a corner": ([START, (2.0, 1.0), GOAL], None, {PathFault.ENTERS_SOLID}),
    "too near a corner": ([START, (2.0, 0.75), GOAL], None, {PathFault.TOO_NEAR}),
    "too near the edge": ([START, (3.0, 0.25), GOAL], None, {PathFault.TOO_NEAR}),
    "out of the map": ([START, (3.0, -0.5), GOAL], None, {PathFault.LEAVES_MAP, PathFault.ENTERS_SOLID}),
    "claims to be longer": ([START, GOAL], 5.1, {PathFault.WRONG_LENGTH}),
}


@pytest.mark.parametrize(("points", "length", "faults"), POINTS.values(), ids=POINTS)
def test_points(points: list[Point], length: float | None, faults: set[PathFault]) -> None:
    assert {finding.fault for finding in Judge(MAP, 0.3).faults(START, GOAL, points, length)} == faults


def test_a_start_too_near_is_not_the_paths_fault_but_going_nearer_is() -> None:
    judge, start = Judge(MAP, 0.3), (0.2, 0.5)
    assert judge.faults(start, GOAL, [start, START, GOAL]) == []
    nearer = judge.faults(start, GOAL, [start, (0.1, 0.5), START, GOAL])
    assert [finding.fault for finding in nearer] == [PathFault.TOO_NEAR]
    assert "near (" in nearer[0].where


def test_a_map_without_walls_has_an_edge() -> None:
    judge = Judge(from_text("..\n..", 1.0), 0.3)
    assert judge.faults((1.0, 1.0), (1.5, 1.0), [(1.0, 1.0), (1.5, 1.0)]) == []
    assert [f.fault for f in judge.faults((1.0, 1.0), (1.9, 1.0), [(1.0, 1.0), (1.9, 1.0)])] == [PathFault.TOO_NEAR]
