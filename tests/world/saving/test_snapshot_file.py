"""What a world saves and when: before it answers, before it tells, and again after a disk that was full."""

from math import inf
from pathlib import Path
from typing import Any, Final
from unittest.mock import Mock

import pytest

from swarm.bus import Bus
from swarm.messages import (
    ACTION,
    EDIT,
    EVENT,
    ORDER,
    PLACES,
    POOL,
    ROBOT_ACTION,
    Accepted,
    Action,
    Do,
    Edit,
    Kind,
    Order,
    Phase,
    Places,
    PoolTargets,
    RobotAction,
    RobotDo,
    Topic,
)
from swarm.settings import Pace
from tests.shared import scenario_of
from tests.world.shared import ask, come, request_of, run_of, step
from world.host.request_answers import answer
from world.host.run import Run
from world.saving.snapshot_file import ENCODER

BLOCK: Final = Edit(kind=Kind.WALL, low=(8.2, 1.2), high=(8.8, 1.8))
STAYS: Final = scenario_of(targets=[], serve=True)
THERE: Final = (7.5, 3.5)

# fmt: off
CHANGES: Final[dict[str, tuple[Topic[Any], Any, dict[str, str]]]] = {  # requests that change the run
    "an order":       (ORDER,        Order(id="a", targets=[THERE]),       {"robot": "r1"}),
    "an action":      (ROBOT_ACTION, RobotAction(do=RobotDo.STOP),         {"robot": "r1"}),
    "for the pool":   (POOL,         PoolTargets(id="a", targets=[THERE]), {}),
    "a place":        (PLACES,       Places(id="a", count=1, at=[]),       {}),
    "an edit":        (EDIT,         BLOCK,                                {}),
    "a button":       (ACTION,       Action(do=Do.PAUSE, id="x"),          {}),
    "a new run":      (ACTION,       Action(do=Do.RESTART, id="x"),        {}),
}
# fmt: on


def staying(file: Path, pace: Pace, phase: Phase | None = None) -> Run:
    """Return the run of a fleet that stays; it goes on from the file if that is there."""
    one = run_of(STAYS, file=file, pace=pace, limit=inf)
    if phase is not None:
        one.go_to(phase)
    return one


def state(one: Run) -> tuple[object, ...]:
    """Return everything that a request may change."""
    return (
        one.phase,
        one.pressed,
        one.publisher.events,
        one.world.bodies.floor.cells.tobytes(),
        ENCODER.encode(one.world.save()),
    )


@pytest.mark.parametrize("pace", ["max", 1.0])
@pytest.mark.parametrize("name", CHANGES)
def test_what_a_request_changes_is_in_the_file_when_the_answer_goes_out(name: str, pace: Pace, tmp_path: Path) -> None:
    """A world that is killed right after its answer must not forget what it promised."""
    (topic, message, ids), file = CHANGES[name], tmp_path / "world.snapshot"
    one = staying(file, pace, Phase.RUNNING)
    step(one)
    if pace != "max":  # in lockstep requests wait for the end of the tick
        one.world.senses(lockstep=False)
        one.in_tick = True
    before, answered = state(one), list[bool]()
    request = request_of(topic, message, **ids)
    request.accept.side_effect = lambda reply: answered.append(state(staying(file, pace)) == state(one))
    answer(request, one, Mock(spec=Bus))
    assert answered == [True], request.refuse.call_args
    assert state(one) != before


def test_an_event_is_told_after_it_was_saved(tmp_path: Path) -> None:
    """A world that is killed in between would tell it twice."""
    file = tmp_path / "world.snapshot"
    told = list[str]()

    def send(topic: Any, message: Any, **ids: str) -> None:  # noqa: ANN401
        if topic is EVENT:
            told.append(message.kind)
            assert message in run_of(file=file).publisher.events, message

    one = run_of(file=file, bus=Mock(spec=Bus, send=send))
    come(one, "r1", "a")
    one.go_to(Phase.RUNNING)
    ask(one, ORDER, Order(id="a", targets=[one.world.poses()[0][:2]]), robot="r1")
    ask(one, EDIT, Edit(kind=Kind.WALL, low=(8.1, 4.1), high=(8.4, 4.4)))
    step(one, r1={})
    assert {"phase", "order", "edit", "reached"} <= set(told)


def test_a_course_goes_on_from_its_file(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = run_of(file=file)
    one.save()
    for name, session in (("r1", "a"), ("r2", "b")):
        come(one, name, session)
    one.go_to(Phase.RUNNING)
    for _ in range(20):
        step(one, r1={"left": 0.3, "right": 0.3})
    ask(one, EDIT, BLOCK)
    ask(one, ORDER, Order(id="a", targets=[THERE]), robot="r1")
    assert ask(one, ACTION, Action(do=Do.PAUSE)) == Accepted(text="the run is paused")
    said: list[str] = []
    other = run_of(file=file, log=said.append)
    assert said == ["the run goes on at 1.00 s, paused"]
    assert (other.world.identity, other.world.run) == (one.world.identity, one.world.run)
    assert (other.world.tick, other.world.poses()) == (20, one.world.poses())
    assert (other.world.bodies.floor.cells == one.world.bodies.floor.cells).all()
    assert (other.scenario.map.cells == one.world.bodies.floor.cells).all()
    assert other.membership.robots_awaited, "both are to come back"
    assert other.repeatable.reasons == one.repeatable.reasons
    assert "r1 was given an order or an action at 1.00 s" in one.repeatable.reasons
    assert come(other, "r1", "a").assigned.stops == [THERE]
    assert run_of().world.identity != one.world.identity, "without a file it is another one"


def test_within_a_tick_of_lockstep_nothing_is_saved(tmp_path: Path) -> None:
    file = tmp_path / "world.snapshot"
    one = run_of(file=file)
    one.world.senses(lockstep=True)
    one.in_tick = True
    one.go_to(Phase.RUNNING)
    assert not file.exists()
    step(one)
    one.save()
    assert file.exists()
    assert run_of(file=file).world.tick == 1


def test_after_a_full_disk_it_is_written_again_and_nothing_is_lost(tmp_path: Path) -> None:
    file, said = tmp_path / "world.snapshot", list[str]()
    beside = tmp_path / ".world.snapshot.new"  # where a snapshot is written before it replaces the one before
    one = run_of(file=file, log=said.append)
    come(one, "r1", "a")
    one.go_to(Phase.RUNNING)
    for full in (1, 2):
        step(one)
        one.save_soon()
        kept = one.world.tick
        beside.symlink_to("/dev/full")
        assert ask(one, ORDER, Order(id=f"o{full}", targets=[THERE]), robot="r1").number == full
        for _ in range(45):
            step(one)
        assert run_of(file=file).world.tick == kept, "the last one that could be written is whole"
        beside.unlink()
        while not one.world.due:
            step(one)
        other = run_of(file=file)
        assert ENCODER.encode(other.world.save()) == ENCODER.encode(one.world.save())
        assert other.publisher.events == one.publisher.events
        lines = [line for line in said if "cannot be written (No space left on device)" in line]
        assert len(lines) == full, "it is said once each time that the disk is full"
