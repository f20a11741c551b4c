"""A router with keys, as a process: who gets in, what its members may do, and a whole fleet."""

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from queue import Queue
from typing import Any, NamedTuple

import pytest
import zenoh

from swarm.bus import Arrival, Bus, Endpoint
from swarm.bus.codec import encode
from swarm.bus.settings import client
from swarm.cli import main
from swarm.errors import ConfigError
from swarm.messages import (
    ACTION,
    CLOCK,
    EDIT,
    JOIN,
    RADIO,
    STATE,
    Activity,
    Broadcast,
    Message,
    State,
    Topic,
)
from swarm.scenario.load import load
from swarm.secure import Identity
from swarm.secure.certificates import Authority
from tests.launch.actors import PATIENCE, Command, Fleet
from tests.secure.shared import DAY, NOW, fleet_keys, member
from world.simulate import Simulation

pytestmark = pytest.mark.processes
BELOW = "swarm/v1/f/"
SAID = Broadcast(
    robot="r1", run=0, tick=0, x=0.0, y=0.0, yaw=0.0, activity=Activity.READY, target=0, distance=0.0, reached=[]
)
LAST = State(
    robot="r1", run=0, tick=0, activity=Activity.READY, target=0, reached=[], unreachable=[], distance=0.0, replans=0
)


class Secured(NamedTuple):
    """A router that runs with the keys of a fleet."""

    keys: Path
    authority: Authority
    port: int
    router: Command

    def endpoint(self, name: str, keys: Path | None = None) -> Endpoint:
        return Endpoint("127.0.0.1", self.port, Identity(keys or self.keys, name))

    def session(self, name: str) -> zenoh.Session:
        return zenoh.open(client(self.endpoint(name)))

    def bus(self, name: str) -> Bus:
        return Bus(self.endpoint(name), "f", lambda line: None)


@pytest.fixture(scope="module")
def secured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Secured]:
    folder = tmp_path_factory.mktemp("secured")
    authority = fleet_keys(folder / "keys")
    place = Endpoint("127.0.0.1", 0, Identity(folder / "keys", "router")).claim()
    arguments = ("--listen", str(place), "--secure", str(folder / "keys"))
    with Command("router", *arguments, runtime=folder) as router:
        router.await_line("router: listening on tls/")
        bus = Secured(folder / "keys", authority, place.port, router).bus("watcher")
        with bus:  # waits until the router answers
            pass
        yield Secured(folder / "keys", authority, place.port, router)


# --- who gets in ---


def settings(secured: Secured, files: dict[str, Path], scheme: str = "tls") -> zenoh.Config:
    """Return what an intruder's session may use, without our checks of its files."""
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [f"{scheme}/127.0.0.1:{secured.port}"],
        "connect/timeout_ms": 0,
        "scouting/multicast/enabled": False,
        "transport/link/tls": {name: str(path) for name, path in files.items()} | {"enable_mtls": len(files) > 1},
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config


def of(folder: Path, name: str) -> dict[str, Path]:
    place = folder / name
    return {
        "root_ca_certificate": place / "ca.pem",
        "connect_certificate": place / "certificate.pem",
        "connect_private_key": place / "key.pem",
    }


def intruder(case: str, secured: Secured, folder: Path) -> zenoh.Config:
    stranger, ours = Authority(NOW - DAY, NOW + DAY), secured.authority
    match case:
        case "plain tcp":
            return settings(secured, {}, "tcp")
        case "no certificate":
            return settings(secured, {"root_ca_certificate": secured.keys / "r1" / "ca.pem"})
        case "foreign":
            return settings(secured, of(member(folder, ours, stranger, "r1", NOW - DAY, NOW + DAY), "r1"))
        case "expired":
            return settings(secured, of(member(folder, ours, ours, "r1", NOW - DAY, NOW - DAY / 2), "r1"))
        case "not valid yet":
            return settings(secured, of(member(folder, ours, ours, "r1", NOW + DAY / 2, NOW + DAY), "r1"))
        case "router's":
            return settings(secured, of(secured.keys, "router"))
        case "another's key":
            files = of(secured.keys, "r1") | {"connect_private_key": secured.keys / "r2" / "key.pem"}
            return settings(secured, files)
        case "good":
            return settings(secured, of(member(folder, ours, ours, "r1", NOW - DAY, NOW + DAY), "r1"))
    raise AssertionError(case)


INTRUDERS = ("plain tcp", "no certificate", "foreign", "expired", "not valid yet", "router's", "another's key")


@pytest.mark.parametrize("case", INTRUDERS)
def test_an_intruder_is_refused(case: str, secured: Secured, tmp_path: Path) -> None:
    with pytest.raises(zenoh.ZError):
        zenoh.open(intruder(case, secured, tmp_path / "keys"))


def test_a_member_gets_in_with_the_same_settings(secured: Secured, tmp_path: Path) -> None:
    with zenoh.open(intruder("good", secured, tmp_path / "keys")) as session:
        assert list(session.info.routers_zid())


