"""The check of who steers: for each command, the fuzzy tables are asked again and their answer is compared with it.

The tables get the distances that a robot sensed at the tick of its command, and the heading and scale that it reports.
Only these two are taken from the robot. They are not checked: a robot could report a heading that fits what it drives.
"""

from collections.abc import Sequence
from math import degrees, nan
from typing import Any, Final

from swarm.geometry import Pose, distance, wrap
from swarm.messages import COMMAND, Activity, Command, Steering
from world.bodies.roster import Roster
from world.bodies.sensors import FreeDistances
from world.measure.state import SteeringState

CLOSE: Final = 1e-3  # m/s; rim speeds this close count as equal; rounding makes 1e-15
IDLE: Final = (Activity.READY, Activity.STOPPED, Activity.DONE)  # activities in which a robot has nowhere to go
BY: Final = ("ticks", "metres", "angle")  # units in which shares are computed

RimSpeeds = tuple[float, float]  # left, right [m/s]


def is_zero(speeds: RimSpeeds) -> bool:
    """Return True if both rim speeds are 0, up to rounding."""
    return abs(speeds[0]) <= CLOSE and abs(speeds[1]) <= CLOSE


def classify(commanded: RimSpeeds, tables: RimSpeeds) -> Steering:
    """Return the first label of `Steering` that fits how the commanded rim speeds follow from the tables' [m/s].

    >>> [classify(speeds, (0.6, 0.4)).value for speeds in ((0.6, 0.4), (0.3, 0.2), (0.2, 0.0), (0.4, 0.6), (0.0, 0.0))]
    ['tables', 'tables', 'tightened', 'blended', 'braked']
    """
    (left, right), (left_wanted, right_wanted) = commanded, tables
    if is_zero(commanded) and not is_zero(tables):
        return Steering.BRAKED
    square = left_wanted**2 + right_wanted**2
    share = max(0.0, min(1.0, (left * left_wanted + right * right_wanted) / square)) if square else 0.0
    if abs(left - share * left_wanted) <= CLOSE and abs(right - share * right_wanted) <= CLOSE:
        return Steering.TABLES
    forward, wanted = (left + right) / 2, (left_wanted + right_wanted) / 2
    same_turn = abs((right - left) - (right_wanted - left_wanted)) <= 2 * CLOSE
    if same_turn and min(0.0, wanted) - CLOSE <= forward <= max(0.0, wanted) + CLOSE:
        return Steering.TIGHTENED
    return Steering.TURNED if abs(forward) <= CLOSE else Steering.BLENDED


class SteeringWatch:
    """The labels of all commands, and how many ticks, metres driven and radians turned each label has."""

    def __init__(self, roster: Roster, starts: Sequence[Pose], dt: float) -> None:
        self._roster, self._dt = roster, dt
        self._kept = round(COMMAND.timeout / self._dt) + 1  # ticks: an older command is not in force
        weights = {label: [0.0, 0.0, 0.0] for label in Steering}
        self.state = SteeringState(poses=starts, weights=weights, labels=[None] * len(starts))

    def add_robot(self, start: Pose) -> None:
        """Check one more robot from now on."""
        self.state.poses = [*self.state.poses, start]
        self.state.labels.append(None)

    def note_distances(self, tick: int, distances: Sequence[FreeDistances]) -> None:
        """Take in what robots sense at a tick."""
        for number, one in enumerate(distances):
            self.state.sensed[number, tick] = one
            self.state.sensed.pop((number, tick - self._kept), None)

    def look(self, commands: Sequence[Command | None], poses: Sequence[Pose]) -> None:
        """Take in the commands in force in a tick, None for a robot without one, and the poses after the tick.

        A tick counts if a wheel is commanded to turn, or if the robot is under way and braked against the tables.
        Metres and angle are those of the body, with the wheels' inertia and pushes from others.
        """
        for number, (command, before, pose) in enumerate(zip(commands, self.state.poses, poses, strict=True)):
            self.state.labels[number] = None if command is None else self._weigh(number, command, before, pose)
        self.state.poses = poses

    def _weigh(self, number: int, command: Command, before: Pose, pose: Pose) -> Steering:
        commanded, tables = (command.left, command.right), self._ask(number, command)
        label = classify(commanded, tables)
        weights = self.state.weights[label]
        if not is_zero(commanded) or (label is Steering.BRAKED and command.activity not in IDLE):
            weights[0] += 1
            if command.scale < 1.0:
                self.state.scaled += 1
                self.state.scales += command.scale
        if pose != before:
            weights[1] += distance(before, pose)
            weights[2] += abs(wrap(pose.yaw - before.yaw))
        return label

    def _ask(self, number: int, command: Command) -> RimSpeeds:
        """Return the tables' rim speeds [m/s] for a command, or NaN if the command answers no recent sense."""
        sensed = self.state.sensed.get((number, command.tick))
        if sensed is None:
            return nan, nan  # they differ from every command
        robot, controller = self._roster.bodies[number], self._roster.controller(number)
        unit, speed = robot.distance_scale * command.scale, robot.speed_scale
        distances = sensed.left / unit, sensed.front / unit, sensed.right / unit
        left, right = controller.wheel_speeds(*distances, -degrees(command.heading))
        return left * speed, right * speed

    def report(self) -> dict[str, Any]:
        """Return the share of each label by ticks, metres and angle; all shares are 0 if there were none.

        ``scaled`` is the time [s, summed over robots] in which the tables got distances with a scale below 1, and the
        mean of those scales.
        """
        state = self.state
        found: dict[str, Any] = {}
        for k, name in enumerate(BY):
            total = sum(weights[k] for weights in state.weights.values())
            found[name] = {
                label.value: weights[k] / total if total else 0.0 for label, weights in state.weights.items()
            }
        mean = state.scales / state.scaled if state.scaled else 1.0
        return found | {"scaled": {"time": state.scaled * self._dt, "mean": mean}}
