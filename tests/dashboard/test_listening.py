"""What a dashboard hears of a fleet's radio on a real wire."""

from dashboard.fold.state import ALL
from dashboard.listening import Listener
from swarm.bus import Arrival, Bus
from swarm.messages import RADIO
from tests.conftest import MakeBus
from tests.messages.made import broadcast


def test_it_listens_to_whom_it_turns_to_and_no_longer(make_bus: MakeBus) -> None:
    bus, other = make_bus(), make_bus()
    listener = Listener(bus)
    for robots, expected in (({"r2"}, {"r2"}), ({ALL}, {"r1", "r2", "r3"}), ({"r1"}, {"r1"})):
        listener.turn_to(frozenset(robots))
        assert heard(bus, other) == expected


def heard(bus: Bus, other: Bus) -> set[str]:
    """Return whose broadcasts arrive; they are sent until some do: a subscription takes its time to be known."""
    names = set[str]()
    for tick in range(20):
        for robot in ("r1", "r2", "r3"):
            other.send(RADIO, broadcast(tick, robot), zx=0, zy=0, robot=robot)
        while isinstance(arrived := bus.receive(timeout=2.0), Arrival):
            names.add(arrived.message.robot)
        if names:
            break
    return names
