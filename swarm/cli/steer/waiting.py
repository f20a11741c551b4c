"""`swarm order --wait`: how far one order is, in lines, until it is done or cannot be done any more."""

from collections.abc import Iterable
from time import monotonic
from typing import TYPE_CHECKING, Final

from swarm.bridge.errand import End, Errand, How
from swarm.cli.look.silence import STANDS
from swarm.messages import CLOCK, EVENT, STATE, STATUS, Activity, Liveness, Message
from swarm.robot.host.joining import AWAY

if TYPE_CHECKING:
    from swarm.bus import Bus

LOOK: Final = 0.2  # s between two looks whether we are told to stop
LINE_EVERY: Final = 2.0  # s between two lines of progress, if nothing but the distance has changed


def step(errand: Errand) -> tuple[object, ...]:
    """Return what is worth a line at once when it changes."""
    state = errand.state
    return errand.phase, errand.heard, state and (state.assignment, state.activity, state.target)


def line(errand: Errand) -> str:
    """Return how far an order is, for people; "" before the robot has taken it."""
    if errand.phase in STANDS:
        return f"{errand.robot}: {STANDS[errand.phase]}"
    if errand.heard is not Liveness.ALIVE:
        return f"{errand.robot}: is {errand.heard.value}"
    state = errand.underway
    if state is None or state.activity is Activity.READY or state.target >= len(state.reached):
        return ""
    stops = len(state.reached)
    to = errand.label(state.target, stops) + f" ({state.target + 1} of {stops})" * (stops > 1)
    whom = f", waits for {', '.join(state.waits)}" if state.waits else ""
    go_on = f"; `swarm go-on {errand.robot}` ends that" if state.activity is Activity.STOPPED else ""
    return f"{errand.robot}: {state.activity.value}, {to}, {state.distance:.1f} m left{whom}{go_on}"


def listen(bus: "Bus", robot: str) -> None:
    """Listen to all that an order's end can be seen from."""
    bus.watch_presence("world")
    bus.listen(STATE, robot=robot)
    for topic in (EVENT, CLOCK, STATUS):
        bus.listen(topic)


def follow(bus: "Bus", errand: Errand) -> int:
    """Print how far an order is until it has ended, and how; return 0 if it is done, else 1."""
    from swarm.bridge.following import asked
    from swarm.bus import Arrival, Presence
    from swarm.stopping import told_to_stop

    worlds, seen = set[str](), monotonic()  # sessions of the world; s, when there was one
    last, written, told = step(errand), "", float("-inf")
    with told_to_stop() as stop:
        end = _first(errand, [*bus.fetch(CLOCK), *bus.fetch(STATE, robot=errand.robot)])
        while end is None and not stop.is_set():
            now = line(errand)
            if now not in {"", written} and (step(errand) != last or monotonic() - told >= LINE_EVERY):
                last, written, told = step(errand), now, monotonic()
                print(written, flush=True)
            if errand.asks and (answers := asked(bus)):
                errand.asks = False
                end = _first(errand, answers) or errand.past()
                continue
            match bus.receive(LOOK):
                case Arrival(message=message):
                    end = errand.take(message)
                case Presence(session=session, alive=alive):
                    (worlds.add if alive else worlds.discard)(session)
            seen = monotonic() if worlds else seen
            if monotonic() - seen > AWAY:
                end = errand.alone(AWAY)
    robot = errand.robot
    stands = f"{errand.name} stands; `swarm status {robot}` shows it, `swarm cancel {robot}` drops it"
    print(stands if end is None else end.text, flush=True)
    return 0 if end is not None and end.how is How.DONE else 1


def _first(errand: Errand, messages: Iterable[Message]) -> End | None:
    """Take in messages; return the first end that one of them is."""
    return next((end for message in messages if (end := errand.take(message)) is not None), None)
