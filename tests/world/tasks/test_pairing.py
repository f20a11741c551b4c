"""The cheapest pairs, with scipy's solver of the same problem as the judge."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from world.tasks.assignment import cheapest_pairs
from world.tasks.dispatcher import LAST, NO_BID

Costs = NDArray[np.float64]

STEPS = st.integers(0, 40).map(lambda steps: 0.6 * steps)  # m, ways over cells: many are equal
BIDS = st.one_of(STEPS, st.just(NO_BID), STEPS.map(lambda bid: bid + LAST), st.floats(-50, 200))  # as the dispatch has


@given(arrays(np.float64, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=BIDS))
def test_the_pairs_cost_as_little_as_those_of_the_judge(costs: Costs) -> None:
    pairs = cheapest_pairs(costs)
    assert len({row for row, _ in pairs}) == len({column for _, column in pairs}) == len(pairs) == min(costs.shape)
    assert pairs == sorted(pairs)
    judge = list(zip(*linear_sum_assignment(costs), strict=True))
    found, least = (sum(costs[pair] for pair in some) for some in (pairs, judge))
    assert abs(found - least) <= 1e-9 * max(1.0, abs(least))


@given(arrays(np.int64, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.integers(0, 3)))
def test_among_equally_cheap_pairs_the_choice_is_that_of_the_judge(whole: NDArray[np.int64]) -> None:
    """Runs that were recorded with the judge's solver have the same digest."""
    costs = whole.astype(np.float64)
    assert cheapest_pairs(costs) == list(zip(*(side.tolist() for side in linear_sum_assignment(costs)), strict=True))


def test_as_many_errands_and_robots_as_there_may_be() -> None:
    costs = np.random.default_rng(1).random((256, 64))
    rows, columns = linear_sum_assignment(costs)
    assert cheapest_pairs(costs) == list(zip(rows.tolist(), columns.tolist(), strict=True))
