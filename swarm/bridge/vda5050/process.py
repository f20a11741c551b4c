"""The process of the bridge: a connection for each robot, orders of a master in, states out, until the run is over."""

from collections import Counter, deque
from collections.abc import Callable
from datetime import UTC, datetime
from time import monotonic
from typing import Any, Final, NamedTuple
from uuid import uuid4

from msgspec.structs import replace

from swarm.bridge.following import ORDERED, REPLY, Follower
from swarm.bridge.vda5050 import messages as vda
from swarm.bridge.vda5050.factsheet import factsheet
from swarm.bridge.vda5050.line import Broker, Down, Heard, Inbox, Line, Up, check, end
from swarm.bridge.vda5050.vehicle import Ask, Vehicle
from swarm.bus import Bus, Endpoint
from swarm.bus.losses import Ledger, Tally
from swarm.errors import PeerError
from swarm.heartbeat import Heartbeat
from swarm.messages import (
    CLOCK,
    EVENT,
    MAP,
    ORDER,
    ROBOT_ACTION,
    STATE,
    TRUTH,
    Accepted,
    Clock,
    Event,
    Order,
    State,
    Topic,
    Truth,
)
from swarm.stopping import told_to_stop

LOOK: Final = 0.2  # s, the shortest time between two states of a vehicle, unless a master has said something
AT_LEAST: Final = 1.0  # s between two states; the standard asks for 30, but who comes late would wait for so long
HEARD: Final = ("order", "instantActions", "connection")  # the last one, to see if somebody else has our name
KEPT: Final = 8  # of our own messages on that topic


class Names(NamedTuple):
    """How vehicles are called: the first parts of their topics, and their map."""

    interface: str
    manufacturer: str
    map_id: str


BROKEN: Final = vda.Connection(connection_state="CONNECTIONBROKEN")
ONLINE: Final = vda.Connection(connection_state="ONLINE")
OFFLINE: Final = vda.Connection(connection_state="OFFLINE")


class ConnectedVehicle:
    """A vehicle, its connection, and what it has told last."""

    def __init__(self, robot: str, vehicle: Vehicle, names: Names, broker: Broker, inbox: Inbox) -> None:
        self.robot, self.vehicle, self._names = robot, vehicle, names
        self._counts: Counter[str] = Counter()
        will = self._topic("connection"), self._packed("connection", BROKEN)
        self.line = Line(broker, robot, inbox, tuple(self._topic(topic) for topic in HEARD), will)
        self.up = False
        self.clock: tuple[Clock | None, bool] = None, False  # the last one that the vehicle was told, and if alone
        self._own = deque([will[1]], maxlen=KEPT)  # what it has said on the topic `connection`
        self.told: vda.State | None = None  # without what changes all the time
        self.told_at = self.shown_at = float("-inf")  # s

    def say(self, topic: str, body: vda.Body, *, sure: bool = False, kept: bool = False) -> None:
        """Publish a message, if there is a connection."""
        if self.up:
            packed = self._packed(topic, body)
            if topic == "connection":
                self._own.append(packed)
            self.line.say(self._topic(topic), packed, sure=sure, kept=kept)

    def hears(self, topic: str) -> bool:
        """Return True if it listens to a topic."""
        return any(topic == self._topic(last) for last in HEARD)

    def is_own(self, payload: bytes) -> bool:
        """Return True if a message on its topic `connection` is its own."""
        return payload in self._own

    def farewell(self) -> tuple[Line, str, bytes]:
        """Return its connection, and what is said there last: that the vehicle goes."""
        return self.line, self._topic("connection"), self._packed("connection", OFFLINE)

    def _topic(self, last: str) -> str:
        return f"{self._names.interface}/{vda.MAJOR}/{self._names.manufacturer}/{self.robot}/{last}"

    def _packed(self, topic: str, body: vda.Body) -> bytes:
        header = vda.Header(
            header_id=self._counts[topic],
            timestamp=vda.stamped(datetime.now(UTC)),
            version=vda.VERSION,
            manufacturer=self._names.manufacturer,
            serial_number=self.robot,
        )
        self._counts[topic] += 1
        return vda.encoded(header, body)


