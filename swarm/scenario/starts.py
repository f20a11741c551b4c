"""The start poses of robots: listed by the scenario, spread on a circle, or drawn in an area with the seed."""

from math import pi
from typing import Final

import numpy as np

from swarm.errors import ConfigError
from swarm.geometry import Pose, poses_on_circle, wrap
from swarm.scenario.load import Scenario
from swarm.traffic.lattice.placement import cells_of, cells_within

GAP: Final = 0.2  # m, left free between a drawn robot and a wall


def robot_names(robots: int) -> tuple[str, ...]:
    """Return the names of a fleet's robots: r1, r2, ..., all of one length, so that they sort by number."""
    width = len(str(robots))
    return tuple(f"r{number:0{width}d}" for number in range(1, robots + 1))


def later_name(number: int, robots: int) -> str:
    """Return the name of robot ``number``, from 0, whose place was opened in a fleet that began with ``robots``.

    >>> later_name(3, 3), later_name(11, 11), later_name(9, 9)
    ('r4', 'r12', 'r10')
    """
    return f"r{number + 1:0{len(str(robots))}d}"


def number_of(name: str) -> int:
    """Return a robot's number, from 0: the inverse of ``robot_names``."""
    return int(name[1:]) - 1


def starts(scenario: Scenario, robots: int, seed: int) -> list[Pose]:
    """Return the start pose of each robot; the same seed gives the same poses.

    Raises:
        ConfigError: fewer poses are listed than robots, or the area has no room for so many robots.
    """
    settings = scenario.settings
    listed, area = settings.start.poses, settings.start.area
    if listed is not None:
        if robots > len(listed):
            raise ConfigError(
                f"{settings.name}: start.poses: expected at least {robots} poses, got {len(listed)}; "
                "list more of them or run fewer robots"
            )
        return [Pose(x, y, wrap(yaw)) for x, y, yaw in listed[:robots]]
    if settings.start.circle is not None:
        return poses_on_circle(*settings.start.circle, robots)
    assert area is not None  # swarm.scenario.load has checked that one of the three is given
    return _in_cells(scenario, robots, seed)


def _in_cells(scenario: Scenario, robots: int, seed: int) -> list[Pose]:
    """Draw a cell of its own for each robot in the area, and a pose in that cell."""
    settings, area = scenario.settings, scenario.settings.start.area
    assert area is not None
    chance = np.random.default_rng([seed, 0])
    cells = cells_of(scenario.map, settings)
    room = cells_within(cells, area)
    if robots > len(room):
        raise ConfigError(
            f"{settings.name}: start.area: expected {cells.side:g} x {cells.side:g} m of floor for each of {robots} "
            f"robots, found room for {len(room)}; enlarge the area or run fewer robots"
        )
    poses = []
    for number in chance.permutation(len(room))[:robots].tolist():
        x, y = cells.centre(room[number])
        spare = cells.side / 2 - settings.robot.radius - GAP
        reach = max(0.0, min(spare, GAP))
        dx, dy, yaw = (float(value) for value in chance.uniform((-reach, -reach, -pi), (reach, reach, pi)))
        px, py = (min(max(at, min(a, b)), max(a, b)) for at, a, b in ((x + dx, *area[::2]), (y + dy, *area[1::2])))
        at = (px, py) if cells.can_fit_disc((room[number],), px, py, settings.robot.radius + 0.05) else (x, y)
        poses.append(Pose(*at, yaw))
    return poses
