"""The pool in whole runs, in one process: who takes what, what goes back, and what the report says."""

from typing import Any

import pytest

from swarm.errors import ConfigError, PeerError
from swarm.messages import Edit, Event, Kind, Order, PoolTargets, RobotAction, RobotDo
from swarm.scenario.check import check
from swarm.scenario.load import Scenario
from tests.shared import scenario_of
from world.faults import Faults, Health, Spell
from world.simulate import Simulation
from world.tasks.dispatcher import STUCK, WINDOW
from world.world import World

HALL = """\
################
#..............#
#..............#
#######..#######
#..............#
#..............#
################
"""
DEAD_END = """\
############
#..........#
#..........#
########.###
########.###
########.###
############
"""
CORNERS = [[1.5, 1.5], [14.5, 1.5], [14.5, 5.5], [1.5, 5.5], [7.5, 1.5], [7.5, 5.5]]
STARTS = {"poses": [[2.5, 2.5, 0.0], [13.5, 2.5, 0.0], [2.5, 4.5, 0.0], [13.5, 4.5, 0.0]]}


def pool_of(pool: list[list[float]], text: str = HALL, **fields: Any) -> Scenario:  # noqa: ANN401
    given: dict[str, Any] = {"start": STARTS, "targets": [], "pool": pool, "limit": 200.0}
    return scenario_of(text, **(given | fields))


def watched(simulation: Simulation, limit: float = 200.0) -> list[Event]:
    """Run to the end; return all events."""
    found = []
    while not simulation.world.is_finished and simulation.world.time < limit:
        found += simulation.step().events
    return found


def kinds(events: list[Event], *of: str) -> list[tuple[str | None, str]]:
    return [(event.robot, event.kind) for event in events if event.kind in of]


def clean(world: World) -> bool:
    return not sum(counts.total() for counts in world.measures.recorder.counts.contact_counts)


def test_each_target_is_visited_once_by_one_robot_and_the_run_ends() -> None:
    simulation = Simulation.of(pool_of(CORNERS), 4, 1)
    events, world = watched(simulation), simulation.world
    assert world.tasks.complete
    assert clean(world)
    assert len(kinds(events, "errand")) == len(CORNERS)
    assert kinds(events, "errand_back") == []
    first = [event for event in events if event.kind == "errand"][:4]
    assert sorted(event.robot or "" for event in first) == [*world.robots], "all set off"
    assert first[0].time == first[3].time
    pool = simulation.report(1.0, 200.0)["pool"]
    assert pool == {
        "given": 6, "done": 6, "per_minute": pytest.approx(6 / world.time * 60), "left": [],
    }  # fmt: skip
    assert simulation.report(1.0, 200.0)["digest"] == Simulation.of(pool_of(CORNERS), 4, 1).run()["digest"]


def test_the_bid_is_the_way_and_not_the_distance() -> None:
    """r1 stands right behind the wall; r2 has the shorter way."""
    starts = {"poses": [[1.5, 2.5, 0.0], [13.5, 4.5, 3.0]]}
    events = watched(Simulation.of(pool_of([[2.5, 4.5]], start=starts), 2, 1))
    assert kinds(events, "errand") == [("r2", "errand")]


def test_an_old_errand_is_not_left_for_ever_because_nearer_ones_come() -> None:
    simulation = Simulation.of(pool_of([[14.5, 5.5]], start={"poses": [[2.5, 2.5, 0.0]]}), 1, 1)
    world, number = simulation.world, 0
    world.put_in(PoolTargets(id="near", targets=[(1.5, 1.5)]))
    while (open_ := world.tasks.pool.open.get("scenario/1")) is not None and world.time < 400:
        simulation.step()
        if open_.robot is None and len(world.tasks.pool.waiting) < 2:
            number += 1
            world.put_in(PoolTargets(id=f"n{number}", targets=[(2.5, 2.5) if number % 2 else (1.5, 1.5)]))
    assert number > 3, "it was passed over for nearer ones"
    assert world.tasks.pool.done > number / 2
    assert "scenario/1" in world.tasks.pool.closed


def test_errands_that_nobody_can_reach_do_not_keep_others_waiting() -> None:
    walled = [[14.5, 5.6 - number / 400] for number in range(WINDOW)]
    simulation = Simulation.of(pool_of([*walled, [7.5, 5.5]]), 2, 1)
    world = simulation.world
    world.edit(Edit(kind=Kind.WALL, low=(12.1, 4.1), high=(12.9, 5.9)))
    world.edit(Edit(kind=Kind.WALL, low=(13.1, 4.1), high=(14.9, 4.9)))
    watched(simulation)
    assert [errand.name for errand in world.tasks.pool.waiting] == [f"scenario/{n + 1}" for n in range(WINDOW)]
    assert world.tasks.pool.done == 1


