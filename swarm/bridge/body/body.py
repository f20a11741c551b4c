"""The body of one robot between the fleet and ROS: commands and readings come in, twists and reports go out. Pure."""

from collections import deque
from collections.abc import Sequence
from typing import Final, NamedTuple

from swarm.bridge.body.guard import FIRST_TRY, LAST_TRY, Guard, GuardInputs
from swarm.bridge.body.localiser import Localiser, SpeedLimits
from swarm.bridge.body.rays import Rays, compute_rays
from swarm.bridge.body.readings import Beams, Localisation, Odometry
from swarm.bridge.body.wheels import LONG, Wheels
from swarm.geometry import Pose, Twist, distance, to_frame, wrap
from swarm.messages import BODY, BodyReport, Command, Sense
from swarm.motion.drive import DifferentialDrive
from swarm.robot.pose_estimate import WITHIN_95
from swarm.settings import Settings

STANDS: Final = Twist(0.0, 0.0)
APART: Final = 0.5  # m or rad between where a robot is and where the fleet has it, which is a tick behind or two
KEPT: Final = 100  # localisations, to tell a twist where there is no odometry
SPAN: Final = 0.2  # s, over which it is told: at 1 cm of noise that leaves 0.07 m/s


class BodyOptions(NamedTuple):
    """What a user says of the robot."""

    robot: str  # its name in the fleet
    odometry: str | None  # topics of ROS; None: there is none of it
    localisation: str | None
    scan: str | None
    command: str
    stop: str | None
    stamped: bool = False  # commands are TwistStamped
    mounted: Pose = Pose(0.0, 0.0, 0.0)  # of the scanner on the robot
    zero_is_far: bool = False  # the scanner writes 0 where nothing is in reach
    track_width: float | None = None  # m, by which the robot makes wheel speeds of a twist; None: the scenario's


