"""`swarm bridge ros2 --body NAME`: a robot of ROS 2 is the body of a robot of the fleet."""

import argparse
import re
from functools import partial
from math import isfinite
from pathlib import Path

from swarm.cli.argument_parser import DEFAULT_PLACE, Parser, endpoint, parse_number_within
from swarm.cli.fleet_lookup import find_fleet
from swarm.errors import ConfigError

TOPICS = ("odom", "pose", "scan", "cmd", "estop")
TOPIC = re.compile(r"(/[A-Za-z](_?[A-Za-z0-9])*)+")  # a full name of ROS
OPTIONS = ("odom", "pose", "scan", "scan_at", "scan_zero_is_far", "cmd", "stamped", "estop", "track_width", "square")
OF_SQUARE = ("kind", "radius", "out")
KIND = re.compile(r"[A-Za-z0-9_.:-]{1,64}")  # the name of a kind in a scenario


def check(options: argparse.Namespace) -> None:
    """Check that options of a body are given with ``--body`` only.

    Raises:
        ConfigError: they are not, or there is neither odometry nor a pose.
    """
    given = [f"--{name.replace('_', '-')}" for name in (*OPTIONS, *OF_SQUARE) if getattr(options, name)]
    if options.body is None and given:
        raise ConfigError(f"{given[0]}: expected --body ROBOT too, got none; name the robot of the fleet")
    if options.body is not None and options.dialect != "rmw_zenoh":
        raise ConfigError(f"--dialect {options.dialect}: expected rmw_zenoh with --body; the other one is not tried")
    shown = {"--clock wall": options.clock == "wall", "--final-turn": options.final_turn, "--without": options.without}
    if options.body is not None and any(shown.values()):
        named = next(name for name, there in shown.items() if there)
        raise ConfigError(f"{named}: expected it without --body, which shows no robots; give it to the other bridge")
    for name in TOPICS:
        topic = getattr(options, name)
        if topic is not None and (name, topic) != ("odom", "none") and not TOPIC.fullmatch(topic):
            raise ConfigError(
                f"--{name}: expected a topic that begins with /, of letters, digits and single _, got {topic!r}"
            )
    if options.square is not None and options.track_width is None:
        raise ConfigError(
            "--square: expected --track-width M too, the wheel separation of the robot's driver, got none"
        )
    if options.square is not None and options.odom == "none":
        raise ConfigError("--square: expected odometry, got --odom none")
    _check_kind(options)
    if options.odom == "none" and options.pose is None:
        raise ConfigError("--odom none: expected --pose T too, got none: one of them tells where the robot is")


def _check_kind(options: argparse.Namespace) -> None:
    """Check that what makes a kind of a robot is given for a square, before one is driven.

    Raises:
        ConfigError: it is not, or the file is there already.
    """
    if options.kind is not None and options.square is None:
        raise ConfigError("--kind: expected --square too, got none: a kind is made of what a square shows; drive one")
    if options.kind is None and (given := [f"--{name}" for name in OF_SQUARE if getattr(options, name)]):
        raise ConfigError(f"{given[0]}: expected --kind NAME too, got none; name the kind that the robot is to be")
    if options.out is not None and options.out.exists():
        raise ConfigError(f"--out {options.out}: expected a new file, got one that is there; name another one")
    if options.out is not None and not options.out.parent.is_dir():
        raise ConfigError(f"--out {options.out}: expected a folder {options.out.parent}, found none; make it first")


def body(options: argparse.Namespace) -> int:
    """Drive a robot of ROS as a body, or measure it."""
    from swarm.bridge.body.body import BodyOptions
    from swarm.geometry import Pose

    name = options.body
    setting = BodyOptions(
        robot=name,
        odometry=None if options.odom == "none" else options.odom or f"/{name}/odom",
        localisation=options.pose,
        scan=options.scan,
        command=options.cmd or f"/{name}/cmd_vel",
        stop=options.estop,
        stamped=options.stamped,
        mounted=Pose(*(options.scan_at or (0.0, 0.0, 0.0))),
        zero_is_far=options.scan_zero_is_far,
        track_width=options.track_width,
    )
    if options.square is not None:
        from swarm.bridge.body.measure import run as measure
        from swarm.bridge.body.square import SquareKind

        ros = endpoint(options.ros or options.connect or f"tcp/{DEFAULT_PLACE}", None, name)
        kind = None if options.kind is None else SquareKind(options.kind, options.radius)
        side, speed = options.square, options.speed
        return measure(ros, options.domain, options.distro, setting, side, speed, kind, options.out)
    from swarm.bridge.body.process import run

    router, fleet = find_fleet(options, name)
    ros = router if options.ros is None else endpoint(options.ros, None, name)
    return run(router, fleet, ros, options.domain, options.distro, setting)


def add_body_options(parser: Parser) -> None:
    """Add the options of a body."""
    group = parser.add_argument_group("a robot of ROS as a body of the fleet", "see docs/body.md")
    add = group.add_argument
    add("--body", metavar="ROBOT", help="which robot of the fleet it is; the world was started with the same")
    add("--odom", metavar="T", help="nav_msgs/Odometry of the robot; /ROBOT/odom by default; none: --pose is enough")
    add("--pose", metavar="T", help="where it is in the map, geometry_msgs/PoseWithCovarianceStamped, as of AMCL")
    add("--scan", metavar="T", help="sensor_msgs/LaserScan; by default the world casts the robot's rays")
    add("--scan-at", metavar="X,Y,YAW", type=_parse_mounting, help="m, rad; the scanner's pose on it")
    add("--scan-zero-is-far", action="store_true", help="the scanner writes 0 where nothing is in reach")
    add("--cmd", metavar="T", help="geometry_msgs/Twist for the robot; /ROBOT/cmd_vel by default")
    add("--stamped", action="store_true", help="--cmd is geometry_msgs/TwistStamped")
    add("--estop", metavar="T", help="std_msgs/Bool: true while an emergency stop is pressed")
    text = "m; by which the robot makes wheel speeds of a twist; by default its track_width in the scenario"
    add("--track-width", metavar="M", type=partial(_number, "--track-width", 0.01, 5.0), help=text)
    text = "drive a square of so many metres (1) to the left without a fleet, and print what is to be measured first"
    add("--square", metavar="SIDE", nargs="?", const=1.0, type=partial(_number, "--square", 0.2, 20.0), help=text)
    add("--speed", metavar="V", type=partial(_number, "--speed", 0.02, 4.0), default=0.2, help="m/s in the square; 0.2")
    text = "make an entry of a scenario's `kinds` of what the square shows: the fleet plans with what was measured"
    add("--kind", metavar="NAME", type=_parse_kind, help=text)
    text = "m; of the circle around all of the robot, from the point between its wheels; for --kind"
    add("--radius", metavar="M", type=partial(_number, "--radius", 0.01, 5.0), help=text)
    add("--out", type=Path, metavar="FILE", help="a new file for what --kind makes; by default it is printed only")


def _parse_mounting(text: str) -> tuple[float, ...]:
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != 3 or not all(isfinite(value) and abs(value) < 10.0 for value in values):
        raise ConfigError(f"--scan-at: expected X,Y,YAW in m and rad, got {text.strip()!r}; for example 0.1,0,3.14")
    return values


def _parse_kind(text: str) -> str:
    if not KIND.fullmatch(text):
        raise ConfigError(f"--kind: expected 1 to 64 letters, digits or _ . : -, got {text!r}; choose another name")
    return text


def _number(name: str, least: float, most: float, text: str) -> float:
    return parse_number_within(least, most, text, f"{name}: expected {least:g} to {most:g}")
