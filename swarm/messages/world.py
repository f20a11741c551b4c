"""The messages of the world (truth, clock, events, map) and the requests to it (action, join)."""

from typing import Annotated, NamedTuple

from msgspec import Meta

from swarm.messages.enums import Activity, Do, Liveness, Phase, RobotDo, Steering
from swarm.messages.fields import (
    Angle,
    Count,
    Drawing,
    Headings,
    Id,
    Length,
    Message,
    Metres,
    OptionalId,
    Point,
    Scale,
    Seconds,
    Sender,
    Speed,
    Text,
    Travel,
    doc,
)
from swarm.messages.floor import PackedMap, ScenarioOnWire
from swarm.messages.robot import MOST_STOPS, Assigned, Believed, State
from swarm.settings import HowMany


class Body(Message, frozen=True, kw_only=True):
    """The true state of one robot."""

    robot: Annotated[Id, doc("its name")]
    x: Annotated[Metres, doc("m; its centre in the map")]
    y: Annotated[Metres, doc("m")]
    yaw: Annotated[Angle, doc("rad; 0 along x, left is positive")]
    left_v: Annotated[Speed, doc("m/s; rim speed of the left wheel now")]
    right_v: Annotated[Speed, doc("m/s; rim speed of the right wheel now")]
    left: Annotated[Length, doc("m; free distance in the left sector")]
    front: Annotated[Length, doc("m; free distance in the front sector")]
    right: Annotated[Length, doc("m; free distance in the right sector")]
    heading: Annotated[Angle, doc("rad; from its last command, as are all fields below")]
    steering: Annotated[Steering | None, doc("how its command differs from the tables' speeds; null: no command")]
    activity: Annotated[Activity, doc("what the robot is doing")]
    scale: Annotated[Scale, doc("the fuzzy controller got the sensed distances divided by this")] = 1.0
    held: Annotated[list[Count], doc("cells that it has reserved; the last is the head")] = []
    waits: Annotated[list[Id], doc("robots that it waits for")] = []
    members: Annotated[list[Id], doc("robots of the joint plan that it follows")] = []
    believed: Annotated[
        Believed | None,
        doc("m, m, rad, m; where it takes itself to be, and how far off that may be; null: here"),
    ] = None
    radius: Annotated[Length, doc("m; of its footprint while it carries a load; 0: that of its kind")] = 0.0


class Mover(Message, frozen=True, kw_only=True):
    """The true state of a moving obstacle: a disc, or a box aligned with its way."""

    x: Annotated[Metres, doc("m; its centre in the map")]
    y: Annotated[Metres, doc("m")]
    yaw: Annotated[Angle, doc("rad; its direction of motion")]
    radius: Annotated[Length, doc("m; 0 for a box")]
    size: Annotated[tuple[Length, Length], doc("m; along and across; (0, 0) for a disc")]


class Truth(Message, frozen=True, kw_only=True):
    """The true state of all bodies at one tick, for the dashboard; robots never receive it."""

    run: Annotated[Count, doc("increases with each restart")]
    tick: Annotated[Count, doc("ticks since the run began")]
    time: Annotated[Seconds, doc("s; since the run began")]
    bodies: Annotated[list[Body], doc("all robots, in the order of their numbers")]
    movers: Annotated[list[Mover], doc("moving obstacles")] = []


class Seen(NamedTuple):
    """Whether a robot is there, and since when."""

    liveness: Annotated[Liveness, doc("whether its process is there and speaks")]
    since: Annotated[Seconds, doc("s; time of the run at which that began; 0: before the run")]


class PoolCounts(Message, frozen=True, kw_only=True):
    """How many targets of the pool are given, under way, waiting and done."""

    given: Annotated[Count, doc("targets that were ever put in")]
    done: Annotated[Count, doc("those that a robot has been at")]
    taken: Annotated[Count, doc("those that a robot drives to")]
    waiting: Annotated[Count, doc("those that no robot has")]