def test_two_errands_at_one_place_are_both_done_one_after_the_other() -> None:
    simulation = Simulation.of(pool_of([[7.5, 1.5], [7.5, 1.5]]), 4, 1)
    events = watched(simulation)
    first_home, then = kinds(events, "errand", "reached")[:4], kinds(events, "errand", "reached")[4:]
    assert [kind for _, kind in first_home] == ["reached"] * 4
    assert [kind for _, kind in then] == ["errand", "reached"] * 2
    assert simulation.world.tasks.pool.done == 2
    assert simulation.world.tasks.complete


def test_robots_first_drive_to_the_stops_of_their_own() -> None:
    simulation = Simulation.of(pool_of(CORNERS[:2], targets=[[7.5, 1.5]]), 2, 1)
    events = watched(simulation)
    order = kinds(events, "errand", "reached")
    for name in ("r1", "r2"):
        own = [kind for robot, kind in order if robot == name]
        assert own[:2] == ["reached", "reached"]
    assert simulation.world.tasks.complete


def test_a_robot_without_an_errand_makes_room_in_a_dead_end() -> None:
    """r1 rests in the corridor that ends at the errand which only r2 may take."""
    starts = {"poses": [[8.5, 4.5, -1.5], [2.5, 4.5, 0.0]]}
    simulation = Simulation.of(pool_of([[8.5, 2.5]], DEAD_END, start=starts), 2, 1)
    world = simulation.world
    events = watched(simulation)
    world.put_in(PoolTargets(id="behind", targets=[(8.5, 1.5)]))
    world.tasks.pool.waiting[0].refused = [0]
    events += watched(simulation)
    assert kinds(events, "errand") == [("r1", "errand"), ("r2", "errand")]
    assert world.tasks.complete
    assert clean(world)


# --- errands that go back ---


def test_a_robot_that_is_away_for_a_while_keeps_its_errand() -> None:
    faults = Faults(spells=(Spell("r1", Health.AWAY, 40, 80),))
    simulation = Simulation.of(pool_of(CORNERS), 4, 1, faults)
    events = watched(simulation)
    assert kinds(events, "errand_back") == []
    assert len(kinds(events, "errand")) == len(CORNERS)
    assert simulation.world.tasks.complete


@pytest.mark.parametrize("spell", [Spell("r1", Health.AWAY, 40, 600), Spell("r1", Health.SUSPENDED, 40, 600)])
def test_the_errand_of_a_robot_that_is_away_for_long_goes_to_another_and_it_works_on_later(spell: Spell) -> None:
    far = [*CORNERS, [14.5, 2.5], [1.5, 2.5], [14.5, 4.5], [1.5, 4.5]] * 2
    simulation = Simulation.of(pool_of(far), 4, 1, Faults(spells=(spell,)))
    events = watched(simulation, 400)
    assert kinds(events, "errand_back") == [("r1", "errand_back")]
    (back,) = [event for event in events if event.kind == "errand_back"]
    assert "goes back to the pool: r1 had it, and it has not answered for long" in back.text
    assert simulation.world.tasks.complete
    assert simulation.world.tasks.pool.done == len(far)


def test_the_errand_of_a_dead_robot_is_done_by_another() -> None:
    simulation = Simulation.of(pool_of(CORNERS), 4, 1, Faults(killed={"r1": 2.0}))
    world, events = simulation.world, []
    while world.tasks.pool.open and world.time < 200:
        events += simulation.step().events
    assert kinds(events, "errand_back") == [("r1", "errand_back")]
    assert world.tasks.pool.done == len(CORNERS)
    assert clean(world)


@pytest.mark.long("minutes of simulated errands")
def test_a_robot_that_is_stuck_serves_the_others_first_and_tries_again_when_none_is_left() -> None:
    """A dead robot stands where the nearest errand is: r1 waits there for long, but not for ever."""
    starts = {"poses": [[2.5, 2.5, 0.0], [5.5, 2.5, 0.0]]}
    simulation = Simulation.of(pool_of([], start=starts, serve=True, reach=0.3), 2, 1, Faults(killed={"r2": 0.0}))
    world = simulation.world
    for _ in range(60):
        simulation.step()
    world.put_in(PoolTargets(id="shut", targets=[(5.5, 2.5)]))
    events = [event for _ in range(10) for event in simulation.step().events]
    world.put_in(PoolTargets(id="far", targets=[(1.5, 5.5), (14.5, 5.5)]))
    while (world.time < STUCK or world.tasks.pool.waiting) and world.time < 400:
        events += simulation.step().events
    back = [event for event in events if event.kind == "errand_back" and event.robot == "r1"]
    assert ["got no nearer for long" in event.text for event in back] == [True]
    assert [event.text.split()[3] for event in events if event.kind == "errand"] == [
        "shut/1",
        "far/1",
        "far/2",
        "shut/1",
    ]
    assert world.tasks.pool.done == 2
    assert clean(world)


