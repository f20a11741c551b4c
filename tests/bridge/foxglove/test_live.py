"""The server alone: what viewers get, and what they cannot do to it."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final

import psutil
import pytest

from swarm.bridge.cdr import layouts
from swarm.bridge.foxglove.viewer_server import BACKLOG, MOST, ViewerServer
from swarm.bridge.ros2.topics import CLOCK, PLAN, TF_STATIC
from swarm.bridge.ros2.types import Types
from swarm.bus import Endpoint
from swarm.errors import ConfigError
from swarm.geometry import Pose
from tests.bridge.foxglove.read import Viewer, viewer

ROS: Final = Types("jazzy")
LIMIT: Final = 100  # bytes
FRAMES: Final = layouts.write_transforms(0, [("map", "r1/odom", Pose(1.0, 2.0, 0.0))])


@contextmanager
def live(port: int = 0) -> Iterator[ViewerServer]:
    with ViewerServer(Endpoint("127.0.0.1", port).claim(), "office", ROS, LIMIT) as server:
        server.offer_topic("/clock", CLOCK)
        server.offer_topic("/tf_static", TF_STATIC)
        yield server


def until_wanted(server: ViewerServer, name: str, one: Viewer) -> None:
    """Go on until the server knows what a viewer wants."""
    while not server.is_topic_wanted(name):
        with suppress(TimeoutError):
            list(one.next(0.1))


def test_topics_come_with_their_schemas_and_go() -> None:
    with live() as server, viewer(server.url) as one:
        until_wanted(server, "/clock", one)
        assert one.channels.keys() == {"/clock", "/tf_static"}
        about = one.channels["/clock"]
        assert (about["encoding"], about["schemaName"]) == ("cdr", "rosgraph_msgs/msg/Clock")
        assert about["schemaEncoding"] == "ros2msg"
        server.offer_topic("/r1/plan", PLAN)
        server.withdraw_topic("/clock")
        server.send_status("that is all", trouble=True)
        one.until_told("that is all")
        assert one.channels.keys() == {"/tf_static", "/r1/plan"}


def test_who_comes_late_gets_what_is_kept() -> None:
    with live() as server:
        server.send_payload("/tf_static", FRAMES, 7)
        with viewer(server.url, "/tf_static") as one:
            until_wanted(server, "/tf_static", one)
            assert list(server.take_published()) == []
            (frame,) = one.until("/tf_static").transforms
            assert frame.child_frame_id == "r1/odom"


def test_only_what_a_viewer_wants_is_wanted() -> None:
    with live() as server, viewer(server.url, "/tf_static") as one:
        until_wanted(server, "/tf_static", one)
        assert not server.is_topic_wanted("/clock")


def test_garbage_of_viewers_is_dropped_and_counted() -> None:
    with live() as server, viewer(server.url) as one:
        one.publish("/r1/goal_pose", "json", bytes(LIMIT + 1))
        one.send(b"\x01\x63\x00\x00\x00on a channel that nobody knows")
        one.send("no json")
        one.send(b"\xff\xff")
        for number in range(MOST + 5):
            one.send(
                f'{{"op": "advertise", "channels": [{{"id": {number}, "topic": "/x", "encoding": "json", "schemaName": ""}}]}}'
            )
        one.send(b"\x01" + (MOST + 1).to_bytes(4, "little") + b"one channel too many")
        one.publish("/r1/goal_pose", "json", b"the last one", number=1000)
        one.send(b"\x01\x01\x00\x00\x00an early one")
        heard = list[str]()
        while not heard:
            with suppress(TimeoutError):
                list(one.next(0.1))
            heard += [f"{found.topic} {found.encoding} {found.payload.decode()}" for found in server.take_published()]
        assert heard == ["/x json an early one"]
        assert server.count_dropped() >= 2
        assert server.count_dropped() == 0


def test_who_may_only_look_is_not_heard() -> None:
    with ViewerServer(Endpoint("127.0.0.1", 0).claim(), "office", ROS, LIMIT, read_only=True) as server:
        server.offer_topic("/clock", CLOCK)
        with viewer(server.url) as one:
            until_wanted(server, "/clock", one)
            one.publish("/r1/goal_pose", "json", b"a goal")
            said = next(told for topic, told in one.messages() if not topic and told["op"] == "status")
            assert "clientPublish" in said["message"] or said["level"] > 0
            assert list(server.take_published()) == []


def test_a_viewer_that_never_reads_costs_nothing() -> None:
    """It reads nothing any more: the server drops what waits for it, and others get the newest."""
    payload = layouts.write_transforms(0, [("map", "r1/odom", Pose(1.0, 2.0, 0.0))] * 100)
    with live() as server, viewer(server.url, "/clock") as other:
        until_wanted(server, "/clock", other)
        with viewer(server.url, "/tf_static") as slow:
            until_wanted(server, "/tf_static", slow)
            memory, sent = psutil.Process().memory_info().rss, 0
            for number in range(20 * BACKLOG):
                server.send_payload("/tf_static", payload, number)
                sent += len(payload)
            server.send_payload("/clock", layouts.write_clock(5 * 10**9), 5 * 10**9)
            assert other.until("/clock").clock.sec == 5
            assert psutil.Process().memory_info().rss - memory < sent / 4, "far less than was sent"


def test_a_port_in_use_is_an_error() -> None:
    with live() as server:
        port = int(server.url.rsplit(":", 1)[1])
        with pytest.raises(
            ConfigError, match=f"port {port} on 127.0.0.1: expected a free port, got Address already in use"
        ):
            Endpoint("127.0.0.1", port).claim()
        with (
            pytest.raises(ConfigError, match=f"port {port} on 127.0.0.1: expected to serve there, got: .*in use"),
            ViewerServer(Endpoint("127.0.0.1", port), "office", ROS, LIMIT),
        ):
            pass
