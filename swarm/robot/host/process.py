"""The process of one robot or more: each joins a world and answers every sense, also of that world started again."""

from collections.abc import Callable, Sequence
from threading import Event as Flag
from typing import Final, NamedTuple

from swarm.bus import Arrival, Bus, Endpoint, Link, Presence, Request
from swarm.errors import SwarmError
from swarm.fingerprint import OF_ROBOTS, fingerprint
from swarm.fuzzy import Controller
from swarm.geometry import Pose
from swarm.heartbeat import Heartbeat
from swarm.messages import (
    CLOCK,
    COMMAND,
    JOIN,
    LEAVE,
    MAP,
    PLAN,
    RADIO,
    SENSE,
    STATE,
    VERSION,
    Clock,
    Join,
    Leave,
    Welcome,
)
from swarm.robot.brain import Robot
from swarm.robot.host.membership import FIRST, Ending, SeatRequest
from swarm.robot.host.radio import Radio, Receiver
from swarm.robot.host.seat import KEPT, GivenAnswer, Seat
from swarm.scenario.load import Scenario
from swarm.scenario.starts import number_of
from swarm.stop_signal import stop_flag
from swarm.suspend_clock import Awake

LOOK: Final = 0.25  # s between two checks whether the process must stop
PEEK: Final = 0.001  # s between two checks for a missing broadcast, whose arrival wakes nothing
GOODBYE: Final = 3.0  # s to wait for the answer when a robot leaves
WELCOME: Final = 10.0  # s to wait for the answer to a join
UNSEEN: Final = 3.0  # s since a world came or went, before one of another wire is looked for
AGAIN: Final = 60.0  # s between two complaints of it
SHARED: Final = 4  # welcomes that are kept for robots that are told the same
ECHOES: Final = (0.0, 0.25, 0.75, 1.75)  # s after the router is back; others come back within half a second


def run(
    endpoint: Endpoint,
    fleet: str,
    robots: Sequence[str | None] = (None,),
    log: Callable[[str], None] = print,
    once: bool = False,
) -> int:
    """Run robots of a fleet until told to stop, and return the exit status; each None takes any free place.

    With ``once`` they end when the run is over that they were in, or when its world has gone for long.

    Raises:
        ConfigError: no router answers.
    """
    with stop_flag() as stop, Bus(endpoint, fleet, log, Heartbeat()) as bus:
        bus.watch_presence("world")
        bus.listen(CLOCK)
        host = RobotHost(bus, robots, log, once=once)
        host.serve(stop)
        host.say_goodbye()
    return 0


class Inbox:
    """The arrivals of a process: each broadcast goes to its receiver, each sense to the robot that the key names."""

    def __init__(self, radio: Radio) -> None:
        self.radio = radio
        self.seats: dict[str, Seat] = {}
        self.waiting: dict[str, Seat] = {}  # seats with a sense, the one that waits longest first

    def sort(self, arrived: Arrival | Presence | Link | Request) -> tuple[str, GivenAnswer] | None:
        """Store a broadcast for later, or a sense to answer; return a robot's answer to one that it had answered."""
        match arrived:
            case Arrival(topic=topic, message=message) if topic is RADIO:
                self.radio.take(message)
            case Arrival(topic=topic, ids=ids, message=message, sender=sender) if topic is SENSE:
                seat = self.seats.get(ids["robot"])
                if seat is None or not seat.obeys(sender):
                    return None  # its place is to be joined again, or this is not its world
                if (given := seat.repeat(message)) is not None:
                    return seat.name, given
                seat.take(message)
                if seat.sense is not None:
                    self.waiting[seat.name] = seat
        return None

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


