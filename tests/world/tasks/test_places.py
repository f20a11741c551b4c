"""Places that are opened while a fleet stays: what is refused, where bodies are put, and that nothing else changes."""

from collections.abc import Mapping
from contextlib import suppress
from itertools import combinations
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm.errors import PeerError
from swarm.geometry import distance
from swarm.messages import JOIN, PLACES, Activity, Join, Liveness, Order, Phase, Places, PoolTargets
from swarm.settings import MOST_ROBOTS
from tests.shared import scenario_of
from tests.world.shared import NOISE, ask, command, reborn, run_of
from world.host.run import Run
from world.simulate import Simulation
from world.tasks.places import MOST_AT_ONCE, REMEMBERED, Spots

FREE: Final = (7.5, 4.5, 1.0)
LENGTH: Final = 25.0  # s
AFTER: Final = 10.0  # s after the last place was opened


def fleet(robots: int = 2, **fields: Any) -> Simulation:  # noqa: ANN401
    given: dict[str, Any] = {"targets": [], "serve": True} | fields
    return Simulation.of(scenario_of(**given), robots, 1)


def places(count: int = 1, *at: tuple[float, float, float], name: str = "a") -> Places:
    return Places(id=name, count=count, at=list(at))


def run_on(simulation: Simulation, seconds: float) -> None:
    until = simulation.world.time + seconds
    while simulation.world.time < until:
        simulation.step()


