"""What a broker asks for before it lets a bridge in, and a fleet that a test tells by hand."""

import shutil
import signal
import subprocess
from pathlib import Path
from typing import Final

import pytest
from msgspec.structs import replace

from swarm.bus import Bus, Endpoint, Request
from swarm.messages import CLOCK, MAP, ORDER, TRUTH, Accepted, Map, Phase, Truth
from swarm.secure.certificates import Authority
from tests.bridge.vda5050.brokers import Broker, needs_mosquitto
from tests.bridge.vda5050.conftest import StartBroker
from tests.bridge.vda5050.masters import master_on
from tests.bridge.vda5050.shared import order_of
from tests.conftest import MakeBus
from tests.launch.actors import PATIENCE, Command
from tests.messages.made import clock, truth
from tests.secure.shared import DAY, NOW
from tests.shared import scenario_of

pytestmark = pytest.mark.processes
PASSWORDS: Final = shutil.which("mosquitto_passwd")


def tell(world: Bus, *robots: str) -> None:
    """Be a world with some robots, all at (3, 0), for whoever asks."""
    settings, packed = scenario_of().to_wire()
    world.announce("world", "world")
    world.keep(MAP, lambda: {MAP.key: Map(packed=packed, scenario=settings)})
    world.keep(CLOCK, lambda: {CLOCK.key: clock(robots=robots)})
    world.keep(TRUTH, lambda: {TRUTH.key: bodies(*robots)})


def bodies(*robots: str) -> Truth:
    one = truth(0)
    return replace(one, bodies=[replace(one.bodies[0], robot=robot) for robot in robots])


def bridge(endpoint: Endpoint, runtime: Path, place: str, *options: str, fleet: str = "told") -> Command:
    command = ("bridge", "vda5050", "--connect", str(endpoint), "--fleet", fleet, "--broker", place)
    return Command(*command, *options, runtime=runtime)


def refusal(endpoint: Endpoint, runtime: Path, place: str, *options: str) -> str:
    """Return what the command says when it is not let in."""
    with bridge(endpoint, runtime, place, *options) as command:
        assert command.end() == 2
        command.reader.join(PATIENCE)
        return command.text.removeprefix(f"swarm: --broker {place}: expected a broker of MQTT")


def test_no_broker_and_one_that_is_none_are_one_sentence(
    tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus
) -> None:
    tell(make_bus(fleet="told"), "r1")
    nobody = f"127.0.0.1:{Endpoint('127.0.0.1', 0).claim().port}"
    said = refusal(endpoint, tmp_runtime, nobody)
    assert said == ", got: Connection refused; start it, or name another one"
    assert ", got" in refusal(endpoint, tmp_runtime, f"127.0.0.1:{endpoint.port}"), "a router of Zenoh"


