"""The fields of a scenario file, each with its type, unit and bounds. Metres, seconds and radians; ``_deg`` is degrees.

Defaults are here and nowhere else. The text of each ``description`` is what the documentation and the errors show.
"""

from typing import Annotated, Literal

from msgspec import Meta, Struct

Metres = Annotated[float, Meta(ge=-1e5, le=1e5)]
Coordinates = tuple[Metres, Metres]
Pace = float | Literal["max"]  # of a run: a speed-up factor, or lockstep as fast as the machine allows


def _metres(low: float, high: float, text: str) -> Meta:
    return Meta(gt=low, le=high, description=f"m; {text}")


class Section(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every part of a scenario is: frozen, named fields, no field it does not know."""


class MapSettings(Section, frozen=True, kw_only=True):
    """Either ``text`` (drawn in the file: # wall, o obstacle, . free) or ``file`` (.yaml of ROS, .map of MovingAI)."""

    text: Annotated[str, Meta(description="one character a cell, the first line is the top")] | None = None
    file: Annotated[str, Meta(description="beside or below the scenario's own folder")] | None = None
    cell: Annotated[float, _metres(0, 10, "side of a character of `text` or of a MovingAI cell")] = 0.5
    known: Annotated[bool, Meta(description="robots are given it; otherwise they learn it from their rays")] = True
    shared: Annotated[bool, Meta(description="robots that learn the map tell each other over the radio")] = True


class StartSettings(Section, frozen=True, kw_only=True):
    """One of: ``area`` (poses are drawn in it with the seed), ``poses`` (robot i takes the i-th), ``circle``.

    On a circle the robots stand evenly, face its middle, and each one's target is the point opposite.
    """

    area: Annotated[tuple[Metres, Metres, Metres, Metres], Meta(description="m; x and y of two corners")] | None = None
    poses: Annotated[
        list[tuple[Metres, Metres, Annotated[float, Meta(ge=-6.3, le=6.3)]]] | None, Meta(description="m, m, rad")
    ] = None
    circle: (
        Annotated[
            tuple[Metres, Metres, Annotated[float, Meta(gt=0, le=1e4)]], Meta(description="m; middle, then diameter")
        ]
        | None
    ) = None


class RobotSettings(Section, frozen=True, kw_only=True):
    """The robot's body and wheels."""

    radius: Annotated[float, _metres(0.01, 5, "of its round footprint")] = 0.2
    track_width: Annotated[float, _metres(0.01, 5, "between the two wheels' contact points")] = 0.4
    wheel_radius: Annotated[float, _metres(0.001, 2, "of the driven wheels")] = 0.05
    wheel_acceleration: Annotated[float, Meta(gt=0, le=100, description="m/s2; how fast a rim speed can change")] = 2.0
    speed_scale: Annotated[float, Meta(gt=0, le=1, description="share of the paper's wheel speeds (0..4 m/s)")] = 0.4
    distance_scale: Annotated[
        float, Meta(ge=0.05, le=10, description="distances are divided by it before they meet the fuzzy terms")
    ] = 1.0


class SensorSettings(Section, frozen=True, kw_only=True):
    """Three proximity sectors of rays from the robot's edge, and the infrared bearing sensor."""

    range: Annotated[float, _metres(0.1, 50, "the farthest a ray sees")] = 1.6
    rays: Annotated[int, Meta(ge=1, le=99, description="rays in each sector")] = 5
    side_deg: Annotated[float, Meta(gt=0, lt=180, description="degrees; middle of the side sectors, off ahead")] = 60.0
    side_half_width_deg: Annotated[float, Meta(ge=0, le=90, description="degrees")] = 25.0
    front_half_width_deg: Annotated[float, Meta(ge=0, le=90, description="degrees")] = 25.0
    noise: Annotated[float, Meta(ge=0, le=1, description="m; standard deviation of a distance")] = 0.0
    bearing_noise_deg: Annotated[float, Meta(ge=0, le=45, description="degrees; standard deviation of a bearing")] = 0.0


class RadioSettings(Section, frozen=True, kw_only=True):
    """Who hears whom."""

    range: Annotated[float, _metres(0.1, 1e4, "how far a broadcast reaches")] = 8.0
    loss: Annotated[float, Meta(ge=0, le=1, description="share of broadcasts that do not arrive, drawn one by one")] = (
        0.0
    )
    line_of_sight: Annotated[bool, Meta(description="walls stop the radio")] = False
    every: Annotated[int, Meta(ge=1, le=100, description="a robot broadcasts each that many ticks")] = 4


class TrafficSettings(Section, frozen=True, kw_only=True):
    """The cells that robots hold: a cell is for who holds it."""

    cell: Annotated[
        float | None, Meta(description="m; side of the cells that are held; by default 6 radii, 4 at least")
    ] = None
    offset: Annotated[
        Coordinates | None, Meta(description="m; corner of cell 0 in the map's frame; by default what opens most ways")
    ] = None


class MoverSettings(Section, frozen=True, kw_only=True):
    """A moving obstacle, a disc (`radius`) or a box (`size`): on no map, seen only by the sensors."""

    waypoints: Annotated[list[Coordinates], Meta(min_length=2, max_length=1000, description="m")]
    speed: Annotated[float, Meta(gt=0, le=5, description="m/s")]
    radius: Annotated[float, _metres(0, 10, "of a disc")] | None = None
    size: Annotated[tuple[float, float], Meta(description="m; along its way and across, of a box")] | None = None
    loop: Annotated[bool, Meta(description="from the last waypoint to the first; otherwise there and back")] = False


class EditSettings(Section, frozen=True, kw_only=True):
    """Walls put up or taken away while the fleet runs, at a time that is known beforehand."""

    at: Annotated[float, Meta(gt=0, le=1e6, description="s since the run began")]
    kind: Annotated[Literal["wall", "obstacle", "free"], Meta(description="what the rectangle becomes")]
    low: Annotated[Coordinates, Meta(description="m; a corner")]
    high: Annotated[Coordinates, Meta(description="m; the opposite corner")]


class Settings(Section, frozen=True, kw_only=True):
    """The file's top level."""

    name: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{1,64}\Z", description="letters, digits and _ . : -")]
    map: MapSettings
    start: StartSettings
    targets: Annotated[list[Coordinates], Meta(max_length=1000, description="m; visited by all in this order")] = []
    own_targets: Annotated[
        list[Annotated[list[Coordinates], Meta(min_length=1, max_length=1000)]],
        Meta(max_length=1000, description="m; instead of `targets`: robot i visits the i-th list"),
    ] = []
    return_home: Annotated[bool, Meta(description="back to the own start at the end")] = True
    reach: Annotated[float, _metres(0, 10, "so near a stop counts as reached")] = 0.4
    robots: Annotated[int, Meta(ge=1, le=1000, description="how many, unless the command says otherwise")] = 1
    seed: Annotated[int, Meta(ge=0, le=2**53, description="draws starts, noise and radio loss")] = 1
    limit: Annotated[float, Meta(gt=0, le=1e6, description="s; simulated time after which the run is given up")] = 600.0
    rate: Annotated[float, Meta(ge=1, le=1000, description="Hz; control steps a second")] = 20.0
    controller: Annotated[
        str, Meta(description="a fuzzy profile: paper, careful, wall_following, or a profile file beside the scenario")
    ] = "paper"
    robot: RobotSettings = RobotSettings()
    sensors: SensorSettings = SensorSettings()
    radio: RadioSettings = RadioSettings()
    traffic: TrafficSettings = TrafficSettings()
    movers: Annotated[list[MoverSettings], Meta(max_length=200, description="moving obstacles")] = []
    edits: Annotated[list[EditSettings], Meta(max_length=200, description="walls that come and go by themselves")] = []
