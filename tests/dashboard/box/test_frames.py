"""What the box tells beside the wire's messages: numbers and words of the progress, and why wheels turn."""

import msgspec
import pytest

from dashboard.box import frames as telling
from dashboard.fold.progress import Progress
from dashboard.fold.scene import scene_of
from dashboard.fold.state import QueuePlace
from swarm.messages import Activity, Liveness, Map, Phase, PoolCounts
from swarm.scenario.load import Scenario
from tests.dashboard.fold.test_progress import folded
from tests.messages.made import clock, event, state, truth


def test_the_overview_says_what_each_robot_does_and_how_far_it_is() -> None:
    progress = folded(
        clock(),
        state(20, target=1, distance=4.0, reached=[True, False, False]),
        state(40, target=1, distance=3.0, reached=[True, False, False], activity=Activity.GIVE_WAY),
        msgspec.structs.replace(event(50), kind="contact", robot="a"),
        msgspec.structs.replace(clock(80), pool=PoolCounts(given=5, done=2, taken=1, waiting=2)),
    )
    told = telling.Overviewing(progress, {"a": QueuePlace(2, 4)}, home=True, link=True)()
    assert (told.run, told.phase, told.time, told.contacts) == (1, Phase.RUNNING, 4.0, 1)
    assert told.pool == PoolCounts(given=5, done=2, taken=1, waiting=2)
    first, second = told.robots
    assert (first.doing, first.target, first.left, first.waits) == ("gives way", 1, 3.0, 2.0)
    assert first.share == pytest.approx((1 + 0.25) / 3, abs=1e-4)
    assert [(row.turn, row.queue) for row in told.robots] == [(2, 4), (0, 0)]
    assert (second.robot, second.stops, second.heard) == ("b", 0, Liveness.STALE)
    assert told.share == pytest.approx(first.share / 2, abs=1e-4), "who has not spoken has not moved"


def test_before_the_world_speaks_there_is_an_overview_too() -> None:
    told = telling.Overviewing(Progress(), {}, home=True, link=False)()
    assert (told.run, told.share, told.robots) == (0, 0.0, ())


def test_the_rules_of_selected_robots_are_those_of_the_controller(paper: Scenario) -> None:
    scenario, packed = paper.to_wire()
    scene = scene_of(Map(scenario=scenario, packed=packed))
    seen = truth(10)
    assert telling.rules(scene, seen, frozenset({"nobody"})) == {}
    why = telling.rules(scene, seen, frozenset({"a"}))["a"]
    assert isinstance(why, telling.Why)
    expected = scene.controller.explain(1.0, 1.0, 1.0, 0.0)
    assert (why.left_v, why.right_v) == (expected.left_v, expected.right_v)
    assert [text for *_, text in why.rules] == [rule.text for rule in expected.rules]


def test_a_frame_is_json_with_the_wires_message() -> None:
    frame = msgspec.json.decode(telling.make_frame("world/clock", clock(20)))
    assert frame["key"] == "world/clock"
    assert frame["message"] == msgspec.json.decode(msgspec.json.encode(clock(20)))
