"""The timetable and the stopwatch, on a clock that the test sets."""

import pytest

from world.host import pace
from world.host.pace import SLIP, Stopwatch, Times, Timetable


class Clock:
    """A wall clock that stands until it is told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        for name in ("monotonic", "perf_counter"):
            monkeypatch.setattr(pace, name, lambda: self.now)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


@pytest.mark.parametrize(("factor", "period"), [(1.0, 0.05), (2.0, 0.025), (0.5, 0.1), (10.0, 0.005)])
def test_a_tick_lasts_as_long_as_the_factor_says(clock: Clock, factor: float, period: float) -> None:
    timetable = Timetable(0.05, factor)
    assert timetable.time_left == 0.0
    for tick in range(1, 5):
        timetable.tick()
        assert timetable.time_left == pytest.approx(tick * period)
    clock.now += 4 * period
    assert timetable.time_left == pytest.approx(0.0, abs=1e-12)


def test_being_late_is_caught_up_as_far_as_it_may(clock: Clock) -> None:
    for late, caught_up in ((0.2, 0.2), (SLIP - 0.05, SLIP - 0.05), (SLIP + 0.05, SLIP), (60.0, SLIP)):
        timetable = Timetable(0.05, 1.0)
        clock.now += 0.05 + late
        timetable.tick()
        ticks = 0
        while timetable.time_left == 0.0:
            timetable.tick()
            ticks += 1
        assert ticks * 0.05 - timetable.time_left == pytest.approx(caught_up), late
        assert ticks <= 20, "no burst of more than a second's ticks"


def test_after_a_pause_it_begins_anew(clock: Clock) -> None:
    timetable = Timetable(0.05, 1.0)
    clock.now += 30.0
    timetable.start()
    timetable.tick()
    assert timetable.time_left == pytest.approx(0.05)


def test_a_slow_tick_shows_in_the_times_and_one_that_is_not_answered_takes_its_period(clock: Clock) -> None:
    timetable = Timetable(0.05, 1.0)
    for tick in range(1000):
        timetable.tick()
        clock.now += 0.01
        assert timetable.look(answered=False) == pytest.approx(0.04)
        clock.now += 0.03 if tick == 500 else 0.0
        timetable.look(answered=tick != 700)
        clock.now += timetable.time_left
        timetable.look(answered=True)  # a tick counts once
    assert timetable.times.report() == pytest.approx({"p50": 0.01, "p99": 0.01, "p99.9": 0.04, "max": 0.05}, rel=0.011)


def test_a_world_that_begins_its_tick_late_has_spent_that_time(clock: Clock) -> None:
    timetable = Timetable(0.05, 1.0)
    timetable.tick()
    clock.now += 0.08
    timetable.look(answered=True)
    timetable.tick()
    timetable.look(answered=True)
    assert timetable.times.time_within(0.5) == pytest.approx(0.03, rel=0.011), "the second tick"
    assert timetable.times.time_within(1.0) == pytest.approx(0.08), "the first"


@pytest.mark.parametrize("seconds", [0.0, 1e-6, 0.00123, 7.0, 90.0])
def test_times_of_any_length_are_counted(seconds: float) -> None:
    times = Times()
    assert times.report() is None
    times.add(seconds)
    report = times.report() or {}
    assert list(report) == ["p50", "p99", "p99.9", "max"]
    assert list(report.values()) == pytest.approx([seconds] * 4, rel=0.011)


def test_a_stopwatch_leaves_the_pauses_out(clock: Clock) -> None:
    watch = Stopwatch()
    shown = []
    # fmt: off
    for what in (watch.halt, watch.go, watch.go, watch.halt, watch.halt, watch.go):
        what()
        clock.now += 1.0
        shown.append(watch.seconds)
    # fmt: on
    assert shown == pytest.approx([0.0, 1.0, 2.0, 2.0, 2.0, 3.0])
