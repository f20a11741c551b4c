"""The messages to and from one robot: sense, command, broadcast, state, plan."""

from typing import Annotated, Final

from msgspec import Meta, Struct

from swarm.messages.enums import Activity, Kind
from swarm.messages.fields import (
    Angle,
    Count,
    Headings,
    Id,
    Length,
    Message,
    Metres,
    Point,
    Scale,
    Seconds,
    Speed,
    Text,
    doc,
)
from swarm.messages.traffic import TrafficBroadcast

MOST_STOPS: Final = 1000  # that one robot is assigned
Believed = tuple[Metres, Metres, Angle, Length]  # m, m, rad, m: a pose, and how far off its place may be


class Edit(Message, frozen=True, kw_only=True, omit_defaults=True):
    """A change of the map while the fleet runs: all cells that a rectangle touches.

    The cells are those of the map (`packed`), in the map's own frame: rows and columns from ``floor(low / resolution)``
    up to, but not including, ``ceil(high / resolution)``, low and high being the least and the greatest coordinate of
    the rectangle's four corners there. So an edge that lies on a cell's edge does not touch the cell beyond it. At
    least one row and one column: a rectangle without width that lies on a cell's edge takes the higher one. For
    rounding, 1e-9 of a cell is added to low and taken from high.
    """

    kind: Annotated[Kind, doc("what the cells become")]
    low: Annotated[Point, doc("m; one corner")]
    high: Annotated[Point, doc("m; the opposite corner")]
    dry_run: Annotated[bool, doc("change nothing, only answer what the edit would do")] = False


