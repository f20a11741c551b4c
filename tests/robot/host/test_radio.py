"""The receiver of a process: one subscription for all robots near a zone, and each robot hears its own list once."""

from typing import Any, Final

from swarm.messages import RADIO
from swarm.robot.host.radio import PATIENCE, Radio, Receiver, zone_of, zones_around
from tests.robot.host.test_seat import broadcast

SIDE: Final = 10.0  # m


class Wire:
    """A bus that knows which zones are subscribed to; a second subscription, or the end of none, is an error."""

    def __init__(self) -> None:
        self.zones: set[tuple[int, int]] = set()

    def listen(self, topic: object, *, quiet: bool, zx: int, zy: int) -> None:
        assert topic is RADIO
        assert quiet
        assert (zx, zy) not in self.zones
        self.zones.add((zx, zy))

    def unlisten(self, topic: object, zx: int, zy: int) -> None:
        assert topic is RADIO
        self.zones.remove((zx, zy))


def radio_and_receivers(receivers: int = 2) -> tuple[Wire, Radio, list[Receiver]]:
    wire: Any = Wire()
    radio = Radio(wire)
    return wire, radio, [Receiver(radio, SIDE) for _ in range(receivers)]


def pairs(heard: list[Any]) -> list[tuple[str, int]]:
    return [(one.robot, one.tick) for one in heard]


def test_a_zone_is_left_of_and_below_its_edges_too() -> None:
    assert zone_of(-0.1, 10.0, SIDE) == (-1, 1)
    assert zones_around((0, 0)) == {(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)}


def test_the_process_subscribes_to_the_zones_around_all_its_robots() -> None:
    wire, _, (one, other) = radio_and_receivers()
    assert one.tune(5.0, 5.0) == (0, 0)
    assert wire.zones == zones_around((0, 0))
    assert other.tune(25.0, 5.0) == (2, 0)
    assert wire.zones == zones_around((0, 0)) | zones_around((2, 0))
    assert other.tune(25.1, 5.0) == (2, 0)


def test_a_zone_is_given_up_when_no_robot_is_near_it() -> None:
    wire, _, (one, other) = radio_and_receivers()
    one.tune(5.0, 5.0)
    other.tune(15.0, 5.0)
    one.tune(95.0, 5.0)
    assert wire.zones == zones_around((9, 0)) | zones_around((1, 0)), "zones that only one has left stay for the other"
    other.tune(95.0, 5.0)
    assert wire.zones == zones_around((9, 0))
    one.close()
    assert wire.zones == zones_around((9, 0))
    other.close()
    assert wire.zones == set()


def test_in_lockstep_each_robot_hears_exactly_its_own_list() -> None:
    _, radio, (one, other) = radio_and_receivers()
    for name in ("r3", "r4", "r5"):
        radio.take(broadcast(name, 6))
    assert pairs(one.listed_broadcasts([("r5", 6), ("r3", 6)], 7)) == [("r5", 6), ("r3", 6)]
    assert pairs(other.listed_broadcasts([("r3", 6)], 7)) == [("r3", 6)], "what one has heard is there for the other"
    assert other.misses_broadcast([("r3", 6), ("r3", 2)])
    assert not other.misses_broadcast([("r4", 6)])


def test_in_real_time_each_robot_hears_its_own_list_and_nothing_twice() -> None:
    _, radio, (one, other) = radio_and_receivers()
    radio.take(broadcast("r4", 6))
    radio.take(broadcast("r3", 6))
    radio.take(broadcast("r3", 2))
    assert pairs(one.what_came([("r4", 6), ("r3", 6), ("r3", 2)], 7)) == [("r3", 2), ("r3", 6), ("r4", 6)]
    radio.take(broadcast("r3", 6))
    assert one.what_came([("r3", 6)], 8) == [], "sent again, and listed again"
    assert pairs(other.what_came([("r3", 6), ("r5", 7)], 8)) == [("r3", 6)]
    radio.take(broadcast("r5", 7))
    assert one.what_came([], 9) == [], "the world did not let this one hear it"
    assert pairs(other.what_came([], 9)) == [("r5", 7)]


def test_in_real_time_a_broadcast_is_waited_for_only_so_long() -> None:
    _, radio, (one, other) = radio_and_receivers()
    for receiver in (one, other):
        assert receiver.what_came([("r3", 6)], 7) == []
    assert one.what_came([], 6 + PATIENCE + 1) == []
    radio.take(broadcast("r3", 6))
    assert one.what_came([], 6 + PATIENCE + 1) == []
    assert pairs(other.what_came([], 6 + PATIENCE)) == [("r3", 6)], "another robot's patience is its own"


def test_of_many_broadcasts_the_old_ones_are_dropped() -> None:
    _, radio, (one, _) = radio_and_receivers()
    for tick in range(1000):
        for name in ("r3", "r4", "r5", "r6", "r7", "r8", "r9"):
            radio.take(broadcast(name, tick))
        one.listed_broadcasts([], tick)
        assert not one.misses_broadcast([("r3", max(0, tick - PATIENCE))])
    assert one.misses_broadcast([("r3", 0)])
    assert len(radio.arrived) <= 1.25 * 7 * (PATIENCE + 1)


def test_one_robot_in_a_new_run_leaves_the_other_its_list() -> None:
    _, radio, (one, other) = radio_and_receivers()
    other.what_came([("r3", 0)], 1)
    one.begin(1)
    radio.take(broadcast("r3", 0))
    assert radio.arrived == {}, "the run before is over for the process"
    radio.take(broadcast("r3", 0, run=1))
    assert pairs(one.what_came([("r3", 0)], 1)) == [("r3", 0)]
    other.begin(1)
    assert other.what_came([], 1) == [], "it was listed in the run before"
    assert pairs(other.what_came([("r3", 0)], 1)) == [("r3", 0)]
