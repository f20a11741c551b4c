"""The process that drives a square with a robot of ROS, without a fleet, and prints what was measured."""

from collections.abc import Callable
from math import inf
from pathlib import Path
from time import monotonic
from typing import Final

from swarm.bridge.body import readings
from swarm.bridge.body.body import STANDS, BodyOptions
from swarm.bridge.body.localiser import Localiser, SpeedLimits
from swarm.bridge.body.ros_robot import RosRobot
from swarm.bridge.body.square import (
    OdometrySample,
    Square,
    SquareKind,
    SquareResult,
    format_kind_entry,
    format_kind_use,
    format_robot_section,
    format_square_result,
    measure_square,
)
from swarm.bridge.ros2.types import Types
from swarm.bus import Endpoint
from swarm.bus.foreign import Foreign
from swarm.bus.losses import Ledger
from swarm.errors import ConfigError, PeerError
from swarm.stop_signal import stop_flag

LOOK: Final = 0.001  # s between two looks for what ROS says: as exactly is latency measured
AGAIN: Final = 0.05  # s between two commands: a robot's driver stands if none comes for a while
SILENT: Final = 0.5  # s without odometry, after which the square is given up
FIRST: Final = 30.0  # s to wait for the first odometry


def run(
    router: Endpoint, domain: int, distro: str, setting: BodyOptions, side: float, speed: float,
    kind: SquareKind | None = None, out: Path | None = None, log: Callable[[str], None] = print,
) -> int:  # fmt: skip
    """Drive a square of a side [m] at a speed [m/s] and print what it shows.

    With a ``kind``, an entry of a scenario's ``kinds`` is printed too, or written as the new file ``out``.

    Raises:
        ConfigError: the router of ROS does not answer, or the file cannot be written.
        PeerError: the robot says nothing, or does not do what it is told; it was told to stand.
    """
    assert setting.track_width is not None, "the command line asks for it"
    turning = 2 * speed / setting.track_width  # rad/s: the rims are as fast in a turn
    square = Square(side, speed, min(turning, 1.0))
    with stop_flag() as stop, Foreign(router) as session:
        ledger = Ledger(log)
        robot = RosRobot(session, Types(distro), domain, setting, ledger)
        try:
            log(f"a square of {side:g} m to the left at {speed:g} m/s by {setting.command}; Ctrl-C ends it")
            drive_square(square, robot, setting, stop.wait)
        finally:
            robot.stop_robot()
            ledger.flush()
    if not square.is_done:
        return 1
    tell_result(measure_square(square, setting.track_width), setting, speed, kind, out, log)
    return 0


def tell_result(
    found: SquareResult, setting: BodyOptions, speed: float, kind: SquareKind | None, out: Path | None,
    log: Callable[[str], None],
) -> None:  # fmt: skip
    """Log what a square at a speed [m/s] shows and what to set for it; with ``out``, the entry of a kind goes there.

    Raises:
        ConfigError: the file is there already, or cannot be written.
    """
    width = setting.track_width
    assert width is not None, "the command line asks for it"
    lines = list(format_square_result(found, width, speed, setting.localisation or setting.odometry or ""))
    lines.append("")
    if kind is None:
        lines += format_robot_section(found, width)
    else:
        entry = list(format_kind_entry(kind, found, width))
        place = "these lines" if out is None else f"what is in {out}"
        lines += format_kind_use(kind, setting.robot, width, place)
        lines += entry
    if setting.localisation is None:
        lines.append("# odometry does not see wheels that slip: measure where it really ends, or give --pose")
    for line in lines:
        log(line)
    if kind is not None and out is not None:
        write_new_file(out, "".join(f"{line}\n" for line in entry))


def write_new_file(path: Path, text: str) -> None:
    """Write a text as a file that was not there before.

    Raises:
        ConfigError: it is there, or cannot be written.
    """
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError as fault:
        raise ConfigError(
            f"--out {path}: expected a new file that can be written, got: {fault.strerror}; name another one"
        ) from None


def drive_square(square: Square, robot: RosRobot, setting: BodyOptions, rest: Callable[[float], bool]) -> None:
    """Drive a square; ``rest`` waits for a time [s] and returns True if we are told to stop.

    Raises:
        PeerError: the robot says nothing, or does not do what it is told.
    """
    localiser = Localiser(SpeedLimits(inf, inf))  # what jumps is measured, too
    twist, sent_at, seen_at = STANDS, float("-inf"), monotonic()
    began = False
    while not square.is_done and not rest(LOOK):
        now = monotonic()
        before = twist
        for odometry in robot.take_readings(readings.ODOMETRY, readings.parse_odometry):
            localiser.take_odometry(odometry, now)
            if setting.localisation is None and not localiser.is_known:
                localiser.set_pose(odometry.pose)
            if (pose := localiser.pose_at(now)) is not None:
                began, seen_at = True, now
                twist = square.add_sample(OdometrySample(now, odometry, pose))
        for found in robot.take_readings(readings.LOCALISATION, readings.parse_localisation):
            localiser.take_localisation(found, now)
        if any(robot.take_readings(readings.STOP, readings.parse_stop)):
            raise PeerError(f"{setting.stop}: expected no emergency stop, got one")
        if now - seen_at > (SILENT if began else FIRST):
            lacks = setting.odometry if localiser.last_odometry_time is None or began else setting.localisation
            raise PeerError(
                f"{lacks}: expected messages, got none for {now - seen_at:.2f} s; the robot was told to stand"
            )
        if twist != before or now - sent_at > AGAIN:
            robot.send_twist(twist)
            sent_at = now
