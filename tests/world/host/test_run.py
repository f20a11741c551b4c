"""The run of a world beside its process: who is lost, what cannot be repeated, what is saved and found again."""

from pathlib import Path
from typing import Any

import pytest

from swarm.errors import ConfigError
from swarm.messages import (
    ACTION,
    CLOCK,
    EDIT,
    ORDER,
    ROBOT_ACTION,
    Accepted,
    Action,
    Activity,
    Do,
    Edit,
    Kind,
    Order,
    Phase,
    RobotAction,
    RobotDo,
    Welcome,
)
from tests.conftest import MakeBus
from tests.shared import scenario_of
from tests.world.shared import absent, ask, come, run_of, step
from world.fleet.liveness import AWAY
from world.fleet.single_world import check_alone
from world.host.reproducible import MOST, REAL_TIME, Repeatable
from world.simulate import Simulation
from world.tasks.standstill import LOST
from world.views.status import STOPS

DONE = {"activity": Activity.DONE, "unreachable": [0, 1]}
BLOCK = Edit(kind=Kind.WALL, low=(8.2, 1.2), high=(8.8, 1.8))


# --- buttons ---


@pytest.mark.parametrize(
    ("before", "again"),
    [(Phase.RUNNING, Do.GO), (Phase.RUNNING, Do.RESUME), (Phase.PAUSED, Do.PAUSE), (Phase.OVER, Do.STOP)],
)
def test_a_button_whose_phase_is_reached_changes_nothing(before: Phase, again: Do) -> None:
    one = run_of()
    one.go_to(before)
    world = one.world
    assert ask(one, ACTION, Action(do=again)) == Accepted(text=f"the run is {before.value} already")
    assert (one.phase, one.world is world) == (before, True)


