"""The liveliness: alive, stale, gone and lost, since when, and the events that tell of it."""

from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.messages import STATE, Liveness, Seen
from world.fleet.liveness import NEXT, STEP, TOLD, Fact, Liveliness
from world.tasks.standstill import LOST

SILENT = STATE.timeout + 0.5  # s
ALIVE, STALE, GONE, MISSED = Liveness.ALIVE, Liveness.STALE, Liveness.GONE, Liveness.LOST


class Fleet:
    """A liveliness of one robot, looked at every half second; the clock runs."""

    def __init__(self) -> None:
        self.liveliness = Liveliness(["r1"], 0.0)
        self.now = self.away = 0.0
        self.told: list[str] = []

    def pass_by(
        self, seconds: float, *, here: bool, speaks: bool = True, running: bool = True, gone: bool = False,
        expected: bool = False,
    ) -> Liveness:  # fmt: skip
        """Let time go by; a robot that has ``gone`` did so at its beginning. Return what the robot is then."""
        for number in range(round(seconds / 0.5)):
            self.now += 0.5
            self.away = 0.0 if here else self.away + 0.5 * running
            if speaks and here:
                self.liveliness.note_message("r1")
            names = ["r1"] if gone and not number else []
            notes = self.liveliness.look(
                self.now, self.now, {} if here else {"r1": self.away}, running=running, gone=names,
                expected=["r1"] if expected else [],
            )  # fmt: skip
            self.told += [note.kind for note in notes]
        return self.liveliness.seen["r1"].liveness


def test_the_tables_say_what_follows_in_every_case() -> None:
    assert set(NEXT) == set(Fact)
    for row in NEXT.values():
        assert set(row) == set(Liveness)
    assert {(was, row[was]) for row, was in product(NEXT.values(), Liveness)} >= set(TOLD)


# fmt: off
STORIES: dict[str, tuple[list[tuple[dict[str, Any], Liveness]], list[str]]] = {  # steps as keywords of ``pass_by``: what the robot is after each; the events
    "comes before the start":     ([({"here": False, "running": False}, GONE), ({"here": True, "running": False}, ALIVE)], []),
    "says nothing":               ([({"here": True}, ALIVE), ({"here": True, "speaks": False}, STALE), ({"here": True}, ALIVE)], ["stale", "back"]),
    "need say nothing in a pause":  ([({"here": True}, ALIVE), ({"here": True, "speaks": False, "running": False}, ALIVE)], []),
    "goes and comes":             ([({"here": True}, ALIVE), ({"here": False, "gone": True}, GONE), ({"here": True}, ALIVE)], ["back"]),
    "is replaced at once":        ([({"here": True}, ALIVE), ({"here": True, "gone": True}, ALIVE)], ["back"]),
    "goes and is lost":           ([({"here": True}, ALIVE), ({"here": False, "gone": True}, GONE), ({"here": False, "seconds": LOST}, MISSED),
                                    ({"here": True}, ALIVE)], ["lost", "back"]),
    "a pause loses nobody":       ([({"here": True}, ALIVE), ({"here": False, "running": False, "seconds": 2 * LOST}, GONE)], []),
    "the router was away":        ([({"here": True}, ALIVE), ({"here": False, "running": False, "expected": True}, ALIVE), ({"here": True}, ALIVE)], []),
    "goes in a pause":            ([({"here": True}, ALIVE), ({"here": False, "running": False}, GONE), ({"here": True}, ALIVE)], []),
}
# fmt: on


@pytest.mark.parametrize("name", STORIES)
def test_what_becomes_of_a_robot(name: str) -> None:
    steps, events = STORIES[name]
    fleet = Fleet()
    for step, then in steps:
        assert fleet.pass_by(**({"seconds": SILENT} | step)) is then
    assert fleet.told == events


def test_since_is_when_it_began_and_a_new_run_begins_at_0() -> None:
    fleet = Fleet()
    fleet.pass_by(2.0, here=True)
    assert fleet.liveliness.seen == {"r1": Seen(ALIVE, 0.5)}
    fleet.pass_by(3.0, here=False, gone=True)
    assert fleet.liveliness.seen == {"r1": Seen(GONE, 2.5)}
    fleet.liveliness.begin()
    assert fleet.liveliness.seen == {"r1": Seen(GONE, 0.0)}


def test_a_world_that_stood_itself_blames_nobody() -> None:
    liveliness = Liveliness(["r1"], 0.0)
    liveliness.look(0.1, 0.0, {}, running=True)
    assert liveliness.look(100.0, 0.1, {}, running=True) == []
    assert STATE.timeout > STEP
    assert liveliness.seen["r1"].liveness is ALIVE


def test_a_world_that_was_killed_goes_on_with_the_roll() -> None:
    fleet = Fleet()
    fleet.pass_by(1.0, here=True)
    fleet.pass_by(2 * LOST, here=False, gone=True)
    fresh = Liveliness(["r1"], 0.0)
    fresh.restore(fleet.liveliness.seen, fleet.liveliness.left)
    assert fresh.look(0.1, 60.0, {"r1": 0.0}, running=True) == []
    assert fresh.seen["r1"].liveness is MISSED, "who was lost stays so until it comes"
    assert [note.text for note in fresh.look(0.2, 60.1, {}, running=True)] == ["is back"]


PASSING = st.tuples(st.floats(0.5, 30.0), st.booleans(), st.booleans(), st.booleans())


@given(st.lists(PASSING, max_size=12))
def test_going_and_coming_back_are_told_in_turn(steps: list[tuple[float, bool, bool, bool]]) -> None:
    fleet, here_before, away_told = Fleet(), False, False
    for seconds, here, speaks, running in steps:
        gone = here_before and not here and running
        away_told |= gone
        before = len(fleet.told)
        then = fleet.pass_by(seconds, here=here, speaks=speaks, running=running, gone=gone)
        assert (then in (GONE, MISSED)) is (not here)
        told = fleet.told[before:]
        assert told.count("lost") <= 1
        if here and away_told:
            assert told[0] == "back"
            away_told = False
        here_before = here
