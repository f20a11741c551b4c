"""What a bridge hears of its orders over the wire; the test is the world."""

from functools import partial

import pytest
from msgspec.structs import replace

from swarm.bridge.errand import OrderErrand, OrderOutcome
from swarm.bridge.fleet_client import LISTEN, ORDERED, FleetClient
from swarm.bus import Bus, Endpoint
from swarm.messages import CLOCK, EVENTS, MAP, STATE, STATUS, Event, Events, Map, Order, Phase, Status
from tests.conftest import MakeBus
from tests.messages.made import clock, event, state
from tests.shared import scenario_of

pytestmark = pytest.mark.processes
SETTINGS, PACKED = scenario_of().to_wire()
STATUS_NOW = Status(
    scenario="s", run=1, tick=20, time=1.0, phase=Phase.RUNNING, complete=False, reason="", edits=0, robots=[],
    events=[], world="w",
)  # fmt: skip


def superseded() -> Event:
    text = "order x (number 1): 1 left; superseded by order y (number 2)"
    return replace(event(20), robot="a", kind="superseded", text=text)


def test_an_order_of_which_the_world_does_not_answer_yet_is_not_taken_as_done(make_bus: MakeBus) -> None:
    world, bus = make_bus(), make_bus()
    world.announce("world", "world")
    world.keep(CLOCK, lambda: {CLOCK.key: clock()})
    world.keep(MAP, lambda: {MAP.key: Map(packed=PACKED, scenario=SETTINGS)})
    world.keep(STATUS, lambda: {STATUS.key: STATUS_NOW})
    follower = FleetClient(bus, print, (*LISTEN, *ORDERED))
    errand = OrderErrand("a", Order(id="x", targets=[(1.0, 2.0)]), 1, run=1)
    follower.errands.add(errand)
    while not errand.is_replaced:  # it has another order: either it was done before, or that has replaced it
        world.send(STATE, state(20, assignment=2), robot="a")
        assert follower.receive_messages() == []
    assert follower.receive_messages() == []
    world.keep(EVENTS, lambda: {EVENTS.key: Events(events=[superseded()])})
    ended = follower.receive_messages()
    while not ended:
        ended = follower.receive_messages()
    assert [(one, end.how) for one, end in ended] == [(errand, OrderOutcome.REPLACED)]
    assert not follower.has_lost_world


def test_a_world_that_begins_at_a_lower_run_again_is_followed_too(make_bus: MakeBus, endpoint: Endpoint) -> None:
    follower = FleetClient(make_bus(fleet="again"), print, LISTEN)
    for run, robots in ((5, ("a",)), (0, ("a", "b")), (0, ("c",))):
        with Bus(endpoint, "again") as world:
            told = clock(run=run, robots=robots)
            world.keep(CLOCK, partial(dict, {CLOCK.key: told}))
            world.keep(MAP, lambda: {MAP.key: Map(packed=PACKED, scenario=SETTINGS)})
            world.announce("world", "world")
            while (follower.fold.run, follower.fold.robots) != (run, robots):
                world.send(CLOCK, told)
                follower.receive_messages()
            floors = [message for message, _, _ in follower.fold.take_messages() if isinstance(message, Map)]
            while not floors:
                follower.receive_messages()
                floors = [message for message, _, _ in follower.fold.take_messages() if isinstance(message, Map)]
