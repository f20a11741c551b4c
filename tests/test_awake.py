"""The clock that stands while its process does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.suspend_clock import LONGEST, Awake

pauses = st.lists(st.floats(0.0, 100.0), max_size=20)


def times(read: list[float]) -> list[float]:
    clock = Awake(iter(read).__next__)
    return [clock.now() for _ in read[1:]]


@pytest.mark.parametrize(
    ("read", "told"),
    [
        ([5.0, 5.0, 5.5, 6.25], [0.0, 0.5, 1.25]),
        ([5.0, 5.25, 10.25, 10.5], [0.25, 0.25 + LONGEST, 0.5 + LONGEST]),  # stopped for 5 s
    ],
)
def test_it_leaves_out_the_time_in_which_nobody_looked(read: list[float], told: list[float]) -> None:
    assert times(read) == told


@given(pauses)
def test_it_never_goes_back_and_never_faster_than_the_clock(steps: list[float]) -> None:
    read = [sum(steps[:count]) for count in range(len(steps) + 1)]
    told = [0.0, *times(read)]
    for before, after, step in zip(told, told[1:], steps, strict=False):
        assert 0.0 <= after - before <= min(step, LONGEST) + 1e-9