def run(
    endpoint: Endpoint,
    fleet: str,
    broker: Broker,
    names: Names,
    shown_every: float | None = None,
    log: Callable[[str], None] = print,
) -> int:
    """Show a fleet to master controls on a broker, until its run is over or we are told to stop.

    With ``shown_every`` [s] each vehicle tells where it is on the topic ``visualization`` too.

    Raises:
        ConfigError: the fleet's router or the broker does not answer, or refuses us.
    """
    with told_to_stop() as stop, Bus(endpoint, fleet, log, Heartbeat()) as bus:
        check(broker)
        log(f"fleet {fleet} is on broker {broker} as {names.interface}/{vda.MAJOR}/{names.manufacturer}/...")
        bridge = VehicleBridge(bus, broker, names, shown_every, log)
        try:
            bridge.follow(stop.is_set)
        finally:
            bridge.close()
    return 0


class VehicleBridge:
    """A fleet on a broker."""

    def __init__(
        self, bus: Bus, broker: Broker, names: Names, shown_every: float | None, log: Callable[[str], None]
    ) -> None:
        self._bus, self._broker, self._names, self._shown_every, self._log = bus, broker, names, shown_every, log
        self._ledger = Ledger(log)
        away = f"no connection to broker {broker}"
        self._away = Tally(lambda count, last: f"{away}, {count} times; the last: {last}", log)
        self._fleet = Follower(bus, log, (CLOCK, MAP, TRUTH, STATE, EVENT, *ORDERED))
        self._fold = self._fleet.fold
        self._inbox = Inbox()
        self._seats: dict[str, ConnectedVehicle] = {}  # by robot
        self._looked = float("-inf")  # s

    def follow(self, stopped: Callable[[], bool]) -> None:
        """Hand on all that comes, in both directions, until the run is over."""
        while not stopped() and not self._fold.over:
            for errand, how in self._fleet.take_in():
                if errand.robot in self._seats:
                    self._seats[errand.robot].vehicle.ended(errand, how)
            self._seat_robots()
            self._take_news()
            for item in self._inbox.take():
                self._heed(item)
            self._tell(monotonic())
            if dropped := self._inbox.dropped():
                self._ledger.miss("mqtt", "the topics of masters", dropped)
            self._ledger.flush()
            self._away.flush()
        if self._fold.over:
            self._log("the run is over")

    def close(self) -> None:
        """Say a last state of all vehicles and that they go, and close all connections."""
        self._tell(monotonic(), last=True)
        end([seat.farewell() for seat in self._seats.values()])
        self._seats = {}

    # --- the fleet ---

    def _seat_robots(self) -> None:
        """Connect for robots that have come, and disconnect for those that the run does not have any more."""
        settings = self._fold.settings
        if settings is None or self._seats.keys() == set(self._fold.robots):
            return
        end([self._seats.pop(name).farewell() for name in self._seats.keys() - set(self._fold.robots)])
        for name in self._fold.robots:
            if name not in self._seats:
                vehicle = Vehicle(name, self._names.map_id, settings)
                self._seats[name] = ConnectedVehicle(name, vehicle, self._names, self._broker, self._inbox)

    def _take_news(self) -> None:
        for message, robot, _ in self._fold.said():
            match message:
                case Truth(bodies=bodies):
                    for body in bodies:
                        if (seat := self._seats.get(body.robot)) is not None:
                            seat.vehicle.take(body)
                case Event(robot=str() as about) if about in self._seats:
                    self._seats[about].vehicle.take(message)
                case State() if robot in self._seats:
                    self._seats[robot].vehicle.take(message)
        clock, alone = self._fold.clock, self._fleet.alone
        for seat in self._seats.values():
            if clock is not None and (seat.clock[0] is not clock or seat.clock[1] is not alone):
                seat.clock = clock, alone
                seat.vehicle.take_clock(clock, alone=alone)
            if (errand := seat.vehicle.back()) is not None:
                self._fleet.errands.add(errand)

    # --- masters ---

    def _heed(self, item: Up | Down | Heard) -> None:
        seat = self._seats.get(item.name)
        match item:
            case _ if seat is None:
                pass  # it has just gone
            case Up():
                seat.up = True
                seat.say("connection", ONLINE, sure=True, kept=True)
                seat.vehicle.owes |= {"state", "factsheet"}
                self._log(f"{item.name} is on the broker")
            case Down(why=why):
                seat.up = False
                self._away.add("mqtt", f"{item.name}: {why}")
            case Heard(topic=topic) if not seat.hears(topic):
                pass  # some brokers send what nobody has asked for
            case Heard(topic=topic, payload=payload) if topic.endswith("/connection"):
                if b'"ONLINE"' in payload and not seat.is_own(payload):
                    self._log(
                        f"{topic}: somebody else is ONLINE there, or was when the broker died: expected one vehicle "
                        "of this name; end the other bridge, or give one of them another --manufacturer"
                    )
            case Heard(topic=topic, payload=payload):
                self._hear(seat, topic.rsplit("/", 1)[1], payload)

    def _hear(self, seat: ConnectedVehicle, topic: str, payload: bytes) -> None:
        """Take in what a master has said to a vehicle."""
        vehicle = seat.vehicle
        try:
            if topic == "order":
                order = vda.decoded(payload, vda.Order)
                self._check_address(seat, order)
                ask = vehicle.order(order, uuid4().hex[:8])
                asks = [] if ask is None else [ask]
            else:
                actions = vda.decoded(payload, vda.InstantActions)
                self._check_address(seat, actions)
                asks = vehicle.act(actions.actions)
        except PeerError as fault:
            vehicle.refuse(topic, payload, fault)
            self._ledger.refuse(topic, PeerError(f"{seat.robot}/{topic}: {fault}"))
            return
        for one in asks:
            self._ask(seat, one)

    def _check_address(self, seat: ConnectedVehicle, message: vda.Header) -> None:
        """Check that a message is for the vehicle on whose topic it has come.

        Raises:
            PeerError: it names another one.
        """
        expected, got = (self._names.manufacturer, seat.robot), (message.manufacturer, message.serial_number)
        if expected != got:
            raise PeerError(f"manufacturer and serialNumber: expected {expected}, as in the topic, got {got}")

    def _ask(self, seat: ConnectedVehicle, ask: Ask) -> None:
        """Ask the world for what a master wants."""
        topic: Topic[Any] = ORDER if isinstance(ask.request, Order) else ROBOT_ACTION
        answer: Accepted | PeerError
        try:
            accepted: Accepted = self._bus.ask(topic, ask.request, timeout=REPLY, robot=seat.robot)
            answer = accepted
            self._log(accepted.text)
        except PeerError as fault:
            answer = fault
            self._log(str(fault))
        errand = seat.vehicle.answered(ask, answer)
        if errand is not None:
            self._fleet.errands.add(errand)

    # --- what vehicles say ---

    def _tell(self, now: float, *, last: bool = False) -> None:
        """Publish what is owed to masters, and each state that has changed or is old."""
        look = last or now - self._looked >= LOOK
        if look:
            self._looked = now
        for seat in self._seats.values():
            if not seat.up or not (look or seat.vehicle.owes):
                continue
            vehicle = seat.vehicle
            if "factsheet" in vehicle.owes and self._fold.settings is not None:
                sheet = factsheet(self._fold.settings, AT_LEAST, self._shown_every)
                seat.say("factsheet", sheet, kept=True)
            state = vehicle.said()
            steady = replace(state, agv_position=None, velocity=None, distance_since_last_node=None, information=())
            if "state" in vehicle.owes or steady != seat.told or now - seat.told_at >= AT_LEAST:
                seat.say("state", state)
                seat.told, seat.told_at = steady, now
            vehicle.owes.clear()
            if self._shown_every is not None and now - seat.shown_at >= self._shown_every - LOOK / 2:
                if (shown := vehicle.shown()) is not None:
                    seat.say("visualization", shown)
                seat.shown_at = now
