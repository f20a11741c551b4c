"""One PIBT step for all robots: what never happens, who comes nearer, and how two robots swap."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.traffic.mapf.pibt import Configuration, StepGenerator, TieBreak
from swarm.traffic.mapf.schedule import BACK, CORNER, ON_THE_SPOT, makespan_and_flowtime
from tests.traffic.maps import Drawn

FLOORS = (Drawn("....", "....", "...."), Drawn("..#.", ".#..", "...."), Drawn("#.##.", ".....", "#.##."))
LIMIT = 60  # steps


def generator(floor: Drawn, goals: Configuration, ties: TieBreak, seed: int) -> StepGenerator:
    tables = [floor.cells.distances(goal) for goal in goals]
    return StepGenerator(floor.cells.neighbours, tables, goals, ties=ties, random=Random(seed))


def assert_can_be_done(floor: Drawn, before: Configuration, after: Configuration) -> None:
    """Each goes to a neighbour or stays; no two to one cell; no two, nor a ring, into each other's cells at once."""
    assert len(set(after)) == len(after)
    for cell, to in zip(before, after, strict=True):
        assert to == cell or to in floor.cells.neighbours[cell]
    entered = {cell: to for cell, to in zip(before, after, strict=True) if cell != to}
    for first in entered:
        cell = entered[first]
        while cell in entered and cell != first:
            cell = entered[cell]
        assert cell != first, "a ring"


crowds = st.tuples(st.sampled_from(FLOORS), st.integers(0, 1000), st.sampled_from(TieBreak)).flatmap(
    lambda drawn: st.tuples(
        st.just(drawn),
        st.permutations([cell for cell, near in enumerate(drawn[0].cells.neighbours) if near]),
        st.permutations([cell for cell, near in enumerate(drawn[0].cells.neighbours) if near]),
        st.integers(1, 6),
    )
)


@given(crowds, st.data())
def test_a_step_can_be_done_obeys_and_leaves_nothing_behind(
    crowd: tuple[tuple[Drawn, int, TieBreak], list[int], list[int], int], data: st.DataObject
) -> None:
    (floor, seed, ties), starts, goals, robots = crowd
    at, wanted = tuple(starts[:robots]), tuple(goals[:robots])
    priority = data.draw(st.permutations(range(robots)))
    ordered = data.draw(st.integers(0, robots))
    orders = tuple(
        (robot, data.draw(st.sampled_from([*floor.cells.neighbours[at[robot]], at[robot]])))
        for robot in priority[:ordered]
    )
    stepping = generator(floor, wanted, ties, seed)
    after = stepping.step(at, at, priority, orders)
    assert after is not None or orders, "who is not ordered about can always stay"
    if after is not None:
        assert_can_be_done(floor, at, after)
        assert all(after[robot] == cell for robot, cell in orders)
    again = generator(floor, wanted, ties, seed)
    assert again.step(at, at, priority, orders) == after
    assert again.step(wanted, wanted, priority, ()) == stepping.step(wanted, wanted, priority, ())


@given(crowds)
def test_who_comes_first_comes_nearer_on_an_open_floor(
    crowd: tuple[tuple[Drawn, int, TieBreak], list[int], list[int], int],
) -> None:
    (_, seed, ties), _, _, robots = crowd
    floor, chance = FLOORS[0], Random(seed)
    at, goals = (tuple(chance.sample(range(12), robots)) for _ in range(2))
    after = generator(floor, goals, ties, seed).step(at, at, range(robots), ())
    assert after is not None
    table = floor.cells.distances(goals[0])
    assert table[after[0]] == max(0, table[at[0]] - 1)


# fmt: off
SWAPS = {  # a map: where two stand, who change places; the most steps it takes, by chance and straight on
    "a junction beside them":     (Drawn("a..b", "#.##"),               "ab", 9),
    "in a tee":                   (Drawn("ab.", "#.#"),                 "ab", 5),
    "at a crossing":              (Drawn("#.#", ".ab", "#.#"),          "ab", 7),
    "a crossing behind them":     (Drawn("##.####", "abc....", "##.####"), "ab", 9),
    "a room at the far end":      (Drawn("ab...#", "####..", "####.#"), "ab", 19),
}
# fmt: on


@pytest.mark.parametrize("ties", [TieBreak.RANDOM, TieBreak.STRAIGHT])
@pytest.mark.parametrize("name", SWAPS)
def test_two_in_a_passage_change_places_where_it_widens(name: str, ties: TieBreak) -> None:
    floor, letters, most = SWAPS[name]
    starts, goals = floor.at(letters), floor.at(letters[::-1])
    for seed in range(6):
        stepping, at, before, steps = generator(floor, goals, ties, seed), starts, starts, 0
        while at != goals and steps < LIMIT:
            first = sorted(range(2), key=lambda robot: at[robot] == goals[robot])
            after = stepping.step(at, before, first, ())
            assert after is not None
            before, at, steps = at, after, steps + 1
        assert steps <= most, seed


def test_who_goes_straight_on_does_so_where_all_ways_are_as_good() -> None:
    floor = Drawn("...", "...", "...")
    for seed in range(20):
        stepping = generator(floor, (8,), TieBreak.STRAIGHT, seed)
        assert stepping.step((1,), (0,), (0,), ()) == (2,)
        assert stepping.step((3,), (0,), (0,), ()) == (6,)
    by_chance = {generator(floor, (8,), TieBreak.RANDOM, seed).step((1,), (0,), (0,), ()) for seed in range(20)}
    assert by_chance == {(2,), (4,)}


# fmt: off
DURATIONS: dict[str, tuple[list[Configuration], tuple[float, float], int]] = {  # steps of all robots: when the last arrives, and the sum of all arrivals, both without corners; corners of the last one; five cells a row
    "nobody moves":                ([(0,)],                                   (0.0, 0.0), 0),
    "straight on":                 ([(0,), (1,), (2,)],                       (2.0, 2.0), 0),
    "round a corner":              ([(0,), (1,), (6,)],                       (1.0, 1.0), 1),
    "round two":                   ([(0,), (1,), (6,), (7,)],                 (1.0, 1.0), 2),
    "there and back":              ([(0,), (1,), (0,)],                       (1.0 + BACK, 1.0 + BACK), 0),
    "it stands in between":        ([(0,), (1,), (1,), (2,)],                 (2.0, 2.0), 0),
    "two apart":                   ([(0, 10), (1, 10), (2, 11)],              (2.0, 3.0), 0),
    "one after the other":         ([(0, 5), (1, 0), (2, 1)],                 (2.0, 4.0), 1),
    "it waits for who comes by":   ([(0, 2, 9), (1, 2, 9), (1, 7, 9), (2, 7, 8)], (2.0, 4.0), 0),
}
# fmt: on


@pytest.mark.parametrize("corner", [CORNER, ON_THE_SPOT])
@pytest.mark.parametrize("name", DURATIONS)
def test_how_long_a_plan_takes_is_counted_in_steps_turns_and_waits(name: str, corner: float) -> None:
    steps, (last, total), corners = DURATIONS[name]
    expected = last + corners * corner, total + corners * corner
    assert makespan_and_flowtime(steps, corner) == pytest.approx(expected)
