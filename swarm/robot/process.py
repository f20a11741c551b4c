"""The process of a robot: it joins a world and answers every sense; when that world is gone, it joins the next."""

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

LOOK: Final = 0.25  # s between two checks whether the process must stop
PEEK: Final = 0.001  # s between two checks for a missing broadcast, whose arrival wakes nothing
OVERDUE: Final = 2.0  # s that lockstep waits for a broadcast that the sense lists as heard
WELCOME: Final = 10.0  # s to wait for the answer to a join
KEPT: Final = 5.0  # s for which answers are kept: a repeated sense gets the same answer
MOST_NAMED: Final = 10  # reasons for dropping a sense that are logged, at most


def run(endpoint: Endpoint, fleet: str, robot: str | None = None, log: Callable[[str], None] = print) -> int:
    """Run one robot of a fleet until told to stop, and return the exit status; without a name it takes any free place.

    Raises:
        ConfigError: no router answers.
        PeerError: the world has no such place.
    """
    with told_to_stop() as stop, Bus(endpoint, fleet, log) as bus:
        bus.watch_presence("world")
        while (world := _find_world(bus, stop)) is not None:
            welcome = bus.ask(JOIN, Join(robot=robot), timeout=WELCOME)
            robot = welcome.robot
            if not _serve(bus, welcome, world, stop, log):
                break
            bus.withdraw("robot", welcome.robot)  # the next world assigns the place again
    return 0


def _find_world(bus: Bus, stop: Flag) -> str | None:
    while not stop.is_set():
        arrived = bus.receive(LOOK)
        if isinstance(arrived, Presence) and arrived.alive:
            return arrived.session
    return None


def _serve(bus: Bus, welcome: Welcome, world: str, stop: Flag, log: Callable[[str], None]) -> bool:
    """Run the robot while the world is alive; return False if told to stop."""
    scenario = Scenario.from_wire(welcome.scenario, welcome.packed)
    name, start = welcome.robot, Pose(*welcome.start)
    robot = Robot(name, number_of(name), scenario, start, edits=welcome.edits)
    if welcome.state is not None:
        robot.resume(welcome.state)
    radio = Radio(bus, scenario.settings.radio.range)
    radio.tune(start.x, start.y)
    inbox = Inbox(robot, radio, log)
    repeats = Repeats(round(KEPT * scenario.settings.rate))
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
            if (again := repeats.to(sense)) is not None:
                _say(bus, name, again, sure=sense.lockstep)
                sense = None
                continue
            if sense.run != robot.run:
                radio.begin(sense.run)
            sense = _step(bus, robot, inbox, repeats, sense, log)
    return False


class Given(NamedTuple):
    """A robot's answer to one sense, and the radio zone that it is sent from."""

    outputs: Outputs
    zone: tuple[int, int]


class Repeats:
    """The answers of the last ticks: a robot steps once per tick, and a repeated sense gets the same answer."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._given: dict[tuple[int, int], Given] = {}  # by run and tick, oldest first

    def to(self, sense: Sense) -> Given | None:
        """Return the earlier answer to this sense, or None."""
        return self._given.get((sense.run, sense.tick))

    def keep(self, sense: Sense, answer: Given) -> None:
        """Store an answer; drop the oldest one if there are too many."""
        self._given[sense.run, sense.tick] = answer
        if len(self._given) > self._most:
            del self._given[next(iter(self._given))]


class Inbox:
    """The inbox of one robot; it drops each sense that does not fit the scenario and logs each reason once."""

    def __init__(self, robot: Robot, radio: Radio, log: Callable[[str], None]) -> None:
        self.radio = radio
        self._robot = robot
        self._log = log
        self._named: set[str] = set()

    def sort(self, arrived: object) -> Sense | None:
        """Store a broadcast for later, or return a sense that fits the scenario."""
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
    bus: Bus, robot: Robot, inbox: Inbox, repeats: Repeats, sense: Sense, log: Callable[[str], None]
) -> Sense | None:
    """Answer a sense; if a newer one arrives during the wait for broadcasts, return that one instead."""
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
    answer = Given(robot.step(Inputs(sense, heard)), zone)
    repeats.keep(sense, answer)
    _say(bus, robot.name, answer, sure=sense.lockstep)
    return None


def _say(bus: Bus, name: str, answer: Given, *, sure: bool) -> None:
    """Send the broadcast, then the rest: a receiver of the command can rely on the broadcast being sent."""
    outputs, (zx, zy) = answer
    if outputs.broadcast is not None:
        bus.send(RADIO, outputs.broadcast, sure=sure, zx=zx, zy=zy, robot=name)
    bus.send(COMMAND, outputs.command, robot=name)
    if outputs.state is not None:
        bus.send(STATE, outputs.state, robot=name)
    if outputs.plan is not None:
        bus.send(PLAN, outputs.plan, robot=name)
