"""`swarm order --wait`: how far one order is, in lines, until it is done or cannot be done any more."""

from collections.abc import Iterable
from time import monotonic
from typing import TYPE_CHECKING, Final

from swarm.bridge.errand import OrderEnd, OrderErrand, OrderOutcome
from swarm.cli.look.silence import STANDS
from swarm.messages import CLOCK, EVENT, STATE, STATUS, Activity, Liveness, Message
from swarm.robot.host.membership import AWAY

if TYPE_CHECKING:
    from swarm.bus import Bus

LOOK: Final = 0.2  # s between two looks whether we are told to stop
LINE_EVERY: Final = 2.0  # s between two lines of progress, if nothing but the distance has changed


def step(errand: OrderErrand) -> tuple[object, ...]:
    """Return what is worth a line at once when it changes."""
    state = errand.state
    return errand.phase, errand.heard, state and (state.assignment, state.activity, state.target)


def format_order_progress(errand: OrderErrand) -> str:
    """Return how far an order is, for people; "" before the robot has taken it."""
    if errand.phase in STANDS:
        return f"{errand.robot}: {STANDS[errand.phase]}"
    if errand.heard is not Liveness.ALIVE:
        return f"{errand.robot}: is {errand.heard.value}"
    state = errand.state_under_way
    if state is None or state.activity is Activity.READY or state.target >= len(state.reached):
        return ""
    stops = len(state.reached)
    to = errand.stop_name(state.target, stops) + f" ({state.target + 1} of {stops})" * (stops > 1)
    whom = f", waits for {', '.join(state.waits)}" if state.waits else ""
    go_on = f"; `swarm go-on {errand.robot}` ends that" if state.activity is Activity.STOPPED else ""
    return f"{errand.robot}: {state.activity.value}, {to}, {state.distance:.1f} m left{whom}{go_on}"


def listen(bus: "Bus", robot: str) -> None:
    """Listen to all that an order's end can be seen from."""
    bus.watch_presence("world")
    bus.listen(STATE, robot=robot)
    for topic in (EVENT, CLOCK, STATUS):
        bus.listen(topic)


def follow_order(bus: "Bus", errand: OrderErrand) -> int:
    """Print how far an order is until it has ended, and how; return 0 if it is done, else 1."""
    from swarm.bridge.fleet_client import fetch_order_evidence
    from swarm.bus import Arrival, Presence
    from swarm.stop_signal import stop_flag

    worlds, seen = set[str](), monotonic()  # sessions of the world; s, when there was one
    last, written, told = step(errand), "", float("-inf")
    with stop_flag() as stop:
        end = _first(errand, [*bus.fetch(CLOCK), *bus.fetch(STATE, robot=errand.robot)])
        while end is None and not stop.is_set():
            now = format_order_progress(errand)
            if now not in {"", written} and (step(errand) != last or monotonic() - told >= LINE_EVERY):
                last, written, told = step(errand), now, monotonic()
                print(written, flush=True)
            if errand.asks and (answers := fetch_order_evidence(bus)):
                errand.asks = False
                end = _first(errand, answers) or errand.end_of_lost_order()
                continue
            match bus.receive(LOOK):
                case Arrival(message=message):
                    end = errand.apply_message(message)
                case Presence(session=session, alive=alive):
                    (worlds.add if alive else worlds.discard)(session)
            seen = monotonic() if worlds else seen
            if monotonic() - seen > AWAY:
                end = errand.end_without_world(AWAY)
    robot = errand.robot
    stands = f"{errand.name} stands; `swarm status {robot}` shows it, `swarm cancel {robot}` drops it"
    print(stands if end is None else end.text, flush=True)
    return 0 if end is not None and end.how is OrderOutcome.DONE else 1


def _first(errand: OrderErrand, messages: Iterable[Message]) -> OrderEnd | None:
    """Take in messages; return the first end that one of them is."""
    return next((end for message in messages if (end := errand.apply_message(message)) is not None), None)
