"""The answers to requests: buttons, edits of the map, and robots that want to join."""

from collections.abc import Sequence
from typing import Final

from msgspec.structs import replace

from swarm.bus import Bus, Request
from swarm.errors import PeerError, SwarmError
from swarm.messages import (
    Accepted,
    Action,
    Do,
    Edit,
    Event,
    Join,
    Leave,
    Message,
    Order,
    Places,
    PoolTargets,
    RobotAction,
    RobotDo,
    Welcome,
)
from swarm.messages.naming import shortened
from world.host.controls import already, pressed
from world.host.run import Course
from world.tasks.cutting import looked_ahead, told
from world.tasks.standing import LOST
from world.views.report import listed
from world.views.welcome import welcome

NAMES: Final = 60  # characters for the robots that a run waits for


def answer(request: Request, course: Course, bus: Bus) -> None:
    """Carry out a request, or refuse it with the reason; ``bus`` is the world's."""
    try:
        match request.message:
            case Action(do=do, id=name):
                reply: Message = _press(do, name, course)
            case Edit() as edit:
                reply = _edit(edit, course)
            case Join() as join:
                reply = _join(join, course, bus)
            case Leave() as leave:
                reply = _leave(leave, course)
            case Order() | RobotAction() as asked:
                reply = _request(request.ids["robot"], asked, course)
            case PoolTargets() as targets:
                reply = _put_in(targets, course)
            case Places() as places:
                reply = _open(places, course)
    except SwarmError as fault:
        request.refuse(shortened(str(fault)))
    else:
        request.accept(replace(reply, text=shortened(reply.text)) if isinstance(reply, Accepted) else reply)


def _press(do: Do, name: str | None, course: Course) -> Accepted:
    """Carry out a button if it may be pressed in this phase; one that is in force already changes nothing."""
    if name is not None and (said := course.pressed.get(name)) is not None:
        return Accepted(text=said)
    if already(course.phase, do):
        return Accepted(text=f"the run is {course.phase.value} already")
    phase = pressed(course.phase, do, course.lobby.absent)
    text = f"the run is {phase.value}{', with all robots at their starts' if do is Do.RESTART else ''}"
    if name is not None:
        course.remember(name, text)
    course.held = course.held and do is not Do.GO
    if do is Do.RESTART:
        course.restart()
    if do is Do.STOP:
        course.end("stopped by command")
    else:
        course.go_to(phase)
    return Accepted(text=text)


def _request(name: str, request: Order | RobotAction, course: Course) -> Accepted:
    """Carry out an order or an action for one robot, and save the run before the answer goes out."""
    world = course.world
    if course.lobby.away(name) >= LOST:
        raise PeerError(f"{name}: expected a robot that is here, it is lost: absent for {LOST:g} s; start it again")
    with course.changing():
        reply, events = world.request(name, request)
    if events and isinstance(request, RobotAction) and request.do is RobotDo.CANCEL:
        reply = replace(reply, text=f"{reply.text}; {_what_follows(name, course)}")
    return _carried_out(reply, events, f"{name} was given an order or an action", course)


def _what_follows(name: str, course: Course) -> str:
    """Return what becomes of a run in which a robot's targets were just cancelled."""
    if course.stays:
        return "the fleet stays, and takes orders until `swarm stop` ends it"
    awaited = [other for other in course.world.tasks.unfinished if other != name]
    when = f"when {listed(awaited, ', ', NAMES)} {'are' if len(awaited) > 1 else 'is'} done" if awaited else "now"
    return f"the run ends {when}{', as not complete' if course.world.tasks.missions.dropped else ''}"


def _put_in(targets: PoolTargets, course: Course) -> Accepted:
    """Put targets into the pool, and save the run before the answer goes out."""
    with course.changing():
        reply, events = course.world.put_in(targets)
    return _carried_out(reply, events, "targets were put into the pool", course)


def _open(places: Places, course: Course) -> Accepted:
    """Open places for more robots, and let everybody know their names and starts."""
    if not course.world.settings.serve:
        raise PeerError(f"places {places.id}: expected a fleet that stays, got one that ends; start it with --serve")
    reply, events = course.open_places(places)
    _carried_out(reply, events, f"{', '.join(reply.robots)} got a place", course)
    if events:
        course.tell_map()
        course.tell_clock()
    return reply


def _carried_out(reply: Accepted, events: Sequence[Event], what: str, course: Course) -> Accepted:
    """If a request changed anything, save the run before its events and the answer go out."""
    if events:
        course.repeatable.no_longer(what, course.world.time)
        course.say_saved(events)
    return reply


def _edit(edit: Edit, course: Course) -> Accepted:
    """Add or remove walls, and send the new map to all listeners; say whom that leaves without a way."""
    changed, lost = looked_ahead(course.world.tasks, course.world.bodies, edit, sensed=course.in_tick)
    text = f"{edit.kind.value} from {edit.low} to {edit.high}{told(lost)}"
    if not changed:
        return Accepted(text=f"{text}: it changes nothing")
    if edit.dry_run:
        return Accepted(text=f"{text}; a dry run: nothing has changed", cuts=lost)
    with course.changing():
        course.world.edit(edit, sensed=course.in_tick)
    events = [course.world.event("edit", text)]
    reply = _carried_out(Accepted(text=text, cuts=lost), events, "the map was edited by a request", course)
    course.tell_map()
    return reply


def _join(join: Join, course: Course, bus: Bus) -> Welcome:
    """Assign a robot process its place in the fleet."""
    name = course.lobby.place(join.robot, join.session, course.awake.now(), join.sender)
    if join.world != course.world.identity:
        course.repeatable.no_longer(f"{name} has started again without its memory", course.world.time)
        if join.world is not None:  # somebody removed the snapshot, or the robot has outlived its fleet
            course.tell(
                "other_world", "goes on from the state that is saved here: the world of its last run has ended", name
            )
    return welcome(name, course.world, course.speaker, bus.id, bus.sender)


def _leave(leave: Leave, course: Course) -> Accepted:
    """Take back the place of a robot process that ends; the body stands where it is, as one whose process was lost."""
    name = leave.robot
    if not course.lobby.leave(name, leave.session, course.awake.now()):
        return Accepted(text=f"{name} has left when its token goes")
    course.part(name)
    return Accepted(text=f"{name} has left")
