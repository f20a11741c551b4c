"""What the world sends to all listeners, and when."""

from dataclasses import replace
from unittest.mock import Mock

import pytest
from msgspec import UNSET

from swarm.bus import Bus
from swarm.bus.codec import decode, encode
from swarm.geometry import Pose
from swarm.messages import CLOCK, EVENT, MAP, TRUTH, Edit, Event, Kind, Liveness, Phase, Seen, Welcome
from tests.shared import scenario_of
from world.fleet import publisher
from world.fleet.publisher import EVENTS_KEPT, Publisher
from world.views.truth import make_truth
from world.views.welcome import welcome
from world.world import World

AT = Pose(2.5, 2.5, 0.0)


def wire_of(*, wanted: bool = True) -> Mock:
    """Return a bus that notes what is sent."""
    wire = Mock(spec=Bus)
    wire.has_listener.side_effect = lambda topic: topic is TRUTH and wanted
    return wire


def sent(wire: Mock) -> list[tuple[object, ...]]:
    return [call.args for call in wire.send.call_args_list]


def speaker_of(wire: Mock, rate: float = 20.0) -> tuple[Publisher, World, list[str]]:
    scenario, logged = scenario_of(rate=rate), list[str]()
    world = World(scenario, [AT], 1)
    return Publisher(wire, scenario, world, logged.append), world, logged


@pytest.mark.parametrize(
    ("rate", "wanted", "ticks"),
    [
        (20.0, True, [0, 2, 4, 6, 8]),  # the truth is told 10 times a second
        (40.0, True, [0, 4, 8]),
        (5.0, True, list(range(10))),  # at most once a tick
        (20.0, False, []),
    ],
)
def test_the_truth_is_told_at_its_rate_if_anybody_listens(rate: float, wanted: bool, ticks: list[int]) -> None:
    wire = wire_of(wanted=wanted)
    one, world, _ = speaker_of(wire, rate)
    told = []
    for tick in range(10):
        one.tell_truth(world.tick, lambda: make_truth(world))
        told += [(tick, topic) for topic, _ in sent(wire)]
        wire.send.reset_mock()
        world.step({})
    assert told == [(tick, TRUTH) for tick in ticks]


def test_the_clock_is_due_at_first_and_then_once_a_period(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 4 Hz: at the table's 1 Hz a rate and a period are the same number."""
    wire, now, often = wire_of(), [50.0], replace(CLOCK, rate=4.0)
    monkeypatch.setattr(publisher, "CLOCK", often)
    monkeypatch.setattr(publisher, "monotonic", lambda: now[0])
    one, world, _ = speaker_of(wire)
    assert one.clock_is_due
    clock = one.clock(world, Phase.RUNNING, ["r1"], {"r1": Seen(Liveness.ALIVE, 0.0)})
    one.tell_clock(clock)
    assert sent(wire) == [(often, clock)]
    assert (clock.tick, clock.robots, clock.present) == (0, ["r1"], ["r1"])
    for now[0], due in ((50.1, False), (50.2, False), (50.3, True), (90.0, True)):
        assert one.clock_is_due is due


def test_an_event_is_sent_and_logged_in_a_line() -> None:
    wire = wire_of()
    one, _, logged = speaker_of(wire)
    events = [Event(run=0, tick=250, time=12.5, kind="stalled", robot=robot, text="says so") for robot in ("r1", None)]
    for event in events:
        one.tell(event)
    assert sent(wire) == [(EVENT, event) for event in events]
    assert logged == ["   12.50 s  r1 says so", "   12.50 s  says so"]


def test_the_map_has_the_starts_and_is_the_newest() -> None:
    wire = wire_of()
    one, world, _ = speaker_of(wire)
    first = one.floor
    assert first.scenario.starts == {"r1": AT}
    assert world.edit(Edit(kind=Kind.WALL, low=(4.2, 4.2), high=(4.4, 4.4)))
    one.tell_map(replace(scenario_of(), map=world.bodies.floor), world)
    assert sent(wire) == [(MAP, one.floor)]
    assert one.floor.packed != first.packed
    assert (first.edits, one.floor.edits) == (0, 1), "a map and its number change together"


def test_the_last_events_are_kept_in_their_order_and_no_more() -> None:
    one, world, _ = speaker_of(wire_of())
    events = [world.event("edit", f"number {number}") for number in range(3 * EVENTS_KEPT)]
    for count, event in enumerate(events, start=1):
        one.tell(event)
        assert one.events == tuple(events[:count][-EVENTS_KEPT:])


def test_a_welcome_crosses_the_wire_and_has_no_starts_of_others() -> None:
    one, world, _ = speaker_of(wire_of())
    packed = encode(welcome("r1", world, one, "session", 7))
    assert decode(packed, Welcome, 100_000).scenario.starts is UNSET
