"""Relations that the constants of traffic must keep."""

from dataclasses import fields, replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.traffic.settings import LEAST_CLAIM, NEAR, ROLLS_ON, TrafficConstants

SETTINGS = TrafficConstants()

# fmt: off
ORDERS: dict[str, tuple[str, ...]] = {  # each of these is less than the next: why
    "a robot is heard several times before it counts as silent, and called dead long after":
        ("often", "every", "ripe", "listen", "fresh", "absent", "surmise", "obstacle", "keep", "emptied"),
    "who was away longer than it may have been late is told from who was late":   ("every", "gap", "fresh"),
    "a leader waits less than its members stand":                                ("again", "gather", "gather_longest", "freeze"),
    "nobody asks for a plan before the last one can have moved anybody":          ("gather", "calm", "stuck", "plan_stuck"),
    "a plan that nobody moves in is given up before the silent are looked for":   ("absent", "plan_stuck", "surmise"),
    "who does not answer is passed over before the same is tried again":          ("gather", "pass_over", "backoff"),
    "a body stops it farther off than walls are doubted":                         ("unexpected", "stop_distance", "sensor_range"),
    "a robot tells more of its way than it holds":                                ("horizon", "ahead"),
    "the body fits with its margin in half a look":                               ("margin", "radius", "stop_distance"),
    "a share of a search is less than all of it":                                 ("starts", "robot_openings", "expansions", "enough"),
}
# fmt: on


@pytest.mark.parametrize("why", ORDERS)
def test_constants_keep_their_order(why: str) -> None:
    values = [getattr(SETTINGS, name) for name in ORDERS[why]]
    assert all(a < b for a, b in pairwise(values)), dict(zip(ORDERS[why], values, strict=True))


# fmt: off
DRIVEN = {  # speed at first [m/s], time [s]: how far [m], how fast then [m/s], of a robot with 0.9 m/s and 2 m/s2
    "no time":                      (0.3,  0.0,  0.0,               0.3),
    "it gains speed":               (0.0,  0.2,  0.04,              0.4),
    "to its highest, no further":   (0.5,  1.0,  0.2 * 0.7 + 0.72,  0.9),
    "at its highest already":       (0.9,  1.0,  0.9,               0.9),
    "nobody knows":                 (None, 1.0,  0.9,               0.9),
    "it says more than it can":     (5.0,  1.0,  0.9,               0.9),
}
# fmt: on


@pytest.mark.parametrize("case", DRIVEN)
def test_how_far_a_robot_may_have_driven(case: str) -> None:
    speed, time, way, top = DRIVEN[case]
    assert replace(SETTINGS, speed=0.9, acceleration=2.0).reach_after(speed, time) == pytest.approx((way, top))


@given(st.floats(0.0, 0.9), st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_two_times_one_after_the_other_are_their_sum(speed: float, first: float, second: float) -> None:
    way, later = SETTINGS.reach_after(speed, first)
    rest, last = SETTINGS.reach_after(later, second)
    assert (way + rest, last) == pytest.approx(SETTINGS.reach_after(speed, first + second))
    assert way <= SETTINGS.speed * first + 1e-12


def test_no_time_is_longer_than_a_few_minutes() -> None:
    ticks = {field.name: getattr(SETTINGS, field.name) for field in fields(SETTINGS) if field.type is int}
    counts = {"starts", "enough", "expansions", "robot_openings"}
    assert max(value for name, value in ticks.items() if name not in counts) * SETTINGS.tick <= 120.0


def test_a_claim_is_ripe_when_everybody_has_spoken_twice() -> None:
    assert SETTINGS.ripe == 2 * SETTINGS.every
    assert SETTINGS.listen >= 3 * SETTINGS.ripe


@pytest.mark.parametrize("reach", [3.0, 8.0, 20.0])
def test_two_that_claim_one_cell_hear_each_other_wherever_they_are(reach: float) -> None:
    settings = replace(SETTINGS, radio_range=reach)
    assert settings.claim_radius == pytest.approx((reach - 1.0) / 2)
    assert 2 * settings.claim_radius <= reach - 1.0 + 1e-9, "and have a metre to spare"
    a_second_of_two = 2 * 1.0 * settings.speed
    assert (
        settings.claim_radius + a_second_of_two
        <= settings.alone_distance
        <= settings.claim_radius + 3 * a_second_of_two
    )


@pytest.mark.parametrize("reach", [3.4, 5.0, 8.0, 9.0, 20.0, 50.0])
@pytest.mark.parametrize("side", [0.9, 1.2, 2.0])
def test_who_could_claim_the_same_cell_is_asked_and_nobody_out_of_hearing(reach: float, side: float) -> None:
    settings = replace(SETTINGS, radio_range=reach)
    asks = settings.asking_distance(side)
    farthest = 2 * min(settings.claim_radius, (settings.horizon + 1) * side)  # from which two can claim one cell
    assert asks <= reach
    every = settings.every * settings.tick  # s
    assert asks - farthest >= 1.0 > 2 * every * 2 * settings.speed, "they hear each other twice before they are there"


def test_who_stands_fits_in_a_cell_of_four_radii_and_who_leans_in_one_of_six() -> None:
    assert SETTINGS.radius + SETTINGS.margin + NEAR < SETTINGS.standing_room < 2 * SETTINGS.radius
    assert SETTINGS.standing_room + ROLLS_ON < SETTINGS.leaning_room < 3 * SETTINGS.radius
    assert 1.0 < LEAST_CLAIM < 2.0, "the next cell's centre, and a little"
