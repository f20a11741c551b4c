"""Orders and actions in whole runs, in one process: what robots do with them, and what the report says."""

from typing import Any

import pytest

from swarm.errors import PeerError
from swarm.geometry import distance, wrap
from swarm.messages import Activity, Order, RobotAction, RobotDo
from swarm.robot.mission import TURNED
from tests.shared import scenario_of
from tests.world.shared import command
from world.faults import Faults, Health, Spell
from world.simulate import Simulation

ROOMS = """\
############
#..........#
#..........#
#####..#####
#..........#
#..........#
############
"""
FAR, NEAR = [7.5, 2.5], [4.5, 4.5]


def simulation_of(*orders: dict[str, Any], robots: int = 4, faults: Faults | None = None, **fields: Any) -> Simulation:  # noqa: ANN401
    return Simulation.of(scenario_of(orders=list(orders), **fields), robots, 1, faults)


def events_of(simulation: Simulation, limit: float = 200.0) -> list[tuple[float, str | None, str]]:
    """Run to the end; return time, robot and kind of each event."""
    found = []
    while not simulation.world.is_finished and simulation.world.time < limit:
        found += [(event.time, event.robot, event.kind) for event in simulation.step().events]
    return found


def order(*targets: tuple[float, float], name: str = "a", update: int = 0) -> Order:
    return Order(id=name, update=update, targets=list(targets))


def do(what: str) -> RobotAction:
    return RobotAction(do=RobotDo(what))


# --- orders ---