class RobotHost:
    """The robots of a process. They keep their memory while the world that they are in is away and comes back."""

    def __init__(
        self,
        bus: Bus,
        robots: Sequence[str | None],
        log: Callable[[str], None],
        *,
        once: bool = False,
        awake: Awake | None = None,
    ) -> None:
        self._bus, self._log, self._awake, self._once = bus, log, awake or Awake(), once
        self._ending = Ending(once=once)
        self._places = [SeatRequest(asked) for asked in robots]
        self._worlds: set[str] = set()  # sessions
        self._world: str | None = None  # identity
        self._inbox = Inbox(Radio(bus))
        self._shared: list[Shared] = []  # the newest first; robots of several kinds are told several things
        self._echoes: list[float] = []  # s; when to say the last answers again
        self._looks = UNSEEN  # s; when to look for a world of another wire

    def serve(self, stop: Flag) -> None:
        """Answer every sense, and join a world with each robot that is in none, until told to stop."""
        wait = LOOK
        while not stop.is_set():
            arrived = self._bus.receive(wait)
            now = self._awake.now()
            if self._once and self._ending.done(now):
                return
            wait = 0.0
            if arrived is not None:
                self._take(arrived, now)
            elif (seat := self._inbox.ready(now)) is not None:
                self._say(seat.name, seat.answer(lambda: self._bus.fetch(MAP)))
            elif (place := self._to_join(now)) is not None:
                self._join(place)
            elif self._echoes and now >= self._echoes[0]:
                self._echoes.pop(0)
                for seat in self._inbox.seats.values():
                    for given in seat.last_answers():
                        self._say(seat.name, given)
            elif not self._worlds and now >= self._looks:
                self._look_for_other_wires(now)
            else:
                wait = PEEK if self._inbox.waiting else FIRST if self._echoes or self._lacks_places else LOOK

    def _take(self, arrived: Arrival | Presence | Link | Request, now: float) -> None:
        match arrived:
            case Arrival(topic=topic, message=message, sender=sender) if topic is CLOCK:
                if self._is_ours(sender):
                    self._hear_clock(message, now)
            case Presence(role="world", session=session, alive=alive):
                (self._worlds.add if alive else self._worlds.discard)(session)
                self._looks = now + UNSEEN
                if session in [place.session for place in self._places] and (said := self._ending.look(alive, now)):
                    self._log(said)
                for place in self._places:
                    place.ask_at_once()
            case Link(up=up):
                for seat in self._inbox.seats.values():
                    seat.wait_again()
                    seat.doubt_last_answers()
                self._echoes = [now + pause for pause in ECHOES] if up else []
            case _:
                if (again := self._inbox.sort(arrived)) is not None:
                    self._say(*again)

    def _hear_clock(self, clock: Clock, now: float) -> None:
        """Take in the clock of the world; a robot that it has not listed for long joins again."""
        if said := self._ending.hear(clock):
            self._log(said)
        for place in self._places:
            if place.name is None or place.session not in self._worlds:
                continue
            place.hear(clock, now)
            if place.is_left_out(now):
                self._log(f"{place.name}: the world does not see this process; it joins once more")
                self._bus.withdraw("robot", place.name)
                place.join_again()

    def _is_ours(self, sender: int | None) -> bool:
        """Return True if a message comes from the world of these robots, as far as one can tell."""
        return any(seat.speaker in {None, sender} for seat in self._inbox.seats.values())

    # --- joining ---

    def _look_for_other_wires(self, now: float) -> None:
        """Say it if the fleet has a world that does not understand these robots: they would wait for ever."""
        found = self._bus.other_wires("world")
        self._looks = now + (AGAIN if found else UNSEEN)
        if found:
            self._log(
                f"expected a world of wire v{VERSION}, got one of {', '.join(found)}; install the zenoh-swarm that it "
                "has, `swarm --version` says which; this process goes on waiting"
            )

    @property
    def _lacks_places(self) -> bool:
        return any(place.session not in self._worlds for place in self._places)

    def _to_join(self, now: float) -> SeatRequest | None:
        """Return a robot that is in no world that lives, if it is time to ask."""
        if not self._worlds:
            return None
        return next((one for one in self._places if one.session not in self._worlds and one.due(now)), None)

    def _join(self, place: SeatRequest) -> None:
        """Ask the world for a robot's place; go on with its run, or begin a new one."""
        bus, known = self._bus, place.name in self._inbox.seats
        asks = Join(
            robot=place.name, session=bus.id, world=self._world if known else None, sender=bus.sender,
            code=fingerprint(libraries=OF_ROBOTS),
        )  # fmt: skip
        try:
            welcome: Welcome = bus.ask(JOIN, asks, WELCOME, fits=lambda reply: reply.session in self._worlds)
            if welcome.world != self._world or not known:
                self._sit_down(place, welcome)
        except SwarmError as fault:
            if place.take_refusal(str(fault), self._awake.now()):
                self._log(f"{place.name or 'a robot'}: {fault}; it asks again and again")
        else:
            place.take_welcome(welcome.session)
            self._log(self._ending.format_join(welcome))
            self._inbox.seats[welcome.robot].speaker = welcome.sender
            self._inbox.seats[welcome.robot].doubt_last_answers()
            bus.announce("robot", welcome.robot)

    def _sit_down(self, place: SeatRequest, welcome: Welcome) -> None:
        """Begin in a world that does not know this process yet."""
        shared = next((one for one in self._shared if one.fits(welcome)), None)
        if shared is None:
            shared = Shared.of(welcome)
            self._shared = [shared, *self._shared][:SHARED]
        if welcome.world != self._world:
            self._leave()
            self._world = welcome.world
        settings, name, start = shared.scenario.settings, welcome.robot, Pose(*welcome.start)
        robot = Robot(name, number_of(name), shared.scenario, start, None, shared.controller, edits=welcome.edits)
        if welcome.state is not None:
            robot.resume(welcome.state, welcome.assigned)
        receiver = Receiver(self._inbox.radio, settings.radio.range)
        receiver.tune(start.x, start.y)
        self._inbox.seats[name] = Seat(robot, receiver, round(KEPT * settings.rate), self._log, welcome.world)
        self._bus.listen(SENSE, robot=name)
        place.name = name

    def _leave(self) -> None:
        """Forget the world before: all robots begin in the next one."""
        for seat in self._inbox.seats.values():
            seat.leave()
            self._bus.withdraw("robot", seat.name)  # the next world assigns the place again
        self._inbox = Inbox(Radio(self._bus))
        for place in self._places:
            place.session = None

    def say_goodbye(self) -> None:
        """Give the places back: the world waits for none of these robots any more, and others may take them."""
        if self._ending.over:
            return  # the world ends, and waits for nobody
        present = [place for place in self._places if place.name is not None and place.session in self._worlds]
        worlds = self._bus.sessions("world") if present else set()  # this process may not have heard that it has gone
        for place in present:
            if place.name is not None and place.session in worlds:
                try:
                    self._bus.ask(LEAVE, Leave(robot=place.name, session=self._bus.id), GOODBYE)
                except SwarmError as fault:
                    self._log(f"{place.name}: left without an answer: {fault}")
                    return  # each of them would wait as long

    # --- speaking ---

    def _say(self, name: str, answer: GivenAnswer) -> None:
        """Send the broadcast, then the rest: a receiver of the command can rely on the broadcast being sent."""
        outputs, (zx, zy), sure, *_ = answer
        bus = self._bus
        if outputs.broadcast is not None:
            bus.send(RADIO, outputs.broadcast, sure=sure, zx=zx, zy=zy, robot=name)
        bus.send(COMMAND, outputs.command, robot=name)
        if outputs.state is not None:
            bus.send(STATE, outputs.state, robot=name)
        if outputs.plan is not None:
            bus.send(PLAN, outputs.plan, robot=name)
