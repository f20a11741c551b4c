"""A differential robot of ROS 2 that nobody here has made: python foreign_robot.py SETTINGS, a JSON object.

It stands for a real robot. It imports nothing of this project: its floor is boxes, its drive a unicycle that obeys late,
gains speed only so fast and slips, its odometry has errors that add up, and its lidar casts rays at the boxes. With
"sim": "irsim" the library ir-sim moves it and casts its rays. It speaks rmw_zenoh's wire with plain zenoh and rosbags.
Lines on its standard input make it fail; it prints its collisions.
"""

import importlib
import json
import random
import select
import struct
import sys
import tempfile
import time
from math import cos, hypot, inf, isfinite, pi, sin
from typing import Any

import numpy as np
import zenoh
import zenoh.ext
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

Settings = dict[str, Any]
Floats = NDArray[np.float64]

STORE = get_typestore(Stores.ROS2_JAZZY)
DEAD_MAN = 0.5  # s without a command: its own driver stands then, as real ones do
USUAL: Settings = {
    "domain": 0, "space": "r2", "stamped": False, "seed": 1,
    "radius": 0.2, "late": 0.06, "acceleration": 1.5, "turn_acceleration": 8.0, "top": 1.6, "slow": 1.0, "turning": 1.0,
    "drift": 0.01, "odom_every": 2, "pose_every": 10, "pose_noise": 0.01, "turn_noise": 0.01, "scan_every": 5,
    "beams": 360, "from": 0.0, "reach": 3.5, "mounted": [0.0, 0.0, 0.0], "zero": False, "boxes": [], "estop": False, "odom_frame": "odom", "sim": "own",
    "step": 0.02,
}  # fmt: skip


class Plant:
    """Where the robot really is."""

    def __init__(self, pose: list[float], settings: Settings) -> None:
        self.x, self.y, self.yaw = pose
        self.v = self.w = 0.0
        self.settings, self.told_at = settings, -inf
        self.told: tuple[float, float] = 0.0, 0.0
        self.waiting: list[tuple[float, float, float]] = []
        self.collisions, self.touches, self.path = 0, False, 0.0

    def command(self, v: float, w: float, now: float) -> None:
        self.waiting.append((now + self.settings["late"], v, w))

    def obeyed(self, now: float, stopped: bool) -> tuple[float, float]:
        """Return the twist that the motors are at now."""
        s = self.settings
        while self.waiting and self.waiting[0][0] <= now:
            self.told_at, *told = self.waiting.pop(0)
            self.told = told[0], told[1]
        v, w = self.told if now - self.told_at < DEAD_MAN and not stopped else (0.0, 0.0)
        return max(-s["top"], min(s["top"], v)) * s["slow"], w * s["slow"] * s["turning"]

    def move(self, now: float, stopped: bool) -> None:
        s = self.settings
        v, w = self.obeyed(now, stopped)
        step = s["step"]
        gain, turn = s["acceleration"] * step, s["turn_acceleration"] * step
        self.v += max(-gain, min(gain, v - self.v))
        self.w += max(-turn, min(turn, w - self.w))
        along = self.yaw + self.w * step / 2
        x, y = self.x + self.v * step * cos(along), self.y + self.v * step * sin(along)
        touches = any(gap(box, x, y) < s["radius"] for box in s["boxes"])
        self.collisions += touches and not self.touches
        self.touches = touches
        if not touches:
            self.path += hypot(x - self.x, y - self.y)
            self.x, self.y = x, y
        self.yaw = (self.yaw + self.w * step + pi) % (2 * pi) - pi


class IrSim(Plant):
    """The same robot in the library ir-sim: its kinematics with their noise, its collisions and its lidar."""

    def __init__(self, pose: list[float], settings: Settings) -> None:
        super().__init__(pose, settings)
        irsim = importlib.import_module("irsim")  # it says on standard output that there is no display
        s = settings
        boxes = [
            {
                "shape": {"name": "rectangle", "length": x1 - x0, "width": y1 - y0},
                "state": [(x0 + x1) / 2, (y0 + y1) / 2, 0],
            }
            for x0, y0, x1, y1 in s["boxes"]
        ]
        robot = {
            "kinematics": {"name": "diff", "noise": True, "alpha": [0.02, 0, 0, 0.02]}, "state": pose, "goal": [1e3, 1e3, 0],
            "shape": {"name": "circle", "radius": s["radius"]}, "vel_min": [-s["top"], -8.0], "vel_max": [s["top"], 8.0],
            "acce": [s["acceleration"], s["turn_acceleration"]],
            "sensors": [{"name": "lidar2d", "range_min": 0.0, "range_max": s["reach"], "angle_range": 2 * pi,
                         "number": s["beams"], "noise": True, "std": 0.01}],
        }  # fmt: skip
        size = [max(box[2] for box in s["boxes"]), max(box[3] for box in s["boxes"])]
        world = {"width": size[0], "height": size[1], "step_time": s["step"], "sample_time": s["step"]}
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            json.dump({"world": world, "robot": [robot], "obstacle": boxes}, file)
            file.flush()
            self.env = irsim.make(file.name, display=False, disable_all_plot=True, log_level="ERROR")

    def move(self, now: float, stopped: bool) -> None:
        before = self.x, self.y
        self.env.step(np.array(self.obeyed(now, stopped)).reshape(2, 1))
        robot = self.env.robot
        self.x, self.y, self.yaw = map(float, robot.state.ravel()[:3])
        self.v, self.w = map(float, robot.velocity.ravel()[:2])
        self.collisions += robot.collision and not self.touches
        self.touches = robot.collision
        self.path += hypot(self.x - before[0], self.y - before[1])

    def scan(self) -> tuple[float, float, Floats]:
        """Return the first angle, the angle between two beams, and the ranges."""
        seen = self.env.robot.get_lidar_scan()
        ranges = np.array(seen["ranges"])
        ranges[ranges >= self.settings["reach"]] = np.inf
        return seen["angle_min"], seen["angle_increment"], ranges


