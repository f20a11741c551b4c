"""The constants of traffic that all robots of a fleet share; a constant of one module alone is in that module."""

from dataclasses import dataclass
from typing import Final

from swarm.messages.traffic import Record

LEAST_CLAIM: Final = 1.2  # cells, how far a robot must at least be able to claim
NEAR: Final = 0.04  # m, how near to the last point of its way a robot stands
LEANS: Final = 0.1  # m, how far a robot may be from where it leans, or from its cell's middle: see CellMap.is_blind
ROLLS_ON: Final = 0.01  # m, for rolling on after a stop
NARROW: Final = 5.5  # radii


def is_lane(side: float, radius: float) -> bool:
    """Return True if cells of ``side`` [m] are too small for the tables' arcs: a robot turns in them on the spot."""
    return side < NARROW * radius


def least_range(side: float) -> float:
    """Return how far a radio must reach [m] for cells of ``side`` [m]: see ``claim_radius``."""
    return 2 * LEAST_CLAIM * side + 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficConstants:
    """The constants that all robots of a fleet share. Times are in ticks of ``tick`` seconds, their only clock."""

    tick: float = 0.05  # s
    step: int = 2  # ticks between two steps of coordination, at most
    every: int = 4  # ticks between two broadcasts of a robot
    # ticks between two broadcasts while a robot listens or hears one that listens: at 50 % loss, 15 in a row are lost
    # once in 30,000
    often: int = 2
    radius: float = 0.2  # m, of this robot's footprint
    top: float = 0.9  # m/s, the most that this robot drives
    widest: float = 0.2  # m, no footprint of the fleet is larger: of a robot whose record says no radius
    tells_body: bool = False  # robots are unlike each other: a record says how wide and how fast its robot is
    margin: float = 0.03  # m, kept between the footprint and the edge of the held cells
    radio_range: float = 8.0  # m
    learns: bool = False  # robots are not given the floor: each plans on the cells that it has learned
    in_sight: bool = False  # walls stop the radio: a robot round a corner is not heard
    speed: float = 0.9  # m/s; no robot is faster: it limits how far a record may have moved since the last one
    acceleration: float = 2.0  # m/s2; no robot gains speed faster
    braking: float = 2.0  # m/s2; every robot brakes with that at least
    sensor_range: float = 1.6  # m, from the robot's edge
    reach: float = 0.4  # m, how near to a stop a robot has to come

    # claims and holds
    horizon: int = 3  # cells claimed or held beyond the one the robot stands in
    ripe: int = 8  # ticks before a claim can become a hold: every robot broadcasts twice
    listen: int = 30  # ticks without any claim after the start and after waking: the robot first hears who is near
    fresh: int = 40  # ticks; a robot whose record is older than this is silent
    absent: int = 140  # ticks of silence for which a member of a plan keeps its turns
    gap: int = 20  # ticks between two steps of a robot; more means that it was suspended
    surmise: int = 200  # ticks of silence before a look decides about the cells of a silent robot
    obstacle: int = 400  # ticks for which ways avoid a cell in which a body was found
    emptied: int = 2400  # ticks for which robots tell that a silent robot's cell was seen empty
    sightings: int = 24  # sightings told in one record at most, newest first
    stop_distance: float = 0.6  # m; no forward speed if an unexpected obstacle is nearer
    unexpected: float = 0.05  # m; a body that is nearer than the map's walls by more than this is not on the map

    # records
    hops: int = 3  # how often a record is relayed
    relay: int = 12  # ticks between two relays of the record of a robot that somebody near may not hear
    relay_silent: int = 16  # ticks between two relays of a silent robot's record
    keep: int = 600  # ticks of silence after which a record is relayed half as often
    relayed: int = 40  # records relayed in one broadcast at most, nearest robots first

    # joint plans
    ahead: int = 6  # cells of its way that a robot tells
    stuck: int = 60  # ticks without progress after which a robot asks for a joint plan
    plan_stuck: int = 160  # ticks without progress of any member, after which a plan is given up
    calm: int = 40  # ticks after adopting a plan in which a robot asks for no other
    again: int = 10  # ticks between two plans of one leader
    gather: int = 20  # ticks for which a leader waits for members that have not frozen
    gather_longest: int = 60  # ticks; it waits twice as long each time that some have not
    freeze: int = 200  # ticks for which a member stands frozen without a plan: all attempts of a search take 120
    carry: int = 100  # ticks for which a leader's record carries its plan, at most: until all follow it
    unanswered: int = 4  # requests without an answer, after which a leader is passed over
    pass_over: int = 100  # ticks for which a leader is passed over
    backoff: int = 200  # ticks before a robot leads again after it has found no plan
    starts: int = 60  # searches for one joint plan at most; the quickest plan is kept
    enough: int = 50_000  # expansions times members, after which no further start is made once there is a plan
    expansions: int = 20_000  # expansions for one joint plan, after which it is given up
    robot_openings: int = 6_000  # expansions times members in one step: about fifteen milliseconds

    def reach_after(self, speed: float | None, time: float, most: float | None = None) -> tuple[float, float]:
        """Return how far [m] a robot may drive in ``time`` [s], and how fast it may be then [m/s].

        ``speed`` is how fast it is at first, ``most`` the fastest that it drives; None if nobody knows.
        """
        most = self.speed if most is None else min(most, self.speed)
        speed = most if speed is None else min(speed, most)
        gains = min(time, (most - speed) / self.acceleration)
        top = speed + self.acceleration * gains
        return (speed + top) / 2 * gains + top * (time - gains), top

    def radius_of(self, record: Record) -> float:
        """Return how wide a robot is at most [m], by its record."""
        return self.widest if record.radius is None else record.radius

    @property
    def claim_radius(self) -> float:
        """How far from its body a robot may claim [m]: two robots that claim one cell must hear each other."""
        return (self.radio_range - 1.0) / 2

    def asking_distance(self, side: float) -> float:
        """Return how far off [m] a robot may be that could claim a cell that this one can claim; ``side`` of a cell.

        Both are then within their claims' reach of that cell. The rest is what both may have driven since the record:
        1.5 m, or 1 m where the radio reaches no farther. Beyond the radio nobody could acknowledge: a claim would wait
        for ever for a robot that stands there.
        """
        return min(self.radio_range, 2 * min(self.claim_radius, (self.horizon + 1) * side) + 1.5)

    @property
    def standing_room(self) -> float:
        """The radius of the disc [m] that has to fit in the cell of a robot at its goal, or a little beside it."""
        return self.radius + self.margin + NEAR + ROLLS_ON

    @property
    def leaning_room(self) -> float:
        """The radius of the disc [m] that a robot keeps inside its cell while it leans, even if it stops badly."""
        return self.standing_room + 0.03

    @property
    def alone_distance(self) -> float:
        """The distance [m] from which another robot is not near: its claims, and a second of both driving."""
        return self.claim_radius + 2.5
