"""Robots unlike each other on one floor: ``python -m benchmarks.kinds [--seeds N] [--start A]``.

Two tables: missions of fleets of two and three kinds, drawn between 0.12 and 0.5 m radius, 0.3 and 1.5 m/s, 0.5 and
3 m/s2; and what one slow robot (0.3 m/s) among seven at 0.9 m/s costs the seven, against the same missions without it.
Whether a way exists for a robot is judged by the drawing: a disc is moved over it, without a lattice.
"""

import argparse
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import replace
from math import hypot
from random import Random
from statistics import mean
from typing import Any, Final, NamedTuple

import msgspec

from benchmarks.floor import LIMIT, hall, load_scenario
from benchmarks.measure import load as load_of_machine
from swarm.errors import ConfigError
from swarm.kinds import complete_kinds, list_kinds, settings_of
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.scenario.check import check
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import settle_lattice
from swarm.settings import KindSettings, StartSettings
from swarm.storm.plans.rooms import draw_places, is_in_one_piece
from world.simulate import Simulation

MAPS: Final = ("paper", "office", "depot", "crossing", "doorway", "circle", "hall 2.4", "hall 1.6")
KINDS: Final = (2, 3)
ROBOTS: Final = (4, 8)  # at least and at most
EACH: Final = 2  # places of a robot
RADII: Final = (0.12, 0.5)  # m
SPEEDS: Final = (0.3, 1.5)  # m/s
BRAKES: Final = (0.5, 3.0)  # m/s2
FULL: Final = 4.0  # m/s, of the paper's wheels at a speed scale of 1
APART: Final = 0.3  # m, between two bodies at the start
TRIES: Final = 20
SLOW, QUICK, QUICK_ROBOTS = 0.3, 0.9, 7  # m/s, m/s
SLOW_MAPS: Final = ("paper", "office", "depot")


class Drawn(NamedTuple):
    """A mission of robots unlike each other."""

    scenario: Scenario
    robots: int
    seed: int
    has_ways: bool  # by the drawing, each robot can come to all its places


def draw_kinds(count: int, chance: Random) -> dict[str, KindSettings]:
    """Draw kinds of robots; the track is as wide as the body, and short-sighted robots are slow."""
    kinds = {}
    for name in ("one", "two", "three")[:count]:
        radius, speed, brake = (chance.uniform(*span) for span in (RADII, SPEEDS, BRAKES))
        kinds[name] = KindSettings(
            radius=round(radius, 2), track_width=round(1.8 * radius, 2), wheel_acceleration=round(brake, 2),
            speed_scale=round(speed / FULL, 3),
        )  # fmt: skip
    return kinds


def floor_of(name: str) -> Scenario:
    """Return the scenario whose floor is driven."""
    return hall(float(name.split()[1]), 2) if name.startswith("hall") else load_scenario(name)


def draw_mission(name: str, kinds: int, seed: int) -> Drawn:
    """Draw a fleet of so many kinds on a floor, with its starts and places."""
    base, chance = floor_of(name), Random(f"{name} {kinds} {seed}")
    named = draw_kinds(kinds, chance)
    counts = [chance.randint(1, 3) for _ in named]
    robots = dict(zip(named, counts, strict=True))
    while sum(robots.values()) < ROBOTS[0]:
        robots[chance.choice(list(named))] += 1
    settings = complete_kinds(msgspec.structs.replace(base.settings, kinds=named, robots=robots))
    radii = [settings_of(settings, kind).robot.radius for kind in list_kinds(settings)]
    rows = draw_rows(base.map, radii, chance)
    starts, stops = [row[0] for row in rows], [row[1:] for row in rows]
    chosen = msgspec.structs.replace(
        settings, start=StartSettings(poses=[(*at, chance.uniform(-3.1, 3.1)) for at in starts]), targets=[],
        own_targets=stops, return_home=False, reach=0.3, limit=2 * LIMIT,
    )  # fmt: skip
    has_ways = all(is_in_one_piece(base.map, radius, row) for radius, row in zip(radii, rows, strict=True))
    return Drawn(replace(base, settings=chosen), len(radii), seed, has_ways)


def draw_rows(floor: OccupancyMap, radii: Sequence[float], chance: Random) -> list[list[Point]]:
    """Draw the start and the places of each robot [m]: each in free floor, and the starts apart from each other."""
    rows: list[list[Point]] = []
    for radius in radii:
        found = None
        for _ in range(TRIES):
            places = draw_places(floor, radius, EACH + 1, chance)
            if places is not None and all(
                hypot(places[0][0] - row[0][0], places[0][1] - row[0][1]) >= radius + other + APART
                for row, other in zip(rows, radii, strict=False)
            ):
                found = places
                break
        assert found is not None, "the floor has no room for so many robots"
        rows.append(found)
    return rows


class Outcome(NamedTuple):
    """What became of one mission."""

    refused: str  # why; "": it was driven
    has_ways: bool
    report: dict[str, Any]


def run(name: str, kinds: int, seed: int) -> Outcome:
    """Drive a drawn mission, unless it is refused."""
    drawn = draw_mission(name, kinds, seed)
    try:
        scenario = check(drawn.scenario, drawn.robots, seed).scenario
    except ConfigError as fault:
        return Outcome(str(fault), drawn.has_ways, {})
    simulation = Simulation.of(scenario, drawn.robots, seed)
    return Outcome("", drawn.has_ways, simulation.run())


