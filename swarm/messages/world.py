"""What the world tells everybody: truth, clock, events, map; and what it is asked: action, edit, join."""

from typing import Annotated, Any

from swarm.messages.enums import Activity, Do, Phase, Steering
from swarm.messages.fields import Angle, Count, Id, Length, Message, Metres, Scale, Seconds, Speed, Text, says
from swarm.messages.robot import State


class Body(Message, frozen=True, kw_only=True):
    """One robot as the world knows it."""

    robot: Annotated[Id, says("its name")]
    x: Annotated[Metres, says("m; its middle in the map")]
    y: Annotated[Metres, says("m")]
    yaw: Annotated[Angle, says("rad; 0 along x, left is positive")]
    left_v: Annotated[Speed, says("m/s; rim speed of the left wheel now")]
    right_v: Annotated[Speed, says("m/s; rim speed of the right wheel now")]
    left: Annotated[Length, says("m; free distance in the left sector")]
    front: Annotated[Length, says("m; free distance in the front sector")]
    right: Annotated[Length, says("m; free distance in the right sector")]
    heading: Annotated[Angle, says("rad; of its last command, as is everything below")]
    steering: Annotated[Steering | None, says("what became of the tables' speeds; null: no command is in force")]
    activity: Annotated[Activity, says("what the robot is doing")]
    scale: Annotated[Scale, says("the fuzzy controller was told the sensed distances divided by this")] = 1.0
    held: Annotated[list[Count], says("cells that it holds; the last is the head")] = []
    waits: Annotated[list[Id], says("robots that it waits for")] = []
    members: Annotated[list[Id], says("robots of the joint plan that it follows")] = []


class Mover(Message, frozen=True, kw_only=True):
    """A moving obstacle, as the world knows it: a disc, or a box along its way."""

    x: Annotated[Metres, says("m; its middle in the map")]
    y: Annotated[Metres, says("m")]
    yaw: Annotated[Angle, says("rad; the way it moves")]
    radius: Annotated[Length, says("m; 0 for a box")]
    size: Annotated[tuple[Length, Length], says("m; along and across; (0, 0) for a disc")]


class Truth(Message, frozen=True, kw_only=True):
    """All bodies at one tick, for those who watch; robots never hear it."""

    run: Annotated[Count, says("goes up with each restart")]
    tick: Annotated[Count, says("ticks since the run began")]
    time: Annotated[Seconds, says("s; since the run began")]
    bodies: Annotated[list[Body], says("all robots, in the order of their numbers")]
    movers: Annotated[list[Mover], says("moving obstacles")] = []


class Clock(Message, frozen=True, kw_only=True):
    """Where the run stands: on change and once a second."""

    run: Annotated[Count, says("goes up with each restart")]
    tick: Annotated[Count, says("ticks since the run began")]
    time: Annotated[Seconds, says("s; since the run began")]
    phase: Annotated[Phase, says("where the run stands")]
    robots: Annotated[list[Id], says("all that belong to the run")]
    present: Annotated[list[Id], says("those whose process is there now")]


class Event(Message, frozen=True, kw_only=True):
    """Something worth a line."""

    run: Annotated[Count, says("goes up with each restart")]
    tick: Annotated[Count, says("ticks since the run began")]
    time: Annotated[Seconds, says("s; since the run began")]
    robot: Annotated[Id | None, says("whom it is about; null: the whole run")]
    kind: Annotated[Id, says("one word")]
    text: Annotated[Text, says("in words, for people")]


class Map(Message, frozen=True, kw_only=True):
    """What stands still: the map, the scenario's settings and the fuzzy profile."""

    packed: Annotated[dict[str, Any], says("the map: rows, columns, cells, resolution, origin (`swarm/maps/wire.py`)")]
    scenario: Annotated[dict[str, Any], says("`settings`, as in a scenario file, `profile` and `starts`")]
    edits: Annotated[Count, says("edits that are in it")] = 0


class Action(Message, frozen=True, kw_only=True):
    """One of the buttons."""

    do: Annotated[Do, says("which one")]


class Join(Message, frozen=True, kw_only=True):
    """A robot process asks for its place in the fleet."""

    robot: Annotated[Id | None, says("which place; null: whichever is free")]


class Welcome(Message, frozen=True, kw_only=True):
    """The place: which robot it is, what the scenario says, and where that robot's mission stood."""

    robot: Annotated[Id, says("its name from now on")]
    scenario: Annotated[dict[str, Any], says("`settings`, as in a scenario file, and `profile`")]
    packed: Annotated[dict[str, Any], says("the map, as in Map")]
    edits: Annotated[Count, says("edits that are in the map")]
    start: Annotated[tuple[Metres, Metres, Angle], says("m, m, rad; its pose when the run began: home")]
    state: Annotated[State | None, says("where its mission stood, if it has been there before")]


class Accepted(Message, frozen=True, kw_only=True):
    """Done as asked."""

    text: Annotated[Text, says("in words, for people")]
