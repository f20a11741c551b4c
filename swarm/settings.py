"""The fields of a scenario file, each with its type, unit and bounds. Metres, seconds and radians; ``_deg`` is degrees.

Defaults are here and nowhere else. The text of each ``description`` is what the documentation and the errors show.
"""

from math import pi
from typing import Annotated, Final, Literal

from msgspec import Meta, Struct

MOST_ROBOTS: Final = 1000  # of a fleet
TAPE: Final = ".swarm"  # the ending of a tape's file
BAG: Final = ".mcap"  # the ending of a bag of ROS 2
PAPER_TOP_SPEED: Final = 4.0  # m/s, the fastest rim speed of the paper's tables
Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{1,64}\Z", description="letters, digits and _ . : -")]
HowMany = Annotated[int, Meta(ge=1, le=MOST_ROBOTS)]
Metres = Annotated[float, Meta(ge=-1e5, le=1e5)]
Coordinates = tuple[Metres, Metres]
Pace = float | Literal["max"]  # a run's speed: times real time, or lockstep as fast as the machine allows


def _metres(low: float, high: float, text: str) -> Meta:
    return Meta(gt=low, le=high, description=f"m; {text}")


class Section(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of all sections of a scenario file: frozen, keyword-only, unknown fields are errors."""


class MapSettings(Section, frozen=True, kw_only=True):
    """Either ``text`` (drawn in the file: # wall, o obstacle, . free) or ``file`` (.yaml of ROS, .map of MovingAI)."""

    text: Annotated[str, Meta(description="one character per cell, the first line is the top")] | None = None
    file: Annotated[str, Meta(description="path of a map in the scenario's folder or below it")] | None = None
    cell: Annotated[float, _metres(0, 10, "side of a character of `text` or of a MovingAI cell")] = 0.5
    known: Annotated[bool, Meta(description="robots get the map; otherwise they learn it from their rays")] = True
    shared: Annotated[bool, Meta(description="robots share what they learn of the map over the radio")] = True


class StartSettings(Section, frozen=True, kw_only=True):
    """One of ``area`` (random poses in it, from the seed), ``poses`` (robot i takes the i-th) or ``circle``.

    On a circle the robots stand evenly spaced and face the centre. Each robot's target is the point opposite its start.
    """

    area: Annotated[tuple[Metres, Metres, Metres, Metres], Meta(description="m; x and y of two corners")] | None = None
    poses: Annotated[
        list[tuple[Metres, Metres, Annotated[float, Meta(ge=-6.3, le=6.3)]]] | None,
        Meta(description="m, m, rad; 4 radii apart are always enough"),
    ] = None
    circle: (
        Annotated[
            tuple[Metres, Metres, Annotated[float, Meta(gt=0, le=1e4)]], Meta(description="m; centre, then diameter")
        ]
        | None
    ) = None


Radius = Annotated[float, _metres(0.01, 5, "of its round footprint")]
TrackWidth = Annotated[float, _metres(0.01, 5, "between the two wheels' contact points")]
WheelAcceleration = Annotated[float, Meta(gt=0, le=100, description="m/s2; largest change of a rim speed")]
SpeedScale = Annotated[float, Meta(gt=0, le=1, description="share of the paper's wheel speeds (0..4 m/s)")]
DistanceScale = Annotated[
    float, Meta(ge=0.05, le=10, description="the fuzzy controller gets the sensed distances divided by this")
]


class RobotSettings(Section, frozen=True, kw_only=True):
    """The robot's body and wheels."""

    radius: Radius = 0.2
    track_width: TrackWidth = 0.4
    wheel_acceleration: WheelAcceleration = 2.0
    speed_scale: SpeedScale = 0.4
    distance_scale: DistanceScale = 1.0

    @property
    def top_speed(self) -> float:
        """The fastest rim speed [m/s]: that of the paper's tables, scaled."""
        return PAPER_TOP_SPEED * self.speed_scale


class SensorSettings(Section, frozen=True, kw_only=True):
    """Three proximity sectors of rays from the robot's edge, and the infrared bearing sensor."""

    range: Annotated[float, _metres(0.1, 50, "reach of a ray")] = 1.6
    rays: Annotated[int, Meta(ge=1, le=99, description="rays in each sector")] = 5
    side_deg: Annotated[float, Meta(gt=0, lt=180, description="degrees; side sectors' centre, from ahead")] = 60.0
    side_half_width_deg: Annotated[float, Meta(ge=0, le=90, description="degrees")] = 25.0
    front_half_width_deg: Annotated[float, Meta(ge=0, le=90, description="degrees")] = 25.0
    noise: Annotated[float, Meta(ge=0, le=1, description="m; standard deviation of a distance")] = 0.0
    bearing_noise_deg: Annotated[float, Meta(ge=0, le=45, description="degrees; standard deviation of a bearing")] = 0.0


class KindSettings(Section, frozen=True, kw_only=True):
    """What robots of one kind have of their own; what is left out is the scenario's: `robot`, `sensors` and so on."""

    radius: Radius | None = None
    track_width: TrackWidth | None = None
    wheel_acceleration: WheelAcceleration | None = None
    speed_scale: SpeedScale | None = None
    distance_scale: DistanceScale | None = None
    sensors: Annotated[SensorSettings | None, Meta(description="what differs from the scenario's `sensors`")] = None
    controller: Annotated[str | None, Meta(description="a fuzzy profile, as the scenario's `controller`")] = None
    start: Annotated[StartSettings | None, Meta(description="`area` or `poses`, as the scenario's `start`")] = None
    targets: (
        Annotated[list[Coordinates], Meta(max_length=1000, description="m; each robot of the kind visits all in order")]
        | None
    ) = None


class JumpSettings(Section, frozen=True, kw_only=True):
    """A localiser that now and then takes a robot for elsewhere, and does not say so."""

    every: Annotated[float, Meta(gt=0, le=1e6, description="s; mean time between two jumps of a robot")] = 30.0
    distance: Annotated[float, _metres(0, 10, "how far a jump leads")] = 0.3
    lasts: Annotated[float, Meta(gt=0, le=1e6, description="s; until the pose is right again")] = 3.0
    robots: Annotated[list[str], Meta(max_length=MOST_ROBOTS, description="whose pose jumps; none: all robots'")] = []


class LocalisationSettings(Section, frozen=True, kw_only=True):
    """How well robots know their poses; by default exactly. Errors are normal, and end at three standard deviations."""

    error: Annotated[float, Meta(ge=0, le=1, description="m; standard deviation of x and of y")] = 0.0
    yaw_error_deg: Annotated[float, Meta(ge=0, le=45, description="degrees; standard deviation of the yaw")] = 0.0
    lasts: Annotated[float, Meta(ge=0, le=1e4, description="s; an error fades to 37 % in this time")] = 2.0
    told: (
        Annotated[float, Meta(ge=0, le=1, description="m; what robots are told of `error`; null: the truth")] | None
    ) = None
    jumps: Annotated[JumpSettings | None, Meta(description="a pose that jumps")] = None

    @property
    def exact(self) -> bool:
        """True if robots are told their true poses."""
        return not self.error and not self.yaw_error_deg and self.jumps is None


class RadioSettings(Section, frozen=True, kw_only=True):
    """The radio model: which broadcasts reach which robots."""

    range: Annotated[float, _metres(0.1, 1e4, "how far a broadcast reaches")] = 8.0
    loss: Annotated[float, Meta(ge=0, le=1, description="probability that a broadcast does not reach a receiver")] = 0.0
    line_of_sight: Annotated[bool, Meta(description="walls block the radio")] = False
    every: Annotated[int, Meta(ge=1, le=10, description="ticks between two broadcasts of a robot")] = 4


class TrafficSettings(Section, frozen=True, kw_only=True):
    """The lattice of cells that robots reserve: a robot drives only in cells it has reserved."""

    cell: Annotated[
        float | None, Meta(description="m; side of a cell; by default 6 robot radii, down to 4 if a target needs it")
    ] = None
    offset: Annotated[
        Coordinates | None, Meta(description="m; corner of cell 0 in the map's frame; by default the best connected")
    ] = None


class MoverSettings(Section, frozen=True, kw_only=True):
    """A moving obstacle, a disc (`radius`) or a box (`size`). It is on no map; only the sensors see it."""

    waypoints: Annotated[list[Coordinates], Meta(min_length=2, max_length=1000, description="m")]
    speed: Annotated[float, Meta(gt=0, le=5, description="m/s")]
    radius: Annotated[float, _metres(0, 10, "of a disc")] | None = None
    size: Annotated[tuple[Metres, Metres], Meta(description="m; length along its way and width of a box")] | None = None
    loop: Annotated[bool, Meta(description="closes the way from the last waypoint; otherwise back and forth")] = False


class EditSettings(Section, frozen=True, kw_only=True):
    """A rectangle of the map that changes during the run, at a time set in the scenario."""

    at: Annotated[float, Meta(gt=0, le=1e6, description="s since the run began")]
    kind: Annotated[Literal["wall", "obstacle", "free"], Meta(description="what the rectangle becomes")]
    low: Annotated[Coordinates, Meta(description="m; one corner")]
    high: Annotated[Coordinates, Meta(description="m; the opposite corner")]


class OrderSettings(Section, frozen=True, kw_only=True):
    """A request to one robot at a time set in the scenario: either `targets`, an order, or `do`, an action."""

    at: Annotated[float, Meta(gt=0, le=1e6, description="s since the run began")]
    robot: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{1,64}\Z", description="its name, such as r1")]
    targets: Annotated[list[Coordinates], Meta(max_length=1000, description="m; in order")] | None = None
    home: Annotated[bool, Meta(description="drive home after the last target")] = False
    headings: Annotated[
        list[Annotated[float, Meta(ge=-pi, le=pi)] | None],
        Meta(max_length=1000, description="rad; for each target, the yaw to turn to there; null or none: any"),
    ] = []
    do: Annotated[Literal["stop", "go_on", "home", "cancel", "load"], Meta(description="an action")] | None = None
    radius: Annotated[Radius | None, Meta(description="m; with `do: load`, of the footprint from then on")] = None
    id: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{1,64}\Z", description="name of the order")] = "scenario"
    update: Annotated[int, Meta(ge=0, le=2**53, description="version of the order")] = 0


class Settings(Section, frozen=True, kw_only=True):
    """The top level of a scenario file."""

    name: Name
    map: MapSettings
    start: StartSettings
    targets: Annotated[list[Coordinates], Meta(max_length=1000, description="m; each robot visits all in order")] = []
    own_targets: Annotated[
        list[Annotated[list[Coordinates], Meta(min_length=1, max_length=1000)]],
        Meta(max_length=1000, description="m; instead of `targets`: robot i visits the i-th list"),
    ] = []
    return_home: Annotated[bool, Meta(description="each robot drives back to its start at the end")] = True
    patrol: Annotated[
        bool, Meta(description="the targets are visited again and again until `limit`; nobody drives home")
    ] = False
    serve: Annotated[
        bool, Meta(description="who is done waits for orders; the run ends only by `swarm stop` or `--limit`")
    ] = False
    retry_stops: Annotated[
        bool, Meta(description="a robot takes up a target that it gave up when an edit or a learned map opens a way")
    ] = True
    reach: Annotated[float, _metres(0, 10, "a target counts as reached within this distance")] = 0.4
    kinds: Annotated[
        dict[Name, KindSettings], Meta(max_length=16, description="robots unlike each other, by name")
    ] = {}
    robots: Annotated[
        HowMany | dict[Name, HowMany],
        Meta(description="number of robots, or how many of each kind; `--robots` overrides it"),
    ] = 1
    seed: Annotated[int, Meta(ge=0, le=2**53, description="of the random starts, noise and radio loss")] = 1
    limit: Annotated[float, Meta(gt=0, le=1e6, description="s; simulated time after which the run is given up")] = 600.0
    rate: Annotated[float, Meta(ge=1, le=1000, description="Hz; control steps per second")] = 20.0
    controller: Annotated[
        str, Meta(description="a fuzzy profile: paper, careful, wall_following, or a profile file beside the scenario")
    ] = "paper"
    robot: RobotSettings = RobotSettings()
    sensors: SensorSettings = SensorSettings()
    localisation: LocalisationSettings = LocalisationSettings()
    radio: RadioSettings = RadioSettings()
    traffic: TrafficSettings = TrafficSettings()
    movers: Annotated[list[MoverSettings], Meta(max_length=200, description="moving obstacles")] = []
    edits: Annotated[list[EditSettings], Meta(max_length=200, description="changes of the map during the run")] = []
    orders: Annotated[list[OrderSettings], Meta(max_length=1000, description="requests during the run")] = []
    pool: Annotated[list[Coordinates], Meta(max_length=1000, description="m; any robot that is free visits them")] = []

    @property
    def count(self) -> int:
        """The number of robots."""
        return self.robots if isinstance(self.robots, int) else sum(self.robots.values())
