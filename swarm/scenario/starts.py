"""The start poses of robots: listed by the scenario, spread on a circle, or drawn in an area with the seed."""

from collections.abc import Sequence
from math import pi
from typing import Final

import numpy as np

from swarm.errors import ConfigError
from swarm.geometry import Pose, poses_on_circle, wrap
from swarm.kinds import kind_of, kind_starts, start_of
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
    if settings.start.circle is not None:
        return poses_on_circle(*settings.start.circle, robots)
    chance = np.random.default_rng([seed, 0])
    poses: dict[int, Pose] = {}
    taken: set[int] = set()  # cells
    placed = [start_of(settings, number) for number in range(robots)]
    for section in (settings.start, *kind_starts(settings)):
        numbers = [number for number, (own, _) in enumerate(placed) if own is section]
        if section.poses is not None:
            if len(numbers) > len(section.poses):
                raise ConfigError(
                    f"{settings.name}: start.poses: expected at least {len(numbers)} poses, got {len(section.poses)}; "
                    "list more of them or run fewer robots"
                )
            poses |= {
                number: Pose(x, y, wrap(yaw)) for number, (x, y, yaw) in zip(numbers, section.poses, strict=False)
            }
        elif section.area is not None and numbers:
            poses |= _in_cells(scenario, section.area, numbers, chance, taken)
    return [poses[number] for number in range(robots)]


def _in_cells(
    scenario: Scenario, area: tuple[float, float, float, float], numbers: Sequence[int], chance: np.random.Generator,
    taken: set[int],
) -> dict[int, Pose]:  # fmt: skip
    """Draw for each of some robots a cell of its own in an area, that nobody has ``taken``, and a pose in that cell."""
    settings, poses = scenario.settings, {}
    each = {kind: scenario.of_kind(kind).settings for kind in {kind_of(settings, number) for number in numbers}}
    widest = max(each.values(), key=lambda one: one.robot.radius)
    cells = cells_of(scenario.map, widest)
    room = [cell for cell in cells_within(cells, area) if cell not in taken]
    if len(numbers) > len(room):
        raise ConfigError(
            f"{settings.name}: start.area: expected {cells.side:g} x {cells.side:g} m of floor for each of "
            f"{len(numbers)} robots, found room for {len(room)}; enlarge the area or run fewer robots"
        )
    for robot, number in zip(numbers, chance.permutation(len(room)).tolist(), strict=False):
        radius = each[kind_of(settings, robot)].robot.radius
        taken.add(room[number])
        x, y = cells.centre(room[number])
        spare = cells.side / 2 - radius - GAP
        reach = max(0.0, min(spare, GAP))
        dx, dy, yaw = (float(value) for value in chance.uniform((-reach, -reach, -pi), (reach, reach, pi)))
        px, py = (min(max(at, min(a, b)), max(a, b)) for at, a, b in ((x + dx, *area[::2]), (y + dy, *area[1::2])))
        at = (px, py) if cells.can_fit_disc((room[number],), px, py, radius + 0.05) else (x, y)
        poses[robot] = Pose(*at, yaw)
    return poses
