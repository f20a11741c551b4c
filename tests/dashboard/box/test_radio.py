"""What the box hears of the radio, and what browsers see of it: learned floors and joint plans."""

import msgspec
import pytest

from dashboard.box.radio import Hearing
from dashboard.fold.radio import ALL, wanted
from dashboard.fold.scene import Scene, scene_of
from swarm.bus import Arrival, Bus
from swarm.messages import RADIO, Broadcast, Map, Truth
from tests.conftest import MakeBus
from tests.dashboard.rehearsal import RATE, Rehearsal

TICK = 11 * RATE  # r1 drives to its second stop, and r2 to its first, by a joint plan


def scene(*, known: bool = True) -> Scene:
    told, packed = Rehearsal(3).scenario.to_wire()
    settings = msgspec.structs.replace(told.settings, map=msgspec.structs.replace(told.settings.map, known=known))
    return scene_of(Map(scenario=msgspec.structs.replace(told, settings=settings), packed=packed))


def said(tick: int) -> tuple[list[Broadcast], Truth]:
    """Return the broadcasts of a second of the rehearsal, and the poses at its end."""
    rehearsal = Rehearsal(3)
    sent = [part for now in range(tick - RATE, tick + 1) for part in rehearsal.messages(now)]
    truths = [message for _, message, _ in sent if isinstance(message, Truth)]
    return [message for _, message, _ in sent if isinstance(message, Broadcast)], truths[-1]


@pytest.mark.parametrize(
    ("known", "selected", "expected"),
    [
        (True, set(), set()),
        (True, {"r2"}, {"r1", "r2", "r3"}),
        (True, {"r1"}, set()),  # in no joint plan on its way to its second stop
        (True, {"nobody"}, set()),
        (False, set(), {ALL}),
    ],
)
def test_only_robots_whose_plan_somebody_looks_at_are_heard(
    known: bool, selected: set[str], expected: set[str]
) -> None:
    _, truth = said(TICK)
    assert wanted(scene(known=known), truth, frozenset(selected)) == expected


def test_nobody_is_heard_before_the_floor_is_known() -> None:
    assert wanted(None, said(TICK)[1], frozenset({"r2"})) == wanted(scene(), None, frozenset({"r2"})) == frozenset()


def test_it_listens_to_whom_it_turns_to_and_no_longer(make_bus: MakeBus) -> None:
    bus, other = make_bus(), make_bus()
    hearing = Hearing(bus)
    broadcasts, _ = said(TICK)
    hearing.turn_to(frozenset({"r2"}))
    assert heard(bus, other, broadcasts) == {"r2"}
    hearing.turn_to(frozenset({ALL}))
    assert heard(bus, other, broadcasts) == {"r1", "r2", "r3"}
    hearing.turn_to(frozenset({"r1"}))
    assert heard(bus, other, broadcasts) == {"r1"}


def heard(bus: Bus, other: Bus, broadcasts: list[Broadcast]) -> set[str]:
    """Return whose broadcasts arrive; they are sent until some do: a subscription takes its time to be known."""
    names = set[str]()
    for _ in range(20):
        for message in broadcasts:
            other.send(RADIO, message, zx=0, zy=0, robot=message.robot)
        while isinstance(arrived := bus.receive(timeout=2.0), Arrival):
            names.add(arrived.message.robot)
        if names:
            break
    return names


def test_the_joint_plan_of_a_selected_robot_is_told(make_bus: MakeBus) -> None:
    hearing = Hearing(make_bus())
    hearing.take(scene())
    broadcasts, truth = said(TICK)
    for message in broadcasts:
        hearing.hear(message)
    (plan,) = hearing.joint(truth, frozenset({"r2"}))
    assert plan.leader == "r1"
    assert "r2" in plan.ways
    body = next(body for body in truth.bodies if body.robot == "r2")
    assert plan.ways["r2"][0] == (body.x, body.y)
    assert hearing.joint(truth, frozenset({"nobody"})) == []
    assert hearing.joint(msgspec.structs.replace(truth, run=9), frozenset({"r2"})) == [], "another run has its own"
    assert hearing.learned(truth) is None, "the floor was given"


def test_a_learned_floor_has_the_cells_told_lately_in_this_run(make_bus: MakeBus) -> None:
    hearing, floor = Hearing(make_bus()), scene(known=False)
    hearing.take(floor)
    (first, *_), truth = said(TICK)
    tell = msgspec.structs.replace
    hearing.hear(tell(first, walls=[7, 3], tick=100))
    hearing.hear(tell(first, walls=[3], tick=500))
    learned = hearing.learned(tell(truth, tick=600))
    assert learned is not None
    assert learned.cells == [3, 7]
    assert (learned.rows * learned.resolution, learned.columns * learned.resolution) == pytest.approx(
        (floor.map.shape[0] * floor.map.resolution, floor.map.shape[1] * floor.map.resolution)
    )
    later = hearing.learned(tell(truth, tick=900))
    assert later is not None
    assert later.cells == [3], "what nobody tells again is forgotten"
    hearing.hear(tell(first, walls=[5], run=1, tick=1))
    again = hearing.learned(tell(truth, run=1, tick=2))
    assert again is not None
    assert again.cells == [5]