def print_fleets(pool: Executor, maps: Sequence[str], seeds: range, *, verbose: bool) -> None:
    """Print missions of fleets of several kinds."""
    print(
        "\n| floor, kinds | complete | refused; of these with a way | contacts | two owners; outside | time [s] "
        "| stalled | tables |\n|---|---|---|---|---|---|---|---|"
    )
    for name in maps:
        for kinds in KINDS:
            found = list(pool.map(run, [name] * len(seeds), [kinds] * len(seeds), seeds))
            driven = [one.report for one in found if not one.refused]
            wrongly = [one.refused for one in found if one.refused and one.has_ways]
            traffic: Counter[str] = Counter()
            for report in driven:
                traffic.update({key: report["traffic"][key] for key in ("overlaps", "outside", "stalled")})
            contacts = sum(sum(report["contacts"].values()) for report in driven)
            complete = [report for report in driven if report["complete"]]
            times, tables = (
                mean([value(report) for report in complete] or [0.0])
                for value in (lambda report: report["sim_time"], lambda report: report["steering"]["ticks"]["tables"])
            )
            print(
                f"| {name}, {kinds} | {len(complete)} of {len(driven)} | {len(found) - len(driven)}; {len(wrongly)} "
                f"| {contacts} | {traffic['overlaps']}; {traffic['outside']} | {times:.0f} | {traffic['stalled']} "
                f"| {tables:.2f} |",
                flush=True,
            )
            for seed, one in zip(seeds, found, strict=True) if verbose else ():
                if fault := _fault_of(one):
                    print(f"    seed {seed}: {fault}", flush=True)


def _fault_of(one: Outcome) -> str:
    """Return what is wrong with a mission, "" if nothing is."""
    if one.refused:
        return one.refused if one.has_ways else ""
    traffic, contacts = one.report["traffic"], sum(one.report["contacts"].values())
    counts = {"contacts": contacts, "overlaps": traffic["overlaps"], "outside": traffic["outside"]}
    said = [f"{count} {name}" for name, count in counts.items() if count]
    return ", ".join([*said, *([] if one.report["complete"] else [one.report["reason"]])])


def draw_slow_mission(name: str, seed: int, *, slow: bool) -> tuple[Scenario, int]:
    """Return seven quick robots on a floor, with one slow robot among them or without it."""
    base, chance = floor_of(name), Random(f"slow {name} {seed}")
    named = {"quick": KindSettings(speed_scale=QUICK / FULL), "slow": KindSettings(speed_scale=SLOW / FULL)}
    robots = {"quick": QUICK_ROBOTS} | ({"slow": 1} if slow else {})
    radius = base.settings.robot.radius
    rows = draw_rows(base.map, [radius] * (QUICK_ROBOTS + 1), chance)[: QUICK_ROBOTS + slow]
    settings = complete_kinds(msgspec.structs.replace(base.settings, kinds=named, robots=robots))
    chosen = msgspec.structs.replace(
        settings, start=StartSettings(poses=[(*row[0], 0.0) for row in rows]), targets=[],
        own_targets=[row[1:] for row in rows], return_home=False, reach=0.3, limit=2 * LIMIT,
    )  # fmt: skip
    return replace(base, settings=chosen), len(rows)


def time_of_seven(name: str, seed: int, slow: bool) -> tuple[bool, float, int]:
    """Return whether a mission was complete, when the last of the seven arrived [s], and the contacts."""
    scenario, robots = draw_slow_mission(name, seed, slow=slow)
    report = Simulation.of(settle_lattice(scenario), robots, seed).run()
    rows = list(report["per_robot"].values())[:QUICK_ROBOTS]
    last = max((time or report["sim_time"]) for row in rows for time in row["reached"])
    return report["complete"], last, sum(report["contacts"].values())


def print_slow(pool: Executor, seeds: range) -> None:
    """Print what a slow robot costs the others."""
    print(
        "\n| floor | complete | contacts | seven alone [s] | with a slow one [s] | times |\n|---|---|---|---|---|---|"
    )
    for name in SLOW_MAPS:
        many = len(seeds)
        alone, among = (list(pool.map(time_of_seven, [name] * many, seeds, [slow] * many)) for slow in (False, True))
        before, after = (mean(time for _, time, _ in rows) for rows in (alone, among))
        done, contacts = (sum(row[at] for rows in (alone, among) for row in rows) for at in (0, 2))
        print(
            f"| {name} | {done} of {2 * many} | {contacts} | {before:.0f} | {after:.0f} | {after / before:.2f} |",
            flush=True,
        )


TABLES: Final = ("fleets", "slow")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--start", type=int, default=4101, help="first seed")
    parser.add_argument("--maps", nargs="*", default=list(MAPS))
    parser.add_argument("--verbose", action="store_true", help="name the seeds that fail, and why")
    parser.add_argument("--tables", nargs="*", default=list(TABLES), choices=TABLES, help="default: both")
    options = parser.parse_args()
    seeds = range(options.start, options.start + options.seeds)
    print(f"load {load_of_machine()}, seeds {seeds[0]} to {seeds[-1]}")
    with ProcessPoolExecutor() as pool:
        if "fleets" in options.tables:
            print_fleets(pool, options.maps, seeds, verbose=options.verbose)
        if "slow" in options.tables:
            print_slow(pool, seeds)


if __name__ == "__main__":
    main()
