"""The process of the bridge: a connection for each robot, orders of a master in, states out, until the run is over."""

from collections import Counter, deque
from collections.abc import Callable
from datetime import UTC, datetime
from time import monotonic
from typing import Any, Final, NamedTuple
from uuid import uuid4

from msgspec.structs import replace

from swarm.bridge.fleet_client import ORDERED, REPLY, FleetClient
from swarm.bridge.vda5050 import messages as vda
from swarm.bridge.vda5050.factsheet import build_factsheet
from swarm.bridge.vda5050.line import (
    Broker,
    ConnectionDown,
    ConnectionUp,
    MqttConnection,
    MqttInbox,
    MqttMessage,
    check_broker,
    close_connections,
)
from swarm.bridge.vda5050.vehicle import Vehicle, WorldRequest
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
    Map,
    Order,
    State,
    Topic,
    Truth,
)
from swarm.stop_signal import stop_flag

LOOK: Final = 0.2  # s, the shortest time between two states of a vehicle, unless a master has said something
AT_LEAST: Final = 1.0  # s between two states; the standard asks for 30, but who comes late would wait for so long
HEARD: Final = ("order", "instantActions", "connection")  # the last one, to see if somebody else has our name
KEPT: Final = 8  # of our own messages on that topic


class VehicleNames(NamedTuple):
    """How vehicles are called: the first parts of their topics, and their map."""

    interface: str
    manufacturer: str
    map_id: str


BROKEN: Final = vda.Connection(connection_state="CONNECTIONBROKEN")
ONLINE: Final = vda.Connection(connection_state="ONLINE")
OFFLINE: Final = vda.Connection(connection_state="OFFLINE")


class ConnectedVehicle:
    """A vehicle, its connection, and what it has told last."""

    def __init__(self, robot: str, vehicle: Vehicle, names: VehicleNames, broker: Broker, inbox: MqttInbox) -> None:
        self.robot, self.vehicle, self._names = robot, vehicle, names
        self._counts: Counter[str] = Counter()
        will = self._topic_name("connection"), self._encode_message("connection", BROKEN)
        self.line = MqttConnection(broker, robot, inbox, tuple(self._topic_name(topic) for topic in HEARD), will)
        self.up = False
        self.clock: tuple[Clock | None, bool] = None, False  # the last one that the vehicle was told, and if alone
        self._own = deque([will[1]], maxlen=KEPT)  # what it has said on the topic `connection`
        self.told: vda.State | None = None  # without what changes all the time
        self.told_at = self.shown_at = float("-inf")  # s

    def publish_message(self, topic: str, body: vda.Body, *, sure: bool = False, kept: bool = False) -> None:
        """Publish a message, if there is a connection."""
        if self.up:
            packed = self._encode_message(topic, body)
            if topic == "connection":
                self._own.append(packed)
            self.line.publish_message(self._topic_name(topic), packed, sure=sure, kept=kept)

    def is_subscribed_to(self, topic: str) -> bool:
        """Return True if it listens to a topic."""
        return any(topic == self._topic_name(last) for last in HEARD)

    def is_own_message(self, payload: bytes) -> bool:
        """Return True if a message on its topic `connection` is its own."""
        return payload in self._own

    def make_farewell(self) -> tuple[MqttConnection, str, bytes]:
        """Return its connection, and what is said there last: that the vehicle goes."""
        return self.line, self._topic_name("connection"), self._encode_message("connection", OFFLINE)

    def _topic_name(self, last: str) -> str:
        return f"{self._names.interface}/{vda.MAJOR}/{self._names.manufacturer}/{self.robot}/{last}"

    def _encode_message(self, topic: str, body: vda.Body) -> bytes:
        header = vda.Header(
            header_id=self._counts[topic],
            timestamp=vda.format_time(datetime.now(UTC)),
            version=vda.VERSION,
            manufacturer=self._names.manufacturer,
            serial_number=self.robot,
        )
        self._counts[topic] += 1
        return vda.encode_message(header, body)