class Clock(Message, frozen=True, kw_only=True):
    """The state of the run: sent on change and once a second; one that says `over` is the last message of its run."""

    run: Annotated[Count, doc("increases with each restart")]
    tick: Annotated[Count, doc("ticks since the run began")]
    time: Annotated[Seconds, doc("s; since the run began")]
    phase: Annotated[Phase, doc("phase of the run")]
    robots: Annotated[list[Id], doc("all robots of the run")]
    present: Annotated[list[Id], doc("robots whose process is connected now")]
    presence: Annotated[dict[Id, Seen], doc("whether each robot is there, and since when")] = {}
    pool: Annotated[PoolCounts | None, doc("targets for any robot; null: there were none")] = None


class Event(Message, frozen=True, kw_only=True):
    """Something that happened in a run, in a line for people."""

    run: Annotated[Count, doc("increases with each restart")]
    tick: Annotated[Count, doc("ticks since the run began")]
    time: Annotated[Seconds, doc("s; since the run began")]
    robot: Annotated[Id | None, doc("the robot that it is about; null: the whole run")]
    kind: Annotated[Id, doc("one word")]
    text: Annotated[Text, doc("what happened, for people")]
    at: Annotated[tuple[Metres, Metres] | None, doc("m; where in the map; null: not told")] = None
    request: Annotated[
        Id | None, doc("id of the order or pool request of which the text has only the first 8 of 32 hex digits")
    ] = None


class Events(Message, frozen=True, kw_only=True):
    """The last 100 events, also of the runs before."""

    events: Annotated[list[Event], doc("in their order, the newest last")]


class Account(Message, frozen=True, kw_only=True):
    """What the world has measured of one robot so far: in the report it has the same names."""

    targets: Annotated[Count, doc("targets that it has")]
    reached: Annotated[list[Seconds | None], doc("s; when it reached each target; null: not yet")]
    laps: Annotated[Count, doc("of a patrol, complete")]
    path_length: Annotated[Travel, doc("m; driven, from the poses of all ticks")]
    shortest_length: Annotated[
        Travel | None, doc("m; through all targets, for a robot alone; null: it has no path, or the run is not over")
    ]
    waiting: Annotated[Seconds, doc("s; during which it gave way or had no path")]
    waits_for: Annotated[
        dict[Id, Seconds], doc("s; of these, for each robot: the 20 longest; with two at a time, for both")
    ]
    replans: Annotated[Count, doc("paths planned after the first")]
    contacts: Annotated[Count, doc("with robots, walls and obstacles")]
    struck: Annotated[Count, doc("those that began while it stood still")]
    stalled: Annotated[Count, doc("times that it made no progress for long")]
    unreachable: Annotated[list[Count], doc("targets that it has given up")]
    standing: Annotated[
        Seconds, doc("s; during which its wheels stood, with a target left and not told to stop, whatever it said")
    ] = 0.0


class RobotStatus(Message, frozen=True, kw_only=True):
    """All that is known of one robot; of one that is not there, what was known last."""

    robot: Annotated[Id, doc("its name")]
    liveness: Annotated[Liveness, doc("whether its process is there and speaks")]
    since: Annotated[Seconds, doc("s; time of the run at which that began; 0: before the run")]
    pose: Annotated[tuple[Metres, Metres, Angle], doc("m, m, rad; its true pose")]
    state: Annotated[State, doc("its progress; before it has spoken, as the world has recorded it")]
    waits: Annotated[list[Id], doc("robots that it waits for, or that shut its way")]
    event: Annotated[Event | None, doc("its last event of this run; null: it has none among the last 100")]
    account: Annotated[Account | None, doc("what the world has measured")] = None
    why: Annotated[Text, doc("what it waits for, for people: who stands where; empty: nothing, or not known")] = ""
    mission: Annotated[Text, doc("what its targets are of, for people: the scenario, an order, the pool")] = ""
    stops: Annotated[list[Point], doc("m; the targets that it has now, in order: the first 20; home is the last")] = []
    home: Annotated[bool, doc("the last of all its targets is home")] = False


