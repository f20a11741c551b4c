"""The localisers of all robots: the pose that each is told, and how good it is said to be.

The error of a pose is drawn from the run's seed, for each robot by itself: normal in x, y and yaw, cut at three
standard deviations, and lasting (an Ornstein-Uhlenbeck process; Uhlenbeck and Ornstein 1930). A pose may also jump, and
be right again after a while; nothing that a robot is told says so.
"""

from collections.abc import Mapping, Sequence
from math import exp, hypot, inf, pi, radians, sqrt
from typing import Final, NamedTuple

import numpy as np

from swarm.geometry import Pose, distance, wrap
from swarm.messages import BodyReport
from swarm.robot.pose_estimate import BOUND, WITHIN_95, YAW_WITHIN_95
from swarm.settings import LocalisationSettings
from world.bodies.event_line import EventLine

MOST: Final = 3.0  # standard deviations, the largest error
SPARE: Final = 0.01  # m; an error that is larger than told by less is not worth a word


class ToldPose(NamedTuple):
    """The pose that a robot is told, and how good it is said to be: see `sense`."""

    pose: Pose
    pose_error: float = 0.0  # m
    yaw_error: float = 0.0  # rad


class PoseError(NamedTuple):
    """The error of one robot's pose."""

    x: float = 0.0  # standard deviations
    y: float = 0.0
    yaw: float = 0.0
    jump_x: float = 0.0  # m
    jump_y: float = 0.0
    right_at: int = 0  # tick at which a jump ends
    jumps_at: float = inf  # tick of the next jump


class LocaliserState(NamedTuple):
    """The state of `Localisers`, which changes its values."""

    noise: list[np.random.Generator]
    errors: list[PoseError]
    worse: list[int]  # robots whose pose is worse than they are told
    spells: list[int]  # how often that began, for each robot
    most: list[float]  # m, the largest error so far, for each robot


class Localisers:
    """The localisers of one run, by the robots' numbers. With exact poses they draw nothing."""

    def __init__(self, settings: LocalisationSettings, robots: Sequence[str], seed: int, dt: float) -> None:
        self._settings, self._names, self._seed, self._dt = settings, robots, seed, dt
        kept = exp(-dt / settings.lasts) if settings.lasts else 0.0
        self._kept, self._new = kept, sqrt(1 - kept * kept)
        told = settings.error if settings.told is None else settings.told
        self._told = WITHIN_95 * told, YAW_WITHIN_95 * radians(settings.yaw_error_deg)
        self.state = LocaliserState([], [], [], [], [])
        for _ in robots:
            self.add_robot()

    def add_robot(self) -> None:
        """Add the localiser of one more robot, and draw its first error."""
        number = len(self.state.errors)
        self.state.noise.append(np.random.default_rng([self._seed, 2, number]))
        self.state.errors.append(self._draw_jump(number, self._draw(number, PoseError(), 0.0, 1.0), 0))
        self.state.spells.append(0)
        self.state.most.append(0.0)

    def draw(self, tick: int) -> None:
        """Draw the errors of a tick."""
        if not self._settings.exact:
            for number, error in enumerate(self.state.errors):
                self.state.errors[number] = self._jump(number, self._draw(number, error, self._kept, self._new), tick)

    def _draw(self, number: int, error: PoseError, kept: float, new: float) -> PoseError:
        if self._settings.exact:
            return error
        x, y, yaw = self.state.noise[number].normal(0.0, 1.0, 3).tolist()
        return error._replace(x=kept * error.x + new * x, y=kept * error.y + new * y, yaw=kept * error.yaw + new * yaw)

    def _jump(self, number: int, error: PoseError, tick: int) -> PoseError:
        """Return the error after a jump that is due at a tick, or at whose end it is right again."""
        jumps = self._settings.jumps
        if jumps is None:
            return error
        if tick >= error.jumps_at:
            turn = float(self.state.noise[number].uniform(-pi, pi))
            x, y = jumps.distance * np.cos(turn), jumps.distance * np.sin(turn)
            error = error._replace(jump_x=float(x), jump_y=float(y), right_at=tick + round(jumps.lasts / self._dt))
            return self._draw_jump(number, error, error.right_at)
        return error._replace(jump_x=0.0, jump_y=0.0) if tick == error.right_at else error

    def _draw_jump(self, number: int, error: PoseError, tick: int) -> PoseError:
        """Return the error with the tick of its next jump after ``tick``: the waits are half to one and a half mean."""
        jumps = self._settings.jumps
        if jumps is None or (jumps.robots and self._names[number] not in jumps.robots):
            return error
        wait = self.state.noise[number].uniform(0.5, 1.5) * jumps.every
        return error._replace(jumps_at=tick + float(wait) / self._dt)

    def told_pose(self, number: int, pose: Pose, report: BodyReport | None) -> ToldPose:
        """Return what a robot is told of its true ``pose``; a body outside tells by its ``report`` how good that is."""
        if report is not None:
            return ToldPose(pose, report.pose_error, report.yaw_error)
        if self._settings.exact:
            return ToldPose(pose)
        error, settings = self.state.errors[number], self._settings
        cut = min(1.0, MOST / max(MOST, hypot(error.x, error.y))) * settings.error
        yaw = max(-MOST, min(MOST, error.yaw)) * radians(settings.yaw_error_deg)
        place = pose.x + cut * error.x + error.jump_x, pose.y + cut * error.y + error.jump_y
        return ToldPose(Pose(*place, wrap(pose.yaw + yaw)), *self._told)

    def watch(self, poses: Sequence[Pose], reports: Mapping[int, BodyReport]) -> list[EventLine]:
        """Return a line for each robot whose pose begins to be worse than it is told, by the true ``poses``."""
        if self._settings.exact:
            return []
        state, lines = self.state, list[EventLine]()
        for number, pose in enumerate(poses):
            if number in reports:
                continue  # nobody knows better where it is
            told = self.told_pose(number, pose, None)
            off, most = distance(told.pose, pose), BOUND * told.pose_error
            state.most[number] = max(state.most[number], off)
            if off <= most + SPARE:
                if number in state.worse:
                    state.worse.remove(number)
            elif number not in state.worse:
                state.worse.append(number)
                state.spells[number] += 1
                text = f"is told a pose that is {off:.2f} m off, and said to be good to {most:.2f} m"
                lines.append(EventLine("pose_worse", text, self._names[number], (pose.x, pose.y)))
        return lines
