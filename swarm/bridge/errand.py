"""What becomes of one order that the world has accepted, by what the wire says of it. Pure: it takes messages."""

from enum import StrEnum
from typing import Final, NamedTuple

from swarm.errors import PeerError
from swarm.messages import Accepted, Activity, Clock, Event, Liveness, Message, Order, Phase, State, Status
from swarm.messages.short_ids import shorten_ids


class OrderOutcome(StrEnum):
    """How an order ends."""

    DONE = "done"
    REPLACED = "superseded"  # by another order, or by the pool; the kind of the event that tells it
    CANCELLED = "cancelled"  # the kind of the event that tells it
    GIVEN_UP = "given up"  # no way leads to what is left
    LOST = "lost"  # its robot; another process may take its place and go on
    AGAIN = "again"  # the run was started again, without it
    OVER = "over"  # the run
    ALONE = "alone"  # the fleet has no world any more


REPLACED: Final = (OrderOutcome.REPLACED, OrderOutcome.CANCELLED)  # as kinds of events


class OrderEnd(NamedTuple):
    """How an order has ended, in a sentence too."""

    how: OrderOutcome
    text: str


class OrderErrand:
    """What is known of one order that was accepted: its robot, its number in its run."""

    def __init__(self, robot: str, order: Order, number: int, run: int) -> None:
        self.robot, self.number, self.run = robot, number, run
        self.name = f"{robot}: order {shorten_ids(order.id)}"
        self._home = order.home
        self.world: str | None = None  # identity of the world that has it; None: not told yet
        self.state: State | None = None  # the last of its robot
        self.phase, self.heard = Phase.RUNNING, Liveness.ALIVE
        self.asks = False  # the robot says that it has no target of this order left: the world has to be asked

    @classmethod
    def from_answer(cls, robot: str, order: Order, answer: Accepted) -> "OrderErrand":
        """Return the errand of an order by the world's answer.

        Raises:
            PeerError: the answer does not say what it is of.
        """
        if answer.number is None or answer.run is None:
            raise PeerError(
                f"{robot}: order: expected an answer with `number` and `run`, got {answer}; the world has taken it, "
                "but is of an older version: replace the world first"
            )
        return cls(robot, order, answer.number, answer.run)

    @property
    def state_under_way(self) -> State | None:
        """The last state of its robot, if that is about this order."""
        return self.state if self.state is not None and self.state.assignment == self.number else None

    @property
    def is_replaced(self) -> bool:
        """True if its robot says that it has another order by now."""
        return self.state is not None and self.state.assignment > self.number

    def apply_message(self, message: Message) -> OrderEnd | None:
        """Take in a message of the fleet; return how the order has ended, None if it has not."""
        match message:
            case State(robot=self.robot, run=self.run):
                self.state = message
                self.asks = message.assignment > self.number or self._has_reached_all(message)
                if message.assignment == self.number and message.activity is Activity.DONE and not self.asks:
                    names = ", ".join(self.stop_name(stop, len(message.reached)) for stop in message.unreachable)
                    return self._make_failed_end(OrderOutcome.GIVEN_UP, f"it has given up {names or 'what is left'}")
            case Event(robot=self.robot, run=self.run) if message.kind in REPLACED:
                # the text names what ended first, and then what has replaced it
                if f"(number {self.number}): " in message.text:
                    return self._make_failed_end(OrderOutcome(message.kind), message.text.split("): ", 1)[1])
            case Clock():
                return self._apply_clock(message)
            case Status(world=world) if world != (self.world or world):  # of the same name, and perhaps run number
                return self._make_failed_end(OrderOutcome.AGAIN, "the fleet was started again, without it")
            case Status(run=self.run):
                self.world = message.world
                return self._apply_status(message)
        return None

    def end_of_lost_order(self) -> OrderEnd | None:
        """Return the end of an order that the robot has no longer and that nothing has replaced: it was done."""
        return OrderEnd(OrderOutcome.DONE, f"{self.name} is done") if self.is_replaced else None

    def end_without_world(self, silence: float) -> OrderEnd:
        """Return the end of an order whose fleet has had no world for so long [s]."""
        return self._make_failed_end(OrderOutcome.ALONE, f"the fleet has had no world for {silence:g} s")

    def stop_name(self, stop: int, stops: int) -> str:
        """Return the name of one of its stops."""
        return "home" if self._home and stop == stops - 1 else f"target {stop + 1}"

    def _apply_clock(self, clock: Clock) -> OrderEnd | None:
        """Take in the run's clock."""
        self.phase = clock.phase
        seen = clock.presence.get(self.robot)
        self.heard = Liveness.ALIVE if seen is None else seen.liveness
        if clock.run > self.run:
            return self._make_failed_end(OrderOutcome.AGAIN, "the run was started again, without it")
        if clock.phase is Phase.OVER:
            return self._make_failed_end(OrderOutcome.OVER, "the run is over")
        if self.heard is Liveness.LOST:
            return self._make_failed_end(
                OrderOutcome.LOST, f"{self.robot} is lost; it goes on if a process takes its place"
            )
        return None

    def _apply_status(self, status: Status) -> OrderEnd | None:
        """Take in what the world has measured: it counts where a robot was, not what it says."""
        for row in status.robots:
            if row.robot == self.robot and row.state.assignment == self.number and row.account is not None:
                times = [time for time in row.account.reached if time is not None]
                if times and len(times) == row.account.targets:
                    reached = f"{len(times)} target{'s' * (len(times) > 1)} reached, the last at {times[-1]:.1f} s"
                    return OrderEnd(OrderOutcome.DONE, f"{self.name} is done: {reached}")
        return None

    def _make_failed_end(self, how: OrderOutcome, why: str) -> OrderEnd:
        return OrderEnd(how, f"{self.name} is not done: {why}")

    def _has_reached_all(self, state: State) -> bool:
        return state.assignment == self.number and bool(state.reached) and all(state.reached)
