"""The answers to requests: buttons and what each does in each phase, edits of the map, robots that want to join."""

from collections.abc import Sequence
from typing import Final

from msgspec.structs import replace

from swarm.bus import Bus, Request
from swarm.errors import PeerError, SwarmError
from swarm.fingerprint import OF_ROBOTS, fingerprint
from swarm.messages import (
    RADIO,
    Accepted,
    Action,
    Do,
    Edit,
    Event,
    Join,
    Leave,
    Message,
    Order,
    Phase,
    Places,
    PoolTargets,
    RobotAction,
    RobotDo,
    Welcome,
)
from swarm.messages.short_ids import shorten_ids
from world.host.run import Run
from world.tasks.edit_cuts import find_cut_targets, format_cut_targets
from world.tasks.standstill import LOST
from world.views.report import list_within
from world.views.welcome import welcome

NAMES: Final = 60  # characters for the robots that a run waits for
# fmt: off
# phase of the run -> {button that may be pressed: next phase}
BUTTONS: Final = {
    Phase.WAITING: {Do.GO: Phase.RUNNING, Do.RESTART: Phase.WAITING, Do.STOP: Phase.OVER},
    Phase.RUNNING: {Do.PAUSE: Phase.PAUSED, Do.RESTART: Phase.RUNNING, Do.STOP: Phase.OVER},
    Phase.PAUSED:  {Do.RESUME: Phase.RUNNING, Do.GO: Phase.RUNNING, Do.RESTART: Phase.PAUSED, Do.STOP: Phase.OVER},
    Phase.OVER:    {},
}
# fmt: on
# buttons whose phase has been reached: an answer may be lost, so pressing again is no error
ALREADY: Final = {Phase.RUNNING: (Do.GO, Do.RESUME), Phase.PAUSED: (Do.PAUSE,), Phase.OVER: (Do.STOP,)}


def answer(request: Request, run: Run, bus: Bus) -> None:
    """Carry out a request, or refuse it with the reason; ``bus`` is the world's."""
    try:
        match request.message:
            case Action(do=do, id=name):
                reply: Message = _press_button(do, name, run)
            case Edit() as edit:
                reply = _edit(edit, run)
            case Join() as join:
                reply = _join(join, run, bus)
            case Leave() as leave:
                reply = _leave(leave, run)
            case Order() | RobotAction() as asked:
                reply = _request(request.ids["robot"], asked, run)
            case PoolTargets() as targets:
                reply = _put_in(targets, run)
            case Places() as places:
                reply = _open(places, run)
    except SwarmError as fault:
        request.refuse(shorten_ids(str(fault)))
    else:
        request.accept(replace(reply, text=shorten_ids(reply.text)) if isinstance(reply, Accepted) else reply)


def _press_button(do: Do, name: str | None, run: Run) -> Accepted:
    """Carry out a button if it may be pressed in this phase; one that is in force already changes nothing."""
    if name is not None and (said := run.pressed.get(name)) is not None:
        return Accepted(text=said)
    if do in ALREADY.get(run.phase, ()):
        return Accepted(text=f"the run is {run.phase.value} already")
    phase = _phase_after(do, run.phase, run.membership.absent_robots)
    text = f"the run is {phase.value}{', with all robots at their starts' if do is Do.RESTART else ''}"
    if name is not None:
        run.remember(name, text)
    run.held = run.held and do is not Do.GO
    if do is Do.RESTART:
        run.restart()
    if do is Do.STOP:
        run.end("stopped by command")
    else:
        run.go_to(phase)
    return Accepted(text=text)


def _phase_after(do: Do, phase: Phase, absent: Sequence[str]) -> Phase:
    """Return the phase that a button leads to in a phase; ``absent`` are the robots whose process is not present.

    Raises:
        PeerError: the button may not be pressed in this phase, or the run cannot begin yet.
    """
    then = BUTTONS[phase].get(do)
    if then is None:
        can = ", ".join(BUTTONS[phase]) or "nothing"
        raise PeerError(f"the run is {phase.value}: expected one of ({can}), got {do.value}")
    if do is Do.GO and absent:
        raise PeerError(f"expected all robots to be present, {', '.join(absent)} missing; wait for them")
    return then


