"""Places that are opened while a fleet stays: what is refused, where bodies are put, and that nothing else changes."""

from collections.abc import Mapping
from itertools import combinations
from math import hypot
from pathlib import Path
from typing import Any, Final
from unittest.mock import Mock

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm.bus import Bus, Request
from swarm.errors import PeerError
from swarm.geometry import distance
from swarm.messages import PLACES, Activity, Join, Liveness, Order, Phase, Places, PoolTargets
from tests.shared import scenario_of
from tests.world.test_snapshot import NOISE, reborn
from world.answering import answer
from world.course import Course
from world.places import MOST_AT_ONCE, MOST_ROBOTS, REMEMBERED, Spots
from world.simulate import Simulation
from world.world import REST

FREE: Final = (7.5, 4.5, 1.0)
LENGTH: Final = 25.0  # s


def fleet(robots: int = 2, **fields: Any) -> Simulation:  # noqa: ANN401
    given: dict[str, Any] = {"targets": [], "serve": True} | fields
    return Simulation.of(scenario_of(**given), robots, 1)


def ask(count: int = 1, *at: tuple[float, float, float], name: str = "a") -> Places:
    return Places(id=name, count=count, at=list(at))


def run_on(simulation: Simulation, seconds: float) -> None:
    until = simulation.world.time + seconds
    while simulation.world.time < until:
        simulation.step()


