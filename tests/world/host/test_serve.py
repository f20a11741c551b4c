"""A fleet that stays: robots without stops, who makes room for whom, what ends the run, and when the clock stands."""

from math import inf
from typing import Any

import msgspec
import pytest

from swarm.errors import ConfigError
from swarm.geometry import distance
from swarm.messages import Activity, Order, Phase, PoolTargets, RobotAction, RobotDo
from swarm.settings import Pace
from tests.shared import scenario_of
from tests.world import shared
from tests.world.shared import absent, run_of
from world.faults import Faults, Health, Spell
from world.fleet.liveness import AWAY
from world.host.run import Run
from world.measure.progress import STALLED
from world.simulate import Simulation
from world.views.status import states

DONE = Activity.DONE
THERE = (7.5, 4.5)


@pytest.mark.parametrize("home", [True, False])
@pytest.mark.parametrize(
    "faults", [Faults(), Faults(spells=(Spell("r1", Health.AWAY, 60, 60),))], ids=["well", "started again"]
)
def test_robots_without_targets_wait_where_they_are_and_then_carry_out_orders(home: bool, faults: Faults) -> None:
    simulation = Simulation.of(scenario_of(targets=[], serve=True, return_home=home), 2, 1, faults)
    world = simulation.world
    for _ in range(20):
        simulation.step()
    assert world.is_finished
    assert world.tasks.complete
    side = world.measures.cells.side
    assert all(distance(*pair) < side for pair in zip(world.poses(), world.starts, strict=True)), "each has one cell"
    world.request("r1", Order(id="a", targets=[THERE]))
    while not world.is_finished:
        simulation.step()
        assert world.time < 60.0
    assert world.tasks.complete
    assert distance(world.poses()[0], THERE) <= world.settings.reach
    assert [past.fate for past in world.tasks.missions.history(0)] == ["done", "done"]


def test_without_serve_targets_are_asked_for() -> None:
    with pytest.raises(ConfigError, match="expected either `targets`"):
        scenario_of(targets=[])


def test_who_is_done_makes_room_for_an_order_to_its_place() -> None:
    simulation = Simulation.of(scenario_of(targets=[], serve=True), 2, 1)
    world = simulation.world
    for _ in range(20):
        simulation.step()
    world.request("r2", Order(id="a", targets=[world.starts[0][:2]]))
    while not world.is_finished:
        simulation.step()
        assert world.time < 60.0
    assert world.tasks.complete
    assert world.measures.recorder.counts.contact_counts[0].total() == 0


# --- the run ---


def run(pace: Pace, limit: float, **fields: Any) -> Run:  # noqa: ANN401
    scenario = scenario_of(targets=[], **fields)
    one = run_of(scenario, pace=pace, limit=limit)
    one.go_to(Phase.RUNNING)
    return one


def step(one: Run, *done: str) -> None:
    shared.step(one, **{name: {"activity": DONE, "reached": [True]} for name in done})


@pytest.mark.parametrize(
    ("done", "away", "limit", "over"),
    [(("r1", "r2"), 0.0, inf, False), (("r1",), AWAY, inf, False), (("r1", "r2"), 0.0, 0.05, True)],
    ids=["all are done", "who is not done is lost", "the limit"],
)
def test_only_a_limit_ends_a_run_of_a_fleet_that_stays(
    done: tuple[str, ...], away: float, limit: float, over: bool
) -> None:
    one = run(1.0, limit, serve=True)
    absent(one, away)
    step(one, *done)
    assert (one.phase is Phase.OVER) is over


