"""Rates, gaps, ages and senders as tables, and which fleet is meant."""

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bus import Sample
from swarm.cli.look.echo import WIDTH, format_message
from swarm.cli.look.rates import Beat, KeyTraffic, sender, topic_of
from swarm.errors import ConfigError
from swarm.launch.fleet_registry import NAME, default_fleet_name, select_fleet
from swarm.messages import REPLIES, TOPICS


def sample(key: str, at: float, size: int = 10) -> Sample:
    return Sample(key, bytes(size), at)


# fmt: off
SENDERS = {  # key: (who, the message's type)
    "robot/r1/sense":  ("world", "Sense"),
    "robot/r1/cmd":    ("r1",    "Command"),
    "robot/r12/state": ("r12",   "State"),
    "robot/r1/plan":   ("r1",    "Plan"),
    "radio/-1/3/r2":   ("r2",    "Broadcast"),
    "world/truth":     ("world", "Truth"),
    "world/clock":     ("world", "Clock"),
    "world/none":      ("?",     None),
    "robot/r1":        ("?",     None),
    "":                ("?",     None),
}
# fmt: on


@pytest.mark.parametrize("key", SENDERS)
def test_the_table_of_topics_says_who_sends_what(key: str) -> None:
    who, message = SENDERS[key]
    topic = topic_of(key)
    assert (sender(key), topic.message.__name__ if topic else None) == (who, message)


def test_every_topic_that_is_published_has_a_sender() -> None:
    keys = {topic.key.format(robot="r1", zx=0, zy=0) for topic in TOPICS}
    asked_for = {key.format(robot="r1") for key in REPLIES}
    assert {key for key in keys if sender(key) == "?"} == asked_for


def test_a_row_of_each_key_has_rate_size_and_age() -> None:
    traffic = KeyTraffic(since=100.0)
    for number in range(20):
        traffic.take(sample("robot/r1/cmd", 100.0 + 0.1 * number, size=50 + number % 2 * 100))
    traffic.take(sample("elsewhere", 101.5))
    other, cmd = traffic.rows(now=102.0)
    assert (cmd.key, cmd.who) == ("robot/r1/cmd", "r1")
    assert (cmd.rate, cmd.usual, cmd.size, cmd.bytes) == pytest.approx((10.0, 20.0, 100.0, 1000.0))
    assert cmd.age == pytest.approx(0.1)
    assert (other.key, other.rate, other.usual, other.age, other.who) == ("elsewhere", 0.5, None, 0.5, "?")


def test_losses_add_up_on_each_key() -> None:
    traffic, beat = KeyTraffic(since=100.0), Beat()
    for number, lost in enumerate((0, 2, 0, 3)):
        one = replace(sample("robot/r1/cmd", 100.0 + number), lost=lost)
        traffic.take(one)
        beat.take(one)
    traffic.take(sample("robot/r2/cmd", 101.0))
    assert [row.lost for row in traffic.rows(now=104.0)] == [5, 0]
    pace = beat.pace()
    assert pace is not None
    assert pace.lost == 5


def test_nothing_heard_has_no_rows() -> None:
    assert KeyTraffic(since=0.0).rows(now=3.0) == []


# fmt: off
BEATS = {  # name: (times [s], (Hz, smallest gap [s], largest, deviation), None: unknown)
    "even":       ([0.0, 0.5, 1.0, 1.5], (2.0, 0.5, 0.5, 0.0)),
    "uneven":     ([0.0, 0.1, 0.4],      (5.0, 0.1, 0.3, 0.1)),
    "one":        ([1.0],                None),
    "none":       ([],                   None),
    "all at once": ([1.0, 1.0],          None),
}
# fmt: on


@pytest.mark.parametrize("name", BEATS)
def test_the_pace_of_a_key(name: str) -> None:
    times, expected = BEATS[name]
    beat = Beat()
    for at in times:
        beat.take(sample("k", at, size=100))
    pace = beat.pace()
    if expected is None:
        assert pace is None
        return
    assert pace is not None
    assert (pace.rate, pace.gap_min, pace.gap_max, pace.gap_deviation) == pytest.approx(expected)
    assert pace.bytes == pytest.approx(100 * pace.rate)
    assert pace.messages == len(times)


@given(st.lists(st.floats(0.001, 10.0), min_size=1, max_size=40))
def test_the_mean_gap_lies_between_the_smallest_and_the_largest(gaps: list[float]) -> None:
    beat, at = Beat(), 0.0
    beat.take(sample("k", at))
    for gap in gaps:
        at += gap
        beat.take(sample("k", at))
    pace = beat.pace()
    assert pace is not None
    assert pace.gap_min - 1e-9 <= 1 / pace.rate <= pace.gap_max + 1e-9
    assert pace.gap_deviation <= pace.gap_max - pace.gap_min + 1e-9


def test_only_the_newest_samples_count() -> None:
    beat = Beat(window=3)
    for at in (0.0, 50.0, 50.5, 51.0):
        beat.take(sample("k", at))
    pace = beat.pace()
    assert pace is not None
    assert (pace.messages, pace.rate) == (3, 2.0)


# fmt: off
CHOICES = {  # wanted, names that run: the chosen one, or what the sentence says
    "the only one":  (None,   ["a"],      "a"),
    "the named one": ("b",    ["a", "b"], "b"),
    "none runs":     (None,   [],         "expected a fleet running here, found none; start one"),
    "several run":   (None,   ["a", "b"], "expected one running fleet here, found a, b; name one with --fleet"),
    "a wrong name":  ("c",    ["a", "b"], "expected a running fleet, got 'c'; running here: a, b"),
    "none to name":  ("c",    [],         "expected a running fleet, got 'c'; none runs here; start one"),
}
# fmt: on


@pytest.mark.parametrize("name", CHOICES)
def test_which_fleet_is_meant(name: str) -> None:
    wanted, names, expected = CHOICES[name]
    if expected in names:
        assert select_fleet(wanted, names, "here") == expected
    else:
        with pytest.raises(ConfigError, match=expected):
            select_fleet(wanted, names, "here")


@given(st.text(max_size=70), st.from_regex(r"[A-Za-z0-9_.:-]{1,64}", fullmatch=True))
def test_every_user_gets_a_fleet_name_that_is_allowed(user: str, scenario: str) -> None:
    assert re.match(NAME, default_fleet_name(scenario, user))


def test_two_users_do_not_meet() -> None:
    assert default_fleet_name("paper", "anna") != default_fleet_name("paper", "ben")


def test_a_message_is_shown_within_the_width_of_a_terminal() -> None:
    fields = {"robot": "r1", "held": list(range(100)), "text": "two\nlines"}
    lines = format_message(sample("robot/r1/cmd", 0.0, size=7), fields).splitlines()
    assert lines[0] == "robot/r1/cmd  7 bytes"
    assert lines[1] == "  robot: r1"
    assert lines[2].startswith("  held: [0, 1, 2")
    assert lines[2].endswith(" ...")
    assert lines[3] == "  text: two lines"
    assert max(map(len, lines)) <= WIDTH
