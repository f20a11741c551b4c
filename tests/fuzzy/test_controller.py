import json
import subprocess
import sys
from collections.abc import Callable
from math import inf, nan, nextafter
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from swarm.fuzzy import ControlInputError, Controller, kernel, load_profile

from . import oracle

PAPER = Controller(load_profile("paper"))
ROOT = Path(__file__).parents[2]

# left, front, right [m], head_ang [degrees, right positive] -> left_v, right_v [m/s]; the project's reference values
REFERENCE = [
    (1.60, 1.60, 1.60, 0.0, 1.5000, 1.5000),
    (1.60, 1.60, 1.60, -90.0, 1.5000, 3.0000),
    (1.60, 1.60, 1.60, 45.0, 3.0000, 1.5000),
    (1.60, 1.60, 1.60, 10.0, 2.1111, 1.5000),
    (0.30, 0.30, 0.30, 0.0, 1.0000, 3.0000),
    (0.30, 1.60, 1.60, 20.0, 3.0000, 1.5000),
    (1.60, 0.70, 1.60, -40.0, 2.6250, 1.5108),
    (0.90, 1.20, 0.75, 15.0, 1.9800, 1.8547),
    (0.65, 1.00, 1.30, -25.0, 1.3287, 1.1875),
    (1.00, 0.85, 0.95, 170.0, 2.5612, 1.4739),
    (1.10, 1.10, 1.10, -5.0, 1.5000, 1.8812),
]

# Where a term begins, peaks or ends, and the floats next to there.
CORNERS = [0.0, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6]
EDGES = sorted({y for x in CORNERS for y in (x, nextafter(x, inf), max(0.0, nextafter(x, -inf)))})
HEADING_CORNERS = [-180.0, -60.0, -30.0, -15.0, 0.0, 15.0, 30.0, 60.0, 180.0]
HEADING_EDGES = [y for x in HEADING_CORNERS for y in (nextafter(x, -inf), x, nextafter(x, inf)) if abs(y) <= 180]
distances = st.floats(0, 2) | st.sampled_from(EDGES)
headings = st.floats(-180, 180) | st.sampled_from(HEADING_EDGES)


@pytest.mark.parametrize("row", REFERENCE)
def test_reference_values(row: tuple[float, ...]) -> None:
    left, front, right, heading, *expected = row
    assert PAPER.wheel_speeds(left, front, right, heading) == pytest.approx(expected, abs=5e-5)


@given(distances, distances, distances, headings)
def test_the_centroid_is_the_dense_integrals(left: float, front: float, right: float, heading: float) -> None:
    expected = oracle.wheel_speeds(left, front, right, heading)
    assert PAPER.wheel_speeds(left, front, right, heading) == pytest.approx(expected, abs=1e-6)


@given(st.floats(0, 1e308), st.floats(0, 1e308), st.floats(0, 1e308), st.floats(-1e308, 1e308))
@example(5e-324, 0.0, 1e-310, 5e-324)
def test_any_sound_input_gives_speeds_the_tables_can_mean(
    left: float, front: float, right: float, heading: float
) -> None:
    for speed in PAPER.wheel_speeds(left, front, right, heading):
        assert 1.0 - 1e-12 <= speed <= 3.0 + 1e-12  # the centroids of slow and fast


def test_no_corner_of_the_terms_leaves_a_behaviour_without_a_rule() -> None:
    for left in EDGES:
        for front in EDGES[::2]:
            for right in EDGES[1::2]:
                for heading in (-180.0, -30.0, nextafter(-30.0, 0), 0.0, 5e-324, 30.0, 180.0):
                    explanation = PAPER.explain(left, front, right, heading)
                    firing = {rule.behaviour for rule in explanation.rules}
                    assert firing == {name for name, weight in explanation.weights.items() if weight > 0}


