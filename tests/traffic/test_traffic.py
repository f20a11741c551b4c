"""Whole fleets of ``Traffic`` over a lossy radio: nobody touches, nobody stands stuck, and what cannot be is said."""

from math import cos, pi, sin

import numpy as np
import pytest

from swarm.errors import ConfigError
from swarm.maps.occupancy import OccupancyMap
from swarm.traffic.cells import CellMap
from swarm.traffic.settings import TrafficSettings
from swarm.traffic.traffic import Traffic
from tests.traffic.maps import BAY, CORRIDOR, DOOR, HARD, Drawn, public
from tests.traffic.sim import Faults, Simulation

LOSSY = Faults(loss=0.3)


def fleet(drawn: Drawn, starts: str, goals: str, *, reach: float = 8.0, faults: Faults | None = None) -> Simulation:
    settings = TrafficSettings(radio_range=reach)
    ends = [[point] for point in drawn.points(goals)]
    return Simulation(drawn.cells, drawn.points(starts), ends, settings=settings, faults=faults, seed=1)


def benchmark(name: str, agents: int | None, *, reach: float, faults: Faults, seed: int = 0) -> Simulation:
    drawn, starts, goals = public(name, agents)
    cells = drawn.cells
    return Simulation(
        cells,
        [cells.centre(cell) for cell in starts],
        [[cells.centre(cell)] for cell in goals],
        settings=TrafficSettings(radio_range=reach),
        faults=faults,
        seed=seed,
    )


def assert_clean(simulation: Simulation) -> None:
    assert simulation.watch.faults == []


def kinds(simulation: Simulation) -> set[str]:
    return {event.kind for _, event in simulation.events}


@pytest.mark.parametrize("reach", [8.0, 5.0])
@pytest.mark.parametrize(
    ("drawn", "starts", "goals"),
    [
        (BAY, "ab", "ba"),
        (BAY, "abc", "bac"),
        (DOOR, "ab", "ba"),
        pytest.param(DOOR, "abcdefgh", "hgfedcba", marks=pytest.mark.slow),
    ],
    ids=["bay", "bay with a rester", "door", "door 8"],
)
def test_small_maps_complete(drawn: Drawn, starts: str, goals: str, reach: float) -> None:
    simulation = fleet(drawn, starts, goals, reach=reach, faults=Faults(loss=0.3))
    assert simulation.run(200)
    assert_clean(simulation)
    assert simulation.watch.deadlocks == 0


def test_a_corridor_swap_is_called_unsolvable_within_seconds() -> None:
    simulation = fleet(CORRIDOR, "ab", "ba")
    assert not simulation.run(30)
    assert_clean(simulation)
    verdicts = [(tick, event) for tick, event in simulation.events if event.kind == "unsolvable"]
    assert verdicts[0][1].robots == ("r000", "r001")
    assert verdicts[0][0] * 0.05 < 15


def test_the_same_run_twice_is_the_same() -> None:
    def trace() -> list[object]:
        simulation = fleet(DOOR, "abcd", "dcba", faults=Faults(loss=0.3, held_up=10))
        poses = []
        for _ in range(600):
            simulation.step()
            poses.append(tuple(body.pose for body in simulation.bodies.values()))
        return [poses, simulation.events]

    assert trace() == trace()


def test_one_target_for_all_is_taken_in_turn() -> None:
    homes = DOOR.points("aceg")
    target = DOOR.points("d")[0]
    settings = TrafficSettings()
    simulation = Simulation(DOOR.cells, homes, [[target, home] for home in homes], settings=settings, faults=LOSSY)
    assert simulation.run(300)
    assert_clean(simulation)


def test_a_robot_at_rest_makes_room() -> None:
    drawn = Drawn("#######", "a..c..b", "###.###")
    simulation = fleet(drawn, "ac", "bc")
    assert simulation.run(120)
    assert_clean(simulation)
    assert "joint_plan" in kinds(simulation)


def test_a_dead_robot_is_driven_round() -> None:
    drawn = Drawn("....", "a.c.b"[:4], "...b")
    simulation = fleet(drawn, "ac", "bc", faults=Faults(killed={"r001": 0.0}))
    assert simulation.run(200)
    assert simulation.watch.count("contact") == 0


@pytest.mark.slow
def test_the_leader_dies_while_it_leads() -> None:
    simulation = fleet(DOOR, "abcdefgh", "hgfedcba", faults=Faults(kill_leader_at=0.0))
    simulation.run(75)
    assert simulation.watch.count("contact") == 0
    dead = [name for name, body in simulation.bodies.items() if body.dead]
    assert dead == ["r001"]  # it stands where r006 wants to go
    arrived = {name for name, body in simulation.bodies.items() if body.arrived_at < 75}
    assert arrived == set(simulation.bodies) - {"r001", "r006"}


def test_bodies_that_start_in_corners_of_one_cell_part() -> None:
    drawn = Drawn(".......", "a.....b", ".......")
    x, y = drawn.cells.centre(drawn.at("a")[0] + 1)
    starts = [(x + 0.45, y), (x + 1.95, y)]  # both reach into the cell between them
    ends = [[point] for point in drawn.points("ba")]
    simulation = Simulation(drawn.cells, starts, ends, settings=TrafficSettings())
    assert simulation.run(100)
    assert simulation.watch.count("contact") == 0
    assert simulation.watch.least_gap > 0.1
    assert "halted" not in kinds(simulation)


def test_cells_too_large_for_the_radio_are_refused() -> None:
    with pytest.raises(ConfigError, match="too short for cells"):
        Traffic("r0", BAY.cells, TrafficSettings(radio_range=3.0))


@pytest.mark.parametrize("name", HARD)
def test_hard_maps_complete(name: str) -> None:
    simulation = benchmark(name, None, reach=5.0, faults=LOSSY)
    assert simulation.run(300)
    assert_clean(simulation)


@pytest.mark.slow
@pytest.mark.parametrize("reach", [8.0, 5.0])
@pytest.mark.parametrize("faults", [Faults(), Faults(loss=0.3), Faults(loss=0.3, held_up=20)], ids=repr)
def test_sixteen_robots_on_the_random_map(reach: float, faults: Faults) -> None:
    simulation = benchmark("random-32-32-20", 16, reach=reach, faults=faults)
    assert simulation.run(400)
    assert_clean(simulation)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", HARD)
def test_suspended_processes_touch_nobody(name: str, seed: int) -> None:
    simulation = benchmark(name, None, reach=5.0, faults=Faults(loss=0.3, suspended=20), seed=seed)
    assert simulation.run(900)
    assert simulation.watch.count("contact") == 0


@pytest.mark.slow
@pytest.mark.parametrize(("robots", "diameter"), [(8, 14.0), (16, 19.0)])
def test_circle_swap(robots: int, diameter: float) -> None:
    count = 1 + int((diameter + 3) / 1.2)
    occupancy = OccupancyMap(np.zeros((count, count), dtype=np.uint8), 1.2)
    middle = count * 0.6
    angles = [2 * pi * index / robots for index in range(robots)]
    points = [(middle + diameter / 2 * cos(angle), middle + diameter / 2 * sin(angle)) for angle in angles]
    cells = CellMap(occupancy, side=1.2, radius=0.23)
    across = [[points[(index + robots // 2) % robots]] for index in range(robots)]
    simulation = Simulation(cells, points, across, settings=TrafficSettings())
    assert simulation.run(3 * diameter / 0.6)
    assert_clean(simulation)
