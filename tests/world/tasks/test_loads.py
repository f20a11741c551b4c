"""Loads: a robot that becomes wider where it stands, plans a new path with that, and is as narrow as before without it."""

from typing import Any

import pytest

from swarm.errors import PeerError
from swarm.messages import RobotAction, RobotDo
from swarm.scenario.load import Scenario
from tests.shared import scenario_of
from world.simulate import Simulation
from world.world import World

GATE = """\
##############
#............#
#............#
#......#.....#
#......#.....#
#......#.....#
#......#.....#
##############
"""  # squares of 1 m
STARTS: list[list[float]] = [[5.4, 3.0, 0.0], [5.0, 5.5, 0.0]]


def room(**fields: Any) -> Scenario:  # noqa: ANN401
    drawn: dict[str, Any] = {"text": GATE, "start": {"poses": STARTS}, "targets": [[11.0, 2.5]], "robots": 2}
    return scenario_of(**(drawn | {"traffic": {"cell": 1.2, "offset": [0.0, 0.0]}} | fields))


def simulate(scenario: Scenario) -> Simulation:
    return Simulation.of(scenario, len(scenario.settings.start.poses or ()), 1)


def load(world: World, name: str, radius: float | None) -> str:
    return world.request(name, RobotAction(do=RobotDo.LOAD, radius=radius))[0].text


def stopped(name: str, radius: float, begin: float = 0.1) -> list[dict[str, Any]]:
    """Return the requests of a scenario that stop a robot, load it and let it go on."""
    asks: list[dict[str, Any]] = [{"do": "stop"}, {"do": "load", "radius": radius}, {"do": "go_on"}]
    return [{"at": begin + 1.5 * number, "robot": name} | ask for number, ask in enumerate(asks)]


# fmt: off
REFUSED: dict[str, tuple[list[float], float, str]] = {  # where r1 stands, the radius, what is said
    "wider than a square":        ([3.0, 3.0, 0.0], 0.7, "r1: load: expected a radius of at most 0.57 m, so that r1 fits in a square of 1.2 m, got 0.7 m"),
    "narrower than it is":        ([3.0, 3.0, 0.0], 0.1, "r1: load: expected a radius of 0.2 m or more, its own, got 0.1 m"),
    "a wall beside it":           ([1.3, 3.0, 0.0], 0.35, "r1: load: expected 0.38 m from its middle to any wall, r1 stands nearer"),
    "another robot beside it":    ([4.5, 5.5, 0.0], 0.35, "r1: load: expected nobody near, r2 is 0.00 m away; wait"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_a_load_that_does_not_fit_is_refused_and_nothing_changes(name: str) -> None:
    start, radius, said = REFUSED[name]
    world = simulate(room(start={"poses": [start, STARTS[1]]})).world
    with pytest.raises(PeerError) as fault:
        load(world, "r1", radius)
    assert said in str(fault.value)
    assert world.roster.loads == {}


def test_who_drives_gets_no_load() -> None:
    simulation = simulate(room())
    while not any(simulation.world.bodies.wheels[0]):
        simulation.step()
    with pytest.raises(PeerError, match="r1: load: expected a robot that stands, r1 drives; tell it to stop first"):
        load(simulation.world, "r1", 0.3)


def test_a_robot_is_as_wide_as_its_load_and_then_as_before() -> None:
    world = simulate(room()).world
    before = world.bodies.distances[0].front
    assert load(world, "r1", 0.3) == "r1 has a radius of 0.3 m now, with its load"
    assert load(world, "r1", 0.3) == "r1 has a radius of 0.3 m already"
    assert world.senses(lockstep=True)["r1"].radius == 0.3
    assert world.senses(lockstep=True)["r2"].radius is None
    assert world.bodies.distances[0].front == pytest.approx(before - 0.1)
    assert load(world, "r1", None) == "r1 has a radius of 0.2 m now, without a load"
    assert world.senses(lockstep=True)["r1"].radius is None
    assert world.bodies.distances[0].front == pytest.approx(before)


@pytest.mark.parametrize("known", [True, False])
def test_a_robot_with_a_load_goes_on_and_touches_nothing(known: bool) -> None:
    scenario = room(orders=stopped("r1", 0.3), map={"text": GATE, "cell": 1.0, "known": known})
    simulation = simulate(scenario)
    report = simulation.run(limit=300.0)
    assert report["complete"], report["reason"]
    assert sum(report["contacts"].values()) == report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0
    assert simulation.world.roster.loads == {0: 0.3}
    assert report["clearance_min"] > 0.0


def test_others_know_how_wide_a_loaded_robot_is() -> None:
    simulation = simulate(room(orders=stopped("r1", 0.3)))
    told: dict[str, set[float | None]] = {"r1": set(), "r2": set()}
    while simulation.world.time < 10.0:
        for name, broadcast in simulation.step().spoken.items():
            assert broadcast.traffic is not None
            told[name].add(broadcast.traffic.own.radius)
    assert told == {"r1": {None, 0.3}, "r2": {None}}


def test_a_robot_that_no_longer_fits_says_so() -> None:
    narrow = "#########\n#.......#\n#########\n"
    scenario = scenario_of(text=narrow, start={"poses": [[2.5, 1.5, 0.0]]}, targets=[[7.5, 1.5]], robots=1,
                           traffic={"cell": 1.0, "offset": [0.0, 0.0]}, orders=stopped("r1", 0.46))  # fmt: skip
    simulation = simulate(scenario)
    said = [event.text for _ in range(120) for event in simulation.step().events if event.kind == "load"]
    assert said == [
        "has a radius of 0.46 m now, with its load",
        "does not fit where it stands: a radius of 0.46 m finds no way from there",
    ]
    report = simulation.run(limit=30.0)
    assert not report["complete"]
    assert sum(report["contacts"].values()) == 0


def test_a_world_that_comes_back_knows_the_loads() -> None:
    first = simulate(room())
    load(first.world, "r1", 0.3)
    first.step()
    state = first.world.save()
    again = simulate(room()).world
    again.restore(state)
    assert again.roster.loads == {0: 0.3}
    assert again.bodies.distances[0] == first.world.bodies.distances[0]