def test_distances_beyond_the_universe_are_clipped_and_bearings_turned_into_it() -> None:
    assert PAPER.wheel_speeds(9.0, 1e9, 1.7, 33.0) == PAPER.wheel_speeds(1.6, 1.6, 1.6, 33.0)
    assert PAPER.wheel_speeds(1.5, 1.5, 1.5, 190.0) == PAPER.wheel_speeds(1.5, 1.5, 1.5, -170.0)
    assert PAPER.wheel_speeds(1.5, 1.5, 1.5, -350.0) == PAPER.wheel_speeds(1.5, 1.5, 1.5, 10.0)
    assert PAPER.wheel_speeds(1.5, 1.5, 1.5, 720.0) == PAPER.wheel_speeds(1.5, 1.5, 1.5, 0.0)


def test_numbers_of_other_types_are_taken() -> None:
    expected = PAPER.wheel_speeds(1.0, 1.0, 0.5, 20.0)
    assert PAPER.wheel_speeds(1, 1, 0.5, 20) == expected
    assert PAPER.wheel_speeds(np.float64(1), np.float64(1), np.float64(0.5), np.float64(20)) == expected
    assert all(type(speed) is float for speed in PAPER.wheel_speeds(1, np.float64(1), 0.5, 20))


def test_many_rows_are_the_single_ones_bit_for_bit() -> None:
    rows = np.random.default_rng(1).uniform([0, 0, 0, -180], [2, 2, 2, 180], (500, 4))
    assert [tuple(row) for row in PAPER.wheel_speeds_many(rows).tolist()] == [PAPER.wheel_speeds(*row) for row in rows]
    assert PAPER.wheel_speeds_many(rows[::-2]).tolist() == PAPER.wheel_speeds_many(rows)[::-2].tolist()
    assert PAPER.wheel_speeds_many(np.empty((0, 4))).shape == (0, 2)
    with pytest.raises(ControlInputError, match=r"shape \(n, 4\), got \(4,\)"):
        PAPER.wheel_speeds_many([1, 1, 1, 0])


@given(distances, distances, distances, headings)
def test_plain_python_gives_the_compiled_bits(left: float, front: float, right: float, heading: float) -> None:
    plain = cast(Callable[..., tuple[float, float, float]], vars(kernel)["infer_into"].py_func)
    tables = PAPER.tables
    scratch = np.empty(kernel.scratch_size(tables.terms, tables.pieces))
    left_v, right_v, _ = plain(left, front, right, heading, *tables, scratch)
    assert (left_v, right_v) == PAPER.wheel_speeds(left, front, right, heading)


def test_another_process_gives_the_same_bits() -> None:
    rows = np.random.default_rng(2).uniform([0, 0, 0, -180], [1.6, 1.6, 1.6, 180], (200, 4)).tolist()
    code = (
        "import json, sys; from swarm.fuzzy import Controller, load_profile; "
        "c = Controller(load_profile('paper')); "
        "print(json.dumps([c.wheel_speeds(*row) for row in json.load(sys.stdin)]))"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], input=json.dumps(rows), cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert json.loads(out.stdout) == [list(PAPER.wheel_speeds(*row)) for row in rows]


@pytest.mark.parametrize("bad", [nan, inf, -inf])
@pytest.mark.parametrize("name", ["left_obs", "front_obs", "right_obs", "head_ang"])
def test_what_is_not_finite_is_refused_by_name(name: str, bad: float) -> None:
    inputs = {"left_obs": 1.0, "front_obs": 1.0, "right_obs": 1.0, "head_ang": 0.0} | {name: bad}
    with pytest.raises(ControlInputError, match=f"^{name}: expected a finite number, got {bad}"):
        PAPER.wheel_speeds(*inputs.values())
    with pytest.raises(ControlInputError, match=f"^{name}: expected a finite number"):
        PAPER.explain(*inputs.values())
    with pytest.raises(ControlInputError, match=f"^row 1: {name}: "):
        PAPER.wheel_speeds_many(np.array([[1, 1, 1, 0], list(inputs.values())]))


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_negative_distance_is_refused(place: int) -> None:
    inputs = [1.0, 1.0, 1.0, 0.0]
    inputs[place] = -1e-9
    with pytest.raises(ControlInputError, match=r"expected a distance >= 0 m, got -1e-09"):
        PAPER.wheel_speeds(*inputs)
    inputs[place] = -0.0
    assert PAPER.wheel_speeds(*inputs) == PAPER.wheel_speeds(*map(abs, inputs))
