"""A robot as a process: join, then sense, decide, speak, act, until the world is gone or we are told to stop."""

from collections.abc import Callable
from threading import Event as Flag
from time import monotonic
from typing import Final, NamedTuple

from swarm.bus import Arrival, Bus, Endpoint, Presence
from swarm.geometry import Pose
from swarm.messages import COMMAND, JOIN, MAP, PLAN, RADIO, SENSE, STATE, Join, Sense, Welcome
from swarm.robot.brain import Inputs, Outputs, Robot
from swarm.robot.radio import Radio
from swarm.scenario.load import Scenario
from swarm.scenario.starts import number_of
from swarm.stopping import told_to_stop

LOOK: Final = 0.25  # s between two looks whether we are told to stop
PEEK: Final = 0.001  # s between two looks for a broadcast that is still missing: these wake nobody
OVERDUE: Final = 2.0  # s that lockstep waits for a broadcast the world says was heard
WELCOME: Final = 10.0  # s to wait for the world's answer
KEPT: Final = 5.0  # s for which answers are kept: a sense that is sent again is given the same answer
MOST_NAMED: Final = 10  # reasons for dropping a sense that are logged


def run(endpoint: Endpoint, fleet: str, robot: str | None = None, log: Callable[[str], None] = print) -> int:
    """Be one robot of a fleet; without a name, whichever place is free.

    Raises:
        ConfigError: there is no router.
        PeerError: the world has no such place.
    """
    with told_to_stop() as stop, Bus(endpoint, fleet, log) as bus:
        bus.watch_presence("world")
        while (world := _find_world(bus, stop)) is not None:
            welcome = bus.ask(JOIN, Join(robot=robot), timeout=WELCOME)
            robot = welcome.robot
            if not _serve(bus, welcome, world, stop, log):
                break
            bus.withdraw("robot", welcome.robot)  # the next world gives this place anew
    return 0


def _find_world(bus: Bus, stop: Flag) -> str | None:
    while not stop.is_set():
        arrived = bus.receive(LOOK)
        if isinstance(arrived, Presence) and arrived.alive:
            return arrived.session
    return None


def _serve(bus: Bus, welcome: Welcome, world: str, stop: Flag, log: Callable[[str], None]) -> bool:
    """Be that robot while that world lives; False when told to stop."""
    scenario = Scenario.from_wire(welcome.scenario, welcome.packed)
    name, start = welcome.robot, Pose(*welcome.start)
    robot = Robot(name, number_of(name), scenario, start, edits=welcome.edits)
    if welcome.state is not None:
        robot.resume(welcome.state)
    radio = Radio(bus, scenario.settings.radio.range)
    radio.tune(start.x, start.y)
    inbox = Inbox(robot, radio, log)
    answers = Answers(round(KEPT * scenario.settings.rate))
    bus.listen(SENSE, robot=name)
    bus.announce("robot", name)
    sense: Sense | None = None
    while not stop.is_set():
        arrived = bus.receive(LOOK if sense is None else 0.0)
        if arrived is not None:
            if isinstance(arrived, Presence) and arrived.session == world and not arrived.alive:
                return True
            sense = _newer(sense, inbox.sort(arrived))
        elif sense is not None:
            if (again := answers.to(sense)) is not None:
                _say(bus, name, again, sure=sense.lockstep)
                sense = None
                continue
            if sense.run != robot.run:
                radio.begin(sense.run)
            sense = _step(bus, robot, inbox, answers, sense, log)
    return False


class Answer(NamedTuple):
    """What a robot says to one sense, and from which zone of the radio."""

    outputs: Outputs
    zone: tuple[int, int]


class Answers:
    """The answers of the last ticks: a robot steps once a tick, and a sense that comes again gets the same answer."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._given: dict[tuple[int, int], Answer] = {}  # by run and tick, oldest first

    def to(self, sense: Sense) -> Answer | None:
        """Return what was answered to this sense before, if anything was."""
        return self._given.get((sense.run, sense.tick))

    def keep(self, sense: Sense, answer: Answer) -> None:
        """Keep an answer, and forget the oldest where there are too many."""
        self._given[sense.run, sense.tick] = answer
        if len(self._given) > self._most:
            del self._given[next(iter(self._given))]


class Inbox:
    """Sorts what arrives for one robot: a sense that does not fit its scenario is dropped, each reason logged once."""

    def __init__(self, robot: Robot, radio: Radio, log: Callable[[str], None]) -> None:
        self.radio = radio
        self._robot = robot
        self._log = log
        self._named: set[str] = set()

    def sort(self, arrived: object) -> Sense | None:
        """Put a broadcast away, return a sense."""
        if not isinstance(arrived, Arrival):
            return None
        if arrived.topic is RADIO:
            self.radio.take(arrived.message)
        if arrived.topic is not SENSE:
            return None
        sense: Sense = arrived.message
        fault = self._robot.fault_of(sense)
        if fault is None:
            return sense
        if fault not in self._named and len(self._named) < MOST_NAMED:
            self._named.add(fault)
            self._log(f"{self._robot.name}: tick {sense.tick}: the sense was dropped: {fault}")
        return None


def _newer(known: Sense | None, other: Sense | None) -> Sense | None:
    if known is None or other is None:
        return other or known
    return max(known, other, key=lambda sense: (sense.run, sense.tick))


def _step(
    bus: Bus, robot: Robot, inbox: Inbox, answers: Answers, sense: Sense, log: Callable[[str], None]
) -> Sense | None:
    """Answer a sense; return a newer one instead, should it come while this one waits for its broadcasts."""
    radio = inbox.radio
    if sense.lockstep:
        deadline = monotonic() + OVERDUE
        while radio.lacks(sense.hears):
            arrived = bus.receive(PEEK)
            if arrived is None and monotonic() > deadline:
                log(f"{robot.name}: tick {sense.tick}: a broadcast that was heard did not arrive in {OVERDUE} s")
                break
            newer = _newer(sense, inbox.sort(arrived))
            if newer is not sense:
                return newer
        heard = radio.exactly(sense.hears, sense.tick)
    else:
        heard = radio.what_came(sense.hears, sense.tick)
    if robot.missed(sense):
        for floor in bus.fetch(MAP):
            robot.take_map(Scenario.from_wire(floor.scenario, floor.packed), floor.edits)
    zone = radio.tune(sense.x, sense.y)
    answer = Answer(robot.step(Inputs(sense, heard)), zone)
    answers.keep(sense, answer)
    _say(bus, robot.name, answer, sure=sense.lockstep)
    return None


def _say(bus: Bus, name: str, answer: Answer, *, sure: bool) -> None:
    """Put the broadcast on the radio, then send the rest: who has the command knows that the broadcast was sent."""
    outputs, (zx, zy) = answer
    if outputs.broadcast is not None:
        bus.send(RADIO, outputs.broadcast, sure=sure, zx=zx, zy=zy, robot=name)
    bus.send(COMMAND, outputs.command, robot=name)
    if outputs.state is not None:
        bus.send(STATE, outputs.state, robot=name)
    if outputs.plan is not None:
        bus.send(PLAN, outputs.plan, robot=name)
