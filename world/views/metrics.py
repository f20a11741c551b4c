"""What the world has measured of each robot: the rows of the report, and of the status while the run goes on."""

from collections.abc import Sequence
from itertools import pairwise
from math import isfinite
from typing import Final

from swarm.maps.occupancy import Point
from swarm.messages import Account
from swarm.planning.grid import Grid
from swarm.planning.path import plan
from swarm.scenario.prepare import planning_grid
from world.world import World

WAITED_FOR: Final = 20  # robots in one row: a status has room for a thousand rows


def compute_accounts(world: World, shortest: Sequence[float | None]) -> dict[str, Account]:
    """Return the account of every robot; ``shortest`` are the lengths [m] of ``shortest_lengths``."""
    record, missions = world.measures.recorder.counts, world.tasks.missions
    return {
        name: Account(
            targets=len(missions.stops(number)),
            reached=list(missions.reached_at[number]),
            laps=missions.laps[number],
            path_length=record.path_length[number],
            shortest_length=shortest[number],
            waiting=record.waiting[number],
            waits_for=_longest(record.waits_for[number]),
            replans=command.replans,
            contacts=record.contact_counts[number].total(),
            struck=record.struck[number],
            stalled=world.measures.progress.state.times[number],
            unreachable=command.unreachable,
            standing=record.standing[number],
        )
        for number, (name, command) in enumerate(zip(world.robots, world.tasks.commands, strict=True))
    }


def count_contacts(world: World) -> dict[str, int]:
    """Return the contacts of the run by what was touched; a contact of two robots, counted for both, is one."""
    counts = world.measures.recorder.counts.contact_counts
    total = {kind: sum(row[kind] for row in counts) for kind in ("robot", "wall", "obstacle")}
    return total | {"robot": total["robot"] // 2}


def clearance_min(world: World) -> float | None:
    """Return the smallest gap [m], or None if there was nothing to touch."""
    gap = world.measures.recorder.judge.smallest
    return gap if isfinite(gap) else None


def shortest_lengths(world: World) -> list[float | None]:
    """Return each robot's ``shortest_length`` [m] from its start through its stops, on the floor as it is."""
    found, floor = [], world.bodies.floor
    for number, start in enumerate(world.starts):
        grid = planning_grid(world.roster.scenario_on(floor, number))
        found.append(shortest_length(grid, start[:2], world.tasks.missions.stops(number)))
    return found


def shortest_length(grid: Grid, start: Point, stops: Sequence[Point]) -> float | None:
    """Return the length [m] of the A* paths from stop to stop for a robot alone, or None if one has no path."""
    total = 0.0
    for a, b in pairwise((start, *stops)):
        path = plan(grid, a, b)
        if path is None:
            return None
        total += path.length
    return total


def _longest(waits: dict[str, float]) -> dict[str, float]:
    """Return the longest waits, the longest first."""
    return dict(sorted(waits.items(), key=lambda row: (-row[1], row[0]))[:WAITED_FOR])
