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
    says,
)
from swarm.messages.traffic import TrafficBroadcast

MOST_STOPS: Final = 1000  # that one robot is assigned


class Edit(Message, frozen=True, kw_only=True, omit_defaults=True):
    """A change of the map while the fleet runs: all cells that a rectangle touches.

    The cells are those of the map (`packed`), in the map's own frame: rows and columns from ``floor(low / resolution)``
    up to, but not including, ``ceil(high / resolution)``, low and high being the least and the greatest coordinate of
    the rectangle's four corners there. So an edge that lies on a cell's edge does not touch the cell beyond it. At
    least one row and one column: a rectangle without width that lies on a cell's edge takes the higher one. For
    rounding, 1e-9 of a cell is added to low and taken from high.
    """

    kind: Annotated[Kind, says("what the cells become")]
    low: Annotated[Point, says("m; one corner")]
    high: Annotated[Point, says("m; the opposite corner")]
    dry_run: Annotated[bool, says("change nothing, only answer what the edit would do")] = False


class Assigned(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The targets that the world has given a robot instead of the scenario's own."""

    number: Annotated[Count, says("its number in this run, from 1; a robot that took it over says this number")]
    stops: Annotated[list[Point], Meta(max_length=MOST_STOPS, description="m; in order; none: the robot is done")]
    home: Annotated[bool, says("the last target is home")] = False
    headings: Annotated[
        Headings,
        Meta(max_length=MOST_STOPS, description="rad; for each stop, the yaw to turn to there; null or none: any"),
    ] = []


class Sense(Message, frozen=True, kw_only=True):
    """Everything that the world tells one robot at one tick."""

    world: Annotated[Id, says("identity of the world; a robot obeys only the world that welcomed it")]
    run: Annotated[Count, says("increases with each restart; messages of an older run are void")]
    tick: Annotated[Count, says("ticks since the run began")]
    time: Annotated[Seconds, says("s; since the run began")]
    lockstep: Annotated[bool, says("the world waits for this robot's command; the robot waits for all it `hears`")]
    x: Annotated[Metres, says("m; the robot's centre in the map")]
    y: Annotated[Metres, says("m")]
    yaw: Annotated[Angle, says("rad; 0 along x, left is positive")]
    linear: Annotated[Speed, says("m/s; forward speed, from the wheels' present speeds")]
    angular: Annotated[Speed, says("rad/s; yaw rate, from the wheels' present speeds")]
    left: Annotated[Length, says("m; free distance from the robot's edge: the nearest hit of the left sector's rays")]
    front: Annotated[Length, says("m; the same of the front sector")]
    right: Annotated[Length, says("m; the same of the right sector")]
    bearings: Annotated[
        list[Angle | None],
        says("rad; of each *target*, home too, relative to the heading, left positive; null: out of sight"),
    ]
    hears: Annotated[
        list[tuple[Id, Count]],
        says("broadcasts (robot, tick) that reach this robot: those of the tick before; it heeds no others"),
    ]
    rays: Annotated[
        list[Length],
        says("m; free distance along each ray, from the robot's edge: left, front, right sector, each right to left"),
    ]
    edits_before: Annotated[Count, says("number of edits before those in `edits`")] = 0
    edits: Annotated[list[Edit], says("edits of the last second")] = []
    assigned: Annotated[
        Assigned | None, says("new targets; repeated until the robot's command has their number, null then")
    ] = None
    stopped: Annotated[
        bool, says("the world ignores the robot's wheel speeds and brakes, until the action `go_on`")
    ] = False


class Took(Struct, frozen=True, kw_only=True):
    """What a robot stepped with, where that is not what the sense lists: a run is replayed from it."""

    heard: Annotated[list[tuple[Id, Count]], says("broadcasts (robot, tick) that it heard before this step, in order")]
    edits: Annotated[Count | None, says("of the map that it fetched before this step; null: it fetched none")] = None
    again: Annotated[bool, says("it had answered this tick before: the world was started again, or missed it")] = False
    before: Annotated[
        list[tuple[Count, list[tuple[Id, Count]], Count | None]],
        says("its last steps, whose answers may be lost with a router or a world: tick, `heard` and `edits` of each"),
    ] = []


class Command(Message, frozen=True, kw_only=True):
    """A robot's wheel speeds, and what the world must know about the robot at the same tick."""

    run: Annotated[Count, says("run of the sense that it answers")]
    tick: Annotated[Count, says("tick of the sense that it answers")]
    left: Annotated[Speed, says("m/s; rim speed of the left wheel")]
    right: Annotated[Speed, says("m/s; rim speed of the right wheel")]
    heading: Annotated[Angle, says("rad; bearing of the aim that the fuzzy controller got; left is positive")]
    activity: Annotated[Activity, says("what the robot is doing")]
    reached: Annotated[list[bool], says("for each target; home is the last one if the mission returns")]
    unreachable: Annotated[list[Count], says("targets given up because no path leads there")]
    held: Annotated[list[Count], says("cells that it has reserved; the last is the head")] = []
    scale: Annotated[Scale, says("the fuzzy controller got the sensed distances divided by this")] = 1.0
    unconstrained: Annotated[bool, says("no robot is near: it reserves only the cells of its body and brake")] = False
    waits: Annotated[list[Id], says("robots that it waits for, or that shut its way: silent, or told to stop")] = []
    members: Annotated[list[Id], says("robots of the joint plan that it follows")] = []
    notes: Annotated[list[tuple[Id, Text]], says("events: (kind, text)")] = []
    sent: Annotated[bool, says("a broadcast of this tick was sent before this command")]
    replans: Annotated[Count, says("paths planned so far")]
    assignment: Annotated[Count, says("number of the targets that `reached` is about; 0: the scenario's")] = 0
    took: Annotated[
        Took | None, says("what it stepped with, if not what the sense lists; a robot need not say it: null")
    ] = None


class BodyReport(Message, frozen=True, kw_only=True):
    """Where the body of a robot is that is outside the world, as a real one is, after it has carried out a command."""

    run: Annotated[Count, says("run of the command that it has carried out")]
    tick: Annotated[Count, says("tick of that command; the pose is that of the next tick")]
    x: Annotated[Metres, says("m; the robot's centre in the map")]
    y: Annotated[Metres, says("m")]
    yaw: Annotated[Angle, says("rad; 0 along x, left is positive")]
    left: Annotated[Speed, says("m/s; rim speed of the left wheel now")]
    right: Annotated[Speed, says("m/s; rim speed of the right wheel now")]
    rays: Annotated[
        list[Length], Meta(max_length=297, description="m; as in `sense`, all of them; none: the world casts them")
    ] = []


class Broadcast(Message, frozen=True, kw_only=True):
    """What a robot sends by radio: position, distance to the target, targets reached (paper 3.1), and traffic."""

    robot: Annotated[Id, says("who speaks")]
    run: Annotated[Count, says("run of the sense after which it was sent")]
    tick: Annotated[Count, says("tick of the sense after which it was sent")]
    x: Annotated[Metres, says("m; position")]
    y: Annotated[Metres, says("m")]
    yaw: Annotated[Angle, says("rad")]
    activity: Annotated[Activity, says("what the robot is doing")]
    target: Annotated[Count, says("index of the target it drives to; the number of targets when all are reached")]
    distance: Annotated[Length, says("m; to that target, along its path")]
    reached: Annotated[list[bool], says("for each target; home is the last one if the mission returns")]
    traffic: Annotated[
        TrafficBroadcast | None, says("reservations, acknowledgements and joint plans of the sender and of others")
    ] = None
    walls: Annotated[
        list[Count], says("cells it has learned to be solid (row * columns + column), where the map is unknown")
    ] = []


class State(Message, frozen=True, kw_only=True):
    """The progress of one robot's mission: sent on change and once a second of the run's clock."""

    robot: Annotated[Id, says("whose mission")]
    run: Annotated[Count, says("increases with each restart")]
    tick: Annotated[Count, says("ticks since the run began")]
    activity: Annotated[Activity, says("what the robot is doing")]
    target: Annotated[Count, says("index of the target it drives to; the number of targets when all are reached")]
    reached: Annotated[list[bool], says("for each target; home is the last one if the mission returns")]
    unreachable: Annotated[list[Count], says("targets given up because no path leads there")]
    distance: Annotated[Length, says("m; to the target, along its path")]
    replans: Annotated[Count, says("paths planned so far")]
    laps: Annotated[Count, says("rounds of a patrol that are complete")] = 0
    assignment: Annotated[Count, says("number of the targets that `reached` is about; 0: the scenario's")] = 0
    waits: Annotated[list[Id], says("robots that it waits for, or that shut its way")] = []


class Plan(Message, frozen=True, kw_only=True):
    """The path that a robot follows now."""

    robot: Annotated[Id, says("whose path")]
    run: Annotated[Count, says("increases with each restart")]
    tick: Annotated[Count, says("ticks since the run began")]
    points: Annotated[list[Point], says("m; from its position to its stop")]