def test_nobody_takes_a_router_with_a_foreign_or_a_robots_certificate_for_the_own_one(
    secured: Secured, tmp_path: Path
) -> None:
    stranger = Authority(NOW - DAY, NOW + DAY)
    with_theirs = member(tmp_path / "theirs", secured.authority, stranger, "r1", NOW - DAY, NOW + DAY)
    for folder in (with_theirs, secured.keys):
        files, port = of(folder, "r1"), Endpoint("127.0.0.1", 0).claim().port
        config = zenoh.Config()
        tls = {
            "listen_certificate": str(files["connect_certificate"]),
            "listen_private_key": str(files["connect_private_key"]),
        }
        config.insert_json5("mode", '"router"')
        config.insert_json5("listen/endpoints", json.dumps([f"tls/127.0.0.1:{port}"]))
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("transport/link/tls", json.dumps(tls))
        with zenoh.open(config), pytest.raises(zenoh.ZError):
            zenoh.open(settings(secured._replace(port=port), of(secured.keys, "r2")))


def test_a_wrong_file_is_named_before_the_router_is_asked(secured: Secured, tmp_path: Path) -> None:
    old = member(tmp_path / "old", secured.authority, secured.authority, "r1", NOW - DAY, NOW - DAY / 2)
    with pytest.raises(ConfigError, match="got one that expired on"), Bus(secured.endpoint("r1", old), "f"):
        pass
    assert main(["go", "--connect", str(secured.endpoint("operator")), "--secure", str(old)]) == 2


def test_a_connection_ends_with_its_certificate(secured: Secured, tmp_path: Path) -> None:
    ended: Queue[datetime] = Queue()

    def note(event: zenoh.TransportEvent) -> None:
        if event.kind == zenoh.SampleKind.DELETE:
            ended.put(datetime.now(UTC))

    for life in (3, 12, 48):  # s; a slow machine may not connect before the shortest has ended
        soon = datetime.now(UTC) + timedelta(seconds=life)
        keys = member(tmp_path / f"{life}", secured.authority, secured.authority, "r1", NOW - DAY, soon)
        with suppress(zenoh.ZError), zenoh.open(settings(secured, of(keys, "r1"))) as session:
            session.info.declare_transport_events_listener(zenoh.handlers.Callback(note), history=False)
            assert ended.get(timeout=life + PATIENCE) >= soon.replace(microsecond=0)
            return
    raise AssertionError("it does not connect")


# --- what a member may do ---


def settle(session: zenoh.Session) -> None:
    """Wait until the router has taken in all that a session has sent: it answers a query, even a refused one."""
    assert list(session.get(BELOW + "world/clock")) == []


class Ears:
    """Everything that arrives anywhere: the watcher, who may hear all, the world, and a robot."""

    def __init__(self, secured: Secured, stack: ExitStack) -> None:
        self._arrived: Queue[tuple[str, bytes]] = Queue()
        watcher = stack.enter_context(secured.session("watcher"))
        world, robot = stack.enter_context(secured.session("world")), stack.enter_context(secured.session("r2"))
        for session, key in (
            (watcher, "**"),
            (world, "robot/*/cmd"),
            (world, "robot/*/state"),
            (robot, "robot/r2/sense"),
        ):
            session.declare_subscriber(BELOW + key, self._hear)
        watcher.liveliness().declare_subscriber(BELOW + "alive/**", self._hear)
        self.asked: list[str] = []
        for topic in (ACTION, EDIT, JOIN):
            world.declare_queryable(BELOW + topic.key, self._answer)
        for session in (watcher, world, robot):
            settle(session)

    def _hear(self, sample: zenoh.Sample) -> None:
        self._arrived.put((str(sample.key_expr), sample.payload.to_bytes()))

    def _answer(self, query: zenoh.Query) -> None:
        self.asked.append(str(query.key_expr))
        query.reply(str(query.key_expr), b"yes")

    def until(self, last: bytes) -> list[str]:
        """Return the keys of all that arrives before a payload."""
        keys = []
        while (arrived := self._arrived.get(timeout=PATIENCE))[1] != last:
            keys.append(arrived[0])
        return keys


Act = Callable[[zenoh.Session, str], Any]


def put(session: zenoh.Session, key: str) -> None:
    session.put(key, b"forged")


def put_declared(session: zenoh.Session, key: str) -> None:
    publisher = session.declare_publisher(key)
    publisher.put(b"forged")


def delete(session: zenoh.Session, key: str) -> None:
    session.delete(key)


def ask(session: zenoh.Session, key: str) -> None:
    assert list(session.get(key, payload=b"forged")) == []


def token(session: zenoh.Session, key: str) -> None:
    session.liveliness().declare_token(key)


