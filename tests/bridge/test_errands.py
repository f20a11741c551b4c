"""Several orders of several robots at once: each ends once, and the world is asked when it has to be."""

import pytest
from msgspec.structs import replace

from swarm.bridge.errand import OrderErrand, OrderOutcome
from swarm.bridge.errands import Errands
from swarm.errors import PeerError
from swarm.messages import Accepted, Activity, Event, Message, Order, Phase, Status
from tests.messages.made import clock, event, state


def errand(robot: str, number: int) -> OrderErrand:
    return OrderErrand(robot, Order(id=f"of-{robot}", targets=[(1.0, 2.0)]), number, run=1)


def followed(*open_: OrderErrand) -> Errands:
    """Return errands about which the world has been asked."""
    errands = Errands()
    for one in open_:
        errands.add(one)
    assert errands.apply_answers([]) == []
    return errands


def ends(errands: Errands, *messages: Message) -> list[tuple[str, OrderOutcome]]:
    return [(one.robot, end.how) for one, end in errands.apply_messages(messages)]


def superseded(robot: str, number: int) -> Event:
    text = f"order x (number {number}): 1 left; superseded by order y (number {number + 1})"
    return replace(event(20), robot=robot, kind="superseded", text=text)


def status(world: str) -> Status:
    return Status(
        scenario="s", run=1, tick=20, time=1.0, phase=Phase.RUNNING, complete=False, reason="", edits=0, robots=[],
        events=[], world=world,
    )  # fmt: skip


def test_each_ends_by_what_is_said_of_it_and_once() -> None:
    errands = followed(errand("a", 1), errand("b", 2))
    assert ends(errands, superseded("b", 1), superseded("b", 2), superseded("b", 2)) == [("b", OrderOutcome.REPLACED)]
    assert [one.robot for one in errands] == ["a"]
    assert ends(errands, clock(run=2), clock(run=3)) == [("a", OrderOutcome.AGAIN)]
    assert len(errands) == 0


def test_the_world_is_asked_after_a_doubt_and_when_a_robot_has_nothing_left() -> None:
    errands = Errands()
    errands.mark_all_unsure()
    assert not errands.has_to_ask, "there is none"
    errands.apply_answers([])
    errands.add(errand("a", 1))
    assert not errands.has_to_ask
    errands.mark_all_unsure()
    assert errands.has_to_ask
    errands.apply_answers([])
    done = state(20, assignment=1, reached=[True], activity=Activity.DONE)
    assert ends(errands, done) == []
    assert errands.has_to_ask
    assert errands.apply_answers([]) == [], "the world has not measured it yet"
    assert ends(errands, state(30, assignment=2)) == []
    assert [(one.robot, end.how) for one, end in errands.apply_answers([])] == [("a", OrderOutcome.DONE)], (
        "nothing has replaced it"
    )


def test_a_robot_that_has_another_order_is_not_taken_as_done_before_the_world_is_asked() -> None:
    errands = followed(errand("a", 1))
    assert ends(errands, state(30, assignment=2)) == []
    ended = errands.apply_answers([superseded("a", 1)])
    assert [end.how for _, end in ended] == [OrderOutcome.REPLACED]


def test_another_world_of_the_same_name_does_not_have_it() -> None:
    errands = followed(errand("a", 1))
    assert ends(errands, status("w1"), status("w1")) == []
    assert ends(errands, status("w2")) == [("a", OrderOutcome.AGAIN)]


def test_a_new_one_is_of_the_world_that_was_heard_of_before() -> None:
    errands = Errands()
    assert ends(errands, status("w1")) == []
    errands.add(errand("a", 1))
    assert ends(errands, status("w2")) == [("a", OrderOutcome.AGAIN)]
    errands.add(errand("a", 2))
    assert ends(errands, status("w2")) == []


def test_without_a_world_all_end() -> None:
    errands = followed(errand("a", 1), errand("b", 2))
    ended = errands.end_all_without_world(30.0)
    assert [end.text for _, end in ended] == [
        "a: order of-a is not done: the fleet has had no world for 30 s",
        "b: order of-b is not done: the fleet has had no world for 30 s",
    ]
    assert len(errands) == 0


def test_an_order_counts_in_the_run_in_which_the_world_has_taken_it() -> None:
    order = Order(id="x", targets=[(1.0, 2.0)])
    taken = OrderErrand.from_answer("a", order, Accepted(text="taken", number=3, run=2))
    assert (taken.number, taken.run) == (3, 2), "whatever run the bridge has heard of"
    for number, run in ((None, 2), (3, None)):
        with pytest.raises(PeerError, match="a: order: expected an answer with `number` and `run`"):
            OrderErrand.from_answer("a", order, Accepted(text="taken", number=number, run=run))