# fmt: off
REFUSED: Final = {
    "none":            (ask(0), "expected 1 to 64 places"),
    "too many at once": (ask(MOST_AT_ONCE + 1), "expected 1 to 64 places"),
    "more starts than places": (ask(1, FREE, FREE), "got 1 with 2 starts"),
    "off the map":     (ask(1, (99.0, 1.0, 0.0)), r"place 1 at \(99, 1\): expected a place on the map"),
    "in a wall":       (ask(1, (0.5, 0.5, 0.0)), "expected free floor"),
    "beside a wall":   (ask(1, (1.1, 2.5, 0.0)), "expected at least 0.25 m from any wall"),
    "on a robot":      (ask(1, (2.6, 2.5, 0.0)), "expected a free place, r1 stands there"),
    "in a held cell":  (ask(1, (2.5, 3.0, 0.0)), "expected a place that nobody has reserved, r1 holds it"),
    "one on the other": (ask(2, FREE, FREE), r"place 2 at \(7.5, 4.5\): expected a free place, another new one"),
    "no room":         (ask(40), "expected a free cell for each of 40 robots, found"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_a_request_is_refused_with_the_reason_and_changes_nothing(name: str) -> None:
    request, expected = REFUSED[name]
    simulation = fleet()
    run_on(simulation, 1.0)
    world = simulation.world
    before = world.recorder.digest
    with pytest.raises(PeerError, match=expected):
        simulation.open_places(request)
    assert (world.robots, world.recorder.digest, world.places.starts) == (["r1", "r2"], before, [])


def test_a_mover_and_a_robot_that_could_not_stop_are_in_the_way() -> None:
    mover = {"radius": 0.3, "waypoints": [[7.5, 4.5], [7.5, 1.5]], "speed": 0.001}
    simulation = fleet(movers=[mover])
    with pytest.raises(PeerError, match="a moving obstacle is there"):
        simulation.open_places(ask(1, FREE))
    world = simulation.world
    world.wheels[0] = (1.6, 1.6)
    with pytest.raises(PeerError, match="expected a place that r1 can stop before, it drives"):
        simulation.open_places(ask(1, (3.5, 2.5, 0.0)))


def test_no_more_robots_than_a_fleet_may_have() -> None:
    simulation = fleet()
    world = simulation.world
    spots = Spots(world.settings, world.floor, world.traffic.watch.cells, [], [], [])
    with pytest.raises(PeerError, match="expected at most 1000 robots, got 2 beside the 999 of now"):
        spots.starts(ask(2), MOST_ROBOTS - 1)


def test_the_same_request_again_changes_nothing_and_another_under_its_id_is_refused() -> None:
    simulation = fleet()
    first, events = simulation.world.open_places(ask(2, FREE))
    assert [event.robot for event in events] == first.robots == ["r3", "r4"]
    digest = simulation.world.recorder.digest
    assert simulation.world.open_places(ask(2, FREE)) == (first, [])
    assert simulation.world.recorder.digest == digest
    with pytest.raises(PeerError, match="expected what was accepted with it"):
        simulation.world.open_places(ask(1, FREE))
    for number in range(REMEMBERED + 1):
        simulation.world.places.enter(ask(name=f"n{number}"), [], [])
    assert len(simulation.world.places.requests) == REMEMBERED


def test_a_newcomer_waits_and_then_takes_orders_and_errands() -> None:
    simulation = fleet(own_targets=[[[7.5, 3.5]], [[7.5, 2.5]]], targets=[], return_home=False)
    world = simulation.world
    run_on(simulation, 1.0)
    simulation.open_places(ask(1, FREE))
    run_on(simulation, 2.0)
    assert distance(world.poses()[2], FREE) < world.settings.reach
    assert world.commands[2].activity is Activity.DONE
    world.put_in(PoolTargets(id="p", targets=[(8.5, 4.5)]))
    run_on(simulation, 12.0)
    errand = world.dispatch.pool.closed["p/1"]
    assert errand.robot == 2
    world.request("r3", Order(id="o", targets=[(2.5, 4.5)], home=True))
    run_on(simulation, 30.0)
    assert world.complete
    assert world.finished
    assert distance(world.poses()[2], FREE) <= world.settings.reach
    report = simulation.report(1.0, 1.0)
    assert [one["fate"] for one in report["per_robot"]["r3"]["history"]] == ["done"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


@settings(max_examples=15, deadline=None)
@given(
    ticks=st.lists(st.integers(1, 60), min_size=1, max_size=4),
    spots=st.lists(st.none() | st.tuples(st.floats(1.0, 9.0), st.floats(1.0, 5.0)), min_size=4, max_size=4),
)
def test_whoever_is_put_wherever_it_is_allowed_nobody_touches_and_no_cell_is_held_twice(
    ticks: list[int], spots: list[tuple[float, float] | None]
) -> None:
    simulation = fleet(targets=[[7.5, 3.5], [2.5, 3.5]])
    world, opened = simulation.world, 0
    for number, (wait, spot) in enumerate(zip(ticks, spots, strict=False)):
        for _ in range(wait):
            simulation.step()
        try:
            simulation.open_places(ask(1, *([(*spot, 0.0)] if spot else []), name=f"n{number}"))
            opened += 1
        except PeerError:
            continue
    run_on(simulation, LENGTH)
    report = simulation.report(1.0, LENGTH)
    assert len(world.robots) == 2 + opened == len(set(world.robots))
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["clearance_min"] > 0.0
    gaps = (hypot(a.x - b.x, a.y - b.y) for a, b in combinations(world.poses(), 2))
    assert min(gaps) > 2 * world.settings.robot.radius


def course(file: Path | None = None, **fields: Any) -> Mapping[str, Any]:  # noqa: ANN401
    """Return the report of a run to which robots come; with a file, the world is replaced from it when it is saved."""
    simulation = fleet(targets=[[7.5, 3.5]], **fields)
    due = {40: ask(1), 41: ask(2, (8.5, 4.5, 0.5), name="b"), 200: ask(1, name="c")}
    while simulation.world.time < LENGTH:
        simulation.step()
        if (request := due.get(simulation.world.tick)) is not None:
            simulation.open_places(request)
        if simulation.world.tick == 260:
            simulation.world.request("r3", Order(id="o", targets=[(2.5, 4.5)]))
        if file is not None and simulation.world.due:
            simulation.world = reborn(simulation, file)
    return simulation.report(1.0, LENGTH)


@pytest.mark.parametrize("fields", [{}, NOISE], ids=["plain", "noise and loss"])
def test_a_world_that_goes_on_from_its_snapshots_keeps_the_places_bit_for_bit(
    fields: dict[str, Any], tmp_path: Path
) -> None:
    expected, got = course(**fields), course(tmp_path / "world.snapshot", **fields)
    assert expected["robots"] == 6
    assert got == expected


# --- the process ---


def host(**fields: Any) -> Course:  # noqa: ANN401
    given: dict[str, Any] = {"targets": [], "serve": True} | fields
    scenario = scenario_of(**given)
    one = Course(Mock(spec=Bus), scenario, 2, 1, "max", float("inf"), False, 0, None, lambda line: None)
    one.go_to(Phase.RUNNING)
    return one


def put(one: Course, request: Places) -> Mock:
    asked = Mock(spec=Request, topic=PLACES, message=request, ids={})
    answer(asked, one, Mock(spec=Bus))
    return asked


def test_without_serve_no_place_is_opened() -> None:
    asked = put(host(serve=False, targets=[[7.5, 3.5]]), ask())
    assert "expected a fleet that stays" in asked.refuse.call_args.args[0]


def test_a_place_is_free_to_take_and_stays_open_after_a_restart() -> None:
    one = host()
    asked = put(one, ask(1, FREE))
    assert asked.accept.call_args.args[0].robots == ["r3"]
    assert one.clock().robots == ["r1", "r2", "r3"]
    assert one.roll.seen["r3"].liveness is Liveness.GONE
    assert one.lobby.absent[-1] == "r3"
    assert one.status().robots[2].pose == pytest.approx(FREE)
    assert one.speaker.floor(one.world).scenario.starts["r3"] == pytest.approx(FREE)  # type: ignore[index]
    assert not one.repeatable.reasons, "it came before the first tick"
    one.restart()
    assert one.world.robots == ["r1", "r2", "r3"]
    assert put(one, ask(1, FREE)).accept.call_args.args[0].robots == ["r3"]
    assert one.world.robots == ["r1", "r2", "r3"]
    assert one.lobby.place(None, "s", 0.0) == "r1"
    assert one.lobby.place("r3", "t", 0.0) == "r3"
    join = Mock(spec=Request, message=Join(robot="r3", session="t", world=None), ids={})
    answer(join, one, Mock(spec=Bus, id="w", sender=1))
    welcomed = join.accept.call_args.args[0]
    assert (welcomed.robot, welcomed.assigned.stops) == ("r3", [])


def test_in_lockstep_a_place_that_nobody_takes_does_not_keep_the_clock_running() -> None:
    one = host()
    done = msgspec.structs.replace(REST, activity=Activity.DONE, reached=[True])
    one.last.commands = {"r1": done, "r2": done}
    one.step()
    assert one.stands
    put(one, ask(1, FREE))
    assert one.stands
    one.world.request("r3", Order(id="a", targets=[(2.5, 4.5)]))
    assert not one.stands
