"""The interface of a robot's brain and its pilot: ``PilotInputs`` go in, ``PilotOutputs`` come out."""

from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple, Protocol

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Activity, Broadcast, Sense
from swarm.messages.traffic import TrafficBroadcast
from swarm.robot.driving.safety import WheelSpeeds
from swarm.robot.ground import Block
from swarm.robot.navigator import Navigator
from swarm.robot.pose_estimate import Estimate
from swarm.traffic.outputs import StepResult

EXACT: Final = Estimate(Pose(0.0, 0.0, 0.0))


class PilotInputs(NamedTuple):
    """What the brain knows at one tick."""

    sense: Sense
    pose: Pose  # the estimate's
    goal: Point  # m, the current stop; the last one when all are done
    then: Point | None  # m, the stop after that one; None: there is none
    heading: float | None  # rad, to turn to at the current stop; None: any
    done: bool  # no stop is left: the robot stands or makes room
    anywhere: bool  # it is done, and need not keep its place
    target: int  # index of that stop; -1: there is none
    navigator: Navigator  # the robot's path to the goal
    heard: Sequence[Broadcast]  # broadcasts that arrived at this tick
    estimate: Estimate = EXACT  # how well the pose is known

    def is_at_goal(self, reach: float) -> bool:
        """Return True if the robot is within ``reach`` [m] of its current stop."""
        return distance(self.pose, self.goal) <= reach


class PilotOutputs(NamedTuple):
    """What the robot does at one tick, and what others are told about it."""

    speeds: WheelSpeeds
    heading: float  # rad, bearing of the aim that the fuzzy controller got
    activity: Activity
    held: Sequence[int] = ()
    scale: float = 1.0  # the fuzzy controller got the sensed distances divided by this
    unconstrained: bool = False  # nobody is near: it holds the cells that its body and brake need
    waits: Sequence[str] = ()
    members: Sequence[str] = ()
    notes: Sequence[tuple[str, str]] = ()
    traffic: TrafficBroadcast | None = None


class Pilot(Protocol):
    """What a brain needs of its pilot."""

    @property
    def last_decision(self) -> StepResult | None:
        """The decisions of its last step of coordination; None: it has made none."""

    def drive(self, inputs: PilotInputs) -> PilotOutputs:
        """Return what the robot does at one tick; call it once a tick."""

    def can_reach(self, here: Point, goal: Point) -> bool:
        """Return True if joined cells lead from ``here`` to ``goal`` [m]."""

    def take_floor(self, floor: OccupancyMap) -> None:
        """Replace the map."""

    def learn(self, floor: OccupancyMap, blocks: Iterable[Block]) -> bool:
        """Take in changed blocks of a learned map; return True if ways may have changed."""

    def robot_at(self, tick: int) -> Callable[[Point], bool]:
        """Return a function that says of a point [m] whether another robot's body may be there at a tick."""
