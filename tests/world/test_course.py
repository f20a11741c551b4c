"""The run of a world beside its process: who is lost, what cannot be repeated, what is saved and found again."""

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import msgspec
import pytest

from swarm.bus import Bus, Presence, Request
from swarm.errors import ConfigError
from swarm.messages import (
    ACTION,
    CLOCK,
    EDIT,
    EVENT,
    JOIN,
    ORDER,
    ROBOT_ACTION,
    Accepted,
    Action,
    Activity,
    Assigned,
    Command,
    Do,
    Edit,
    Join,
    Kind,
    Order,
    Phase,
    RobotAction,
    RobotDo,
    Welcome,
)
from tests.conftest import MakeBus
from tests.shared import scenario_of
from world.answering import answer
from world.course import Course
from world.ending import AWAY
from world.repeatable import MOST, REAL_TIME, Repeatable
from world.rival import check_alone
from world.roll import LOST
from world.world import REST

DONE = {"activity": Activity.DONE, "unreachable": [0, 1]}
BLOCK = Edit(kind=Kind.WALL, low=(8.2, 1.2), high=(8.8, 1.8))


def course(file: Path | None = None, pace: Any = "max", log: list[str] | None = None) -> Course:  # noqa: ANN401
    said = [] if log is None else log
    return Course(Mock(spec=Bus), scenario_of(), 2, 1, pace, 300.0, False, 0, file, said.append)


def come(one: Course, name: str, session: str, world: str | None = None) -> Any:  # noqa: ANN401
    """Let a robot join; return the answer."""
    reply = ask(one, JOIN, Join(robot=name, session=session, world=world))
    one.lobby.take(Presence("robot", name, session, alive=True), 0.0)
    return reply


def ask(one: Course, topic: Any, message: Any, **ids: str) -> Any:  # noqa: ANN401
    request = Mock(spec=Request, topic=topic, message=message, ids=ids)
    answer(request, one, Mock(spec=Bus, id="the world", sender=7))
    return request.accept.call_args.args[0] if request.accept.called else request.refuse.call_args.args[0]


def step(one: Course, **fields: dict[str, Any]) -> None:
    for name, said in fields.items():
        command: Command = msgspec.structs.replace(REST, run=one.world.run, tick=one.world.tick, **said)
        one.last.take(name, command, one.world.run, one.world.tick)
    one.step()


# --- buttons ---


@pytest.mark.parametrize(
    ("before", "again"),
    [(Phase.RUNNING, Do.GO), (Phase.RUNNING, Do.RESUME), (Phase.PAUSED, Do.PAUSE), (Phase.OVER, Do.STOP)],
)
def test_a_button_whose_phase_is_reached_changes_nothing(before: Phase, again: Do) -> None:
    one = course()
    one.go_to(before)
    world = one.world
    assert ask(one, ACTION, Action(do=again)) == Accepted(text=f"the run is {before.value} already")
    assert (one.phase, one.world is world) == (before, True)


