"""How long a robot has made no progress, by the clock of the caller: its way is no shorter, or it is at one place."""

import pytest

from swarm.traffic.progress_checker import ProgressChecker, make_movement_test, make_way_length_test


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
    checker = ProgressChecker(make_way_length_test(longer=2))
    assert [checker.check(left, tick) for tick, left in enumerate(lefts)] == ticks


def test_a_clock_that_stands_and_a_way_that_is_no_new_one() -> None:
    checker = ProgressChecker(make_way_length_test())
    assert [checker.check(left, clock) for left, clock in ((5, 1), (9, 2), (99, 2), (5, 3), (4, 4))] == [0, 1, 1, 2, 0]


def test_a_robot_makes_progress_once_it_has_moved_farther_than_the_radius() -> None:
    checker = ProgressChecker(make_movement_test(0.5))
    moves = [(1.0, 0.0), (2.0, 0.5), (3.0, 0.51), (4.0, 0.9), (5.0, 0.0)]  # s, m
    assert [checker.check((x, 0.0), time) for time, x in moves] == [0.0, 1.0, 0.0, 1.0, 0.0]
    checker.restart((0.0, 0.0), 6.0)
    assert checker.check((0.3, 0.4), 8.0) == 2.0
    checker.forget()
    assert checker.check((0.3, 0.4), 9.0) == 0.0
