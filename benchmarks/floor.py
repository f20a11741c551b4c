"""Any place on the floor, and halls that are two robots wide: ``python -m benchmarks.floor [--seeds N] [--start A]``.

Four tables: how many random free places a fleet refuses as a stop; how many of them one robot drives to, one after the
other, with the smallest reach, and where robots come to rest; missions to such places, against the same missions with a
reach of 0.4 m; and robots head on in halls, against one robot alone, with poses that are 3 cm off too. Places and halls
know no lattice: a body with 5 cm around it is clear of the drawn walls; in a hall each seed draws other starts.
``--also`` names more scenario files, for the first two tables; ``--tables`` are those to print.
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import replace
from math import inf, pi
from pathlib import Path
from random import Random
from statistics import mean
from typing import Any, Final, NamedTuple

import msgspec

from benchmarks.measure import load as load_of_machine
from swarm.fuzzy import load_profile
from swarm.geometry import distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.maps.text import from_text
from swarm.scenario.load import Scenario, check_values, load
from swarm.scenario.prepare import prepare, settle_lattice
from swarm.settings import LocalisationSettings
from swarm.storm.plans.rooms import CLEAR, draw_places
from swarm.traffic.lattice.placement import cells_of, gap_to_stop
from world.bodies.roster import Roster
from world.simulate import Simulation
from world.tasks.reachable import Reachable

ROOT: Final = Path(__file__).parents[1]
MAPS: Final = ("paper", "office", "depot", "box", "unknown")
HELD_BACK: Final = ("doorway", "crossing")  # no place on them was looked at before the cells were chosen as they are
PLACES: Final = 300
RESTS: Final = 30  # places on each map at which a robot comes to rest
EACH: Final = 3  # places of a robot
REACHES: Final = (0.25, 0.1, 0.05)  # m
WIDE: Final = 0.4  # m, the reach to compare with
FLEETS: Final = (("paper", 4), ("paper", 8), ("office", 4), ("office", 8))
WIDTHS: Final = (1.0, 1.2, 1.4, 1.6, 2.0, 2.4)  # m
LENGTH: Final = 12.0  # m, of a hall
FINE: Final = 0.1  # m, of the squares in which a hall is drawn
END: Final = 0.8  # m, from a hall's end to the first robot
ROBOT: Final = 0.2  # m, radius of a robot in a hall
APART: Final = 1.0  # m, from one robot to the next behind it
LIMIT: Final = 400.0  # s, simulated
A_PLACE: Final = 40.0  # s, simulated, on average for each place
SETTLE: Final = 60  # ticks after the arrival, until a robot is at rest
OFF_IN: Final = 1.6  # m, the hall with poses that are off
OFF: Final = LocalisationSettings(error=0.03, yaw_error_deg=1.5)


class Row(NamedTuple):
    """What some runs came to."""

    complete: int
    runs: int
    contacts: int
    overlaps: int
    outside: int
    time: float  # s until the last arrival, of those that are complete; nan: none
    settling: float  # s after that, until those that made room are back at their places
    tables: float


def load_scenario(name: str) -> Scenario:
    """Return a scenario of the project, or of a file with its path."""
    return load(Path(name) if name.endswith(".yaml") else ROOT / "scenarios" / f"{name}.yaml")


def free_places(floor: OccupancyMap, radius: float, count: int, seed: int) -> list[Point]:
    """Draw places [m, map frame] where a body of ``radius`` [m] is clear of the drawn walls by 5 cm."""
    found = draw_places(floor, radius, count, Random(seed), between=-inf)
    assert found is not None, "the floor has hardly any free place"
    return found


def mission_to_places(scenario: Scenario, robots: int, each: int, reach: float, seed: int) -> Scenario:
    """Return the scenario on the lattice that it has with its own targets, with ``each`` places for each robot."""
    settled = settle_lattice(scenario)
    places = free_places(settled.map, settled.settings.robot.radius, robots * each, seed)
    settings = msgspec.structs.replace(
        settled.settings,
        robots=robots,
        reach=reach,
        targets=[],
        own_targets=[places[number * each : (number + 1) * each] for number in range(robots)],
        return_home=False,
    )
    return replace(settled, settings=settings)


def hall(width: float, robots: int, seed: int | None = None) -> Scenario:
    """Return a hall of ``width`` [m], through which robots from both ends drive to the other; or one robot alone.

    With a ``seed`` they start anywhere across the hall, up to 10 cm along it from their places, with any heading.
    """
    rows, columns = round(width / FINE), round(LENGTH / FINE)
    text = "\n".join(["#" * (columns + 2), *["#" + "." * columns + "#"] * rows, "#" * (columns + 2)])
    middle, right = FINE + width / 2, robots // 2
    west = [(FINE + END + APART * number, middle) for number in range(robots - right)]
    east = [(FINE + LENGTH - END - APART * number, middle) for number in range(max(1, right))]
    ends = [*((*east, *east)[: len(west)]), *west[:right]] if right else east[:1]
    poses = [[*place, 0.0] for place in west] + [[*place, 3.1] for place in east[:right]]
    if seed is not None:
        chance, spare = Random(seed), width / 2 - ROBOT - CLEAR
        poses = [
            [x + chance.uniform(-0.1, 0.1), y + chance.uniform(-spare, spare), chance.uniform(-pi, pi)]
            for x, y, _ in poses
        ]
    raw = {
        "name": f"hall_{width:g}",
        "map": {"text": text, "cell": FINE},
        "start": {"poses": poses},
        "own_targets": [[list(place)] for place in ends],
        "robots": robots,
        "return_home": False,
    }
    settings = check_values(raw, f"hall {width:g} m")
    return settle_lattice(Scenario(settings, from_text(text, FINE), load_profile("paper")))


def drive(scenario: Scenario, robots: int, seed: int) -> dict[str, Any]:
    """Return the report of a run."""
    return Simulation.of(scenario, robots, seed).run(limit=LIMIT)


def drive_to_places(name: str, robots: int, reach: float, seed: int) -> dict[str, Any]:
    """Return the report of a mission to random places."""
    return drive(mission_to_places(load_scenario(name), robots, EACH, reach, seed), robots, seed)


def drive_through_hall(
    width: float, robots: int, seed: int, localisation: LocalisationSettings | None = None
) -> dict[str, Any]:
    """Return the report of robots head on in a hall."""
    scenario = hall(width, robots, seed)
    if localisation is not None:
        scenario = replace(scenario, settings=msgspec.structs.replace(scenario.settings, localisation=localisation))
    return drive(scenario, robots, seed)


def visit_all(name: str, seed: int) -> tuple[int, float, int]:
    """Return how many of the places one robot drives to, the time of each [s], and its contacts."""
    mission = mission_to_places(load_scenario(name), 1, PLACES, REACHES[-1], seed)
    simulation = Simulation.of(mission, 1, seed)
    report = simulation.run(limit=A_PLACE * PLACES)
    visited = sum(time is not None for time in simulation.world.tasks.missions.reached_at[0])
    return visited, report["sim_time"] / max(1, visited), sum(report["contacts"].values())


def find_rest(name: str, seed: int) -> float:
    """Return how far from a random place [m] a robot comes to rest that was sent there; inf: it never came."""
    mission = mission_to_places(load_scenario(name), 1, 1, REACHES[-1], seed)
    simulation = Simulation.of(mission, 1, seed)
    if not simulation.run(limit=LIMIT)["complete"]:
        return inf
    for _ in range(SETTLE):
        simulation.step()
    return distance(simulation.world.poses()[0][:2], mission.settings.own_targets[0][0])


def count_refused(name: str, reach: float, seed: int) -> tuple[int, int]:
    """Return how many of the places are refused as a stop, and how many no robot reaches inside one cell."""
    scenario, starts = prepare(load_scenario(name), 1, seed)
    settings = msgspec.structs.replace(scenario.settings, reach=reach)
    cells, floor = cells_of(scenario.map, settings), scenario.map
    places = free_places(floor, settings.robot.radius, PLACES, seed)
    stops = Reachable(Roster(scenario.with_settings(settings), ["r1"]), floor)
    refused = sum(bool(stops.wrong(0, starts[0][:2], place)) for place in places)
    return refused, sum(gap_to_stop(cells, place, settings) > reach for place in places)


def row_of(reports: list[dict[str, Any]]) -> Row:
    """Return what some runs came to."""
    arrivals = [(one["sim_time"], one["traffic"]["settling"]) for one in reports if one["complete"]]
    times = [time - settling for time, settling in arrivals]
    return Row(
        len(times),
        len(reports),
        sum(sum(report["contacts"].values()) for report in reports),
        sum(report["traffic"]["overlaps"] for report in reports),
        sum(report["traffic"]["outside"] for report in reports),
        mean(times) if times else float("nan"),
        mean(settling for _, settling in arrivals) if times else float("nan"),
        mean(report["steering"]["angle"]["tables"] for report in reports),
    )


def text_of(row: Row, against: float) -> str:
    """Return the cells of a table that all tables of runs share."""
    return (
        f"| {row.complete} of {row.runs} | {row.contacts} | {row.overlaps}; {row.outside} "
        f"| {row.time:.0f} | {row.time / against:.2f} | {row.settling:.0f} | {row.tables:.2f} |"
    )


HEAD: Final = "complete | contacts | two owners; outside | time [s] | times that at {} | settling [s] | tables |"


def print_refused(pool: Executor, maps: Sequence[str], seeds: range) -> None:
    """Print how many places are refused on each map."""
    print("\n| map | reach [m] | refused | not reached inside one cell |\n|---|---|---|---|")
    many = len(REACHES)
    for name in maps:
        found = list(pool.map(count_refused, [name] * many, REACHES, [seeds[0]] * many))
        for reach, (refused, outside) in zip(REACHES, found, strict=True):
            print(f"| {Path(name).stem} | {reach:g} | {refused} of {PLACES} | {outside} of {PLACES} |", flush=True)


def print_visits(pool: Executor, maps: Sequence[str], seeds: range) -> None:
    """Print how many places one robot drives to on each map, and where robots come to rest."""
    print(
        f"\n| map, reach {REACHES[-1]:g} m | visited | contacts | time of each [s] | rests of {RESTS} "
        "| mean distance [m] | greatest [m] |\n|---|---|---|---|---|---|---|"
    )
    rests = [pool.map(find_rest, [name] * RESTS, range(seeds[0], seeds[0] + RESTS)) for name in maps]
    visits = pool.map(visit_all, maps, [seeds[0]] * len(maps))
    for name, at_rest, (visited, time, contacts) in zip(maps, rests, visits, strict=True):
        at = [rest for rest in at_rest if rest < inf]
        print(
            f"| {Path(name).stem} | {visited} of {PLACES} | {contacts} | {time:.1f} | {len(at)} "
            f"| {mean(at or [inf]):.3f} | {max(at, default=inf):.3f} |",
            flush=True,
        )


def print_fleets(pool: Executor, maps: Sequence[str], seeds: range) -> None:
    """Print missions of fleets to places, against the same with a wide reach."""
    print(f"\n| fleet | reach [m] | {HEAD.format('0.4 m')}\n|---|---|---|---|---|---|---|---|---|")
    many = len(seeds)
    for name, robots in FLEETS:
        wide = 0.0
        for reach in (WIDE, *REACHES):
            row = row_of(list(pool.map(drive_to_places, [name] * many, [robots] * many, [reach] * many, seeds)))
            wide = wide or row.time
            print(f"| {name} {robots} | {reach:g} {text_of(row, wide)}", flush=True)


def print_halls(pool: Executor, maps: Sequence[str], seeds: range) -> None:
    """Print missions through halls, against one robot alone."""
    print(f"\n| hall [m] | robots | {HEAD.format('one robot alone')}\n|---|---|---|---|---|---|---|---|---|")
    for width in WIDTHS:
        alone = 0.0
        for robots in (1, 2, 4, 6):
            row = row_of(list(pool.map(drive_through_hall, [width] * 3, [robots] * 3, seeds[:3])))
            alone = alone or row.time
            print(f"| {width:g} | {robots} {text_of(row, alone)}", flush=True)
        if width == OFF_IN:
            row = row_of(list(pool.map(drive_through_hall, [width] * 3, [2] * 3, seeds[:3], [OFF] * 3)))
            print(f"| {width:g} | 2, poses 3 cm off {text_of(row, alone)}", flush=True)


TABLES: Final = {"refused": print_refused, "visits": print_visits, "fleets": print_fleets, "halls": print_halls}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--start", type=int, default=9001, help="first seed")
    parser.add_argument("--also", nargs="*", default=[], metavar="FILE.yaml", help="more scenarios")
    parser.add_argument("--tables", nargs="*", default=list(TABLES), choices=TABLES, help="default: all of them")
    options = parser.parse_args()
    seeds = range(options.start, options.start + options.seeds)
    maps = (*MAPS, *HELD_BACK, *options.also)
    print(f"load {load_of_machine()}, seeds {seeds[0]} to {seeds[-1]}")
    with ProcessPoolExecutor() as pool:
        for table in options.tables:
            TABLES[table](pool, maps, seeds)


if __name__ == "__main__":
    main()
