"""What comes from ROS may be anything: it becomes numbers that can be, or an error that says what is wrong."""

from contextlib import suppress
from math import inf, nan, pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bridge.body import readings
from swarm.bridge.body.readings import LOCALISATION, ODOMETRY, SCAN, STOP
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.geometry import Pose, Twist

ROS = Types("jazzy")
READ = {
    ODOMETRY: readings.parse_odometry, LOCALISATION: readings.parse_localisation, SCAN: readings.parse_scan, STOP: readings.parse_stop,
}  # fmt: skip


def header(frame: str) -> Any:  # noqa: ANN401
    return ROS.make_message(
        "std_msgs/msg/Header",
        stamp=ROS.make_message("builtin_interfaces/msg/Time", sec=3, nanosec=500_000_000),
        frame_id=frame,
    )


def posed(x: float = 1.0, y: float = 2.0, turn: tuple[float, ...] = (0.0, 0.0, sqrt(0.5), sqrt(0.5))) -> Any:  # noqa: ANN401
    qx, qy, qz, qw = turn
    pose = ROS.make_message(
        "geometry_msgs/msg/Pose", position=ROS.make_message("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
        orientation=ROS.make_message("geometry_msgs/msg/Quaternion", x=qx, y=qy, z=qz, w=qw),
    )  # fmt: skip
    return ROS.make_message("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36))


def odometry(frame: str = "odom", v: float = 0.5, w: float = -0.1, **pose: Any) -> bytes:  # noqa: ANN401
    def vector(x: float, z: float) -> Any:  # noqa: ANN401
        return ROS.make_message("geometry_msgs/msg/Vector3", x=x, y=0.0, z=z)

    twist = ROS.make_message("geometry_msgs/msg/Twist", linear=vector(v, 0.0), angular=vector(0.0, w))
    return ROS.serialize(ODOMETRY, ROS.make_message(
        ODOMETRY, header=header(frame), child_frame_id="base_link", pose=posed(**pose),
        twist=ROS.make_message("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    ))  # fmt: skip


def localisation(frame: str = "map", **pose: Any) -> bytes:  # noqa: ANN401
    return ROS.serialize(LOCALISATION, ROS.make_message(LOCALISATION, header=header(frame), pose=posed(**pose)))


def scan(**changed: Any) -> bytes:  # noqa: ANN401
    fields = {
        "angle_min": -pi, "angle_max": pi, "angle_increment": 0.1, "time_increment": 0.0, "scan_time": 0.1,
        "range_min": 0.1, "range_max": 3.5, "ranges": np.ones(3, np.float32), "intensities": np.zeros(0, np.float32),
    }  # fmt: skip
    return ROS.serialize(SCAN, ROS.make_message(SCAN, header=header("base_scan"), **fields | changed))


@pytest.mark.parametrize("frame", ["odom", "r2/odom", "/odom"])
def test_odometry_is_read(frame: str) -> None:
    found = readings.parse_odometry(ROS, odometry(frame))
    assert found.stamp == 3.5
    assert found.pose == pytest.approx((1.0, 2.0, pi / 2))
    assert found.twist == Twist(0.5, -0.1)


def test_a_localisation_a_scan_and_a_stop_are_read() -> None:
    assert readings.parse_localisation(ROS, localisation(turn=(0.0, 0.0, 0.0, 2.0))).pose == Pose(1.0, 2.0, 0.0)
    found = readings.parse_scan(ROS, scan())
    assert found.first == pytest.approx(-pi)
    assert found.ranges.tolist() == [1.0] * 3
    assert readings.parse_stop(ROS, ROS.serialize(STOP, ROS.make_message(STOP, data=True))) is True


@pytest.mark.parametrize(
    ("kind", "payload", "why"),
    [
        (ODOMETRY, odometry("base_link"), "header.frame_id: expected 'odom', got 'base_link'"),
        (ODOMETRY, odometry("map"), "header.frame_id: expected 'odom', got 'map'"),
        (ODOMETRY, odometry(v=nan), "twist: expected speeds within 100 m/s and rad/s, got (nan, -0.1)"),
        (ODOMETRY, odometry(w=1e9), "twist: expected speeds within 100 m/s and rad/s, got (0.5, 1000000000.0)"),
        (ODOMETRY, odometry(x=inf), "pose.position: expected x and y within 1e5 m, got (inf, 2.0)"),
        (ODOMETRY, odometry(turn=(0.0, 0.0, 0.0, 0.0)), "pose.orientation: expected a rotation, got (0.0, 0.0, 0.0, 0.0)"),
        (ODOMETRY, localisation(), "expected CDR of nav_msgs/msg/Odometry, got 364 bytes that are none"),
        (LOCALISATION, localisation("odom"), "header.frame_id: expected 'map', got 'odom'"),
        (LOCALISATION, localisation(y=nan), "pose.position: expected x and y within 1e5 m, got (1.0, nan)"),
        (SCAN, scan(ranges=np.ones(0, np.float32)), "expected beams at angles, got 0 from"),
        (SCAN, scan(angle_increment=0.0), "expected beams at angles, got 3 from"),
        (SCAN, scan(angle_min=nan), "expected beams at angles, got 3 from nan rad on"),
        (SCAN, scan(range_max=0.05), "expected 0 <= range_min < range_max, got"),
        (SCAN, b"", "expected CDR of sensor_msgs/msg/LaserScan, which begins with 00 01 00 00, got ''"),
        (STOP, b"\0\1\0\0", "expected CDR of std_msgs/msg/Bool, got 4 bytes that are none"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_and_said(kind: str, payload: bytes, why: str) -> None:
    with pytest.raises(PeerError) as fault:
        READ[kind](ROS, payload)
    assert why in str(fault.value)


@given(kind=st.sampled_from(sorted(READ)), tail=st.binary(max_size=800))
def test_no_payload_is_worse_than_an_error(kind: str, tail: bytes) -> None:
    with suppress(PeerError):
        READ[kind](ROS, b"\0\1\0\0" + tail)


@given(cut=st.integers(0, 700), at=st.integers(0, 700), byte=st.integers(0, 255))
def test_a_message_that_is_cut_or_spoiled_is_no_worse(cut: int, at: int, byte: int) -> None:
    for kind, whole in ((ODOMETRY, odometry()), (LOCALISATION, localisation()), (SCAN, scan())):
        spoiled = bytearray(whole)
        spoiled[min(at, len(spoiled) - 1)] = byte
        for payload in (whole[:cut], bytes(spoiled)):
            with suppress(PeerError):
                READ[kind](ROS, payload)