# fmt: off
REFUSED: Final = {
    "none":            (places(0), "expected 1 to 64 places"),
    "too many at once": (places(MOST_AT_ONCE + 1), "expected 1 to 64 places"),
    "more starts than places": (places(1, FREE, FREE), "got 1 with 2 starts"),
    "off the map":     (places(1, (99.0, 1.0, 0.0)), r"place 1 at \(99, 1\): expected a place on the map"),
    "in a wall":       (places(1, (0.5, 0.5, 0.0)), "expected free floor"),
    "beside a wall":   (places(1, (1.1, 2.5, 0.0)), "expected at least 0.25 m from any wall"),
    "on a robot":      (places(1, (2.6, 2.5, 0.0)), "expected a free place, r1 stands there"),
    "in a held cell":  (places(1, (2.5, 3.0, 0.0)), "expected a place that nobody has reserved, r1 holds it"),
    "one on the other": (places(2, FREE, FREE), r"place 2 at \(7.5, 4.5\): expected a free place, another new one"),
    "no room":         (places(40), "expected a free cell for each of 40 robots, found"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_a_request_is_refused_with_the_reason_and_changes_nothing(name: str) -> None:
    request, expected = REFUSED[name]
    simulation = fleet()
    run_on(simulation, 1.0)
    world = simulation.world
    before = world.measures.recorder.digest
    with pytest.raises(PeerError, match=expected):
        simulation.open_places(request)
    assert (world.robots, world.measures.recorder.digest, world.tasks.places.starts) == (["r1", "r2"], before, [])


def test_no_body_is_put_where_a_restart_puts_another_one_back() -> None:
    one, home = fleet(targets=[[7.5, 4.5]]), (2.5, 2.5, 0.0)
    run_on(one, 6.0)
    assert distance(one.world.poses()[0], home) > 2.0, "it has driven away"
    for x in (2.5, 2.7, 2.89):
        with pytest.raises(PeerError, match="expected a place that is nobody's home"):
            one.open_places(places(1, (x, 2.5, 0.0)))
    one.open_places(places(10, name="b"))
    assert min(distance(a, b) for a, b in combinations(one.world.starts, 2)) > 2 * one.world.settings.robot.radius


def test_a_mover_and_a_robot_that_could_not_stop_are_in_the_way() -> None:
    mover = {"radius": 0.3, "waypoints": [[7.5, 4.5], [7.5, 1.5]], "speed": 0.001}
    simulation = fleet(movers=[mover])
    with pytest.raises(PeerError, match="a moving obstacle is there"):
        simulation.open_places(places(1, FREE))
    world = simulation.world
    world.bodies.wheels[0] = (1.6, 1.6)
    with pytest.raises(PeerError, match="expected a place that r1 can stop before, it drives"):
        simulation.open_places(places(1, (3.5, 2.5, 0.0)))


def test_no_more_robots_than_a_fleet_may_have() -> None:
    simulation = fleet()
    world = simulation.world
    spots = Spots(world.settings, world.bodies.floor, [], [], [], [])
    with pytest.raises(PeerError, match="expected at most 1000 robots, got 2 beside the 999 of now"):
        spots.starts(places(2), MOST_ROBOTS - 1)


def test_the_same_request_again_changes_nothing_and_another_under_its_id_is_refused() -> None:
    simulation = fleet()
    first, events = simulation.world.open_places(places(2, FREE))
    assert [event.robot for event in events] == first.robots == ["r3", "r4"]
    digest = simulation.world.measures.recorder.digest
    assert simulation.world.open_places(places(2, FREE)) == (first, [])
    assert simulation.world.measures.recorder.digest == digest
    with pytest.raises(PeerError, match="expected what was accepted with it"):
        simulation.world.open_places(places(1, FREE))
    for number in range(REMEMBERED + 1):
        simulation.world.tasks.places.enter(places(name=f"n{number}"), [], [])
    assert len(simulation.world.tasks.places.requests) == REMEMBERED


def test_a_newcomer_waits_and_then_takes_orders_and_errands() -> None:
    simulation = fleet(own_targets=[[[7.5, 3.5]], [[7.5, 2.5]]], targets=[], return_home=False)
    world = simulation.world
    run_on(simulation, 1.0)
    simulation.open_places(places(1, FREE))
    run_on(simulation, 2.0)
    assert distance(world.poses()[2], FREE) < world.settings.reach
    assert world.tasks.commands[2].activity is Activity.DONE
    world.put_in(PoolTargets(id="p", targets=[(8.5, 4.5)]))
    run_on(simulation, 12.0)
    errand = world.tasks.pool.closed["p/1"]
    assert errand.robot == 2
    world.request("r3", Order(id="o", targets=[(2.5, 4.5)], home=True))
    run_on(simulation, 30.0)
    assert world.tasks.complete
    assert world.is_finished
    assert distance(world.poses()[2], FREE) <= world.settings.reach
    report = simulation.report(1.0, 1.0)
    assert [one["fate"] for one in report["per_robot"]["r3"]["history"]] == ["done"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


@pytest.mark.long("many simulated fleets")
@settings(max_examples=8, deadline=None)
@given(
    waits=st.lists(st.integers(1, 60), min_size=1, max_size=4),
    spots=st.lists(st.none() | st.tuples(st.floats(1.0, 9.0), st.floats(1.0, 5.0)), min_size=4, max_size=4),
)
def test_whoever_is_put_wherever_it_is_allowed_nobody_touches_and_no_cell_is_held_twice(
    waits: list[int], spots: list[tuple[float, float] | None]
) -> None:
    simulation, opened = fleet(targets=[[7.5, 3.5], [2.5, 3.5]]), 0
    for number, (wait, spot) in enumerate(zip(waits, spots, strict=False)):
        for _ in range(wait):
            simulation.step()
        with suppress(PeerError):
            simulation.open_places(places(1, *([(*spot, 0.0)] if spot else []), name=f"n{number}"))
            opened += 1
    run_on(simulation, AFTER)
    world = simulation.world
    assert world.robots == [f"r{number + 1}" for number in range(2 + opened)]
    assert world.measures.recorder.judge.smallest > 0.0
    assert world.measures.reservations.state.watch.faults == []


def run(file: Path | None = None, **fields: Any) -> Mapping[str, Any]:  # noqa: ANN401
    """Return the report of a run to which robots come; with a file, the world is replaced from it when it is saved."""
    simulation = fleet(targets=[[7.5, 3.5]], **fields)
    due = {40: places(1), 41: places(2, (8.5, 4.5, 0.5), name="b"), 200: places(1, name="c")}
    while simulation.world.time < LENGTH:
        simulation.step()
        if (request := due.get(simulation.world.tick)) is not None:
            simulation.open_places(request)
        if simulation.world.tick == 260:
            simulation.world.request("r3", Order(id="o", targets=[(2.5, 4.5)]))
        if file is not None and simulation.world.due:
            simulation.world = reborn(simulation, file)
    return simulation.report(1.0, LENGTH)


@pytest.mark.parametrize(
    "fields", [pytest.param({}, marks=pytest.mark.long("three runs")), NOISE], ids=["plain", "noise and loss"]
)
def test_a_world_that_goes_on_from_its_snapshots_keeps_the_places_bit_for_bit(
    fields: dict[str, Any], tmp_path: Path
) -> None:
    expected, got = run(**fields), run(tmp_path / "world.snapshot", **fields)
    assert expected["robots"] == 6
    assert got == expected


# --- the process ---


def staying(**fields: Any) -> Run:  # noqa: ANN401
    given: dict[str, Any] = {"targets": [], "serve": True} | fields
    one = run_of(scenario_of(**given), limit=float("inf"))
    one.go_to(Phase.RUNNING)
    return one


def test_without_serve_no_place_is_opened() -> None:
    said = ask(staying(serve=False, targets=[[7.5, 3.5]]), PLACES, places())
    assert "expected a fleet that stays" in said


def test_a_place_is_free_to_take_and_stays_open_after_a_restart() -> None:
    one = staying()
    assert ask(one, PLACES, places(1, FREE)).robots == ["r3"]
    assert one.clock().robots == ["r1", "r2", "r3"]
    assert one.liveliness.seen["r3"].liveness is Liveness.GONE
    assert one.membership.absent_robots[-1] == "r3"
    assert one.status().robots[2].pose == pytest.approx(FREE)
    assert one.publisher.floor.scenario.starts["r3"] == pytest.approx(FREE)  # type: ignore[index]
    assert not one.repeatable.reasons, "it came before the first tick"
    one.restart()
    assert one.world.robots == ["r1", "r2", "r3"]
    assert ask(one, PLACES, places(1, FREE)).robots == ["r3"]
    assert one.world.robots == ["r1", "r2", "r3"]
    assert one.membership.place(None, "s", 0.0) == "r1"
    assert one.membership.place("r3", "t", 0.0) == "r3"
    welcomed = ask(one, JOIN, Join(robot="r3", session="t", world=None))
    assert (welcomed.robot, welcomed.assigned.stops) == ("r3", [])


def test_in_lockstep_a_place_that_nobody_takes_does_not_keep_the_clock_running() -> None:
    one = staying()
    done = command(activity=Activity.DONE, reached=[True])
    one.last.commands = {"r1": done, "r2": done}
    one.step()
    assert one.stands
    ask(one, PLACES, places(1, FREE))
    assert one.stands
    one.world.request("r3", Order(id="a", targets=[(2.5, 4.5)]))
    assert not one.stands