def test_an_order_puts_the_errand_back_and_the_robot_is_free_after_it() -> None:
    simulation = Simulation.of(pool_of([[14.5, 1.5], [14.5, 5.5]]), 1, 1)
    world = simulation.world
    events = [event for _ in range(40) for event in simulation.step().events]
    world.request("r1", Order(id="a", targets=[(1.5, 1.5)]))
    events += watched(simulation)
    texts = [event.text for event in events if event.kind == "errand_back"]
    assert len(texts) == 1
    assert "it has other targets now" in texts[0]
    assert world.tasks.complete
    history = simulation.report(1.0, 1.0)["per_robot"]["r1"]["history"]
    assert [one["what"] for one in history][:2] == ["the scenario's targets", "order a update 0"]
    assert len(history) == 3, "errands that are over are not in it"


@pytest.mark.parametrize("do", [RobotDo.HOME, RobotDo.CANCEL])
def test_a_robot_that_is_sent_home_or_cancelled_takes_no_errand_until_it_has_an_order(do: RobotDo) -> None:
    simulation = Simulation.of(pool_of([[14.5, 1.5]]), 1, 1)
    world = simulation.world
    for _ in range(40):
        simulation.step()
    world.request("r1", RobotAction(do=do))
    watched(simulation)
    assert world.is_finished
    assert not world.tasks.complete
    assert "pool target scenario/1 at (14.5, 1.5)" in simulation.report(1.0, 1.0)["reason"]
    world.request("r1", Order(id="a", targets=[(2.5, 2.5)]))
    watched(simulation)
    assert world.tasks.complete


def test_a_stopped_robot_keeps_its_errand() -> None:
    simulation = Simulation.of(pool_of([[14.5, 1.5]]), 4, 1)
    world = simulation.world
    for _ in range(20):
        simulation.step()
    world.request("r2", RobotAction(do=RobotDo.STOP))
    for _ in range(400):
        simulation.step()
    (errand,) = world.tasks.pool.taken_errands
    assert errand.robot == 1
    world.request("r2", RobotAction(do=RobotDo.GO_ON))
    events = watched(simulation)
    assert kinds(events, "errand", "errand_back") == []
    assert world.tasks.complete


def test_an_errand_that_a_wall_cuts_off_waits_and_is_done_when_the_way_is_open() -> None:
    edits = [
        {"at": 1.0, "kind": "wall", "low": [7, 3], "high": [9, 4]},
        {"at": 30.0, "kind": "free", "low": [7, 3], "high": [9, 4]},
    ]
    starts = {"poses": [[2.5, 1.5, 0.0], [4.5, 1.5, 0.0]]}
    simulation = Simulation.of(pool_of([[7.5, 5.5]], start=starts, edits=edits), 2, 1)
    events = watched(simulation)
    assert simulation.world.tasks.complete
    assert simulation.world.time > 30
    assert len(kinds(events, "errand_back")) == 1, "nobody takes what has no way"
    del edits[1]
    shut = Simulation.of(pool_of([[7.5, 5.5]], start=starts, edits=edits), 2, 1)
    watched(shut)
    assert shut.world.time < 190, "the run ends: nobody can go there"
    assert not shut.world.tasks.complete
    assert "pool target scenario/1 at (7.5, 5.5)" in shut.report(1.0, 200.0)["reason"]


# --- requests, and what is kept ---

REFUSED = [
    ([(-5.0, 1.0)], "target 1 at .*: expected a place on the map"),
    ([(1.5, 1.5), (3.5, 3.5)], "target 2 at .*: expected free floor, got a wall"),
]


@pytest.mark.parametrize(("targets", "text"), REFUSED)
def test_a_target_that_no_robot_can_reach_is_refused(targets: list[tuple[float, float]], text: str) -> None:
    world = Simulation.of(pool_of(CORNERS), 4, 1).world
    digest = world.measures.recorder.digest
    with pytest.raises(PeerError, match=text):
        world.put_in(PoolTargets(id="a", targets=targets))
    assert (world.tasks.pool.given, world.measures.recorder.digest) == (len(CORNERS), digest)


def test_the_digest_covers_the_pool_and_runs_without_one_have_none() -> None:
    digests = set()
    for targets in ([], [(1.5, 1.5)], [(7.5, 1.5)]):
        world = Simulation.of(pool_of(CORNERS), 4, 1).world
        if targets:
            world.put_in(PoolTargets(id="a", targets=targets))
        digests.add(world.measures.recorder.digest)
    assert len(digests) == 3
    assert "pool" not in Simulation.of(scenario_of(), 2, 1).run()


def test_a_scenario_with_a_bad_target_in_its_pool_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"pool: target 2 at .*: expected free floor"):
        check(pool_of([[1.5, 1.5], [3.5, 3.5]]), 4, 1)
    check(pool_of(CORNERS), 4, 1)


def test_targets_are_offered_again_after_an_edit() -> None:
    world = Simulation.of(pool_of(CORNERS), 4, 1).world
    errand = world.tasks.pool.waiting[0]
    errand.refused = [0, 1, 2, 3]
    assert world.edit(Edit(kind=Kind.WALL, low=(1, 5), high=(2, 6)))
    assert errand.refused == []