# fmt: off
FORGED: list[tuple[str, Act, str]] = [  # each way to forge once; test_access.py has more keys
    ("r1",       put,          "robot/r2/cmd"),
    ("r1",       put_declared, "robot/r2/state"),
    ("r1",       put,          "radio/3/4/r2"),
    ("r1",       put,          "world/clock"),
    ("r1",       put,          "robot/r1/state$*"),
    ("r1",       put,          "**"),
    ("r1",       delete,       "robot/r2/state"),
    ("r1",       ask,          "world/edit"),
    ("r1",       token,        "alive/robot/r2/ab12"),
    ("r1",       token,        "alive/world/world/ab12"),
    ("watcher",  ask,          "world/action"),
    ("operator", put,          "robot/r1/cmd"),
    ("bridge",   ask,          "world/edit"),
    ("bridge",   put,          "robot/r1/cmd"),
]
# fmt: on


@pytest.mark.parametrize(("name", "act", "key"), FORGED, ids=lambda part: getattr(part, "__name__", part))
def test_what_is_forged_arrives_nowhere(name: str, act: Act, key: str, secured: Secured) -> None:
    with ExitStack() as stack:
        ears = Ears(secured, stack)
        robot, forger = stack.enter_context(secured.session("r1")), stack.enter_context(secured.session(name))
        act(forger, BELOW + key)
        settle(forger)
        robot.put(BELOW + "robot/r1/state", b"true")
        assert ears.until(b"true") == []
        assert ears.asked == []


def test_what_is_true_arrives_and_the_operator_is_answered(secured: Secured) -> None:
    with ExitStack() as stack:
        ears = Ears(secured, stack)
        robot = stack.enter_context(secured.session("r1"))
        robot.put(BELOW + "robot/r1/cmd", b"first")
        robot.put(BELOW + "radio/3/4/r1", b"last")
        assert set(ears.until(b"last")) <= {BELOW + "robot/r1/cmd"}
        (reply,) = stack.enter_context(secured.session("operator")).get(BELOW + "world/action", payload=b"x")
        assert reply.ok is not None
        assert ears.asked == [BELOW + "world/action"]


def test_a_robot_does_not_hear_what_another_is_told(secured: Secured) -> None:
    with ExitStack() as stack:
        world, spy = stack.enter_context(secured.session("world")), stack.enter_context(secured.session("r1"))
        heard: Queue[bytes] = Queue()
        spy.declare_subscriber(BELOW + "robot/r2/sense", lambda sample: heard.put(sample.payload.to_bytes()))
        spy.declare_subscriber(BELOW + "robot/r1/sense", lambda sample: heard.put(sample.payload.to_bytes()))
        settle(spy)
        world.put(BELOW + "robot/r2/sense", b"secret")
        world.put(BELOW + "robot/r1/sense", b"own")
        assert heard.get(timeout=PATIENCE) == b"own"


WIDE: list[tuple[Topic[Any], str, str, Message]] = [
    (STATE, "swarm/v1/*/robot/r1/state", "robot/r1/state", LAST),
    (RADIO, BELOW + "radio/*/*/r1", "radio/0/0/r1", SAID),
]


@pytest.mark.parametrize(("topic", "wide", "own", "message"), WIDE, ids=["fleet", "zone"])
def test_a_wildcard_beside_the_own_name_is_dropped_by_the_receiver(
    topic: Topic[Message], wide: str, own: str, message: Message, secured: Secured
) -> None:
    """The list allows r1 any zone, and any fleet on this router: it cannot forbid them all at once."""
    with secured.bus("watcher") as bus, secured.session("r1") as robot:
        bus.listen(topic)
        bus.fetch(CLOCK)  # the router knows by now to what the bus listens
        robot.put(wide, encode(message))
        robot.put(BELOW + own, encode(message))
        arrived = bus.receive(PATIENCE)
        assert isinstance(arrived, Arrival)
        assert (arrived.ids["robot"], bus.refused_counts[topic.key]) == ("r1", 1)


# --- a whole fleet ---


def test_a_secure_fleet_drives_the_very_run_of_an_open_one_and_takes_orders_with_keys_only(
    small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = tmp_runtime / "keys"
    fleet_keys(keys)
    with Fleet(small, "--pace", "max", "--wait", runtime=tmp_runtime, keys=keys) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
        places = {
            one.laddr.ip for process in fleet.family for one in process.net_connections() if one.status == "LISTEN"
        }
        assert places == {"127.0.0.1"}
        assert main(["go"]) == 2
        assert "needs keys: add --secure DIR" in capsys.readouterr().err
        assert main(["status", "--secure", str(keys)]) == 0
        assert main(["go", "--secure", str(keys)]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert report["complete"]
    assert report["digest"] == Simulation.of(load(small), 2, 1).run()["digest"]


def test_an_old_key_of_one_robot_ends_the_command_before_it_starts_anything(
    small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = tmp_runtime / "keys"
    authority = fleet_keys(keys)
    old = member(tmp_runtime / "old", authority, authority, "r2", NOW - DAY, NOW - DAY / 2)
    (keys / "r2").rename(tmp_runtime / "r2")
    (old / "r2").rename(keys / "r2")
    assert main(["run", str(small), "--robots", "2", "--dashboard", "off", "--secure", str(keys)]) == 2
    assert "keys/r2/certificate.pem: expected a certificate that is valid now" in capsys.readouterr().err
