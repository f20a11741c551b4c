"""A robot that says nothing of traffic: it drives straight along its path and stops before what its sensors show.

It stands for a foreign robot that knows the wire and no rule of traffic: it holds no cells, asks nobody and answers
nobody. Its broadcasts say where it is.
"""

from collections.abc import Callable, Iterable, Sequence
from math import sqrt
from typing import Final

import numpy as np
from msgspec.structs import replace

from swarm.geometry import Twist, bearing, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Activity, Broadcast
from swarm.motion.drive import DifferentialDrive
from swarm.robot.brain import Inputs, Robot
from swarm.robot.driving.pilot import PilotInputs, PilotOutputs
from swarm.robot.driving.safety import NO_BODIES, STAND, Constraints, SafetyFilter
from swarm.robot.ground import Block
from swarm.robot.outputs import Outputs
from swarm.settings import Settings
from world.simulate import Simulation

CRUISE: Final = 0.5  # m/s
AHEAD: Final = 0.4  # m along its path, the point that it drives to
TURNS: Final = 0.5  # rad; it turns in place towards a point farther to a side
KEEPS: Final = 0.35  # m, from its edge to what its sensors show in front when it stops
BESIDE: Final = 0.1  # m, from its edge to what they show at its sides: it drives along walls
NOTHING_SHUT: Final = np.empty((0, 4))


class MuteRobot(Robot):
    """A robot that says nothing of traffic."""

    def _new_pilot(self) -> "StraightPilot":
        return StraightPilot(self._settings)

    def step(self, inputs: Inputs) -> Outputs:
        """Return what the robot does at one tick."""
        outputs, sense = super().step(inputs), inputs.sense
        if (sense.tick + self._number) % self._settings.radio.every:
            return outputs
        broadcast = Broadcast(
            robot=self.name, run=self.run, tick=sense.tick, x=sense.x, y=sense.y, yaw=sense.yaw,
            activity=self._activity, target=self.mission.target, distance=self._navigator.remaining,
            reached=list(self.mission.reached),
        )  # fmt: skip
        return outputs._replace(command=replace(outputs.command, sent=True), broadcast=broadcast)


class StraightPilot:
    """The driver of a mute robot: straight along the path, with the safety filter's limits."""

    last_decision: Final = None  # it takes no part in traffic

    def __init__(self, settings: Settings) -> None:
        self._drive = DifferentialDrive(settings.robot.track_width)
        self._filter = SafetyFilter(settings)
        self._brake = settings.robot.wheel_acceleration

    def drive(self, inputs: PilotInputs) -> PilotOutputs:
        """Return what the robot does at one tick."""
        path, sense = inputs.navigator.path, inputs.sense
        if path is None or inputs.done:
            return PilotOutputs(STAND, 0.0, Activity.DONE if inputs.done else Activity.BLOCKED)
        along = path.stations[-1] - inputs.navigator.remaining
        error = bearing(inputs.pose, path.point_at(min(along + AHEAD, path.stations[-1])))
        room = max(0.0, min(sense.front - KEEPS, sense.left - BESIDE, sense.right - BESIDE))
        linear = 0.0 if abs(error) > TURNS else min(CRUISE, sqrt(2 * 0.5 * self._brake * room))
        wanted = self._drive.rim_speeds(Twist(linear, max(-1.5, min(1.5, 2.0 * error))))
        limits = Constraints(
            inputs.navigator.grid, NOTHING_SHUT, inputs.pose, NO_BODIES, distance(inputs.pose, inputs.goal)
        )
        return PilotOutputs(self._filter.check(sense, wanted, limits), error, Activity.DRIVE)

    def can_reach(self, here: Point, goal: Point) -> bool:
        """Return True: its path decides."""
        return True

    def take_floor(self, floor: OccupancyMap) -> None:
        """Do nothing: it has no cells."""

    def learn(self, floor: OccupancyMap, blocks: Iterable[Block]) -> bool:
        """Do nothing: it has no cells."""
        return False

    def robot_at(self, tick: int) -> Callable[[Point], bool]:
        """Return a function that says of no point that a robot may be there."""
        return lambda place: False


def make_mute(simulation: Simulation, robots: Sequence[str]) -> None:
    """Replace robots of a simulation that has not begun by ones that say nothing of traffic."""
    for number, robot in enumerate(simulation.robots):
        if robot.name in robots:
            simulation.robots[number] = MuteRobot(
                robot.name, number, simulation.world.roster.scenario(number), simulation.world.starts[number]
            )
