"""The process of one robot or more: each joins a world and answers every sense; when it is gone, all join the next."""

from collections.abc import Callable, Sequence
from threading import Event as Flag
from time import monotonic
from typing import Final, NamedTuple

from swarm.bus import Arrival, Bus, Endpoint, Link, Presence, Request
from swarm.fuzzy import Controller
from swarm.geometry import Pose
from swarm.messages import COMMAND, JOIN, MAP, PLAN, RADIO, SENSE, STATE, Join, Welcome
from swarm.robot.brain import Robot
from swarm.robot.radio import Ear, Radio
from swarm.robot.seat import Given, Seat
from swarm.scenario.load import Scenario
from swarm.scenario.starts import number_of
from swarm.stopping import told_to_stop

LOOK: Final = 0.25  # s between two checks whether the process must stop
PEEK: Final = 0.001  # s between two checks for a missing broadcast, whose arrival wakes nothing
WELCOME: Final = 10.0  # s to wait for the answer to a join
KEPT: Final = 5.0  # s for which answers are kept: a repeated sense gets the same answer


def run(
    endpoint: Endpoint, fleet: str, robots: Sequence[str | None] = (None,), log: Callable[[str], None] = print
) -> int:
    """Run robots of a fleet until told to stop, and return the exit status; each None takes any free place.

    Raises:
        ConfigError: no router answers.
        PeerError: the world has no such place.
    """
    with told_to_stop() as stop, Bus(endpoint, fleet, log) as bus:
        bus.watch_presence("world")
        while (world := _find_world(bus, stop)) is not None:
            inbox = _join(bus, robots, log)
            robots = list(inbox.seats)
            if not _serve(bus, inbox, world, stop):
                break
            for seat in inbox.seats.values():
                seat.leave()
                bus.withdraw("robot", seat.name)  # the next world assigns the place again
    return 0


def _find_world(bus: Bus, stop: Flag) -> str | None:
    while not stop.is_set():
        arrived = bus.receive(LOOK)
        if isinstance(arrived, Presence) and arrived.alive:
            return arrived.session
    return None


class Inbox:
    """The arrivals of a process: each broadcast goes to its receiver, each sense to the robot that the key names."""

    def __init__(self, radio: Radio) -> None:
        self.radio = radio
        self.seats: dict[str, Seat] = {}
        self.waiting: dict[str, Seat] = {}  # seats with a sense, the one that waits longest first

    def sort(self, arrived: Arrival | Presence | Link | Request) -> None:
        """Store a broadcast for later, or a sense to answer."""
        match arrived:
            case Arrival(topic=topic, message=message) if topic is RADIO:
                self.radio.take(message)
            case Arrival(topic=topic, ids=ids, message=message) if topic is SENSE:
                seat = self.seats[ids["robot"]]
                seat.take(message)
                if seat.sense is not None:
                    self.waiting[seat.name] = seat

    def ready(self, now: float) -> Seat | None:
        """Return and no longer keep the seat that waits longest among those that can answer at a time [s], if any."""
        for seat in self.waiting.values():
            if seat.ready(now):
                return self.waiting.pop(seat.name)
        return None


class Shared(NamedTuple):
    """What robots of a process that were welcomed with the same map have in common; nobody changes it."""

    welcome: Welcome
    scenario: Scenario
    controller: Controller

    @classmethod
    def of(cls, welcome: Welcome) -> "Shared":
        """Return it for a robot's welcome."""
        scenario = Scenario.from_wire(welcome.scenario, welcome.packed)
        return cls(welcome, scenario, Controller(scenario.profile))

    def fits(self, welcome: Welcome) -> bool:
        """Return True if another robot was told the same."""
        own = self.welcome
        return (own.edits, own.packed, own.scenario) == (welcome.edits, welcome.packed, welcome.scenario)


def _join(bus: Bus, robots: Sequence[str | None], log: Callable[[str], None]) -> Inbox:
    """Join the world with each robot in turn, and announce it as soon as it can answer."""
    inbox = Inbox(Radio(bus))
    shared: Shared | None = None
    for asked in robots:
        welcome = bus.ask(JOIN, Join(robot=asked), timeout=WELCOME)
        if shared is None or not shared.fits(welcome):
            shared = Shared.of(welcome)
        settings, name, start = shared.scenario.settings, welcome.robot, Pose(*welcome.start)
        robot = Robot(name, number_of(name), shared.scenario, start, None, shared.controller, edits=welcome.edits)
        if welcome.state is not None:
            robot.resume(welcome.state)
        ear = Ear(inbox.radio, settings.radio.range)
        ear.tune(start.x, start.y)
        inbox.seats[name] = Seat(robot, ear, round(KEPT * settings.rate), log)
        bus.listen(SENSE, robot=name)
        bus.announce("robot", name)
    return inbox


def _serve(bus: Bus, inbox: Inbox, world: str, stop: Flag) -> bool:
    """Answer every sense while the world is alive; return False if told to stop."""
    wait = LOOK
    while not stop.is_set():
        arrived = bus.receive(wait)
        if arrived is not None:
            if isinstance(arrived, Presence) and arrived.session == world and not arrived.alive:
                return True
            inbox.sort(arrived)
        elif (seat := inbox.ready(monotonic())) is not None:
            _say(bus, seat.name, seat.answer(lambda: bus.fetch(MAP)))
        else:
            wait = PEEK if inbox.waiting else LOOK
            continue
        wait = 0.0
    return False


def _say(bus: Bus, name: str, answer: Given) -> None:
    """Send the broadcast, then the rest: a receiver of the command can rely on the broadcast being sent."""
    outputs, (zx, zy), sure = answer
    if outputs.broadcast is not None:
        bus.send(RADIO, outputs.broadcast, sure=sure, zx=zx, zy=zy, robot=name)
    bus.send(COMMAND, outputs.command, robot=name)
    if outputs.state is not None:
        bus.send(STATE, outputs.state, robot=name)
    if outputs.plan is not None:
        bus.send(PLAN, outputs.plan, robot=name)