def run(
    endpoint: Endpoint,
    fleet: str,
    broker: Broker,
    names: VehicleNames,
    shown_every: float | None = None,
    log: Callable[[str], None] = print,
) -> int:
    """Show a fleet to master controls on a broker, until its run is over or we are told to stop.

    With ``shown_every`` [s] each vehicle tells where it is on the topic ``visualization`` too.

    Raises:
        ConfigError: the fleet's router or the broker does not answer, or refuses us.
    """
    with stop_flag() as stop, Bus(endpoint, fleet, log, Heartbeat()) as bus:
        check_broker(broker)
        log(f"fleet {fleet} is on broker {broker} as {names.interface}/{vda.MAJOR}/{names.manufacturer}/...")
        bridge = VehicleBridge(bus, broker, names, shown_every, log)
        try:
            bridge.follow_fleet(stop.is_set)
        finally:
            bridge.close()
    return 0


class VehicleBridge:
    """A fleet on a broker."""

    def __init__(
        self, bus: Bus, broker: Broker, names: VehicleNames, shown_every: float | None, log: Callable[[str], None]
    ) -> None:
        self._bus, self._broker, self._names, self._shown_every, self._log = bus, broker, names, shown_every, log
        self._ledger = Ledger(log)
        away = f"no connection to broker {broker}"
        self._away = Tally(lambda count, last: f"{away}, {count} times; the last: {last}", log)
        self._fleet = FleetClient(bus, log, (CLOCK, MAP, TRUTH, STATE, EVENT, *ORDERED))
        self._fold = self._fleet.fold
        self._inbox = MqttInbox()
        self._seats: dict[str, ConnectedVehicle] = {}  # by robot
        self._looked = float("-inf")  # s

    def follow_fleet(self, stopped: Callable[[], bool]) -> None:
        """Hand on all that comes, in both directions, until the run is over."""
        while not stopped() and not self._fold.over:
            for errand, how in self._fleet.receive_messages():
                if errand.robot in self._seats:
                    self._seats[errand.robot].vehicle.take_end(errand, how)
            self._connect_robots()
            self._update_vehicles()
            for item in self._inbox.take_items():
                self._handle_mqtt_item(item)
            self._publish_states(monotonic())
            if dropped := self._inbox.count_dropped():
                self._ledger.miss("mqtt", "the topics of masters", dropped)
            self._ledger.flush()
            self._away.flush()
        if self._fold.over:
            self._log("the run is over")

    def close(self) -> None:
        """Say a last state of all vehicles and that they go, and close all connections."""
        self._publish_states(monotonic(), last=True)
        close_connections([seat.make_farewell() for seat in self._seats.values()])
        self._seats = {}

    # --- the fleet ---

    def _connect_robots(self) -> None:
        """Connect for robots that have come, and disconnect for those that the run does not have any more."""
        settings = self._fold.settings
        if settings is None or self._seats.keys() == set(self._fold.robots):
            return
        close_connections(
            [self._seats.pop(name).make_farewell() for name in self._seats.keys() - set(self._fold.robots)]
        )
        for name in self._fold.robots:
            if name not in self._seats:
                vehicle = Vehicle(name, self._names.map_id, settings.of_robot(name))
                self._seats[name] = ConnectedVehicle(name, vehicle, self._names, self._broker, self._inbox)

    def _update_vehicles(self) -> None:
        for message, robot, _ in self._fold.take_messages():
            match message:
                case Map():  # with the kinds of robots that have come later
                    assert self._fold.settings is not None, "it has them"
                    for name, one in self._seats.items():
                        one.vehicle.take_settings(self._fold.settings.of_robot(name))
                case Truth(bodies=bodies):
                    for body in bodies:
                        if (seat := self._seats.get(body.robot)) is not None:
                            seat.vehicle.apply_message(body)
                case Event(robot=str() as about) if about in self._seats:
                    self._seats[about].vehicle.apply_message(message)
                case State() if robot in self._seats:
                    self._seats[robot].vehicle.apply_message(message)
        clock, alone = self._fold.clock, self._fleet.has_lost_world
        for seat in self._seats.values():
            if clock is not None and (seat.clock[0] is not clock or seat.clock[1] is not alone):
                seat.clock = clock, alone
                seat.vehicle.take_clock(clock, alone=alone)
            if (errand := seat.vehicle.resume_order()) is not None:
                self._fleet.errands.add(errand)

    # --- masters ---

    def _handle_mqtt_item(self, item: ConnectionUp | ConnectionDown | MqttMessage) -> None:
        seat = self._seats.get(item.name)
        match item:
            case _ if seat is None:
                pass  # it has just gone
            case ConnectionUp():
                seat.up = True
                seat.publish_message("connection", ONLINE, sure=True, kept=True)
                seat.vehicle.owes |= {"state", "factsheet"}
                self._log(f"{item.name} is on the broker")
            case ConnectionDown(why=why):
                seat.up = False
                self._away.add("mqtt", f"{item.name}: {why}")
            case MqttMessage(topic=topic) if not seat.is_subscribed_to(topic):
                pass  # some brokers send what nobody has asked for
            case MqttMessage(topic=topic, payload=payload) if topic.endswith("/connection"):
                if b'"ONLINE"' in payload and not seat.is_own_message(payload):
                    self._log(
                        f"{topic}: somebody else is ONLINE there, or was when the broker died: expected one vehicle "
                        "of this name; end the other bridge, or give one of them another --manufacturer"
                    )
            case MqttMessage(topic=topic, payload=payload):
                self._take_master_message(seat, topic.rsplit("/", 1)[1], payload)

    def _take_master_message(self, seat: ConnectedVehicle, topic: str, payload: bytes) -> None:
        """Take in what a master has said to a vehicle."""
        vehicle = seat.vehicle
        try:
            if topic == "order":
                order = vda.decode_message(payload, vda.Order)
                self._check_address(seat, order)
                ask = vehicle.take_order(order, uuid4().hex[:8])
                asks = [] if ask is None else [ask]
            else:
                actions = vda.decode_message(payload, vda.InstantActions)
                self._check_address(seat, actions)
                asks = vehicle.take_actions(actions.actions)
        except PeerError as fault:
            vehicle.refuse_message(topic, payload, fault)
            self._ledger.refuse(topic, PeerError(f"{seat.robot}/{topic}: {fault}"))
            return
        for one in asks:
            self._ask_world(seat, one)

    def _check_address(self, seat: ConnectedVehicle, message: vda.Header) -> None:
        """Check that a message is for the vehicle on whose topic it has come.

        Raises:
            PeerError: it names another one.
        """
        expected, got = (self._names.manufacturer, seat.robot), (message.manufacturer, message.serial_number)
        if expected != got:
            raise PeerError(f"manufacturer and serialNumber: expected {expected}, as in the topic, got {got}")

    def _ask_world(self, seat: ConnectedVehicle, ask: WorldRequest) -> None:
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
        errand = seat.vehicle.take_answer(ask, answer)
        if errand is not None:
            self._fleet.errands.add(errand)

    # --- what vehicles say ---

    def _publish_states(self, now: float, *, last: bool = False) -> None:
        """Publish what is owed to masters, and each state that has changed or is old."""
        look = last or now - self._looked >= LOOK
        if look:
            self._looked = now
        for seat in self._seats.values():
            if not seat.up or not (look or seat.vehicle.owes):
                continue
            vehicle = seat.vehicle
            if "factsheet" in vehicle.owes and self._fold.settings is not None:
                kind = self._fold.settings.kind(seat.robot)
                sheet = build_factsheet(vehicle.settings, AT_LEAST, self._shown_every, kind)
                seat.publish_message("factsheet", sheet, kept=True)
            state = vehicle.state_message()
            steady = replace(state, agv_position=None, velocity=None, distance_since_last_node=None, information=())
            if "state" in vehicle.owes or steady != seat.told or now - seat.told_at >= AT_LEAST:
                seat.publish_message("state", state)
                seat.told, seat.told_at = steady, now
            vehicle.owes.clear()
            if self._shown_every is not None and now - seat.shown_at >= self._shown_every - LOOK / 2:
                if (shown := vehicle.visualization_message()) is not None:
                    seat.publish_message("visualization", shown)
                seat.shown_at = now
