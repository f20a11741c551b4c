"""A real fleet, the bridge as a process, a real broker, and masters: one from PyPI unchanged, one of plain paho."""

import asyncio
import json
import signal
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from math import dist
from pathlib import Path
from typing import Any, Final

import pytest
from vda5050 import MasterClient, MasterConfig, OrderBuilder
from vda5050.model import Connection, Edge, Factsheet, Node, NodePosition, State, Visualization
from vda5050.validation import SchemaValidator

from swarm.bridge.vda5050.messages import LIMIT
from swarm.cli import main
from tests.bridge.vda5050.brokers import Broker
from tests.bridge.vda5050.masters import Master, Message, master_on
from tests.bridge.vda5050.shared import MAKER, actions_of, header, order_of
from tests.launch.actors import LONGEST, SMALL, Command, Fleet
from tests.secure.shared import fleet_keys

pytestmark = pytest.mark.processes
MODELS: Final[dict[str, Any]] = {
    "state": State,
    "connection": Connection,
    "factsheet": Factsheet,
    "visualization": Visualization,
}


@pytest.fixture
def idle(tmp_runtime: Path) -> Path:
    """Return the file of a scenario whose robots have nothing to do."""
    path = tmp_runtime / "idle.yaml"
    path.write_text(SMALL.replace("[[9.5, 2.0], [9.5, 6.0]]", "[]"))
    return path


@contextmanager
def bridged(
    idle: Path, tmp_runtime: Path, broker: Broker, *options: str, robots: int = 2
) -> Iterator[tuple[Fleet, Command]]:
    with (
        Fleet(idle, "--serve", "--pace", "3", runtime=tmp_runtime, robots=robots) as fleet,
        fleet.bus() as bus,
    ):
        fleet.await_all(bus)
        with Command("bridge", "vda5050", "--broker", broker.place, *options, runtime=tmp_runtime) as bridge:
            yield fleet, bridge


def place_of(state: Message) -> tuple[float, float]:
    return state["agvPosition"]["x"], state["agvPosition"]["y"]


def placed(state: Message) -> bool:
    return "agvPosition" in state


def judge(master: Master) -> None:
    """Check all that vehicles said against the standard's schemas, an independent model, and the counts of headers."""
    validator, numbers = SchemaValidator(), defaultdict[tuple[str, str], int](lambda: -1)
    assert master.heard
    for robot, topic, message, kept in master.heard:
        validator.validate(topic, message)
        MODELS[topic].model_validate(message)
        if not kept and message.get("connectionState") != "CONNECTIONBROKEN":
            before = numbers[robot, topic]
            numbers[robot, topic] = message["headerId"]
            assert before in {-1, message["headerId"] - 1} or message["headerId"] <= 1, (robot, topic, before, message)


@pytest.mark.costs("a robot drives over three nodes in real time")
def test_a_master_from_pypi_dispatches_three_nodes_and_sees_the_end(
    idle: Path, tmp_runtime: Path, broker: Broker
) -> None:
    async def dispatch() -> list[str]:
        seen: list[str] = []
        faults: list[Any] = []
        config = MasterConfig(
            broker_url=f"mqtt://{broker.place}", validate_messages=True, visualization=True, username="any"
        )
        async with MasterClient(config) as client:
            client.on_error(faults.append)
            client.on_state(lambda state, key: seen.append(state.last_node_id) if key.serial_number == "r1" else None)
            vehicle = f"{MAKER}/r1"
            await client.wait_for(vehicle, lambda one: one.state and one.state.agv_position, timeout=LONGEST)
            at = (await client.session(vehicle)).state.agv_position
            order = OrderBuilder(order_id="tour", manufacturer=MAKER, serial_number="r1")
            for name, x, y in [("here", at.x, at.y), ("A", 9.5, 2.0), ("B", 9.5, 6.0)]:
                order.add_node(name, x=x, y=y, map_id=at.map_id, allowed_deviation_xy=0.5)
            order.add_edge("here", "A").add_edge("A", "B")
            assert (await client.dispatch(order.build(), vehicle)).accepted
            done = await client.wait_for(
                vehicle, lambda one: one.state.order_id == "tour" and not one.state.node_states, timeout=LONGEST
            )
            assert done
            place = NodePosition(x=2.5, y=6.0, map_id=at.map_id)
            more = Node(node_id="C", sequence_id=0, released=True, node_position=place, actions=[])
            way = Edge(edge_id="B-C", sequence_id=0, released=True, start_node_id="B", end_node_id="C", actions=[])
            assert (await client.extend_base(vehicle, [more], [way])).accepted
            assert await client.wait_for(vehicle, lambda one: one.state.last_node_id == "C", timeout=LONGEST)
            await client.pause(vehicle, action_id="p1")
            assert await client.wait_for_action(vehicle, "p1", timeout=LONGEST)
            await client.resume(vehicle, action_id="p2")
            assert await client.wait_for_action(vehicle, "p2", timeout=LONGEST)
            assert client.metrics_snapshot()["visualizations_received"] > 0
            assert not faults
        return seen

    with bridged(idle, tmp_runtime, broker, "--visualization", "2") as (fleet, bridge):
        seen = asyncio.run(dispatch())
        assert list(dict.fromkeys(seen)) == ["", "here", "A", "B", "C"]
        assert main(["stop"]) == 0
        bridge.await_line("the run is over")
        assert bridge.end() == 0
        fleet.end()