class RosBody:
    """A robot of ROS as the fleet knows it. All times are s of one clock, that of the caller."""

    def __init__(self, setting: BodyOptions, settings: Settings, now: float) -> None:
        robot = settings.robot
        self._setting, self._settings, self._dt = setting, settings, 1 / settings.rate
        self._drive = DifferentialDrive(setting.track_width or robot.track_width)
        limits = SpeedLimits(robot.top_speed, 2 * robot.top_speed / self._drive.track_width)
        self._localiser = Localiser(limits)
        self._guard = Guard(setting.robot, setting.odometry, setting.localisation, setting.scan, setting.stop)
        self._wheels = Wheels(robot.top_speed, robot.wheel_acceleration)
        self._wheels_fault, self._wheels_at = "", 0.0
        self._command: tuple[Command, float] | None = None  # the newest, and when it came
        self._report: BodyReport | None = None
        self._placed: Pose | None = None  # where the fleet has it
        self._apart_since: float | None = None  # s; None: that is where it is
        self._stop: bool | None = None if setting.stop else False
        self._found: deque[tuple[float, Pose]] = deque(maxlen=KEPT)  # localisations and when they came
        self._jump, self._jumped_at = "", 0.0
        self._errors = 0.0, 0.0  # m, rad; of the last localisation, 95 %
        self._is_worse = False  # than the scenario reckons with
        self._scan, self._scanned_at = Rays([]), None if setting.scan else now
        self._stands: str | None = None  # the name of the fault for which it stands
        self._beat_at = now

    # --- in ---

    def take_odometry(self, odometry: Odometry, now: float) -> None:
        """Take in where the robot is in its own odometry."""
        if jump := self._localiser.take_odometry(odometry, now):
            self._jump, self._jumped_at = f"its odometry {jump}", now
        self._set_start_pose()

    def take_localisation(self, found: Localisation, now: float) -> None:
        """Take in where the robot is in the map; without odometry, that tells its twist too."""
        self._errors = found.error, found.yaw_error
        if self._setting.odometry is None:
            self._found.append((now, found.pose))
            jump = self._localiser.take_odometry(Odometry(found.stamp, found.pose, mean_twist(self._found)), now)
            self._localiser.set_pose(found.pose)
        else:
            jump = self._localiser.take_localisation(found, now)
        if jump:
            self._jump, self._jumped_at = f"its localisation {jump}", now
            self._found.clear()

    def take_scan(self, scan: Beams, now: float) -> None:
        """Take in a scan. One that lacks a ray leaves the last that was whole."""
        found = compute_rays(scan, self._setting.mounted, self._settings, zero_is_far=self._setting.zero_is_far)
        if found.free:
            self._scan, self._scanned_at = found, now
        else:
            self._scan = Rays(self._scan.free, found.lacks)

    def take_stop(self, pressed: bool) -> None:
        """Take in whether an emergency stop is pressed."""
        self._stop = pressed

    def take_sense(self, sense: Sense, now: float) -> None:
        """Take in where the fleet has the robot: with odometry alone it begins there, and later it must agree."""
        self._placed = Pose(sense.x, sense.y, sense.yaw)
        self._set_start_pose()
        at = self._report if self._report is None else Pose(self._report.x, self._report.y, self._report.yaw)
        if at is None or max(distance(at, self._placed), abs(wrap(at.yaw - self._placed.yaw))) <= APART:
            self._apart_since = None
        elif self._apart_since is None:
            self._apart_since = now

    def take_command(self, command: Command, now: float) -> bool:
        """Take in what the robot's brain commands; return True if it is another command than the last."""
        before = None if self._command is None else self._command[0]
        self._command = command, now
        return before is None or (command.run, command.tick) != (before.run, before.tick)

    def _set_start_pose(self) -> None:
        localiser = self._localiser
        alone = self._setting.localisation is None and not localiser.lost and not localiser.is_known
        if alone and self._placed is not None and localiser.last_odometry_time is not None:
            localiser.set_pose(self._placed)

    # --- out ---

    def compute_twist(self, now: float) -> tuple[Twist, list[str]]:
        """Return the twist for the robot now, and what is to be said about it."""
        if self._wheels_fault == "" and self._wheels.fault:
            self._wheels_fault, self._wheels_at = self._wheels.fault, now
        fault = self._guard.find_fault(self._guard_inputs(now))
        if self._wheels_fault and now - self._wheels_at >= self._guard.tries:
            self._wheels_fault, self._guard.tries = "", min(LAST_TRY, 2 * self._guard.tries)
            self._wheels = self._wheels.make_idle()
        said = [*self._format_stand_change(fault), *self._format_localisation_warning()]
        dt, self._beat_at = now - self._beat_at, now
        if fault is not None or self._command is None:
            self._wheels = self._wheels.make_idle()
            return STANDS, said
        command, top = self._command[0], self._settings.robot.top_speed
        left, right = (
            max(-top, min(top, speed)) for speed in (command.left, command.right)
        )  # as the world limits them
        self._wheels = self._wheels.advance_wheels((left, right), self._drive.rim_speeds(self._localiser.twist), dt)
        if self._wheels.well > LONG:
            self._guard.tries = FIRST_TRY
        return self._drive.twist(left, right), said

    def _format_localisation_warning(self) -> list[str]:
        """Return a line if the localisation begins to be worse than the fleet was set for."""
        setting = self._settings.localisation
        most = WITHIN_95 * (setting.error if setting.told is None else setting.told)
        worse, before = self._errors[0] > most, self._is_worse
        self._is_worse = worse
        if not worse or before:
            return []
        return [
            f"localisation: is good to {self._errors[0]:.2f} m (95 %), and the scenario reckons with {most:.2f} m; "
            "set localisation.error in the scenario, or mend the robot's map"
        ]

    def make_report(self, now: float) -> BodyReport | None:
        """Return what to report for the last command: the pose at the next tick. None: the pose is not known."""
        if self._command is None:
            return None
        command = self._command[0]
        last = self._report
        if last is not None and (last.run, last.tick) == (command.run, command.tick):
            return last
        heard = self._localiser.last_odometry_time
        pose = self._localiser.pose_at(now + self._dt)
        if pose is None or heard is None or now - heard > BODY.timeout:
            return None
        left, right = self._drive.rim_speeds(self._localiser.twist)
        fresh = self._setting.scan is not None and not self._guard.has_old_scan(self._guard_inputs(now))
        # a fleet that takes poses for exact has no room for their errors in its cells
        errors = (0.0, 0.0) if self._settings.localisation.exact else self._errors
        self._report = BodyReport(
            run=command.run, tick=command.tick, x=pose.x, y=pose.y, yaw=pose.yaw, left=left, right=right,
            rays=self._scan.free if fresh else [],
            pose_error=errors[0], yaw_error=errors[1],
        )  # fmt: skip
        return self._report

    def _guard_inputs(self, now: float) -> GuardInputs:
        def age(at: float | None) -> float | None:
            return None if at is None else now - at

        return GuardInputs(
            odometry_age=age(self._localiser.last_odometry_time),
            known=self._localiser.is_known,
            lost=self._localiser.lost,
            jump=self._jump,
            jump_age=now - self._jumped_at,
            scan_age=age(self._scanned_at) if self._setting.scan else 0.0,
            scan_lacks=self._scan.lacks,
            apart_for=age(self._apart_since) or 0.0,
            alone=self._localiser.alone if self._setting.odometry and self._setting.localisation else 0.0,
            stop=self._stop,
            wheels=self._wheels_fault,
            wheels_age=now - self._wheels_at,
            command_age=None if self._command is None else now - self._command[1],
        )

    def _format_stand_change(self, fault: tuple[str, str] | None) -> list[str]:
        """Return the lines about a change: why it stands, or that it goes on."""
        name = None if fault is None else fault[0]
        if name == self._stands:
            return []
        self._stands = name
        robot = self._setting.robot
        return [f"{robot} stands: {fault[1]}" if fault is not None else f"{robot} goes on"]


def mean_twist(found: Sequence[tuple[float, Pose]]) -> Twist:
    """Return the twist of a robot that was seen at times [s] and poses, over the last ``SPAN``."""
    now, last = found[-1]
    then, before = next(((at, pose) for at, pose in found if now - at <= SPAN), found[-1])
    if then == now:
        return STANDS
    forward, _ = to_frame(before, last.x, last.y)
    return Twist(forward / (now - then), wrap(last.yaw - before.yaw) / (now - then))
