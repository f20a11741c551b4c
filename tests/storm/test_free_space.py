"""The distance to the nearest solid square, against every square in turn."""

from math import hypot

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from swarm.storm.free_space import gaps

SIDE = 0.2  # m
PLACES = st.tuples(st.integers(-8, 48), st.integers(-8, 48))  # in quarters of a square: edges and corners too


@given(
    solid=arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.booleans(), fill=st.just(True)),
    places=st.lists(PLACES, min_size=1, max_size=20),
)
def test_the_nearest_solid_square_is_found(solid: NDArray[np.bool_], places: list[tuple[int, int]]) -> None:
    points = np.array(places) * SIDE / 4
    least = [
        min(
            (
                hypot(max(column * SIDE - x, x - (column + 1) * SIDE, 0.0), max(row * SIDE - y, y - (row + 1) * SIDE, 0.0))
                for row, column in np.argwhere(solid).tolist()
            ),
            default=np.inf,
        )
        for x, y in points.tolist()
    ]  # fmt: skip
    np.testing.assert_allclose(gaps(solid, SIDE, points), least, atol=1e-9)
