"""What one robot is told and what it tells: sense, command, broadcast, state, plan."""

from typing import Annotated

from swarm.messages.enums import Activity, Kind
from swarm.messages.fields import Angle, Count, Id, Length, Message, Metres, Point, Scale, Seconds, Speed, Text, says
from swarm.messages.traffic import TrafficBroadcast


class Edit(Message, frozen=True, kw_only=True):
    """Walls added or removed while the fleet runs: all cells of the map that a rectangle touches."""

    kind: Annotated[Kind, says("what the cells become")]
    low: Annotated[Point, says("m; one corner")]
    high: Annotated[Point, says("m; the opposite corner")]


class Sense(Message, frozen=True, kw_only=True):
    """What the world lets one robot know at one tick."""

    run: Annotated[Count, says("goes up with each restart; everything of an older run is void")]
    tick: Annotated[Count, says("ticks since the run began")]
    time: Annotated[Seconds, says("s; since the run began")]
    lockstep: Annotated[bool, says("the world waits for this robot's command, the robot for all that it `hears`")]
    x: Annotated[Metres, says("m; the robot's middle in the map")]
    y: Annotated[Metres, says("m")]
    yaw: Annotated[Angle, says("rad; 0 along x, left is positive")]
    linear: Annotated[Speed, says("m/s; as the wheels turn now")]
    angular: Annotated[Speed, says("rad/s; as the wheels turn now")]
    left: Annotated[Length, says("m; free distance from the robot's edge: the nearest hit of the left sector's rays")]
    front: Annotated[Length, says("m; the same of the front sector")]
    right: Annotated[Length, says("m; the same of the right sector")]
    bearings: Annotated[list[Angle | None], says("rad; of each stop, null where it is out of sight")]
    hears: Annotated[list[tuple[Id, Count]], says("broadcasts (robot, tick) that reach this robot")]
    rays: Annotated[list[Length], says("m; every ray of the left, front and right sector in turn")]
    edits_before: Annotated[Count, says("how many edits there have been before those in `edits`")] = 0
    edits: Annotated[list[Edit], says("edits of the last second")] = []


class Command(Message, frozen=True, kw_only=True):
    """What a robot's wheels shall do, and what the world must know at the same tick."""

    run: Annotated[Count, says("of the sense that it answers")]
    tick: Annotated[Count, says("of the sense that it answers")]
    left: Annotated[Speed, says("m/s; rim speed of the left wheel")]
    right: Annotated[Speed, says("m/s; rim speed of the right wheel")]
    heading: Annotated[Angle, says("rad; what the fuzzy controller was asked to turn towards; left is positive")]
    activity: Annotated[Activity, says("what the robot is doing")]
    reached: Annotated[list[bool], says("of each stop: the targets, then home where the mission returns")]
    unreachable: Annotated[list[Count], says("stops given up because no path led there")]
    held: Annotated[list[Count], says("cells that it holds; the last is the head")] = []
    scale: Annotated[Scale, says("the fuzzy controller was told the sensed distances divided by this")] = 1.0
    unconstrained: Annotated[bool, says("nobody is near: it holds whatever cells its body and brake need")] = False
    waits: Annotated[list[Id], says("robots that it waits for")] = []
    members: Annotated[list[Id], says("robots of the joint plan that it follows")] = []
    notes: Annotated[list[tuple[Id, Text]], says("what happened: kind, in words")] = []
    sent: Annotated[bool, says("a broadcast of this tick was put on the radio before this")]
    replans: Annotated[Count, says("paths planned so far")]


class Broadcast(Message, frozen=True, kw_only=True):
    """The paper's radio (section 3.1): position, how far from the target, whether reached; and what it is about."""

    robot: Annotated[Id, says("who speaks")]
    run: Annotated[Count, says("of the sense that it was said at")]
    tick: Annotated[Count, says("of the sense that it was said at")]
    x: Annotated[Metres, says("m; position")]
    y: Annotated[Metres, says("m")]
    yaw: Annotated[Angle, says("rad")]
    activity: Annotated[Activity, says("what the robot is doing")]
    target: Annotated[Count, says("index of the stop it drives to; the number of stops when all are reached")]
    distance: Annotated[Length, says("m; to that stop, along its path")]
    reached: Annotated[list[bool], says("of each stop")]
    traffic: Annotated[
        TrafficBroadcast | None, says("reservations, acknowledgements and joint plans, of the sender and of others")
    ] = None
    walls: Annotated[
        list[Count], says("cells it has learned to be solid (row * columns + column), where the map is unknown")
    ] = []


class State(Message, frozen=True, kw_only=True):
    """Where one robot's mission stands: on change and at least once a second."""

    robot: Annotated[Id, says("whose mission")]
    run: Annotated[Count, says("goes up with each restart")]
    tick: Annotated[Count, says("ticks since the run began")]
    activity: Annotated[Activity, says("what the robot is doing")]
    target: Annotated[Count, says("index of the stop it drives to; the number of stops when all are reached")]
    reached: Annotated[list[bool], says("of each stop: the targets, then home where the mission returns")]
    unreachable: Annotated[list[Count], says("stops given up because no path led there")]
    distance: Annotated[Length, says("m; to the stop, along its path")]
    replans: Annotated[Count, says("paths planned so far")]


class Plan(Message, frozen=True, kw_only=True):
    """The path that a robot follows now."""

    robot: Annotated[Id, says("whose path")]
    run: Annotated[Count, says("goes up with each restart")]
    tick: Annotated[Count, says("ticks since the run began")]
    points: Annotated[list[Point], says("m; from where it stands to its stop")]
