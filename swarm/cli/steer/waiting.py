"""`swarm order --wait`: what the wire says of one order, until it is done or cannot be done any more.

``Wait`` is pure: it takes messages, and says how far the order is and how it has ended.
"""

from collections.abc import Iterable
from time import monotonic
from typing import TYPE_CHECKING, Final, NamedTuple

from swarm.cli.look.silence import STANDS
from swarm.messages import (
    CLOCK,
    EVENT,
    EVENTS,
    STATE,
    STATUS,
    Activity,
    Clock,
    Event,
    Liveness,
    Message,
    Order,
    Phase,
    State,
    Status,
)
from swarm.messages.naming import shortened
from swarm.robot.host.joining import AWAY

if TYPE_CHECKING:
    from swarm.bus import Bus

LOOK: Final = 0.2  # s between two looks whether we are told to stop
LINE_EVERY: Final = 2.0  # s between two lines of progress, if nothing but the distance has changed
REPLACED: Final = ("superseded", "cancelled")  # kinds of events


class End(NamedTuple):
    """How waiting for an order ends."""

    status: int
    text: str


class Wait:
    """What is known of one order that was accepted: its robot, its number in its run."""

    def __init__(self, robot: str, order: Order, number: int, run: int) -> None:
        self._robot, self._number, self._run = robot, number, run
        self.name = f"{robot}: order {shortened(order.id)}"
        self._home = order.home
        self._state: State | None = None
        self._phase, self._heard = Phase.RUNNING, Liveness.ALIVE
        self.asks = False  # the robot says that it has no target of this order left: the world has to be asked

    def take(self, message: Message) -> End | None:
        """Take in a message of the fleet; return how the order has ended, None if it has not."""
        match message:
            case State(robot=self._robot, run=self._run):
                self._state = message
                self.asks = message.assignment > self._number or self._has_all(message)
                if message.assignment == self._number and message.activity is Activity.DONE and not self.asks:
                    names = ", ".join(self._label(stop, len(message.reached)) for stop in message.unreachable)
                    return End(1, f"{self.name} is not done: it has given up {names or 'what is left'}")
            case Event(robot=self._robot, run=self._run) if message.kind in REPLACED:
                # the text names what ended first, and then what has replaced it
                if f"(number {self._number}): " in message.text:
                    return End(1, f"{self.name} is not done: {message.text.split('): ', 1)[1]}")
            case Clock():
                return self._hear(message)
            case Status(run=self._run):
                return self._look(message)
        return None

    def past(self) -> End | None:
        """Return the end of an order that the robot has no longer and that nothing has replaced: it was done."""
        newer = self._state is not None and self._state.assignment > self._number
        return End(0, f"{self.name} is done") if newer else None

    def _hear(self, clock: Clock) -> End | None:
        """Take in the run's clock."""
        self._phase = clock.phase
        seen = clock.presence.get(self._robot)
        self._heard = Liveness.ALIVE if seen is None else seen.liveness
        if clock.run > self._run:
            return End(1, f"{self.name} is not done: the run was started again, without it")
        if clock.phase is Phase.OVER:
            return End(1, f"{self.name} is not done: the run is over")
        if self._heard is Liveness.LOST:
            return End(1, f"{self.name} is not done: {self._robot} is lost; it goes on if a process takes its place")
        return None

    def _look(self, status: Status) -> End | None:
        """Take in what the world has measured: it counts where a robot was, not what it says."""
        for row in status.robots:
            if row.robot == self._robot and row.state.assignment == self._number and row.account is not None:
                times = [time for time in row.account.reached if time is not None]
                if times and len(times) == row.account.targets:
                    plural = "s" * (len(times) > 1)
                    return End(
                        0, f"{self.name} is done: {len(times)} target{plural} reached, the last at {times[-1]:.1f} s"
                    )
        return None

    def _has_all(self, state: State) -> bool:
        return state.assignment == self._number and bool(state.reached) and all(state.reached)

    def _label(self, stop: int, stops: int) -> str:
        return "home" if self._home and stop == stops - 1 else f"target {stop + 1}"

    @property
    def step(self) -> tuple[object, ...]:
        """What is worth a line at once when it changes."""
        state = self._state
        return self._phase, self._heard, state and (state.assignment, state.activity, state.target)

    @property
    def line(self) -> str:
        """How far the order is, for people; "" before the robot has taken it."""
        if self._phase in STANDS:
            return f"{self._robot}: {STANDS[self._phase]}"
        if self._heard is not Liveness.ALIVE:
            return f"{self._robot}: is {self._heard.value}"
        state = self._state
        if state is None or state.assignment != self._number or state.activity is Activity.READY:
            return ""
        if state.target >= len(state.reached):
            return ""
        stops = len(state.reached)
        to = self._label(state.target, stops) + f" ({state.target + 1} of {stops})" * (stops > 1)
        whom = f", waits for {', '.join(state.waits)}" if state.waits else ""
        go_on = f"; `swarm go-on {self._robot}` ends that" if state.activity is Activity.STOPPED else ""
        return f"{self._robot}: {state.activity.value}, {to}, {state.distance:.1f} m left{whom}{go_on}"


def listen(bus: "Bus", robot: str) -> int:
    """Listen to all that an order's end can be seen from; return the number of the run."""
    bus.watch_presence("world")
    bus.listen(STATE, robot=robot)
    for topic in (EVENT, CLOCK, STATUS):
        bus.listen(topic)
    return max((clock.run for clock in bus.fetch(CLOCK)), default=0)


def follow(bus: "Bus", wait: Wait, robot: str) -> int:
    """Print how far an order is until it has ended, and how; return 0 if it is done, else 1."""
    from swarm.bus import Arrival, Presence
    from swarm.stopping import told_to_stop

    worlds, seen = set[str](), monotonic()  # sessions of the world; s, when there was one
    step, line, told = wait.step, "", float("-inf")
    with told_to_stop() as stop:
        end = _first(wait, [*bus.fetch(CLOCK), *bus.fetch(STATE, robot=robot)])
        while end is None and not stop.is_set():
            if wait.line not in {"", line} and (wait.step != step or monotonic() - told >= LINE_EVERY):
                step, line, told = wait.step, wait.line, monotonic()
                print(line, flush=True)
            if wait.asks:
                wait.asks = False
                end = (
                    _first(wait, [*bus.fetch(STATUS), *(e for one in bus.fetch(EVENTS) for e in one.events)])
                    or wait.past()
                )
                continue
            match bus.receive(LOOK):
                case Arrival(message=message):
                    end = wait.take(message)
                case Presence(session=session, alive=alive):
                    (worlds.add if alive else worlds.discard)(session)
            seen = monotonic() if worlds else seen
            if monotonic() - seen > AWAY:
                end = End(1, f"{wait.name} is not done: the fleet has had no world for {AWAY:g} s")
    if end is None:
        end = End(1, f"{wait.name} stands; `swarm status {robot}` shows it, `swarm cancel {robot}` drops it")
    print(end.text, flush=True)
    return end.status


def _first(wait: Wait, messages: Iterable[Message]) -> End | None:
    """Take in messages; return the first end that one of them is."""
    return next((end for message in messages if (end := wait.take(message)) is not None), None)
