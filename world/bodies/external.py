"""External bodies: the pose of such a robot is reported by another process, as a real robot's.

Pure: it knows no bus and no clock but the run's ticks. The brain of such a robot is a robot process as any other.
"""

from collections.abc import Mapping, Sequence
from math import hypot
from typing import Final, NamedTuple

from swarm.errors import ConfigError
from swarm.geometry import Pose, wrap
from swarm.maps.occupancy import OccupancyMap
from swarm.messages import BODY, BodyReport
from swarm.scenario.starts import robot_names as scenario_names
from world.bodies.event_line import EventLine
from world.bodies.roster import Roster
from world.bodies.sensors import FreeDistances

SLACK: Final = 0.02  # m that a body may seem to move beyond its top speed: it measures, too


class Reported(NamedTuple):
    """External bodies at the next tick, by the robots' numbers."""

    poses: dict[int, Pose]
    wheels: dict[int, tuple[float, float]]  # rim speeds [m/s]
    jumped: list[int]
    said: list[EventLine]


def check_external(names: Sequence[str], robots: int) -> tuple[str, ...]:
    """Return the names of robots whose body is external.

    Raises:
        ConfigError: there is no such robot.
    """
    for name in names:
        if name not in scenario_names(robots):
            raise ConfigError(f"--body {name}: expected one of {', '.join(scenario_names(robots))}, got {name!r}")
    return tuple(names)


class ExternalState(NamedTuple):
    """The state of `External`, which changes its values."""

    poses: dict[int, Pose]
    reports: dict[int, BodyReport]  # the newest one of each
    silent: list[int]


class External:
    """The external bodies of one run."""

    def __init__(self, numbers: Mapping[str, int], starts: Sequence[Pose], roster: Roster, dt: float) -> None:
        self._numbers, self._roster = numbers, roster
        self.told: Mapping[str, BodyReport] = {}  # the newest reports that have come
        self._dt = dt
        self.state = ExternalState({number: starts[number] for number in numbers.values()}, {}, [])

    def step(self, tick: int, floor: OccupancyMap) -> Reported:
        """Take in what was reported since the last tick; return where these bodies are at the next.

        A body without a report stands where it was; after ``BODY.timeout`` that is told. A report from beyond the map
        is refused, and counts as none.
        """
        poses, reports, silent = self.state
        wheels, jumped, said = dict[int, tuple[float, float]](), list[int](), list[EventLine]()
        for name, number in self._numbers.items():
            last, report = reports.get(number), self.told.get(name)
            if report is not None and not floor.inside(floor.cell_of(report.x, report.y)):
                text = f"is at ({report.x:g}, {report.y:g}) m by its body's report, beyond the map"
                said.append(EventLine("body_refused", text, name))
                report = None
            if report is not None and (last is None or report.tick > last.tick):
                pose, before = Pose(report.x, report.y, wrap(report.yaw)), poses[number]
                ticks = report.tick - (-1 if last is None else last.tick)
                most = self._roster.bodies[number].top_speed * self._dt * ticks + SLACK
                moved = hypot(pose.x - before.x, pose.y - before.y)
                if moved > most:
                    jumped.append(number)
                    text = f"jumped {moved:.2f} m in {ticks * self._dt:.2f} s, by its body's report"
                    said.append(EventLine("body_jumped", text, name))
                if number in silent:
                    silent.remove(number)
                    said.append(EventLine("body_back", "reports its body again", name))
                reports[number], poses[number] = report, pose
                wheels[number] = (report.left, report.right)
                continue
            wheels[number] = (0.0, 0.0)
            quiet = (tick - (-1 if last is None else last.tick)) * self._dt
            if quiet > BODY.timeout and number not in silent:
                silent.append(number)
                text = f"has reported no body for {BODY.timeout:g} s; it counts as standing"
                said.append(EventLine("body_silent", text, name))
        return Reported(dict(poses), wheels, jumped, said)

    def distances(self) -> dict[int, FreeDistances]:
        """Return what bodies have measured themselves, of those that tell all their rays."""
        found = {}
        for number, report in self.state.reports.items():
            sensors = self._roster.settings(number).sensors
            rays, reach = sensors.rays, sensors.range
            if number not in self.state.silent and len(report.rays) == 3 * rays:
                told = [min(reach, ray) for ray in report.rays]
                found[number] = FreeDistances(min(told[:rays]), min(told[rays : 2 * rays]), min(told[2 * rays :]), told)
        return found
