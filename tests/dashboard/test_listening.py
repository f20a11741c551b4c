"""What a dashboard hears of a fleet's radio on a real wire."""

from dashboard.fleet_listener import FleetListener
from dashboard.fold.state import ALL
from swarm.bus import Arrival, Bus
from swarm.messages import RADIO
from tests.conftest import MakeBus
from tests.messages.made import broadcast

ROUNDS = 40


def test_it_listens_to_whom_it_turns_to_and_no_longer(make_bus: MakeBus) -> None:
    bus, other = make_bus(), make_bus()
    listener = FleetListener(bus)
    for robots, expected in (({"r2"}, {"r2"}), ({ALL}, {"r1", "r2", "r3"}), ({"r1"}, {"r1"})):
        listener.turn_to(frozenset(robots))
        rounds = (heard(bus, other, tick) for tick in range(ROUNDS))
        assert any(names == expected for names in rounds), robots


def heard(bus: Bus, other: Bus, tick: int) -> set[str]:
    """Return whose broadcasts of one round arrive: a change of subscriptions takes some rounds to be known to `other`."""
    for robot in ("r1", "r2", "r3"):
        other.send(RADIO, broadcast(tick, robot), zx=0, zy=0, robot=robot)
    names = set[str]()
    while isinstance(arrived := bus.receive(timeout=0.5), Arrival):
        names.add(arrived.message.robot)
    return names