@pytest.mark.parametrize(
    ("pace", "limit", "fields", "done", "stands"),
    [
        ("max", inf, {}, ("r1", "r2"), True),
        ("max", inf, {}, ("r1",), False),
        (1.0, inf, {}, ("r1", "r2"), False),
        ("max", 300.0, {}, ("r1", "r2"), False),
        ("max", inf, {"orders": [{"at": 9.0, "robot": "r1", "targets": [THERE]}]}, ("r1", "r2"), False),
        ("max", inf, {"edits": [{"at": 9.0, "kind": "wall", "low": (8, 1), "high": (8.5, 1.5)}]}, ("r1", "r2"), False),
    ],
    ids=["all are done", "one is not", "real time", "a limit", "an order is planned", "an edit is planned"],
)
def test_in_lockstep_the_clock_stands_while_nobody_has_anything_to_do(
    pace: Pace, limit: float, fields: dict[str, object], done: tuple[str, ...], stands: bool
) -> None:
    one = run(pace, limit, serve=True, **fields)
    assert not one.stands
    step(one, *done)
    assert bool(one.stands) is stands
    if stands:
        one.world.request("r2", Order(id="a", targets=[THERE]))
        assert not one.stands


def test_in_lockstep_targets_for_the_pool_wake_a_fleet_that_rests() -> None:
    one = run("max", inf, serve=True)
    step(one, "r1", "r2")
    assert one.stands
    one.world.put_in(PoolTargets(id="p", targets=[THERE]))
    assert not one.stands


def test_a_lost_robot_does_not_end_a_run_in_which_others_have_errands_to_take() -> None:
    one = run(1.0, inf, pool=[THERE], return_home=True)
    step(one, "r1")
    absent(one, AWAY)
    step(one)
    assert one.world.tasks.unfinished_robots == ["r2"]
    assert one.phase is Phase.RUNNING, "r1 can still take the errand"
    while one.world.tasks.pool.waiting:
        step(one, "r1")
    one.world.request("r1", RobotAction(do=RobotDo.CANCEL))
    step(one)
    assert [event.kind for event in one.publisher.events].count("errand") == 1


def test_a_new_order_is_not_blamed_for_the_time_that_the_old_one_stood() -> None:
    one = run(1.0, inf, serve=True)
    one.world.request("r1", Order(id="a", targets=[THERE]))
    ticks = round((STALLED - 1.0) / one.world.dt)
    for _ in range(ticks):
        step(one)
    assert max(one.world.measures.progress.standing(one.world.time)[:1]) > STALLED - 3.0
    one.world.request("r1", Order(id="b", targets=[(2.5, 4.5)]))
    assert one.world.measures.progress.standing(one.world.time)[0] == 0.0
    for _ in range(60):
        step(one)
    assert not [event for event in one.publisher.events if event.kind == "stalled"]


def test_a_robot_that_was_done_has_stops_left_as_soon_as_it_has_an_order() -> None:
    """Who has no stop left stands for ever: the run would be given up at once."""
    one = run(1.0, inf, serve=True)
    step(one, "r1", "r2")
    assert one.world.measures.progress.standing(one.world.time) == [inf, inf]
    one.world.request("r1", Order(id="a", targets=[THERE]))
    assert one.world.measures.progress.standing(one.world.time) == [0.0, inf]


def test_done_with_the_stops_before_is_no_false_claim_about_those_of_now() -> None:
    one = run(1.0, inf, serve=True)
    step(one, "r2")
    one.world.request("r1", Order(id="a", targets=[THERE]))
    step(one, "r1")  # it has not heard of the order
    assert not [event for event in one.publisher.events if event.kind == "false_claim"]


def test_a_state_that_was_lost_with_a_world_is_told_from_the_last_command() -> None:
    simulation = Simulation.of(scenario_of(targets=[], serve=True), 2, 1)
    world = simulation.world
    for _ in range(20):
        simulation.step()
    newest = states(world, {})["r1"]
    assert newest.activity is DONE
    old = msgspec.structs.replace(newest, tick=1, activity=Activity.DRIVE, distance=0.9)
    assert states(world, {"r1": old})["r1"].activity is DONE
    slow = msgspec.structs.replace(old, activity=DONE)
    assert states(world, {"r1": slow})["r1"] is slow, "a robot says its state once a second"
    early = msgspec.structs.replace(old, tick=world.tick)
    assert states(world, {"r1": early})["r1"] is early, "a state may come before the command of its tick"
