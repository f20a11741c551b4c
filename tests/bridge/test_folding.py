"""What the bridge keeps of a fleet's messages until it says them."""

from msgspec import structs

from swarm.bridge.fleet_view import FleetView
from swarm.messages import Clock, Map, Message, Phase, Plan, Sense
from tests.messages.made import clock, truth
from tests.robot.shared import FITS
from tests.shared import scenario_of

SETTINGS, PACKED = scenario_of().to_wire()
FLOOR = Map(packed=PACKED, scenario=SETTINGS)


def sense(tick: int, run: int = 1) -> Sense:
    return structs.replace(FITS, run=run, tick=tick, time=tick / 20)


def plan(tick: int) -> Plan:
    return Plan(robot="r1", run=1, tick=tick, points=[(0.0, 0.0), (1.0, 0.0)])


def heard(fold: FleetView) -> list[tuple[Message, str, float]]:
    """Return what is said, without the clocks, of which the last one is always among it."""
    return [one for one in fold.take_messages() if not isinstance(one[0], Clock)]


def folded(*messages: Message) -> FleetView:
    fold = FleetView()
    for message in messages:
        fold.apply_message(message, "r1" if isinstance(message, Sense) else "")
    return fold


def test_only_the_newest_of_each_kind_is_said_and_once() -> None:
    fold = folded(clock(robots=("r1",)), FLOOR, truth(20), sense(19), truth(22), sense(20), sense(22), plan(10))
    assert heard(fold) == [
        (FLOOR, "", 1.1), (truth(22), "", 1.1), (sense(22), "r1", 1.1), (plan(10), "r1", 0.5),
    ]  # fmt: skip
    assert heard(fold) == []


def test_nothing_is_said_before_the_map_has_come_and_nothing_is_lost_by_that() -> None:
    fold = folded(clock(robots=("r1",)), plan(10))
    assert heard(fold) == []
    fold.apply_message(FLOOR)
    assert heard(fold) == [(plan(10), "r1", 0.5), (FLOOR, "", 0.0)]


def test_what_a_robot_says_before_the_clock_lists_it_is_said_when_it_does() -> None:
    fold = folded(clock(robots=("r2",)), FLOOR, plan(10))
    assert [message for message, _, _ in heard(fold)] == [FLOOR]
    fold.apply_message(clock(robots=("r1", "r2")))
    assert [message for message, _, _ in heard(fold)] == [plan(10)]


def test_another_run_makes_the_older_one_void() -> None:
    fold = folded(clock(robots=("r1",)), FLOOR, sense(40), truth(40), sense(1, run=2), sense(41))
    assert heard(fold) == [(FLOOR, "", 0.05), (sense(1, run=2), "r1", 0.05)]
    assert fold.run == 2


def test_the_run_is_over_when_its_clock_says_so_and_not_when_that_of_an_older_one_does() -> None:
    fold = folded(clock(run=2), clock(phase=Phase.OVER))
    assert not fold.over
    fold.apply_message(clock(run=2, phase=Phase.OVER))
    assert fold.over


def test_another_world_may_begin_with_a_lower_run_or_go_on_with_the_same() -> None:
    fold = folded(clock(run=5), FLOOR, truth(40, run=5))
    fold.accept_next_run()
    assert fold.run == 5, "whoever asks meanwhile gets that of now"
    fold.apply_message(clock(run=5))
    assert (fold.run, fold.time) == (5, clock().time)
    fold.apply_message(sense(40, run=4))
    assert fold.run == 5, "an older run is void again"
    fold.accept_next_run()
    fold.apply_message(clock(run=0))
    assert fold.run == 0
