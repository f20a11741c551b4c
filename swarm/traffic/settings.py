"""Every constant of traffic, with its unit and where it comes from."""

from dataclasses import dataclass
from typing import Final

LEAST_CLAIM: Final = 1.2  # cells, how far a robot must be able to claim
NEAR: Final = 0.04  # m, so near the last point of its way a robot stands
SPARE: Final = 0.01  # m, for what it rolls on


def least_range(side: float) -> float:
    """Return how far a radio must reach [m] for cells of ``side`` [m]: see ``claim_radius``."""
    return 2 * LEAST_CLAIM * side + 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficSettings:
    """What all robots of a fleet share. Times are in ticks of ``tick`` seconds: robots have no other clock."""

    tick: float = 0.05  # s
    every: int = 4  # ticks between two broadcasts of a robot
    often: int = (
        2  # ticks between two while it listens or hears somebody listen: 15 in a row get lost once in 30,000 at 50 %
    )
    radius: float = 0.2  # m, of the robot's footprint
    margin: float = 0.03  # m, kept between the footprint and the edge of the held cells
    radio_range: float = 8.0  # m
    learns: bool = False  # nobody is given the floor: each robot plans on the cells that it has learned
    in_sight: bool = False  # walls stop the radio: round a corner nobody is heard
    speed: float = 0.9  # m/s, nobody is faster: what a record may have moved since the last one
    sensor_range: float = 1.6  # m, from the robot's edge

    # claims and holds
    horizon: int = 3  # cells claimed or held beyond the one the robot stands in
    ripe: int = 8  # ticks before a claim can become a hold: two broadcasts of everybody
    listen: int = 30  # ticks without any claim after the start and after waking: those near are heard first
    fresh: int = 40  # ticks; a record older than this is of a silent robot
    absent: int = 140  # ticks of silence for which a member of a plan keeps its turns in it
    gap: int = 20  # ticks between two steps of the same robot that mean it was suspended
    surmise: int = 200  # ticks of silence before a look decides about the cells of a silent robot
    obstacle: int = 400  # ticks for which a body found in a cell keeps it out of paths
    emptied: int = 2400  # ticks for which it is passed on that a silent robot's cell was seen empty
    sightings: int = 24  # told in one record at most, newest first
    stop_distance: float = 0.6  # m, to an unexpected obstacle: no forward speed
    unexpected: float = 0.05  # m, so much nearer than the map's own walls is something else

    # records
    hops: int = 3  # how often a record is passed on
    keep: int = 600  # ticks for which a silent robot's record is passed on
    relayed: int = 40  # records passed on in one broadcast at most, nearest first

    # joint plans
    ahead: int = 6  # cells of its way a robot tells
    stuck: int = 60  # ticks without progress that ask for a joint plan
    plan_stuck: int = 160  # ticks in which nobody of a plan has advanced, before it is given up
    calm: int = 40  # ticks after adopting a plan in which a robot asks for no other
    again: int = 10  # ticks between two plans of one leader
    gather: int = 20  # ticks a leader waits for those who have not frozen
    freeze: int = 200  # ticks a member stands frozen without a plan at most: all attempts of a search take 120
    carry: int = 100  # ticks for which a leader's record carries its plan
    unanswered: int = 4  # checks after which a leader asked in vain is passed over
    pass_over: int = 100  # ticks for which it is
    backoff: int = 200  # ticks before the same cluster is planned again after no plan was found
    starts: int = 60  # searches for one joint plan at most, the quickest plan is kept
    enough: int = 50_000  # openings times members, after which no further start is made once there is a plan
    expansions: int = 20_000  # openings for one joint plan before it is given up
    robot_openings: int = 6_000  # openings times members in one step: about fifteen milliseconds

    @property
    def claim_radius(self) -> float:
        """How far from its body a robot may claim [m]: two that claim one cell must hear each other."""
        return (self.radio_range - 1.0) / 2

    @property
    def standing_room(self) -> float:
        """The disc [m] that has to fit in a cell where a robot stands at its goal, or a little beside it."""
        return self.radius + self.margin + NEAR + SPARE

    @property
    def leaning_room(self) -> float:
        """The disc [m] round which a robot leans out of its cell, and stays in it where it stops badly."""
        return self.standing_room + 0.03

    @property
    def alone(self) -> float:
        """How far off the next robot must be [m] to count as nobody: its claims, and a second of both driving."""
        return self.claim_radius + 2.5