@needs_mosquitto
def test_a_broker_lets_in_who_has_the_password_and_whom_its_authority_vouches_for(
    tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus, start_broker: StartBroker
) -> None:
    assert PASSWORDS is not None
    tell(make_bus(fleet="told"), "r1")
    folder = tmp_runtime
    subprocess.run([PASSWORDS, "-c", "-b", str(folder / "passwords"), "fleet", "open sesame"], check=True)
    authority, other = Authority(NOW - DAY, NOW + DAY), Authority(NOW - DAY, NOW + DAY)
    server, client = authority.router("broker", ["127.0.0.1"]), authority.client("fleet")
    for name, content in [
        ("ca.pem", authority.certificate), ("other.pem", other.certificate), ("server.pem", server.certificate),
        ("server.key", server.key), ("client.pem", client.certificate), ("client.key", client.key),
        ("right", b"open sesame\n"), ("wrong", b"open barley"),
    ]:  # fmt: skip
        (folder / name).write_bytes(content)
    locked = start_broker("allow_anonymous false", f"password_file {folder / 'passwords'}")
    tls = [
        f"{name} {folder / file}"
        for name, file in [("cafile", "ca.pem"), ("certfile", "server.pem"), ("keyfile", "server.key")]
    ]
    sealed = start_broker("allow_anonymous true", "require_certificate true", *tls)

    def file(name: str) -> str:
        return str(folder / name)

    user = ("--user", "fleet", "--password-file")
    who = ("--tls-cert", file("client.pem"), "--tls-key", file("client.key"))
    assert (
        refusal(endpoint, folder, locked.place)
        == " that lets us in, got: Not authorized; see --user, --password-file and --tls-ca"
    )
    assert "Not authorized" in refusal(endpoint, folder, locked.place, *user, file("wrong"))
    assert "self-signed certificate" in refusal(endpoint, folder, sealed.place, "--tls", *who)
    assert "certificate" in refusal(endpoint, folder, sealed.place, "--tls-ca", file("other.pem"), *who)
    assert ", got" in refusal(endpoint, folder, sealed.place, "--tls-ca", file("ca.pem"))
    assert ", got" in refusal(endpoint, folder, sealed.place)
    for place, options in (
        (locked.place, (*user, file("right"))),
        (sealed.place, ("--tls-ca", file("ca.pem"), *who)),
    ):
        with bridge(endpoint, folder, place, *options) as command:
            command.await_line("r1 is on the broker")


def test_robots_that_come_go_and_a_run_that_ends_without_a_process_of_the_fleet(
    tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus, broker: Broker
) -> None:
    with make_bus(fleet="told") as world:
        tell(world, "r1", "arm.2")
        world.serve(ORDER)
        with master_on(broker.port) as master, bridge(endpoint, tmp_runtime, broker.place) as command:
            for robot in ("r1", "arm.2"):
                master.connection(robot, "ONLINE")
            master.say("r1", "order", order_of(("A", 3.0, 0.0), ("B", 5.0, 2.0)))
            asked = request(world)
            assert asked.message.targets == [(5.0, 2.0)]
            asked.accept(Accepted(text="taken", number=7, run=0))
            state = master.until("r1", "state", lambda said: said["orderId"] == "o1")
            assert [one["nodeId"] for one in state["nodeStates"]] == ["B"]

            master.say("arm.2", "order", order_of(("A", 3.0, 0.0), ("B", 5.0, 2.0), robot="arm.2"))
            request(world).refuse("order: in a wall")
            assert master.error("arm.2", "in a wall") == "orderError"

            world.send(CLOCK, clock(robots=("r1", "r3")))
            master.connection("arm.2", "OFFLINE")
            master.connection("r3", "ONLINE")
            world.send(CLOCK, clock(run=2, robots=("r1", "r3")))
            assert master.error("r1", "the run was started again, without it") == "orderError"
            world.send(CLOCK, clock(run=2, phase=Phase.OVER, robots=("r1", "r3")))
            for robot in ("r1", "r3"):
                master.connection(robot, "OFFLINE")
            assert command.end() == 0


def request(world: Bus) -> Request:
    while not isinstance(arrived := world.receive(PATIENCE), Request):
        assert arrived is not None, "nobody asks"
    return arrived


def test_two_bridges_for_one_vehicle_say_so_and_a_broker_that_is_stuck_keeps_none_of_them(
    tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus, broker: Broker
) -> None:
    tell(make_bus(fleet="told"), "r1", "r2")
    with bridge(endpoint, tmp_runtime, broker.place) as one:
        one.await_line("r2 is on the broker")
        with bridge(endpoint, tmp_runtime, broker.place) as other:
            for command in (one, other):
                command.await_line("uagv/v2/zenoh-swarm/r1/connection: somebody else is ONLINE there")
            with bridge(endpoint, tmp_runtime, broker.place, "--manufacturer", "acme") as third:
                third.await_line("r2 is on the broker")
                broker.process.send_signal(signal.SIGSTOP)
                for command in (one, other, third):
                    command.process.send_signal(signal.SIGTERM)
                    assert command.end() == 0
                assert "somebody else" not in third.text