class Wheels:
    """What the robot's encoders say: its own motion with errors that add up, from wherever it was switched on."""

    def __init__(self, settings: Settings, chance: random.Random) -> None:
        self.x, self.y, self.yaw, self.step = 0.0, 0.0, 0.0, settings["step"]
        self.drift = settings["drift"] * chance.choice([-1, 1]), settings["drift"] * chance.choice([-1, 1])

    def move(self, v: float, w: float) -> None:
        v, w = v * (1 + self.drift[0]), w * (1 + self.drift[1]) + v * self.drift[1] * 0.2
        self.x += v * self.step * cos(self.yaw + w * self.step / 2)
        self.y += v * self.step * sin(self.yaw + w * self.step / 2)
        self.yaw = (self.yaw + w * self.step + pi) % (2 * pi) - pi


def gap(box: list[float], x: float, y: float) -> float:
    return hypot(max(box[0] - x, x - box[2], 0.0), max(box[1] - y, y - box[3], 0.0))


def cast(boxes: Floats, x: float, y: float, angles: Floats) -> Floats:
    """Slabs: how far rays get from a point, for boxes (n, 4) of low x, low y, high x, high y."""
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.stack([np.cos(angles), np.sin(angles)], 1)[:, None, :]
        low, high = (boxes[None, :, :2] - (x, y)) / along, (boxes[None, :, 2:] - (x, y)) / along
        near, far = np.minimum(low, high).max(2), np.maximum(low, high).min(2)
    near[(near > far) | (near < 0)] = np.inf
    nearest: Floats = near.min(1)
    return nearest


class Driver:
    """The robot's nodes in ROS."""

    def __init__(self, session: zenoh.Session, settings: Settings) -> None:
        self.s = settings
        self.publishers: dict[str, tuple[str, Any]] = {}
        self.numbers: dict[str, int] = {}
        for topic, kind, kept in (
            ("odom", "nav_msgs/msg/Odometry", 0), ("scan", "sensor_msgs/msg/LaserScan", 0),
            ("amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", 1), ("estop", "std_msgs/msg/Bool", 1),
        ):  # fmt: skip
            self.publishers[topic] = kind, zenoh.ext.declare_advanced_publisher(
                session, self.key(topic, kind), cache=zenoh.ext.CacheConfig(kept) if kept else None,
                publisher_detection=True if kept else None,
                sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5)
                if kept else None,
            )  # fmt: skip

    def key(self, topic: str, kind: str) -> str:
        package, folder, name = kind.split("/")
        return (
            f"{self.s['domain']}/{self.s['space']}/{topic}/{package}::{folder}::dds_::{name}_/{STORE.hash_rihs01(kind)}"
        )

    def send(self, topic: str, message: Any) -> None:  # noqa: ANN401
        kind, publisher = self.publishers[topic]
        payload = message if isinstance(message, bytes) else bytes(STORE.serialize_cdr(message, kind))
        number = self.numbers[topic] = self.numbers.get(topic, 0) + 1
        publisher.put(payload, attachment=struct.pack("<qqB16s", number, time.time_ns(), 16, topic.encode().ljust(16)))


def make(name: str, **fields: Any) -> Any:  # noqa: ANN401
    return STORE.types[name](**fields)


def header(frame: str) -> Any:  # noqa: ANN401
    seconds, rest = divmod(time.time_ns(), 10**9)
    stamp = make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def posed(x: float, y: float, yaw: float) -> Any:  # noqa: ANN401
    pose = make(
        "geometry_msgs/msg/Pose",
        position=make("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
        orientation=make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2)),
    )
    return make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36))


def vector(x: float, z: float) -> Any:  # noqa: ANN401
    return make("geometry_msgs/msg/Vector3", x=x, y=0.0, z=z)


def odometry(wheels: Wheels, v: float, w: float, frame: str) -> Any:  # noqa: ANN401
    twist = make("geometry_msgs/msg/Twist", linear=vector(v, 0.0), angular=vector(0.0, w))
    return make(
        "nav_msgs/msg/Odometry", header=header(frame), child_frame_id="base_footprint",
        pose=posed(wheels.x, wheels.y, wheels.yaw),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    )  # fmt: skip


