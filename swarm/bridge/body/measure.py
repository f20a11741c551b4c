"""The process that drives a square with a robot of ROS, without a fleet, and prints what was measured."""

from collections.abc import Callable
from math import inf
from time import monotonic
from typing import Final

from swarm.bridge.body import readings
from swarm.bridge.body.body import STANDS, Setting
from swarm.bridge.body.localiser import Limits, Localiser
from swarm.bridge.body.ros_robot import RosRobot
from swarm.bridge.body.square import Sample, Square, measured, told
from swarm.bridge.ros2.types import Types
from swarm.bus import Endpoint
from swarm.bus.foreign import Foreign
from swarm.bus.losses import Ledger
from swarm.errors import PeerError
from swarm.stopping import told_to_stop

LOOK: Final = 0.001  # s between two looks for what ROS says: as exactly is latency measured
AGAIN: Final = 0.05  # s between two commands: a robot's driver stands if none comes for a while
SILENT: Final = 0.5  # s without odometry, after which the square is given up
FIRST: Final = 30.0  # s to wait for the first odometry


def run(
    router: Endpoint, domain: int, distro: str, setting: Setting, side: float, speed: float,
    log: Callable[[str], None] = print,
) -> int:  # fmt: skip
    """Drive a square of a side [m] at a speed [m/s] and print what it shows.

    Raises:
        ConfigError: the router of ROS does not answer.
        PeerError: the robot says nothing, or does not do what it is told; it was told to stand.
    """
    assert setting.track_width is not None, "the command line asks for it"
    turning = 2 * speed / setting.track_width  # rad/s: the rims are as fast in a turn
    square = Square(side, speed, min(turning, 1.0))
    with told_to_stop() as stop, Foreign(router) as session:
        ledger = Ledger(log)
        robot = RosRobot(session, Types(distro), domain, setting, ledger)
        try:
            log(f"a square of {side:g} m to the left at {speed:g} m/s by {setting.command}; Ctrl-C ends it")
            drive(square, robot, setting, stop.wait)
        finally:
            robot.stand()
            ledger.flush()
    if not square.done:
        return 1
    by = setting.localisation or setting.odometry or ""
    for line in told(measured(square, setting.track_width), setting.track_width, speed, by):
        log(line)
    if setting.localisation is None:
        log("# odometry does not see wheels that slip: measure where it really ends, or give --pose")
    return 0


def drive(square: Square, robot: RosRobot, setting: Setting, rest: Callable[[float], bool]) -> None:
    """Drive a square; ``rest`` waits for a time [s] and returns True if we are told to stop.

    Raises:
        PeerError: the robot says nothing, or does not do what it is told.
    """
    localiser = Localiser(Limits(inf, inf))  # what jumps is measured, too
    twist, sent_at, seen_at = STANDS, float("-inf"), monotonic()
    began = False
    while not square.done and not rest(LOOK):
        now = monotonic()
        before = twist
        for odometry in robot.heard(readings.ODOMETRY, readings.odometry):
            localiser.take(odometry, now)
            if setting.localisation is None and not localiser.known:
                localiser.begin_at(odometry.pose)
            if (pose := localiser.pose(now)) is not None:
                began, seen_at = True, now
                twist = square.step(Sample(now, odometry, pose))
        for found in robot.heard(readings.LOCALISATION, readings.localisation):
            localiser.correct(found, now)
        if any(robot.heard(readings.STOP, readings.stop)):
            raise PeerError(f"{setting.stop}: expected no emergency stop, got one")
        if now - seen_at > (SILENT if began else FIRST):
            lacks = setting.odometry if localiser.heard_at is None or began else setting.localisation
            raise PeerError(
                f"{lacks}: expected messages, got none for {now - seen_at:.2f} s; the robot was told to stand"
            )
        if twist != before or now - sent_at > AGAIN:
            robot.drive(twist)
            sent_at = now