def _request(name: str, request: Order | RobotAction, run: Run) -> Accepted:
    """Carry out an order or an action for one robot, and save the run before the answer goes out."""
    world = run.world
    if run.membership.absence_time(name) >= LOST:
        raise PeerError(f"{name}: expected a robot that is here, it is lost: absent for {LOST:g} s; start it again")
    with run.lock_for_change():
        reply, events = world.request(name, request)
    run.tape.note_request(world.number(name), request)
    if events and isinstance(request, RobotAction) and request.do is RobotDo.CANCEL:
        reply = replace(reply, text=f"{reply.text}; {_what_follows(name, run)}")
    return _save_change(reply, events, f"{name} was given an order or an action", run)


def _what_follows(name: str, run: Run) -> str:
    """Return what becomes of a run in which a robot's targets were just cancelled."""
    if run.stays:
        return "the fleet stays, and takes orders until `swarm stop` ends it"
    awaited = [other for other in run.world.tasks.unfinished_robots if other != name]
    when = f"when {list_within(awaited, ', ', NAMES)} {'are' if len(awaited) > 1 else 'is'} done" if awaited else "now"
    return f"the run ends {when}{', as not complete' if run.world.tasks.missions.dropped_targets else ''}"


def _put_in(targets: PoolTargets, run: Run) -> Accepted:
    """Put targets into the pool, and save the run before the answer goes out."""
    with run.lock_for_change():
        reply, events = run.world.put_in(targets)
    run.tape.note_request(None, targets)
    return _save_change(reply, events, "targets were put into the pool", run)


def _open(places: Places, run: Run) -> Accepted:
    """Open places for more robots, and let everybody know their names and starts."""
    if not run.world.settings.serve:
        raise PeerError(f"places {places.id}: expected a fleet that stays, got one that ends; start it with --serve")
    reply, events = run.open_places(places)
    run.tape.note_request(None, places)
    _save_change(reply, events, f"{', '.join(reply.robots)} got a place", run)
    if events:
        run.tell_map()
        run.tell_clock()
    return reply


def _save_change(reply: Accepted, events: Sequence[Event], what: str, run: Run) -> Accepted:
    """If a request changed anything, save the run before its events and the answer go out."""
    if events:
        run.repeatable.no_longer(what, run.world.time)
        run.say_saved(events)
    return reply


def _edit(edit: Edit, run: Run) -> Accepted:
    """Add or remove walls, and send the new map to all listeners; say whom that leaves without a way."""
    changed, lost = find_cut_targets(run.world.tasks, run.world.bodies, edit, sensed=run.in_tick)
    text = f"{edit.kind.value} from {edit.low} to {edit.high}{format_cut_targets(lost)}"
    if not changed:
        return Accepted(text=f"{text}: it changes nothing")
    if edit.dry_run:
        return Accepted(text=f"{text}; a dry run: nothing has changed", cuts=lost)
    with run.lock_for_change():
        run.world.edit(edit, sensed=run.in_tick)
    run.tape.note_request(None, edit)
    events = [run.world.event("edit", text)]
    reply = _save_change(Accepted(text=text, cuts=lost), events, "the map was edited by a request", run)
    run.tell_map()
    return reply


def _join(join: Join, run: Run, bus: Bus) -> Welcome:
    """Assign a robot process its place in the fleet."""
    name = run.membership.place(join.robot, join.session, run.awake.now(), join.sender)
    if join.world != run.world.identity:
        ours = join.code == fingerprint(libraries=OF_ROBOTS)
        run.tape.note_join(run.world.number(name), ours=ours)
        if run.tape.is_on and not ours:  # a replay cannot compute what it says
            bus.listen(RADIO, quiet=True, robot=name)
        run.repeatable.no_longer(f"{name} has started again without its memory", run.world.time)
        if join.world is not None:  # somebody removed the snapshot, or the robot has outlived its fleet
            run.tell(
                "other_world", "goes on from the state that is saved here: the world of its last run has ended", name
            )
    return welcome(name, run.world, run.publisher, bus.id, bus.sender)


def _leave(leave: Leave, run: Run) -> Accepted:
    """Take back the place of a robot process that ends; the body stands where it is, as one whose process was lost."""
    name = leave.robot
    if not run.membership.leave(name, leave.session, run.awake.now()):
        return Accepted(text=f"{name} has left when its token goes")
    run.part(name)
    return Accepted(text=f"{name} has left")
