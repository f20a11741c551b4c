"""The ticks since a way last became shorter."""

import pytest

from swarm.traffic.progress_checker import ProgressChecker

LONGER = 2


@pytest.mark.parametrize(
    ("lefts", "ticks"),
    [
        ([5, 5, 5], [0, 1, 2]),
        ([5, 4, 4], [0, 0, 1]),
        ([5, 6, 7], [0, 1, 2]),  # a detour
        ([5, 6, 8, 8], [0, 1, 0, 1]),  # another way
        ([5, 6, 5, 4], [0, 1, 2, 0]),  # back on the old one
        ([0, 0], [0, 1]),
    ],
)
def test_only_a_shorter_way_or_another_one_begins_anew(lefts: list[int], ticks: list[int]) -> None:
    getting_on = ProgressChecker(LONGER)
    assert [getting_on.look(left, counts=True) for left in lefts] == ticks


def test_ticks_that_do_not_count_and_a_new_way() -> None:
    getting_on = ProgressChecker(LONGER)
    assert [getting_on.look(5, counts=counts) for counts in (True, True, False, True)] == [0, 1, 1, 2]
    assert [getting_on.look(5, counts=True, new=new) for new in (True, False, True)] == [0, 1, 0]