@pytest.mark.long("a fleet that is ordered about, and a bridge that is killed and started again")
def test_a_bridge_that_is_killed_is_broken_and_the_next_one_goes_on(
    idle: Path, tmp_runtime: Path, broker: Broker
) -> None:
    with bridged(idle, tmp_runtime, broker) as (fleet, bridge), master_on(broker.port) as master:
        master.connection("r1", "ONLINE")
        at = place_of(master.until("r1", "state", placed))
        master.say(
            "r1", "order", order_of(("here", *at), ("A", 9.5, 2.0), ("B", 9.5, 6.0), ("C", 2.5, 6.0), released=2)
        )
        state = master.until("r1", "state", lambda said: said["driving"])
        assert (state["orderId"], [one["nodeId"] for one in state["nodeStates"]]) == ("o1", ["A", "B", "C"])
        assert (state["newBaseRequest"], state["lastNodeId"]) == (True, "here")

        master.say("r1", "order", order_of(("A", 9.5, 2.0), ("B", 9.5, 6.0), update=1, first=2))
        master.until("r1", "state", lambda said: said["orderUpdateId"] == 1)
        master.until("r1", "state", lambda said: said["lastNodeId"] == "A")
        master.say("r1", "order", order_of(("here", *at), ("A", 9.5, 2.0), order_id="o2"))
        assert master.error("r1", "expected no new order before order o1 is done") == "orderError"
        master.say("r1", "instantActions", actions_of("cancelOrder#c1"))
        state = master.until(
            "r1", "state", lambda said: said["actionStates"] and said["actionStates"][0]["actionStatus"] == "FINISHED"
        )
        assert (state["nodeStates"], state["edgeStates"], state["lastNodeId"]) == ([], [], "A")

        master.say("r1", "order", order_of(("new", *place_of(state)), ("wall", 5.5, 3.5), order_id="o3"))
        assert master.error("r1", "expected free floor, got a wall or obstacle") == "orderError"
        master.say("r1", "order", order_of(("new", *place_of(state)), ("B", 9.5, 6.0), order_id="o4"))
        master.until("r1", "state", lambda said: said["orderId"] == "o4" and not said["errors"])
        assert main(["order", "r1", "2.5,2"]) == 0
        assert master.error("r1", "superseded by order") == "orderError"

        bridge.process.send_signal(signal.SIGKILL)
        assert bridge.process.wait() == -signal.SIGKILL
        for robot in ("r1", "r2"):
            master.connection(robot, "CONNECTIONBROKEN")
        with Command("bridge", "vda5050", "--broker", broker.place, runtime=tmp_runtime) as again:
            for robot in ("r1", "r2"):
                master.connection(robot, "ONLINE")
            assert dist(place_of(master.until("r2", "state", placed)), (2.5, 4.0)) < 2.0
            again.process.send_signal(signal.SIGTERM)
            for robot in ("r1", "r2"):
                master.connection(robot, "OFFLINE")
            assert again.end() == 0
        with master_on(broker.port) as late:
            assert late.until("r1", "connection", kept=True)["connectionState"] == "OFFLINE"
            assert late.until("r1", "factsheet", kept=True)["physicalParameters"]["speedMax"] == 1.6
            judge(late)
        judge(master)
        assert main(["stop"]) == 0
        fleet.end()