class Status(Message, frozen=True, kw_only=True):
    """The run in one message, as JSON: sent at each change of the phase, the end included, and kept for a `get`."""

    scenario: Annotated[Text, doc("name of the scenario")]
    run: Annotated[Count, doc("increases with each restart")]
    tick: Annotated[Count, doc("ticks since the run began")]
    time: Annotated[Seconds, doc("s; since the run began")]
    phase: Annotated[Phase, doc("phase of the run")]
    complete: Annotated[bool, doc("every robot has been at all its targets")]
    reason: Annotated[Text, doc("why a run that is over is not complete; else empty")]
    edits: Annotated[Count, doc("number of edits of the map so far")]
    robots: Annotated[list[RobotStatus], doc("all robots, in the order of their numbers")]
    events: Annotated[list[Event], doc("the last 100 events, the newest last")]
    pool: Annotated[PoolCounts | None, doc("targets for any robot; null: there were none")] = None
    contacts: Annotated[dict[Id, Count], doc("with robots, walls and obstacles; two robots that touch: one")] = {}
    clearance_min: Annotated[Metres | None, doc("m; smallest gap so far; null: there was nothing to touch")] = None
    world: Annotated[Id | None, doc("identity of the world; that of another one is another")] = None


class Map(Message, frozen=True, kw_only=True):
    """The map, the scenario's settings and the fuzzy profile."""

    packed: Annotated[PackedMap, doc("the map")]
    scenario: Annotated[ScenarioOnWire, doc("the settings, the fuzzy profile and the start of each robot")]
    edits: Annotated[Count, doc("number of edits that the map includes")] = 0


class Action(Message, frozen=True, kw_only=True):
    """A request of a user: one of the buttons."""

    do: Annotated[Do, doc("which one")]
    id: Annotated[Id | None, doc("name of the request: the same one said again is carried out once")] = None


class Order(Message, frozen=True, kw_only=True):
    """A request of a user: the targets of one robot from now on, instead of those that it has."""

    id: Annotated[Id, doc("name of the order, chosen by who gives it; the same order said again changes nothing")]
    update: Annotated[Count, doc("version of the order: a higher one replaces a lower one")] = 0
    targets: Annotated[list[Point], Meta(max_length=MOST_STOPS, description="m; in order; at most 100 are accepted")]
    home: Annotated[bool, doc("drive home after the last target")] = False
    headings: Annotated[
        Headings,
        Meta(max_length=MOST_STOPS, description="rad; for each target, the yaw to turn to there; null or none: any"),
    ] = []


class RobotAction(Message, frozen=True, kw_only=True):
    """A request of a user to one robot."""

    do: Annotated[RobotDo, doc("which one")]
    radius: Annotated[
        Length | None, doc("m; of `load`: the footprint's radius from now on; null: that of its kind, without a load")
    ] = None


class PoolTargets(Message, frozen=True, kw_only=True):
    """A request of a user: targets for the pool. Each is visited once, by any robot that is free."""

    id: Annotated[Id, doc("name of the request; the same one said again changes nothing")]
    targets: Annotated[list[Point], Meta(max_length=MOST_STOPS, description="m; at most 100 are accepted")]


class Places(Message, frozen=True, kw_only=True):
    """A request of a user: places for more robots in a fleet that stays. They wait for processes to take them."""

    id: Annotated[Id, doc("name of the request; the same one said again changes nothing")]
    count: Annotated[Count, doc("how many; a fleet has at most 1000 robots")]
    at: Annotated[
        list[tuple[Metres, Metres, Angle]],
        Meta(max_length=MOST_STOPS, description="m, m, rad; starts of the first ones; the world finds the others"),
    ] = []
    kind: Annotated[
        OptionalId, doc("what they are: one of the scenario's `kinds`; empty: a fleet without kinds has one")
    ] = ""


Share = Annotated[float, Meta(gt=0, le=1)]
Cell = Annotated[float, Meta(gt=0, le=10)]
Starts = Annotated[list[tuple[Metres, Metres, Angle]], Meta(max_length=1000)]
Stops = Annotated[list[Point], Meta(max_length=MOST_STOPS)]