def scan(plant: Plant, settings: Settings, boxes: Floats) -> Any:  # noqa: ANN401
    """A lidar whose beam 0 points ``from`` and that turns to the left; nothing in reach is +inf by REP-117, or 0."""
    if isinstance(plant, IrSim):
        first, step, ranges = plant.scan()
    else:
        mx, my, turned = settings["mounted"]
        c, s = cos(plant.yaw), sin(plant.yaw)
        first, step = settings["from"], 2 * pi / settings["beams"]
        angles = plant.yaw + turned + first + step * np.arange(settings["beams"])
        ranges = cast(boxes, plant.x + c * mx - s * my, plant.y + s * mx + c * my, angles)
        ranges[ranges > settings["reach"]] = 0.0 if settings["zero"] else np.inf
    if settings.get("half"):
        ranges = ranges[: len(ranges) // 2]
    return make(
        "sensor_msgs/msg/LaserScan", header=header("base_scan"), angle_min=first, angle_max=first + step * (len(ranges) - 1),
        angle_increment=step, time_increment=0.0, scan_time=0.1, range_min=0.12, range_max=settings["reach"],
        ranges=ranges.astype(np.float32), intensities=np.zeros(0, np.float32),
    )  # fmt: skip


def drive(session: zenoh.Session, settings: Settings) -> None:
    chance = random.Random(settings["seed"])
    plant = (IrSim if settings["sim"] == "irsim" else Plant)(settings["pose"], settings)
    wheels, step = Wheels(settings, chance), settings["step"]
    boxes = np.array(settings["boxes"] or [[1e6, 1e6, 1e6 + 1, 1e6 + 1]], float)
    driver = Driver(session, settings)
    kind = "geometry_msgs/msg/TwistStamped" if settings["stamped"] else "geometry_msgs/msg/Twist"
    commands: Any = session.declare_subscriber(driver.key("cmd_vel", kind), zenoh.handlers.FifoChannel(1000))
    stopped = asked = False
    off: set[str] = set()
    driver.send("estop", make("std_msgs/msg/Bool", data=False))
    print("the robot stands", flush=True)
    began, tick = time.monotonic(), 0
    while True:
        tick += 1
        late = time.monotonic() - began - tick * step
        while True:  # what it is told does not make its time go faster
            wait = began + tick * step - time.monotonic()
            if wait <= 0.0 or not select.select([sys.stdin], [], [], wait)[0]:
                break
            words = sys.stdin.readline().split()
            if not words:
                print(f"collisions {plant.collisions}, path {plant.path:.1f} m", flush=True)
                return
            name, *values = words
            if name == "jump":  # somebody carries it, or its localisation errs: both come to the same for who listens
                settings["error"] = [float(value) for value in values]
            elif name == "reset":  # its driver has started again
                wheels.x = wheels.y = wheels.yaw = 0.0
            elif name in {"off", "on"}:
                off = off | set(values) if name == "off" else off - set(values)
            elif name == "estop":
                stopped = values == ["on"]
                if settings["estop"]:
                    driver.send("estop", make("std_msgs/msg/Bool", data=stopped))
            elif name == "garbage":
                driver.send(values[0], b"garbage")
            elif name == "where":
                asked = True
            elif name == "set":
                settings[values[0]] = json.loads(values[1])
        now = time.monotonic()
        while (sample := commands.try_recv()) is not None:
            said: Any = STORE.deserialize_cdr(sample.payload.to_bytes(), kind)
            said = said.twist if settings["stamped"] else said
            assert isfinite(said.linear.x + said.angular.z)
            plant.command(said.linear.x, said.angular.z, now)
        if late > 0.1:
            began = now - tick * step  # the machine was busy: the robot was frozen with it
        plant.move(now, stopped)
        if asked:  # once a step at most
            asked = False
            print("at", plant.x, plant.y, plant.yaw, plant.v, plant.w, *plant.told, flush=True)
        wheels.move(plant.v, plant.w)
        if tick % settings["odom_every"] == 0 and "odom" not in off:
            driver.send("odom", odometry(wheels, plant.v, plant.w, settings["odom_frame"]))
        if tick % settings["pose_every"] == 0 and "pose" not in off:
            dx, dy, turn = settings.get("error", (0.0, 0.0, 0.0))
            noise, turns = settings["pose_noise"], settings["turn_noise"]
            found = posed(
                plant.x + dx + chance.gauss(0, noise), plant.y + dy + chance.gauss(0, noise),
                plant.yaw + turn + chance.gauss(0, turns),
            )  # fmt: skip
            driver.send(
                "amcl_pose",
                make("geometry_msgs/msg/PoseWithCovarianceStamped", header=header("map"), pose=found),
            )
        if tick % settings["scan_every"] == 0 and "scan" not in off:
            driver.send("scan", scan(plant, settings, boxes))


def main(text: str) -> None:
    settings = USUAL | json.loads(text)
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([settings["router"]]))
    with zenoh.open(config) as session:
        drive(session, settings)


if __name__ == "__main__":
    main(sys.argv[1])
