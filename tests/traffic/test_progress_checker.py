"""The ticks since a way last became shorter, and the time since a robot left a place."""

import pytest

from swarm.traffic.progress_checker import PlaceChecker, ProgressChecker

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
    checker = ProgressChecker(LONGER)
    assert [checker.check(left, counts=True) for left in lefts] == ticks


def test_ticks_that_do_not_count_and_a_new_way() -> None:
    checker = ProgressChecker(LONGER)
    assert [checker.check(5, counts=counts) for counts in (True, True, False, True)] == [0, 1, 1, 2]
    assert [checker.check(5, counts=True, new=new) for new in (True, False, True)] == [0, 1, 0]


def test_a_robot_makes_progress_once_it_has_moved_farther_than_the_radius() -> None:
    checker = PlaceChecker(0.5)
    moves = [(1.0, 0.0), (2.0, 0.5), (3.0, 0.51), (4.0, 0.9), (5.0, 0.0)]  # s, m
    assert [checker.check((x, 0.0), time) for time, x in moves] == [0.0, 1.0, 0.0, 1.0, 0.0]
    checker.restart((0.0, 0.0), 6.0)
    assert checker.check((0.0, 0.5), 8.0) == 2.0
    checker.forget()
    assert checker.check((0.0, 0.5), 9.0) == 0.0
    assert PlaceChecker(0.5, (0.0, 0.0)).check((0.3, 0.4), 7.0) == 7.0, "it has been there from the beginning"
