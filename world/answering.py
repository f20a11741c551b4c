"""The answers to requests: buttons, edits of the map, and robots that want to join."""

from swarm.bus import Request
from swarm.errors import SwarmError
from swarm.messages import Accepted, Action, Do, Edit, Join, Message, Welcome
from world.controls import pressed
from world.course import Course
from world.welcome import welcome


def answer(request: Request, course: Course, session: str) -> None:
    """Carry out a request, or refuse it with the reason; ``session`` is that of the world."""
    try:
        match request.message:
            case Action(do=do):
                reply: Message = _press(do, course)
            case Edit() as edit:
                reply = _edit(edit, course)
            case Join() as join:
                reply = _join(join, course, session)
    except SwarmError as fault:
        request.refuse(str(fault))
    else:
        request.accept(reply)


def _press(do: Do, course: Course) -> Accepted:
    """Carry out a button if it may be pressed in this phase."""
    phase = pressed(course.phase, do, course.lobby.absent)
    course.held = course.held and do is not Do.GO
    if do is Do.RESTART:
        course.restart()
    if do is Do.STOP:
        course.end("stopped by command")
    elif phase is not course.phase or do is Do.RESTART:
        course.go_to(phase)
    return Accepted(text=f"the run is {course.phase.value}")


def _edit(edit: Edit, course: Course) -> Accepted:
    """Add or remove walls, and send the new map to all listeners."""
    text = f"{edit.kind.value} from {edit.low} to {edit.high}"
    if not course.world.edit(edit):
        return Accepted(text=f"{text}: it changes nothing")
    course.tell("edit", text)
    course.tell_map()
    course.repeatable.no_longer("the map was edited by a request", course.world.time)
    course.save_soon()
    return Accepted(text=text)


def _join(join: Join, course: Course, session: str) -> Welcome:
    """Assign a robot process its place in the fleet."""
    name = course.lobby.place(join.robot, join.session, course.awake.now())
    if join.world != course.world.identity:
        course.repeatable.no_longer(f"{name} has started again without its memory", course.world.time)
    return welcome(name, course.world, course.speaker, session)
