"""What the driver of a robot keeps from one tick to the next."""

from typing import NamedTuple

from swarm.maps.occupancy import Point
from swarm.messages import Broadcast
from swarm.robot.driving.safety import STAND, WheelSpeeds
from swarm.traffic.interface import TrafficOutputs
from swarm.traffic.lattice.cell_map import CellMap


class Driven(NamedTuple):
    """How a robot drove in one tick, as far as the next one needs it."""

    speeds: WheelSpeeds = STAND
    heading: float = 0.0  # rad, that the tables got
    scale: float = 1.0  # the tables got the sensed distances divided by this
    drawn_to: Point | None = None  # m, the aim if all the floor were granted
    circles: bool = False  # its way did not become shorter for long
    target: int = -1  # the stop for which this was counted


class Assignment(NamedTuple):
    """What coordination was asked for; if it changes, a step is due at once."""

    goal: Point | None = None  # m
    stopped: bool = False  # it was told to stop
    cells: CellMap | None = None


class LastTick(NamedTuple):
    """What the driver keeps of the last tick."""

    driven: Driven = Driven()
    rolled: tuple[int, ...] = ()  # cells that the tables would drive over, by the last rollout
    kept_away: int = 0  # ticks that it was kept from its place since it is done
    granted: TrafficOutputs | None = None  # None: there was no tick before
    asked: Assignment = Assignment()
    unheard: tuple[Broadcast, ...] = ()  # broadcasts that came since the last step of coordination
