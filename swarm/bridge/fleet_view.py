"""What the bridge knows of the fleet, and what it has still to say of it. Pure."""

from collections import deque
from collections.abc import Iterator
from typing import Final

from swarm.bridge.fleet_settings import FleetSettings
from swarm.messages import Broadcast, Clock, Event, Map, Message, Phase, Plan, Sense, State, Truth

FLEET: Final = ""  # instead of a robot's name, for what is of no single robot
MOST_EVENTS: Final = 1000  # that wait to be said


class FleetView:
    """The newest messages of a fleet. A bridge that is slower than the run leaves messages out; it never lags."""

    def __init__(self) -> None:
        self.robots: tuple[str, ...] = ()  # of the run, by its clock
        self.run = -1
        self.time = 0.0  # s, since the run began
        self.over = False
        self._void = False  # the run that comes next counts, whatever its number
        self.clock: Clock | None = None  # the newest
        self.settings: FleetSettings | None = None  # not known before the map has come
        self._waiting: dict[tuple[type[Message], str], Message] = {}
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)  # all that come, not only the newest

    def accept_next_run(self) -> None:
        """Take whatever run comes next: another world is there, and may begin with a lower number."""
        self._void = True

    def apply_message(self, message: Message, robot: str = FLEET) -> None:
        """Take in a message; ``robot`` is the one that its key names. What is of an older run is left out."""
        run = getattr(message, "run", self.run)
        if run < self.run and not self._void:
            return
        if self._void and hasattr(message, "run"):
            self._void, self.time = False, getattr(message, "time", 0.0)
        if run != self.run:
            self.run, self.time, self.over = run, 0.0, False
            self._waiting = {key: one for key, one in self._waiting.items() if isinstance(one, Map)}
            self._events.clear()
        match message:
            case Clock(robots=robots, phase=phase, time=time):
                self.clock = message
                self.robots, self.over, self.time = tuple(robots), phase is Phase.OVER, max(self.time, time)
            case Map(scenario=scenario):
                self.settings = FleetSettings.from_wire(scenario)
            case Truth(time=time) | Sense(time=time):
                self.time = max(self.time, time)
            case Plan(robot=owner) | State(robot=owner) | Broadcast(robot=owner):
                robot = owner
            case Event():
                self._events.append(message)
                return
        self._waiting[type(message), robot] = message

    def take_messages(self) -> Iterator[tuple[Message, str, float]]:
        """Yield what has come since the last call, with the robot of each and its time [s] in the run.

        Nothing is said before the settings are known, nor of a robot before the clock lists it.
        """
        if self.settings is None:
            return
        while self._events:
            event = self._events.popleft()
            yield event, FLEET, event.time
        known = {FLEET, *self.robots}
        waiting = self._waiting
        self._waiting = {key: message for key, message in waiting.items() if key[1] not in known}
        for robot, message in [(robot, message) for (_, robot), message in waiting.items() if robot in known]:
            match message:
                case Truth(time=time) | Sense(time=time):
                    yield message, robot, time
                case Plan(tick=tick) | State(tick=tick):
                    yield message, robot, tick / self.settings.shared.rate
                case _:
                    yield message, robot, self.time