def test_a_named_button_is_pressed_once_also_after_the_world_was_started_again(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = run_of(file=file)
    for name, session in (("r1", "a"), ("r2", "b")):
        come(one, name, session)
    one.go_to(Phase.RUNNING)
    first = ask(one, ACTION, Action(do=Do.RESTART, id="x"))
    assert ask(one, ACTION, Action(do=Do.RESTART, id="x")) == first
    assert one.world.run == 1
    assert ask(one, ACTION, Action(do=Do.RESTART)) == first
    assert one.world.run == 2
    other = run_of(file=file)
    assert ask(other, ACTION, Action(do=Do.RESTART, id="x")) == first
    assert other.world.run == 2


# --- orders ---


def test_a_robot_that_is_lost_gets_no_order() -> None:
    one = run_of()
    absent(one, LOST)
    assert "it is lost: absent for 20 s" in ask(one, ROBOT_ACTION, RobotAction(do=RobotDo.STOP), robot="r1")


# --- who is lost ---


@pytest.mark.parametrize(
    ("others", "away", "given_up", "over"),
    [
        (DONE, AWAY, "", True),
        (DONE, AWAY - 1, "", False),
        ({}, AWAY, "", False),
        (DONE, LOST, "r7 r2", True),
        (DONE, LOST, "r7", False),
        (DONE, LOST - 1, "r2", False),
        ({}, LOST, "r2", False),
    ],
)
def test_who_is_absent_for_long_while_all_others_are_finished_is_lost(
    others: dict[str, Any], away: float, given_up: str, over: bool, tmp_path: Path
) -> None:
    file = tmp_path / "given_up"
    if given_up:
        file.write_text(given_up)
    one = run_of(given_up=file)
    one.go_to(Phase.RUNNING)
    come(one, "r1", "a")
    absent(one, away)
    step(one, r1=others)
    assert (one.phase is Phase.OVER) is over
    report = one.report()
    assert report["lost"] == (["r2"] if over else [])
    assert not report["complete"]
    if over:
        assert str(report["reason"]).startswith(f"lost r2: absent for {away:.0f} s; not reached: ")


def test_a_run_waits_while_only_absent_robots_have_stops_left() -> None:
    one = run_of()
    one.go_to(Phase.RUNNING)
    come(one, "r1", "a")
    assert not one.waits, "r1 has stops too"
    step(one, r1=DONE)
    assert one.waits
    come(one, "r2", "b")
    assert not one.waits


# --- what cannot be repeated ---


def test_a_robot_that_remembers_nothing_in_the_middle_of_a_run_is_a_reason() -> None:
    one = run_of()
    for name, session in (("r1", "a"), ("r2", "b")):
        come(one, name, session)
    step(one)
    assert one.repeatable.reasons == [], "before the first tick nobody has anything to remember"
    assert isinstance(come(one, "r1", "a", world=one.world.identity), Welcome)
    assert one.repeatable.reasons == []
    come(one, "r1", "a")
    assert one.repeatable.reasons == ["r1 has started again without its memory at 0.05 s"]


def test_reasons_are_bounded_and_start_over_with_a_run() -> None:
    one = Repeatable(lockstep=True)
    for number in range(3 * MOST):
        one.no_longer(f"reason {number}", 1.0)
    assert len(one.reasons) == MOST
    one.begin()
    assert one.reasons == []
    assert Repeatable(lockstep=False).reasons == [REAL_TIME]


def test_a_broadcast_that_was_overdue_is_a_reason() -> None:
    one = run_of()
    step(one)
    step(one, r2={"notes": [("overdue", "went on without a broadcast")]})
    assert one.report()["not_reproducible"] == ["r2 went on without a broadcast at 0.05 s"]
    assert one.report()["reproducible"] is False


# --- what a robot is told that joins ---


def test_the_progress_of_a_robot_is_what_the_world_has_seen() -> None:
    one = run_of()
    assert come(one, "r1", "a").state is None
    step(one, r1={"reached": [True, True], "activity": Activity.DONE})
    state = come(one, "r1", "a").state
    assert (state.reached, state.target, state.robot) == ([False, False], 0, "r1")
    step(one, r1={"unreachable": [0, 7], "activity": Activity.DRIVE})
    state = come(one, "r1", "a").state
    assert (state.unreachable, state.target) == ([0], 1)


def test_the_last_event_of_a_robot_is_one_of_the_run_that_goes_on() -> None:
    one = run_of()
    come(one, "r1", "a")
    one.go_to(Phase.RUNNING)
    one.tell("stop", "stops", "r1")
    before = one.status().robots[0].event
    assert before is not None
    assert (before.text, before.run) == ("stops", 0)
    assert ask(one, ACTION, Action(do=Do.RESTART)).text == "the run is running, with all robots at their starts"
    assert (one.status().run, one.status().robots[0].event) == (1, None)
    assert "stops" in [event.text for event in one.status().events], "those of older runs are kept"
    one.tell("go_on", "goes on", "r1")
    after = one.status().robots[0].event
    assert after is not None
    assert (after.text, after.run) == ("goes on", 1)


def test_the_status_has_what_a_robot_has_been_given_and_where_that_is() -> None:
    one = run_of()
    row = one.status().robots[0]
    assert (row.mission, row.stops, row.home) == (
        "the scenario's targets",
        list(one.world.tasks.missions.stops(0)),
        True,
    )
    name = "4151c0bbfe5c4e2b8c3e4a2d9b0f1a77"
    ask(one, ORDER, Order(id=name, targets=[(4.5, 2.5)] * 30), robot="r1")
    row = one.status().robots[0]
    assert (row.mission, row.home) == ("order 4151c0bb update 0", False)
    assert row.stops == [(4.5, 2.5)] * STOPS, "no more, or a thousand robots would not fit"


# --- edits ---


def test_an_edit_that_changes_nothing_is_answered_so_and_not_counted() -> None:
    one = run_of()
    step(one)
    answers = [ask(one, EDIT, BLOCK).text for _ in range(2)]
    assert [text.endswith("it changes nothing") for text in answers] == [False, True]
    assert one.world.bodies.edits == 1
    assert one.repeatable.reasons == ["the map was edited by a request at 0.05 s"]
    assert "expected a rectangle" in ask(one, EDIT, Edit(kind=Kind.WALL, low=(-9.0, -9.0), high=(-8.0, -8.0)))


# --- another world ---


def test_a_second_world_finds_the_first_one_and_a_token_alone_is_none(make_bus: MakeBus) -> None:
    first, second, stranger = make_bus(), make_bus(), make_bus()
    said: list[str] = []
    stranger.announce("world", "world")
    while not first.sessions("world"):
        pass
    with check_alone(first, "f", said.append):
        clock = run_of().clock()
        first.keep(CLOCK, lambda: {CLOCK.key: clock})
        first.announce("world", "world")
    assert said == ["fleet f: ignored the token of a world that does not answer"]
    while not second.fetch(CLOCK) or first.id not in second.sessions("world"):
        pass
    with pytest.raises(ConfigError, match="expected no world, got one"), check_alone(second, "f", said.append):
        raise AssertionError("it was let in")


@pytest.mark.parametrize("larger", [True, False])
def test_of_two_worlds_that_start_at_once_the_one_with_the_larger_id_gives_way(make_bus: MakeBus, larger: bool) -> None:
    one, other = sorted((make_bus(), make_bus()), key=lambda bus: bus.id, reverse=larger)
    refused = False
    try:
        with check_alone(one, "f", print):
            for bus in (one, other):
                bus.announce("world", "world")
            while one.sessions("world") != {one.id, other.id}:
                pass
    except ConfigError:
        refused = True
    assert refused is larger


def test_a_robot_that_comes_from_another_world_is_told_of() -> None:
    one = run_of()
    for world in (None, one.world.identity):
        come(one, "r1", "s1", world)
    assert not [event for event in one.publisher.events if event.kind == "other_world"]
    come(one, "r2", "s2", "a world whose snapshot was removed"[:16])
    (event,) = [event for event in one.publisher.events if event.kind == "other_world"]
    assert event.robot == "r2"


def test_a_robot_is_at_its_next_stop_until_that_counts() -> None:
    simulation = Simulation.of(scenario_of(), 2, 1)
    world, there = simulation.world, 0
    while world.tasks.missions.left[0] is not None:
        before, was_there = world.tasks.missions.left[0], world.is_at_next_stop("r1")
        simulation.step()
        assert was_there == (world.tasks.missions.left[0] != before), "exactly then it counts at the end of the tick"
        there += was_there
    assert there == len(world.tasks.missions.stops(0))
    assert not world.is_at_next_stop("r1"), "it has none"
    assert not world.is_at_next_stop("r9"), "the fleet has no such robot"


# --- a robot whose mission is cancelled ---

# fmt: off
CANCELLED = {  # how the fleet was started, the robots that have targets left: what the answer says, whether the run ends
    "the only one":                   (False, ("r1",),      "the run ends now, as not complete", True),
    "one of two":                     (False, ("r1", "r2"), "the run ends when r2 is done, as not complete", False),
    "it was started by hand":         (True, ("r1",), "the fleet stays, and takes orders until `swarm stop` ends it", False),
}
# fmt: on


@pytest.mark.parametrize("name", CANCELLED)
def test_a_cancelled_mission_is_not_complete_and_the_answer_says_what_becomes_of_the_run(name: str) -> None:
    by_hand, left, says, ends = CANCELLED[name]
    one = run_of(wait=by_hand)
    for robot, session in (("r1", "a"), ("r2", "b")):
        come(one, robot, session)
    one.held = False
    one.go_to(Phase.RUNNING)
    step(one, **{robot: {"activity": Activity.DRIVE} | ({} if robot in left else DONE) for robot in ("r1", "r2")})
    answer = ask(one, ROBOT_ACTION, RobotAction(do=RobotDo.CANCEL), robot="r1")
    assert answer == Accepted(text=f"r1 has no targets now, number 1; {says}")
    step(one, r1={"activity": Activity.DONE, "assignment": 1}, r2={} if "r2" in left else DONE)
    assert (one.phase is Phase.OVER) is ends
    report = one.report()
    assert not report["complete"]
    assert "r1's mission was cancelled" in str(report["reason"])