def test_a_named_button_is_pressed_once_also_after_the_world_was_started_again(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = course(file)
    for name, session in (("r1", "a"), ("r2", "b")):
        come(one, name, session)
    one.go_to(Phase.RUNNING)
    first = ask(one, ACTION, Action(do=Do.RESTART, id="x"))
    assert ask(one, ACTION, Action(do=Do.RESTART, id="x")) == first
    assert one.world.run == 1
    assert ask(one, ACTION, Action(do=Do.RESTART)) == first
    assert one.world.run == 2
    other = course(file)
    assert ask(other, ACTION, Action(do=Do.RESTART, id="x")) == first
    assert other.world.run == 2


# --- orders ---


def test_an_order_is_answered_after_it_was_saved(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = course(file)
    come(one, "r1", "a")
    one.go_to(Phase.RUNNING)
    step(one, r1={"left": 0.3, "right": 0.3})
    order = Order(id="a", targets=[(7.5, 3.5)])
    answered = ask(one, ORDER, order, robot="r1")
    assert answered == Accepted(text="r1: order a update 0 is number 1: 1 target", number=1)
    other = course(file)
    assert other.world.missions.orders.rows == one.world.missions.orders.rows
    assert come(other, "r1", "a").assigned == Assigned(number=1, stops=[(7.5, 3.5)])
    assert ask(other, ORDER, order, robot="r1") == answered
    assert "r1 was given an order or an action at 0.05 s" in one.repeatable.reasons


def test_an_event_is_told_after_it_was_saved(tmp_path: Path) -> None:
    """A world that is killed in between would tell it twice."""
    file = tmp_path / "world.snapshot"
    one, told = course(file), list[str]()

    def send(topic: Any, message: Any, **ids: str) -> None:  # noqa: ANN401
        if topic is EVENT:
            told.append(message.kind)
            assert message in course(file).speaker.events, message

    one.speaker._bus.send = send  # type: ignore[assignment, method-assign]
    come(one, "r1", "a")
    one.go_to(Phase.RUNNING)
    ask(one, ORDER, Order(id="a", targets=[one.world.poses()[0][:2]]), robot="r1")
    ask(one, EDIT, Edit(kind=Kind.WALL, low=(8.1, 4.1), high=(8.4, 4.4)))
    step(one, r1={})
    assert {"phase", "order", "edit", "reached"} <= set(told)


def test_a_robot_that_is_lost_gets_no_order() -> None:
    one = course()
    one.lobby._away["r1"] = LOST
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
    one = Course(Mock(spec=Bus), scenario_of(), 2, 1, "max", 300.0, False, 0, None, print, given_up=file)
    one.go_to(Phase.RUNNING)
    come(one, "r1", "a")
    now = one.lobby._looked_at
    one.lobby.look(now + away, running=True)
    step(one, r1=others)
    assert (one.phase is Phase.OVER) is over
    report = one.report()
    assert report["lost"] == (["r2"] if over else [])
    assert not report["complete"]
    if over:
        assert str(report["reason"]).startswith(f"lost r2: absent for {away:.0f} s; not reached: ")


def test_a_run_waits_while_only_absent_robots_have_stops_left() -> None:
    one = course()
    one.go_to(Phase.RUNNING)
    come(one, "r1", "a")
    assert not one.waits, "r1 has stops too"
    step(one, r1=DONE)
    assert one.waits
    come(one, "r2", "b")
    assert not one.waits


# --- what cannot be repeated ---


def test_a_robot_that_remembers_nothing_in_the_middle_of_a_run_is_a_reason() -> None:
    one = course()
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
    one = course()
    step(one)
    step(one, r2={"notes": [("overdue", "went on without a broadcast")]})
    assert one.report()["not_reproducible"] == ["r2 went on without a broadcast at 0.05 s"]
    assert one.report()["reproducible"] is False


# --- what a robot is told that joins ---


def test_the_progress_of_a_robot_is_what_the_world_has_seen() -> None:
    one = course()
    assert come(one, "r1", "a").state is None
    step(one, r1={"reached": [True, True], "activity": Activity.DONE})
    state = come(one, "r1", "a").state
    assert (state.reached, state.target, state.robot) == ([False, False], 0, "r1")
    step(one, r1={"unreachable": [0, 7], "activity": Activity.DRIVE})
    state = come(one, "r1", "a").state
    assert (state.unreachable, state.target) == ([0], 1)


# --- edits ---


def test_an_edit_that_changes_nothing_is_answered_so_and_not_counted() -> None:
    one = course()
    step(one)
    answers = [ask(one, EDIT, BLOCK).text for _ in range(2)]
    assert [text.endswith("it changes nothing") for text in answers] == [False, True]
    assert one.world.edits == 1
    assert one.repeatable.reasons == ["the map was edited by a request at 0.05 s"]
    assert "expected a rectangle" in ask(one, EDIT, Edit(kind=Kind.WALL, low=(-9.0, -9.0), high=(-8.0, -8.0)))


# --- what is saved ---


def test_a_course_goes_on_from_its_file(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = course(file)
    one.save()
    for name, session in (("r1", "a"), ("r2", "b")):
        come(one, name, session)
    one.go_to(Phase.RUNNING)
    for _ in range(20):
        step(one, r1={"left": 0.3, "right": 0.3})
    ask(one, EDIT, BLOCK)
    assert ask(one, ACTION, Action(do=Do.PAUSE)) == Accepted(text="the run is paused")
    said: list[str] = []
    other = course(file, log=said)
    assert said == ["the run goes on at 1.00 s, paused"]
    assert (other.world.identity, other.world.run) == (one.world.identity, one.world.run)
    assert (other.world.tick, other.world.poses()) == (20, one.world.poses())
    assert (other.world.floor.cells == one.world.floor.cells).all()
    assert (other.speaker.scenario.map.cells == one.world.floor.cells).all()
    assert other.lobby.expected, "both are to come back"
    assert other.repeatable.reasons == one.repeatable.reasons
    assert course().world.identity != one.world.identity, "without a file it is another one"


def test_in_real_time_an_order_within_a_tick_is_saved_before_its_answer(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = course(file, pace=1.0)
    come(one, "r1", "a")
    one.world.senses(lockstep=False)
    one.in_tick = True
    order = Order(id="a", targets=[(2.5, 2.5)])
    said = ask(one, ORDER, order, robot="r1")
    assert said.number == 1
    other = course(file, pace=1.0)
    assert other.world.missions.orders.assigned(0) == one.world.missions.orders.assigned(0) != None  # noqa: E711
    assert ask(other, ORDER, order, robot="r1") == said, "said again it changes nothing"


def test_within_a_tick_of_lockstep_nothing_is_saved(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = course(file)
    one.world.senses(lockstep=True)
    one.in_tick = True
    one.go_to(Phase.RUNNING)
    assert not file.exists()
    step(one)
    one.save()
    assert file.exists()
    assert course(file).world.tick == 1


def test_a_file_that_cannot_be_written_is_told_once_and_costs_no_run(tmp_path: Path) -> None:
    said: list[str] = []
    one = course(tmp_path / "no folder" / "world.snapshot", log=said)
    for _ in range(60):
        step(one)
    lines = [line for line in said if "cannot be written" in line]
    assert len(lines) == 1
    assert "No such file or directory" in lines[0]


# --- another world ---


def test_a_second_world_finds_the_first_one_and_a_token_alone_is_none(make_bus: MakeBus) -> None:
    first, second, stranger = make_bus(), make_bus(), make_bus()
    said: list[str] = []
    stranger.announce("world", "world")
    while not first.sessions("world"):
        pass
    with check_alone(first, "f", said.append):
        clock = course().clock()
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