class Assigned(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The targets that the world has given a robot instead of the scenario's own."""

    number: Annotated[Count, doc("its number in this run, from 1; a robot that took it over says this number")]
    stops: Annotated[list[Point], Meta(max_length=MOST_STOPS, description="m; in order; none: the robot is done")]
    home: Annotated[bool, doc("the last target is home")] = False
    headings: Annotated[
        Headings,
        Meta(max_length=MOST_STOPS, description="rad; for each stop, the yaw to turn to there; null or none: any"),
    ] = []


class Counted(Struct, frozen=True, kw_only=True):
    """The stops that the world has counted, for a robot that does not know its pose exactly."""

    assignment: Annotated[Count, doc("number of the targets that this is about; 0: the scenario's")]
    laps: Annotated[Count, doc("rounds of a patrol that are complete")]
    reached: Annotated[list[bool], doc("for each target of this round; home is the last one if the mission returns")]


class Sense(Message, frozen=True, kw_only=True):
    """Everything that the world tells one robot at one tick."""

    world: Annotated[Id, doc("identity of the world; a robot obeys only the world that welcomed it")]
    run: Annotated[Count, doc("increases with each restart; messages of an older run are void")]
    tick: Annotated[Count, doc("ticks since the run began")]
    time: Annotated[Seconds, doc("s; since the run began")]
    lockstep: Annotated[bool, doc("the world waits for this robot's command; the robot waits for all it `hears`")]
    x: Annotated[Metres, doc("m; the robot's centre in the map")]
    y: Annotated[Metres, doc("m")]
    yaw: Annotated[Angle, doc("rad; 0 along x, left is positive")]
    linear: Annotated[Speed, doc("m/s; forward speed, from the wheels' present speeds")]
    angular: Annotated[Speed, doc("rad/s; yaw rate, from the wheels' present speeds")]
    left: Annotated[Length, doc("m; free distance from the robot's edge: the nearest hit of the left sector's rays")]
    front: Annotated[Length, doc("m; the same of the front sector")]
    right: Annotated[Length, doc("m; the same of the right sector")]
    bearings: Annotated[
        list[Angle | None],
        doc("rad; of each *target*, home too, relative to the heading, left positive; null: out of sight"),
    ]
    hears: Annotated[
        list[tuple[Id, Count]],
        doc("broadcasts (robot, tick) that reach this robot: those of the tick before; it heeds no others"),
    ]
    rays: Annotated[
        list[Length],
        doc("m; free distance along each ray, from the robot's edge: left, front, right sector, each right to left"),
    ]
    edits_before: Annotated[Count, doc("number of edits before those in `edits`")] = 0
    edits: Annotated[list[Edit], doc("edits of the last second")] = []
    assigned: Annotated[
        Assigned | None, doc("new targets; repeated until the robot's command has their number, null then")
    ] = None
    stopped: Annotated[bool, doc("the world ignores the robot's wheel speeds and brakes, until the action `go_on`")] = (
        False
    )
    pose_error: Annotated[Length, doc("m; the true place is within this of (x, y) in 95 % of all cases; 0: exact")] = (
        0.0
    )
    yaw_error: Annotated[Angle, doc("rad; the true yaw is within this of `yaw` in 95 % of all cases; 0: exact")] = 0.0
    counted: Annotated[
        Counted | None,
        doc("the stops that count, by the world: the robot ticks off these and no others; null: it judges by its pose"),
    ] = None
    radius: Annotated[
        Length | None, doc("m; of its footprint while it carries a load; null: as its settings say, without a load")
    ] = None


class Took(Struct, frozen=True, kw_only=True):
    """What a robot stepped with, where that is not what the sense lists: a run is replayed from it."""

    heard: Annotated[list[tuple[Id, Count]], doc("broadcasts (robot, tick) that it heard before this step, in order")]
    edits: Annotated[Count | None, doc("of the map that it fetched before this step; null: it fetched none")] = None
    again: Annotated[bool, doc("it had answered this tick before: the world was started again, or missed it")] = False
    before: Annotated[
        list[tuple[Count, list[tuple[Id, Count]], Count | None]],
        doc("its last steps, whose answers may be lost with a router or a world: tick, `heard` and `edits` of each"),
    ] = []


class Command(Message, frozen=True, kw_only=True):
    """A robot's wheel speeds, and what the world must know about the robot at the same tick."""

    run: Annotated[Count, doc("run of the sense that it answers")]
    tick: Annotated[Count, doc("tick of the sense that it answers")]
    left: Annotated[Speed, doc("m/s; rim speed of the left wheel")]
    right: Annotated[Speed, doc("m/s; rim speed of the right wheel")]
    heading: Annotated[Angle, doc("rad; bearing of the aim that the fuzzy controller got; left is positive")]
    activity: Annotated[Activity, doc("what the robot is doing")]
    reached: Annotated[list[bool], doc("for each target; home is the last one if the mission returns")]
    unreachable: Annotated[list[Count], doc("targets given up because no path leads there")]
    held: Annotated[list[Count], doc("cells that it has reserved; the last is the head")] = []
    scale: Annotated[Scale, doc("the fuzzy controller got the sensed distances divided by this")] = 1.0
    unconstrained: Annotated[bool, doc("no robot is near: it reserves only the cells of its body and brake")] = False
    waits: Annotated[list[Id], doc("robots that it waits for, or that shut its way: silent, or told to stop")] = []
    members: Annotated[list[Id], doc("robots of the joint plan that it follows")] = []
    notes: Annotated[list[tuple[Id, Text]], doc("events: (kind, text)")] = []
    sent: Annotated[bool, doc("a broadcast of this tick was sent before this command")]
    replans: Annotated[Count, doc("paths planned so far")]
    assignment: Annotated[Count, doc("number of the targets that `reached` is about; 0: the scenario's")] = 0
    believed: Annotated[
        Believed | None, doc("m, m, rad, m; where it takes itself to be, and how far off that may be; null: as told")
    ] = None
    took: Annotated[
        Took | None, doc("what it stepped with, if not what the sense lists; a robot need not say it: null")
    ] = None


class BodyReport(Message, frozen=True, kw_only=True):
    """Where the body of a robot is that is outside the world, as a real one is, after it has carried out a command."""

    run: Annotated[Count, doc("run of the command that it has carried out")]
    tick: Annotated[Count, doc("tick of that command; the pose is that of the next tick")]
    x: Annotated[Metres, doc("m; the robot's centre in the map")]
    y: Annotated[Metres, doc("m")]
    yaw: Annotated[Angle, doc("rad; 0 along x, left is positive")]
    left: Annotated[Speed, doc("m/s; rim speed of the left wheel now")]
    right: Annotated[Speed, doc("m/s; rim speed of the right wheel now")]
    rays: Annotated[
        list[Length], Meta(max_length=297, description="m; as in `sense`, all of them; none: the world casts them")
    ] = []
    pose_error: Annotated[Length, doc("m; how good the place is, as in `sense`; 0: exact")] = 0.0
    yaw_error: Annotated[Angle, doc("rad; how good the yaw is, as in `sense`; 0: exact")] = 0.0


class Broadcast(Message, frozen=True, kw_only=True):
    """What a robot sends by radio: position, distance to the target, targets reached (paper 3.1), and traffic."""

    robot: Annotated[Id, doc("who speaks")]
    run: Annotated[Count, doc("run of the sense after which it was sent")]
    tick: Annotated[Count, doc("tick of the sense after which it was sent")]
    x: Annotated[Metres, doc("m; position")]
    y: Annotated[Metres, doc("m")]
    yaw: Annotated[Angle, doc("rad")]
    activity: Annotated[Activity, doc("what the robot is doing")]
    target: Annotated[Count, doc("index of the target it drives to; the number of targets when all are reached")]
    distance: Annotated[Length, doc("m; to that target, along its path")]
    reached: Annotated[list[bool], doc("for each target; home is the last one if the mission returns")]
    traffic: Annotated[
        TrafficBroadcast | None, doc("reservations, acknowledgements and joint plans of the sender and of others")
    ] = None
    walls: Annotated[
        list[Count], doc("cells it has learned to be solid (row * columns + column), where the map is unknown")
    ] = []


class State(Message, frozen=True, kw_only=True):
    """The progress of one robot's mission: sent on change and once a second of the run's clock."""

    robot: Annotated[Id, doc("whose mission")]
    run: Annotated[Count, doc("increases with each restart")]
    tick: Annotated[Count, doc("ticks since the run began")]
    activity: Annotated[Activity, doc("what the robot is doing")]
    target: Annotated[Count, doc("index of the target it drives to; the number of targets when all are reached")]
    reached: Annotated[list[bool], doc("for each target; home is the last one if the mission returns")]
    unreachable: Annotated[list[Count], doc("targets given up because no path leads there")]
    distance: Annotated[Length, doc("m; to the target, along its path")]
    replans: Annotated[Count, doc("paths planned so far")]
    laps: Annotated[Count, doc("rounds of a patrol that are complete")] = 0
    assignment: Annotated[Count, doc("number of the targets that `reached` is about; 0: the scenario's")] = 0
    waits: Annotated[list[Id], doc("robots that it waits for, or that shut its way")] = []


class Plan(Message, frozen=True, kw_only=True):
    """The path that a robot follows now."""

    robot: Annotated[Id, doc("whose path")]
    run: Annotated[Count, doc("increases with each restart")]
    tick: Annotated[Count, doc("ticks since the run began")]
    points: Annotated[list[Point], doc("m; from its position to its stop")]
