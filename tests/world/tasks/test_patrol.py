"""Patrols: robots visit their targets again and again, and the world counts the laps by their poses."""

import pytest

from swarm.errors import ConfigError
from swarm.geometry import distance
from swarm.messages import Activity, Edit, Event, Kind, RobotAction, RobotDo
from swarm.scenario.load import Scenario
from tests.shared import scenario_of
from world.faults import Faults, Health, Spell
from world.simulate import Simulation

TARGETS = [[7.5, 2.5], [4.5, 4.5], [2.5, 3.5]]


def patrol() -> Scenario:
    return scenario_of(targets=TARGETS, patrol=True, robots=3, limit=120.0)


def reached(events: list[Event], robot: str) -> list[str]:
    return [event.text for event in events if (event.kind, event.robot) == ("reached", robot)]


@pytest.mark.long("minutes of a simulated patrol")
@pytest.mark.parametrize(
    "faults", [Faults(), Faults(spells=(Spell("r2", Health.AWAY, 700, 60),))], ids=["well", "started again"]
)
def test_a_patrol_goes_on_until_its_limit_and_counts_laps(faults: Faults) -> None:
    simulation = Simulation.of(patrol(), 3, 5, faults)
    world, events = simulation.world, list[Event]()
    while world.time < 120.0:
        assert not world.is_finished
        events += simulation.step().events
    report = simulation.report(1.0, 120.0)
    assert report["complete"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    for number, name in enumerate(world.robots):
        visits = [f"is at target {visit % 3 + 1}" for visit in range(3000)]
        seen = reached(events, name)
        assert seen == visits[: len(seen)], "each target in its turn, in every lap"
        row = report["per_robot"][name]
        assert row["laps"] == len(seen) // 3 >= 2
        assert sum(time is not None for time in row["reached"]) == len(seen) % 3
        assert simulation.robots[number].mission.laps == row["laps"]
    assert not [event for event in events if event.kind == "false_claim"]


def test_a_visit_counts_only_within_reach() -> None:
    simulation = Simulation.of(patrol(), 2, 5)
    world, visits = simulation.world, 0
    while world.time < 60.0:
        before = [world.tasks.missions.left[number] for number in range(2)]
        poses = world.poses()
        for event in simulation.step().events:
            if event.kind == "reached":
                number = world.robots.index(event.robot or "")
                visits += 1
                assert distance(poses[number], tuple(TARGETS[before[number] or 0])) <= world.settings.reach
    assert visits > 6


def test_a_patrol_goes_on_without_a_target_that_was_walled_in_and_ends_with_one_left() -> None:
    simulation = Simulation.of(patrol(), 1, 5)
    world = simulation.world
    while not world.tasks.missions.laps[0]:
        simulation.step()
    world.edit(Edit(kind=Kind.WALL, low=(7.1, 2.1), high=(7.9, 2.9)))
    while world.tasks.missions.laps[0] < 4 or distance(world.poses()[0], (2.5, 3.5)) < 1.5:
        simulation.step()
    assert [command.unreachable for command in world.tasks.commands] == [[0]]
    assert world.tasks.complete
    world.edit(Edit(kind=Kind.WALL, low=(2.1, 3.1), high=(2.9, 3.9)))
    while not world.is_finished:
        simulation.step()
    assert world.tasks.commands[0].activity is Activity.DONE


def test_a_patrol_that_gives_up_the_last_target_of_a_lap_begins_the_next() -> None:
    simulation = Simulation.of(patrol(), 1, 5)
    world = simulation.world
    while world.tasks.missions.left[0] != 2:
        simulation.step()
    world.edit(Edit(kind=Kind.WALL, low=(2.1, 3.1), high=(2.9, 3.9)))
    events = list[Event]()
    while world.tasks.missions.laps[0] < 3:
        events += simulation.step().events
        assert world.time < 120.0, "the world counts no laps"
    assert reached(events, "r1")[:2] == ["is at target 1", "is at target 2"]
    world.request("r1", RobotAction(do=RobotDo.CANCEL))
    assert world.tasks.missions.orders.rows[0].stops == [], "a patrol has stops left in each lap"


@pytest.mark.parametrize(
    "targets",
    [{"targets": [[7.5, 3.5]]}, {"targets": [[7.5, 3.5], [7.0, 3.5]]},
     {"targets": [], "own_targets": [TARGETS, [[7.5, 3.5]]]}],
    ids=["one", "near each other", "one of a robot's own"],
)  # fmt: skip
def test_a_patrol_needs_two_targets_apart(targets: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match=r"patrol: expected at least two targets a robot, more than 0\.8 m apart"):
        scenario_of(**targets, patrol=True)  # type: ignore[arg-type]