class Setup(Message, frozen=True, kw_only=True):
    """What a fleet drives, without a file: the paper's box. A ``get`` has it as it is; in a request null keeps a part.

    What a ``get`` cannot say is null, so its answer is a request that changes nothing of the mission. An accepted
    request starts the fleet again: nothing is reached, robots that were added later are gone, and it waits for ``go``.
    """

    scenario: Annotated[Id | None, doc("its name; in a request: one that comes with the project, or that of now")]
    robots: Annotated[
        Count | None, doc("how many; null with `starts`: one at each; with another scenario: its number")
    ] = None
    mix: Annotated[
        dict[Id, HowMany] | None, doc("how many of each kind, instead of `robots`; null: the scenario has no kinds")
    ] = None
    speed: Annotated[
        Share | None,
        doc("share of the paper's wheel speeds (0..4 m/s) for all; null in a `get`: each kind has its own"),
    ] = None
    starts: Annotated[Starts | None, doc("m, m, rad; of the robots; null in a `get`: on a circle")] = None
    targets: Annotated[Stops | None, doc("m; each robot visits all in order; null in a `get`: each has its own")] = None
    map: Annotated[
        Drawing | None,
        doc("`#` wall, `o` obstacle, `.` free; the first line is the top; null in a `get`: a file, or too large"),
    ] = None
    cell: Annotated[Cell | None, doc("m; side of a character of `map`")] = None


class Join(Message, frozen=True, kw_only=True):
    """A robot process's request for a place in the fleet."""

    robot: Annotated[Id | None, doc("the place; null: any free one")]
    session: Annotated[Id, doc("Zenoh session of the process: its token `alive/robot/<id>/<session>` takes the place")]
    world: Annotated[Id | None, doc("identity of the world whose run this robot is in; null: it remembers nothing")]
    sender: Annotated[
        Sender | None, doc("what is attached to its messages: the world takes no others in its name; null: any")
    ] = None
    code: Annotated[
        Id | None,
        doc("fingerprint of its code; if it is not the world's, the tape keeps all that the robot says"),
    ] = None


class Leave(Message, frozen=True, kw_only=True):
    """A robot process gives its place back: its body stays where it stands until a process takes the place again."""

    robot: Annotated[Id, doc("the place")]
    session: Annotated[Id, doc("Zenoh session of the process that has the place")]


class Welcome(Message, frozen=True, kw_only=True):
    """The answer to a join: the robot's name, the scenario, the map, and the progress of that robot's mission."""

    robot: Annotated[Id, doc("name of the robot")]
    world: Annotated[Id, doc("identity of the world; a robot that is in a run of the same one goes on with it")]
    session: Annotated[Id, doc("Zenoh session of the world: it has the token `alive/world/world/<session>`")]
    scenario: Annotated[ScenarioOnWire, doc("the settings and the fuzzy profile")]
    packed: Annotated[PackedMap, doc("the map")]
    edits: Annotated[Count, doc("number of edits that the map includes")]
    start: Annotated[tuple[Metres, Metres, Angle], doc("m, m, rad; its pose when the run began: home")]
    state: Annotated[
        State | None, doc("progress of its mission, by the world's own record; null: the run has not begun")
    ]
    assigned: Annotated[Assigned | None, doc("the targets that it has now; null: those of the scenario")] = None
    sender: Annotated[
        Sender | None, doc("what is attached to the world's messages: the robot obeys no other sense; null: any")
    ] = None


class Accepted(Message, frozen=True, kw_only=True):
    """The answer to a request that was carried out."""

    text: Annotated[Text, doc("what was done, for people")]
    number: Annotated[Count | None, doc("of an order: the `assignment` in the robot's state while it has it")] = None
    run: Annotated[Count | None, doc("of an order: the run in which it was taken")] = None
    robots: Annotated[list[Id], doc("of places: the robots that they are for")] = []
    cuts: Annotated[list[tuple[Id, Text]], doc("of an edit: (robot or `pool`, target) whose last way it takes")] = []