def test_an_order_replaces_the_stops_and_is_reported_with_those_before() -> None:
    orders = (
        {"at": 2.0, "robot": "r1", "targets": [FAR, NEAR]},
        {"at": 5.0, "robot": "r1", "update": 1, "targets": [NEAR], "home": True},
    )
    report, again = simulation_of(*orders).run(), simulation_of(*orders).run()
    assert report["complete"]
    assert report["digest"] == again["digest"]
    assert report["digest"] != simulation_of().run()["digest"]
    row = report["per_robot"]["r1"]
    assert row["orders"] == {"done": 1, "superseded": 2, "cancelled": 0, "open": 0}
    assert [(one["number"], one["what"]) for one in row["history"]] == [
        (0, "the scenario's targets"), (1, "order scenario update 0"), (2, "order scenario update 1"),
    ]  # fmt: skip
    assert row["history"][-1]["reached"] == row["reached"]
    assert "history" not in report["per_robot"]["r2"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


@pytest.mark.parametrize("faults", [Faults(), Faults(late=0.15)], ids=["at once", "late commands"])
def test_a_robot_turns_to_the_heading_of_a_target_before_it_counts_and_drives_on(faults: Faults) -> None:
    asked = {("r1", "target 1"): 3.0, ("r1", "target 2"): -1.5, ("r2", "target 2"): 0.0}
    simulation = simulation_of(
        {"at": 1.0, "robot": "r1", "targets": [FAR, NEAR], "headings": [3.0, -1.5], "home": True},
        {"at": 1.0, "robot": "r2", "targets": [NEAR, FAR], "headings": [None, 0.0]},
        faults=faults,
    )
    off: dict[tuple[str, str], float] = {}
    while not simulation.world.is_finished and simulation.world.time < 300.0:
        events, poses = simulation.step().events, simulation.world.poses()
        for event in events:
            stop = event.robot or "", event.text.removeprefix("is at ")
            if event.kind == "reached" and event.time > 1.0 and stop in asked:
                off[stop] = abs(wrap(asked[stop] - poses[int(stop[0][1:]) - 1].yaw))
    assert off.keys() == asked.keys()
    assert max(off.values()) <= TURNED
    report = simulation.run()
    assert report["complete"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


def test_the_digest_covers_orders_even_if_nobody_moves() -> None:
    digests = []
    for request in (None, order((7.5, 2.5)), order((7.5, 2.5), update=1)):
        world = simulation_of(robots=1).world
        if request is not None:
            world.request("r1", request)
        digests.append(world.measures.recorder.digest)
    assert len(set(digests)) == 3


def test_a_robot_that_is_done_drives_again() -> None:
    simulation = simulation_of({"at": 60.0, "robot": "r1", "targets": [FAR]}, robots=1)
    reached = [time for time, _, kind in events_of(simulation) if kind == "reached"]
    assert len(reached) == 3
    assert reached[1] < 60.0 < reached[2]


def test_the_stops_are_told_until_the_robot_has_taken_them_over() -> None:
    world = simulation_of(robots=1).world
    world.request("r1", order((7.5, 2.5), (4.5, 4.5), (2.5, 2.5)))
    for _ in range(3):
        sense = world.senses(lockstep=True)["r1"]
        assert sense.assigned is not None
        assert (sense.assigned.number, len(sense.bearings)) == (1, 3)
        world.step({"r1": command(tick=world.tick, activity=Activity.DONE, reached=[True] * 2)})
        assert world.tasks.unfinished_robots == ["r1"]
    world.step({"r1": command(tick=world.tick, activity=Activity.READY, assignment=1)})
    assert world.senses(lockstep=True)["r1"].assigned is None


def test_what_a_robot_says_about_stops_that_it_no_longer_has_does_not_count() -> None:
    world = simulation_of(robots=1).world
    world.request("r1", order((7.5, 2.5)))
    said = command(tick=0, reached=[True, True], unreachable=[0])
    assert world.step({"r1": said}) == []
    assert world.tasks.missions.left == [0]


def test_an_order_outlives_the_robot() -> None:
    """The process ends before it has heard the order, and again after it has."""
    away = (Spell("r1", Health.AWAY, 38, 20), Spell("r1", Health.AWAY, 80, 20))
    simulation = simulation_of({"at": 2.0, "robot": "r1", "targets": [FAR, NEAR]}, faults=Faults(spells=away))
    report = simulation.run()
    assert report["complete"]
    assert report["per_robot"]["r1"]["history"][-1]["fate"] == "done"


def test_with_late_answers_orders_are_carried_out_too() -> None:
    orders = [{"at": 1.0 + number, "robot": "r1", "update": number, "targets": [FAR, NEAR]} for number in range(5)]
    report = simulation_of(*orders, faults=Faults(late=0.2)).run()
    assert report["complete"]
    assert report["per_robot"]["r1"]["orders"]["superseded"] == 5


# fmt: off
REFUSED = {  # map, target, part of the sentence
    "off the map":   (ROOMS, (40.0, 2.5), "expected a place on the map"),
    "in a wall":     (ROOMS, (1.5, 3.5), "expected free floor"),
    "no way":        (ROOMS.replace("#####..#####", "############"), (2.5, 2.0), "can reach, found no way"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_an_order_to_where_a_robot_cannot_go_is_refused(name: str) -> None:
    text, target, part = REFUSED[name]
    start = {"poses": [[2.5, 5.0, 0.0]]}
    world = simulation_of(text=text, robots=1, start=start, targets=[[7.5, 5.0]], return_home=False).world
    with pytest.raises(PeerError, match=part):
        world.request("r1", order((7.5, 5.0), target))
    assert world.tasks.missions.orders.last == 0


def test_an_order_for_an_unknown_robot_is_refused() -> None:
    with pytest.raises(PeerError, match="expected one of r1, r2, r3, r4, got 'r9'"):
        simulation_of().world.request("r9", do("stop"))


def test_a_planned_request_that_is_refused_becomes_an_event() -> None:
    simulation = simulation_of({"at": 1.0, "robot": "r1", "targets": [[0.5, 0.5]]}, robots=1)
    assert (1.0, "request_refused") in [(time, kind) for time, _, kind in events_of(simulation)]
    assert simulation.world.tasks.complete


# --- actions ---


def test_the_world_stops_a_robot_whatever_it_commands() -> None:
    world = simulation_of(robots=1).world

    def step() -> float:
        world.step({"r1": command(0.8, 0.8, tick=world.tick)})
        return world.bodies.wheels[0][0]

    most = world.settings.robot.wheel_acceleration * world.dt
    before = max(step() for _ in range(10))
    assert before == pytest.approx(0.8)
    world.request("r1", do("stop"))
    braking = [step() for _ in range(12)]
    assert all(abs(a - b) <= most + 1e-9 for a, b in zip([before, *braking], braking, strict=False))
    assert braking[-4:] == [0.0] * 4
    assert world.senses(lockstep=True)["r1"].stopped
    world.request("r1", do("go_on"))
    assert step() > 0.0


def test_others_drive_round_a_stopped_robot_which_then_goes_on() -> None:
    """It stands for longer than a robot may make no progress; nobody is blamed for it."""
    simulation = simulation_of({"at": 2.5, "robot": "r2", "do": "stop"}, {"at": 100.0, "robot": "r2", "do": "go_on"})
    world, places, said = simulation.world, set(), []
    while not world.is_finished and world.time < 200.0:
        tick = simulation.step()
        said += [(event.robot, event.kind) for event in tick.events]
        if 5.0 < world.time < 100.0:
            places.add(world.poses()[1])
            assert tick.commands["r2"].activity is Activity.STOPPED
    assert len(places) == 1
    assert world.tasks.complete
    assert ("r2", "stalled") not in said
    report = simulation.report(1.0, 200.0)
    assert all(max(report["per_robot"][name]["reached"]) < 100.0 for name in ("r1", "r3", "r4"))
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert (report["traffic"]["overlaps"], report["traffic"]["outside"]) == (0, 0)


def test_a_robot_that_is_stopped_in_the_only_door_jams_nobody_for_ever() -> None:
    """The others wait for it: a jam that a user makes is no proof that there is no solution."""
    fields: dict[str, Any] = {
        "text": ROOMS, "return_home": False, "start": {"poses": [[6.0, 3.5, 1.57], [6.0, 1.8, 1.57]]},
        "targets": [], "own_targets": [[[2.5, 5.0]], [[8.5, 5.0]]],
    }  # fmt: skip
    stop, go_on = {"at": 0.1, "robot": "r1", "do": "stop"}, {"at": 90.0, "robot": "r1", "do": "go_on"}
    simulation = simulation_of(stop, go_on, robots=2, **fields)
    events_of(simulation, 89.0)
    assert simulation.world.time >= 89.0
    assert not any(simulation.world.tasks.missions.reached_at[1])
    assert simulation.run(200.0)["complete"]


def test_home_and_cancel_drop_what_is_left() -> None:
    simulation = simulation_of({"at": 3.0, "robot": "r1", "do": "home"}, {"at": 3.0, "robot": "r2", "do": "cancel"})
    start = simulation.world.starts[0]
    events = events_of(simulation)
    assert {(robot, kind) for _, robot, kind in events} >= {
        ("r1", "cancelled"), ("r1", "home"), ("r2", "cancelled"), ("r2", "cancel"),
    }  # fmt: skip
    assert not [1 for _, robot, kind in events if robot == "r2" and kind == "reached"]
    report = simulation.report(1.0, 200.0)
    assert report["reason"] == "r2's mission was cancelled"
    assert not report["complete"]
    assert [one["fate"] for one in report["per_robot"]["r1"]["history"]] == ["cancelled", "done"]
    reached = report["per_robot"]["r1"]["reached"][0]
    assert reached is not None
    assert distance(simulation.world.poses()[0], start) <= 1.5


def test_a_run_of_a_stopped_robot_with_stops_left_does_not_end() -> None:
    simulation = simulation_of({"at": 2.0, "robot": "r1", "do": "stop"}, robots=1)
    events_of(simulation, 90.0)
    assert simulation.world.tasks.unfinished_robots == ["r1"]
    assert simulation.world.measures.progress.state.times == [0]


# --- stops that were given up ---

WALLED = [
    {"at": 1.0, "kind": "wall", "low": [5.2, 3.2], "high": [6.8, 3.8]},
    {"at": 60.0, "kind": "free", "low": [5.2, 3.2], "high": [6.8, 3.8]},
]


def walled(**fields: Any) -> Simulation:  # noqa: ANN401
    start, targets = {"poses": [[2.5, 5.0, 0.0]]}, [[2.5, 2.0], [8.5, 5.0]]
    return simulation_of(
        text=ROOMS, robots=1, start=start, targets=targets, **({"edits": WALLED} | fields)
    )  # fmt: skip


def test_a_stop_that_was_given_up_is_taken_up_when_a_way_opens_and_the_robot_drives_home_once_more() -> None:
    simulation = walled()
    events = [(time, kind) for time, _, kind in events_of(simulation)]
    kinds = [kind for _, kind in events]
    assert kinds.count("unreachable") == kinds.count("taken_up") == 1
    assert kinds.count("reached") == 4  # target 2, home, target 1, home
    report = simulation.report(1.0, 200.0)
    assert report["complete"]
    assert report["per_robot"]["r1"]["unreachable"] == []
    assert min(report["per_robot"]["r1"]["reached"][::2]) > 60.0


@pytest.mark.parametrize("fields", [{"retry_stops": False}, {"edits": WALLED[:1]}])
def test_if_no_way_can_open_the_run_ends_without_that_stop(fields: dict[str, Any]) -> None:
    simulation = walled(**fields)
    events_of(simulation)
    assert simulation.world.time < 60.0
    report = simulation.report(1.0, 200.0)
    assert not report["complete"]
    assert report["reason"] == "not reached: r1 target 1 (no path)"