@pytest.mark.long("a fleet of its own, and a broker that is away for a while")
def test_a_broker_that_goes_away_and_comes_back_is_told_all_again(
    idle: Path, tmp_runtime: Path, broker: Broker
) -> None:
    with bridged(idle, tmp_runtime, broker) as (fleet, bridge):
        with master_on(broker.port) as master:
            at = place_of(master.until("r1", "state", placed))
            master.say("r1", "order", order_of(("here", *at), ("A", 9.5, 2.0), ("B", 9.5, 6.0)))
            master.until("r1", "state", lambda said: said["driving"])
        broker.kill()
        bridge.await_line("no connection to broker")
        broker.start()
        with master_on(broker.port) as master:
            master.connection("r1", "ONLINE")
            done = master.until("r1", "state", lambda said: said["lastNodeId"] == "B")
            assert (done["orderId"], done["nodeStates"], done["errors"]) == ("o1", [], [])
            master.until("r1", "factsheet")
            judge(master)
            assert main(["restart"]) == 0
            master.until("r1", "state", lambda said: said["lastNodeId"] == "")
            assert main(["stop"]) == 0
            master.connection("r1", "OFFLINE")
        assert bridge.end() == 0
        fleet.end()


@pytest.mark.long("a fleet of its own, with keys")
def test_a_fleet_with_keys_is_on_a_broker_too(small: Path, tmp_runtime: Path, broker: Broker) -> None:
    fleet_keys(keys := tmp_runtime / "keys")
    with Fleet(small, "--serve", runtime=tmp_runtime, keys=keys) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        command = ("bridge", "vda5050", "--secure", str(keys), "--broker", broker.place)
        with Command(*command, runtime=tmp_runtime) as bridge, master_on(broker.port) as master:
            master.until("r1", "state", placed)
            master.say("r1", "instantActions", actions_of("startPause"))
            master.until("r1", "state", lambda said: said["paused"] and not said["driving"])
            assert main(["stop", "--secure", str(keys)]) == 0
            assert bridge.end() == 0
            fleet.end()


GARBAGE: Final = [
    ("order", b"garbage", "order: expected JSON, got b'garbage'"),
    ("order", b"{" * 100_000, "order: expected JSON"),
    ("order", bytes(LIMIT + 1), f"order: expected at most {LIMIT} bytes, got {LIMIT + 1}"),
    ("order", json.dumps(order_of(("A", 1.0, 2.0), robot="r2")).encode(), "as in the topic, got ('zenoh-swarm', 'r2')"),
    ("order", json.dumps(header() | {"orderId": "o9"}).encode(), "order: Object missing required field"),
    ("instantActions", b"[]", "instantActions: expected object, got []"),
    ("instantActions", b'{"actions": 3}', "instantActions: actions: expected array, got 3"),
]


def test_what_cannot_be_read_is_an_error_of_its_vehicle_and_two_masters_see_it(
    idle: Path, tmp_runtime: Path, broker: Broker
) -> None:
    options = ("--interface", "agv", "--manufacturer", "acme", "--map-id", "hall")
    with (
        bridged(idle, tmp_runtime, broker, *options) as (fleet, bridge),
        master_on(broker.port, "agv", "acme") as one, master_on(broker.port, "agv", "acme") as other,
    ):  # fmt: skip
        state = one.until("r1", "state", placed)
        assert (state["manufacturer"], state["agvPosition"]["mapId"], state["maps"][0]["mapId"]) == (
            "acme",
            "hall",
            "hall",
        )
        for topic, payload, said in GARBAGE:
            one.say("r1", topic, payload)
            assert one.error("r1", said) == "validationError"
        bridge.await_line("dropped")
        assert other.error("r1", "instantActions: expected object") == "validationError"
        one.say("r2", "instantActions", actions_of("startPause", robot="r2") | {"manufacturer": "acme"})
        other.until("r2", "state", lambda said: said["paused"])
        other.say("r2", "instantActions", actions_of("stopPause", robot="r2") | {"manufacturer": "acme"})
        one.until("r2", "state", lambda said: not said["paused"])
        assert one.until("r2", "state")["errors"] == []
        judge(one)
        assert main(["stop"]) == 0
        assert bridge.end() == 0
        fleet.end()
