"""A MovingAI map and its .scen file as a scenario: row i is robot i's start and target (MAPF benchmark files)."""

from math import atan2
from pathlib import Path
from typing import Final

from swarm.errors import ConfigError
from swarm.fuzzy import load_profile
from swarm.maps.load import load_map
from swarm.maps.movingai import load_scen
from swarm.scenario.load import Scenario
from swarm.settings import (
    MapSettings,
    RadioSettings,
    RobotSettings,
    SensorSettings,
    Settings,
    StartSettings,
    TrafficSettings,
)  # fmt: skip

CELL: Final = 1.0  # m, side of a map cell; traffic reserves the same cells
ROBOT: Final = RobotSettings(radius=0.2, track_width=0.4, speed_scale=0.4, distance_scale=0.375)
SENSORS: Final = SensorSettings(side_deg=30.0, side_half_width_deg=10.0, front_half_width_deg=10.0)  # for corridors
LIMIT: Final = 900.0  # s


def from_benchmark(map_path: Path, scen_path: Path, robots: int | None, *, serve: bool = False) -> Scenario:
    """Return a scenario from a map and a .scen file; each robot faces its target at the start.

    ``serve`` is the scenario's field of that name.

    Raises:
        ConfigError: one of the files is wrong, or the .scen file has fewer rows than robots.
    """
    floor = load_map(map_path, cell=CELL)
    rows = load_scen(scen_path, floor)
    count = len(rows) if robots is None else robots
    if not 1 <= count <= len(rows):
        raise ConfigError(f"{scen_path}: expected a row for each of {count} robots, got {len(rows)}; run fewer robots")
    starts, targets = [], []
    for start, goal, _ in rows[:count]:
        (x, y), target = floor.centre_of(start), floor.centre_of(goal)
        starts.append((x, y, atan2(target[1] - y, target[0] - x)))
        targets.append([target])
    settings = Settings(
        name=map_path.stem.replace(" ", "-"),
        map=MapSettings(file=map_path.name, cell=CELL),
        start=StartSettings(poses=starts),
        own_targets=targets,
        return_home=False,
        serve=serve,
        reach=0.3,
        robots=count,
        limit=LIMIT,
        robot=ROBOT,
        sensors=SENSORS,
        radio=RadioSettings(range=8.0),
        traffic=TrafficSettings(cell=CELL),
    )
    return Scenario(settings, floor, load_profile("paper"))
