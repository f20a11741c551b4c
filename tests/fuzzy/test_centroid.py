"""The closed form of the centroid, compared with dense integration, for any terms clipped at any heights."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.fuzzy.kernel import centroid
from swarm.fuzzy.tables import pieces_of
from swarm.fuzzy.vocabulary import Term, Variable

CELLS = 40_000  # over 0..4; corners lie between cells, so that vertical edges cost no accuracy
MIDPOINTS = (np.arange(CELLS) + 0.5) * 4 / CELLS

corners = st.lists(st.integers(0, 40), min_size=4, max_size=4).map(sorted).filter(lambda x: x[0] < x[3])
shapes = st.lists(st.tuples(corners, st.floats(0.02, 1)), min_size=1, max_size=5)


def closed_form(trapezoids: list[tuple[float, ...]], heights: list[float]) -> float:
    terms = tuple(Term(f"t{k}", *corners) for k, corners in enumerate(trapezoids))
    items = list(pieces_of(Variable("left_v", "m/s", 0.0, 4.0, terms)))
    first: dict[tuple[int, ...], int] = {}
    for k, (chosen, _) in enumerate(items):
        first.setdefault(chosen, k)
    pieces = np.array([(0, first[chosen[:-1]] if len(chosen) > 1 else -1, chosen[-1]) for chosen, _ in items])
    areas = np.array([area for _, area in items])
    scratch = np.concatenate([heights, np.zeros(len(items))])
    return centroid(0, 0, len(heights), pieces, areas, scratch)


def dense(trapezoids: list[tuple[float, ...]], heights: list[float]) -> float:
    joined = np.zeros(CELLS)
    for (a, b, c, d), height in zip(trapezoids, heights, strict=True):
        rise = (MIDPOINTS - a) / (b - a) if b > a else np.where(a < MIDPOINTS, 1.0, 0.0)
        fall = (d - MIDPOINTS) / (d - c) if d > c else np.where(d > MIDPOINTS, 1.0, 0.0)
        joined = np.maximum(joined, np.clip(np.minimum(rise, fall), 0, height))
    return float(joined @ MIDPOINTS / joined.sum())


@given(shapes)
def test_the_closed_form_is_the_dense_integrals(shape: list[tuple[list[int], float]]) -> None:
    trapezoids = [tuple(x / 10 for x in corners) for corners, _ in shape]
    heights = [height for _, height in shape]
    assert closed_form(trapezoids, heights) == pytest.approx(dense(trapezoids, heights), abs=1e-6)


@pytest.mark.parametrize(
    ("trapezoids", "heights", "expected"),
    [
        ([(0, 1, 1, 2)], [1.0], 1.0),
        ([(0, 1, 1, 2)], [1e-300], 1.0),  # as faint as can be: still a shape
        ([(0, 0, 0, 3)], [1.0], 1.0),  # a right triangle's centroid is a third in
        ([(0, 0, 1, 1), (3, 3, 4, 4)], [0.5, 0.5], 2.0),  # apart
        ([(0, 0, 2, 2), (0, 0, 2, 2)], [0.3, 0.9], 1.0),  # one within the other
        ([(0, 0, 1, 1), (1, 1, 2, 2)], [1.0, 0.5], 5 / 6),  # touching: (1 * 0.5 + 0.5 * 1.5) / 1.5
    ],
)
def test_shapes_worked_out_by_hand(trapezoids: list[tuple[float, ...]], heights: list[float], expected: float) -> None:
    assert closed_form(trapezoids, heights) == pytest.approx(expected, rel=1e-14)


def test_nothing_fired_gives_zero_and_no_division_by_it() -> None:
    assert closed_form([(0, 1, 1, 2)], [0.0]) == 0.0
