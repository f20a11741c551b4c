"""Nav2's actions on a real fleet, by a client with plain zenoh and messages of another library."""

import os
import signal
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from queue import SimpleQueue
from typing import Final, NamedTuple

import pytest
import zenoh

from swarm.bridge.ros2.graph import REQUEST_LIMIT
from swarm.bus import Endpoint
from swarm.cli import main
from tests.bridge.ros2.foreign import (
    ABORTED,
    CANCELED,
    CANCELING,
    EXECUTING,
    SUCCEEDED,
    UNKNOWN,
    Accepted,
    Client,
    Feedback,
    RefusedError,
    Result,
    ThroughFeedback,
    Time,
    ToPoseRequest,
    await_tokens,
    client_session,
    placed,
    router_of_ros,
    tokens,
    uuid,
)
from tests.launch.actors import PATIENCE, Command, Fleet

pytestmark = pytest.mark.processes
DOMAIN = 7
NONE, REJECTED, UNKNOWN_GOAL, TERMINATED = range(4)  # action_msgs/srv/CancelGoal


class Seen(NamedTuple):
    """A fleet, its bridge, and a session of somebody of ROS."""

    fleet: Fleet
    bridge: Command
    session: zenoh.Session


@contextmanager
def bridged(small: Path, runtime: Path, router: Endpoint, *arguments: str) -> Iterator[Seen]:
    with Fleet(small, "--serve", "--pace", "3", runtime=runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        command = ("bridge", "ros2", "--ros", str(router), "--domain", str(DOMAIN), *arguments)
        with Command(*command, runtime=runtime) as bridge, client_session(router) as session:
            bridge.await_line("fleet ")
            yield Seen(fleet, bridge, session)


GET_STATE = "RIHS01_800a0a5aae599782b02932de0caf563f6dc4e7e94b794eadde075ba2cbef9795"
FAR, NEAR = placed(9.5, 2.0), placed(9.5, 6.0)


@pytest.mark.costs("a robot drives to a goal in real time")
def test_a_goal_is_accepted_followed_and_reached(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    with bridged(small, tmp_runtime, endpoint) as seen, Client(seen.session, DOMAIN, "r1") as client:
        first = uuid()
        assert client.send(first, FAR, tree="other.xml")
        seen.bridge.await_line("behavior_tree is ignored")
        waiting = client.result(first)
        assert not client.send(first, FAR), "the id is known"
        said: list[Feedback] = []
        while not said or said[-1].estimated_time_remaining.sec > 0:
            said.append(Feedback.deserialize(client.feedback.get(timeout=PATIENCE).payload.to_bytes()))
        assert {bytes(one.goal_id) for one in said} == {first}
        assert said[0].distance_remaining > said[-1].distance_remaining
        assert said[-1].navigation_time.sec > 0
        assert waiting.get(Result) == Result(SUCCEEDED, 0, ""), "while it is under way, some of its time is left"
        assert client.await_status(first, SUCCEEDED) == [EXECUTING, SUCCEEDED]
        assert client.result(first).get(Result).status == SUCCEEDED, "it is kept"
        assert client.result(uuid()).get(Result).status == UNKNOWN


@pytest.mark.costs("a fleet, and a dozen refusals")
def test_what_cannot_be_a_goal_is_refused_and_counted(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    with bridged(small, tmp_runtime, endpoint) as seen, Client(seen.session, DOMAIN, "r1") as client:
        for pose, why in (
            (placed(5.5, 3.5), "expected free floor, got a wall or obstacle"),
            (placed(99.0, 3.5), "expected a place on the map, got one outside"),
            (placed(9.5, 2.0, frame="odom"), "header.frame_id: expected 'map', got 'odom'"),
            (placed(float("nan"), 2.0), "expected x and y within 1e6 m, got (nan, 2.0)"),
        ):
            assert not client.send(uuid(), pose)
            assert why in seen.bridge.await_line(why)
        request = ToPoseRequest(list(uuid()), FAR, "").serialize()
        for part, payload, attached, why in (
            ("send_goal", b"garbage", True, "SendGoal_Request, which begins with 00 01 00 00, got '67 61 72 62'"),
            ("send_goal", request[:40], True, "got 40 bytes that are none"),
            ("send_goal", bytes(REQUEST_LIMIT + 1), True, f"expected at most {REQUEST_LIMIT} bytes"),
            ("send_goal", request, False, "expected an attachment of 33 bytes, as rmw_zenoh's, got nothing"),
            ("get_result", b"", True, "GetResult_Request, which begins with 00 01 00 00, got ''"),
            ("cancel_goal", b"\x00\x01\x00\x00", True, "CancelGoal_Request, got 4 bytes that are none"),
        ):
            with pytest.raises(RefusedError) as refused:
                client.ask(part, payload, attached).get(Accepted)
            assert f"/r1/navigate_to_pose/_action/{part}: expected" in str(refused.value)
            assert why in str(refused.value)
        seen.bridge.await_line("bad message")
        with Client(seen.session, DOMAIN, "r1", "navigate_through_poses") as through:
            assert not through.send_through(uuid())
            seen.bridge.await_line("poses: expected at least one, got none")
        assert client.send(uuid(), FAR), "it goes on"
        for node in ("bt_navigator", "amcl"):  # Nav2's own client waits for both before it sends a goal
            key = f"{DOMAIN}/r1/{node}/get_state/lifecycle_msgs::srv::dds_::GetState_/{GET_STATE}"
            (reply,) = seen.session.get(
                key, payload=b"\x00\x01\x00\x00\x00", attachment=struct.pack("<qqB16s", 1, 1, 16, bytes(16)),
                target=zenoh.QueryTarget.ALL_COMPLETE, timeout=PATIENCE,
            )  # fmt: skip
            assert reply.ok is not None
            assert reply.ok.payload.to_bytes() == b"\x00\x01\x00\x00\x03\x00\x00\x00\x07\x00\x00\x00active\x00"


@pytest.mark.long("a fleet with a bridge drives to two goals")
def test_a_newer_goal_of_another_client_aborts_the_older(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    with (
        bridged(small, tmp_runtime, endpoint) as seen,
        client_session(endpoint) as another,
        Client(seen.session, DOMAIN, "r1") as one,
        Client(another, DOMAIN, "r1", "navigate_through_poses") as other,
    ):
        first, second, third = uuid(), uuid(), uuid()
        assert one.send(first, FAR)
        waiting = one.result(first)
        assert other.send_through(second, NEAR, FAR)
        result = waiting.get(Result)
        assert (result.status, result.error_code) == (ABORTED, 9000)
        assert f"superseded by order {second.hex()[:8]}" in result.error_msg
        told = [ThroughFeedback.deserialize(other.feedback.get(timeout=PATIENCE).payload.to_bytes())]
        while told[-1].number_of_poses_remaining == 2:
            told.append(ThroughFeedback.deserialize(other.feedback.get(timeout=PATIENCE).payload.to_bytes()))
        assert told[0].distance_remaining > 4.0, "to the second pose it is 4 m from the first"
        assert told[-1].number_of_poses_remaining == 1
        assert other.result(second).get(Result) == Result(SUCCEEDED, 0, "")
        assert one.send(third, NEAR)
        assert main(["order", "r1", "9.5,2"]) == 0
        assert one.result(third).get(Result).status == ABORTED, "somebody of the fleet has other wishes"


@pytest.mark.long("a fleet with a bridge drives to a goal")
def test_a_client_that_dies_leaves_its_goal_under_way_and_another_gets_the_result(
    small: Path, tmp_runtime: Path, endpoint: Endpoint
) -> None:
    with bridged(small, tmp_runtime, endpoint) as seen, Client(seen.session, DOMAIN, "r1") as other:
        goal = uuid()
        with client_session(endpoint) as dying, Client(dying, DOMAIN, "r1") as one:
            assert one.send(goal, NEAR)
            one.result(goal)
        assert other.result(goal).get(Result) == Result(SUCCEEDED, 0, "")


def test_goals_are_cancelled_by_id_and_all_at_once(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    with bridged(small, tmp_runtime, endpoint) as seen, Client(seen.session, DOMAIN, "r1") as client:
        assert client.cancel() == (NONE, [])
        assert client.cancel(uuid()) == (UNKNOWN_GOAL, [])
        first, second = uuid(), uuid()
        assert client.send(first, FAR)
        waiting = client.result(first)
        assert client.cancel(first) == (NONE, [first])
        result = waiting.get(Result)
        assert (result.status, result.error_code) == (CANCELED, 0)
        assert f"r1: order {first.hex()[:8]} is not done: 1 left; cancelled" in result.error_msg
        assert client.await_status(first, CANCELED) in ([EXECUTING, CANCELING, CANCELED], [EXECUTING, CANCELED])
        assert client.cancel(first) == (TERMINATED, [])
        assert client.send(second, FAR)
        assert client.cancel(at=Time(0, 1)) == (NONE, []), "it was accepted later"
        assert client.cancel() == (NONE, [second])
        assert client.result(second).get(Result).status == CANCELED


def test_no_goal_hangs_when_the_fleet_starts_again_or_the_bridge_ends(
    small: Path, tmp_runtime: Path, endpoint: Endpoint
) -> None:
    with bridged(small, tmp_runtime, endpoint) as seen, Client(seen.session, DOMAIN, "r1") as client:
        first, second = uuid(), uuid()
        assert client.send(first, FAR)
        waiting = client.result(first)
        assert main(["restart"]) == 0
        assert "the run was started again, without it" in waiting.get(Result).error_msg
        assert client.send(second, FAR)
        waiting = client.result(second)
        assert client.cancel(uuid()) == (UNKNOWN_GOAL, []), "the request for the result has come, too"
        seen.bridge.process.send_signal(signal.SIGTERM)
        result = waiting.get(Result)
        assert (result.status, result.error_msg) == (
            ABORTED, f"r1: order {second.hex()[:8]} is out of sight: the bridge ends",
        )  # fmt: skip
        assert seen.bridge.end() == 0


@pytest.mark.long("a fleet with a bridge drives to a goal")
def test_a_fleet_adapter_for_ros2dds_sees_the_same_without_attachments(
    small: Path, tmp_runtime: Path, endpoint: Endpoint
) -> None:
    """Open-RMF's free_fleet takes robots from zenoh-bridge-ros2dds; the keys are those in its source."""
    with bridged(small, tmp_runtime, endpoint, "--dialect", "ros2dds") as seen:
        assert f"is as ros2dds has robots on {endpoint}" in seen.bridge.await_line("fleet ")
        frames: SimpleQueue[zenoh.Sample] = SimpleQueue()
        subscriber = seen.session.declare_subscriber("r1/tf", frames.put)
        moved = frames.get(timeout=PATIENCE)
        subscriber.undeclare()  # type: ignore[no-untyped-call]
        assert moved.attachment is None
        assert b"base_footprint" in moved.payload.to_bytes()
        with Client(seen.session, None, "r1") as client:
            first, second = uuid(), uuid()
            assert not client.send(first, placed(5.5, 3.5))
            assert client.send(first, NEAR)
            assert client.cancel() == (NONE, [first])
            assert client.result(first).get(Result).status == CANCELED
            assert client.send(second, FAR)
            heard = first
            while heard != second:
                heard = bytes(Feedback.deserialize(client.feedback.get(timeout=PATIENCE).payload.to_bytes()).goal_id)
            assert client.result(second).get(Result).status == SUCCEEDED
            assert client.await_status(second, SUCCEEDED)[-1] == SUCCEEDED


@pytest.mark.long("a fleet, a bridge and a router that are killed")
def test_a_goal_outlives_the_router_of_ros_but_not_a_bridge_that_is_killed(small: Path, tmp_runtime: Path) -> None:
    """What a client waits for ends with its router, or with the bridge; then it asks again."""
    place = Endpoint("127.0.0.1", 0).claim()
    first = uuid()
    served = [f"%r1%navigate_to_pose%_action%{name}" for name in ("send_goal", "get_result", "cancel_goal")]
    bridge = ("bridge", "ros2", "--ros", str(place), "--domain", str(DOMAIN))
    with ExitStack() as stack:
        router = stack.enter_context(ExitStack())
        router.enter_context(router_of_ros(place))
        seen = stack.enter_context(bridged(small, tmp_runtime, place))
        with Client(seen.session, DOMAIN, "r1") as client:
            assert client.send(first, FAR)
        router.close()
        stack.enter_context(router_of_ros(place))
        session = stack.enter_context(client_session(place))
        heard, watching = tokens(session, DOMAIN)
        await_tokens(heard, served, zenoh.SampleKind.PUT)
        with Client(session, DOMAIN, "r1") as client:
            assert client.result(first).get(Result).status == SUCCEEDED
            second = uuid()
            assert client.send(second, NEAR)
            waiting = client.result(second)
            assert client.cancel(uuid()) == (UNKNOWN_GOAL, [])
            seen.bridge.process.kill()
            with pytest.raises(AssertionError, match="ended without an answer"):
                waiting.get(Result)
            await_tokens(heard, served, zenoh.SampleKind.DELETE)
            with Command(*bridge, runtime=tmp_runtime):
                await_tokens(heard, served, zenoh.SampleKind.PUT)
                assert client.result(second).get(Result).status == UNKNOWN
                assert client.send(uuid(), FAR)
        watching.undeclare()


FREE_FLEET: Final = os.environ.get("FREE_FLEET")  # a copy of its repository


def script(name: str, session_of: Endpoint, folder: Path, *arguments: str) -> "subprocess.Popen[str]":
    """Start a script of free_fleet as it is."""
    assert FREE_FLEET is not None
    config = folder / "zenoh.json5"
    config.write_text(f'{{mode: "client", connect: {{endpoints: ["{session_of}"]}}}}')
    paths = [f"{FREE_FLEET}/free_fleet", f"{FREE_FLEET}/free_fleet_examples"]
    return subprocess.Popen(
        [sys.executable, "-u", "-m", f"free_fleet_examples.{name}", "-c", str(config), "-n", "r1", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip


def read_until(process: "subprocess.Popen[str]", part: str) -> list[str]:
    """Read lines until one has a part."""
    assert process.stdout is not None
    lines: list[str] = []
    for line in process.stdout:
        lines.append(line)
        if part in line:
            return lines
    raise AssertionError(lines)


@pytest.mark.long("a robot drives to a goal in real time")
@pytest.mark.skipif(FREE_FLEET is None, reason="FREE_FLEET names no copy of open-rmf/free_fleet")
def test_the_scripts_of_free_fleet_send_and_cancel(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    with bridged(small, tmp_runtime, endpoint, "--dialect", "ros2dds"), ExitStack() as stack:

        def run(name: str, *arguments: str) -> "subprocess.Popen[str]":
            process = stack.enter_context(script(name, endpoint, tmp_runtime, *arguments))
            stack.callback(process.kill)  # one of them goes on for ever after the result
            return process

        with client_session(endpoint) as session, Client(session, None, "r1"):
            pass  # until then there is nobody to ask
        read_until(run("nav2_send_navigate_to_pose", "-x", "5.5", "-y", "3.5"), "Goal rejected")
        goal = run("nav2_send_navigate_to_pose", "-x", "9.5", "-y", "2.0")
        read_until(goal, "Goal accepted by server")
        read_until(goal, "Distance remaining: ")
        read_until(run("nav2_cancel_all_goals"), "Return code: 0")
        read_until(goal, "Result: 5")
        goal = run("nav2_send_navigate_to_pose", "-x", "9.5", "-y", "2.0")
        read_until(goal, "Result: 4")
