"""The process of a body: it hears the robot in ROS and its brain in the fleet, and drives the robot, until the end."""

from collections.abc import Callable
from time import monotonic
from typing import Final

from swarm.bridge.body import readings
from swarm.bridge.body.body import BodyOptions, RosBody
from swarm.bridge.body.ros_robot import RosRobot
from swarm.bridge.ros2.types import Types
from swarm.bus import Arrival, Bus, Endpoint, Link
from swarm.bus.foreign import Foreign
from swarm.bus.losses import Ledger
from swarm.errors import ConfigError
from swarm.heartbeat import Heartbeat
from swarm.kinds import settings_of_named
from swarm.messages import BODY, CLOCK, COMMAND, MAP, SENSE, Clock, Command, Phase, Sense
from swarm.settings import Settings
from swarm.stop_signal import stop_flag

LOOK: Final = 0.01  # s, the longest time between two looks for what ROS says
MOST: Final = 100  # arrivals that are taken in before the robot is told


def run(
    endpoint: Endpoint,
    fleet: str,
    router: Endpoint,
    domain: int,
    distro: str,
    setting: BodyOptions,
    log: Callable[[str], None] = print,
) -> int:
    """Drive a robot of ROS as the body of one robot of a fleet until the run is over or we are told to stop.

    Raises:
        ConfigError: one of the routers does not answer, or the fleet has another scenario than at the beginning.
    """
    with stop_flag() as stop, Bus(endpoint, fleet, log, Heartbeat()) as bus, Foreign(router) as session:
        ledger = Ledger(log)
        robot = RosRobot(session, Types(distro), domain, setting, ledger)
        try:
            place = f"ROS domain {domain} ({distro}) on {router}"
            log(f"{setting.robot} of fleet {fleet} is the robot that obeys {setting.command} in {place}")
            BodyBridge(bus, robot, setting, ledger, log).drive_until_end(stop.is_set)
        finally:
            robot.stop_robot()
    return 0


class BodyBridge:
    """The main loop of one body."""

    def __init__(
        self, bus: Bus, robot: RosRobot, setting: BodyOptions, ledger: Ledger, log: Callable[[str], None]
    ) -> None:
        self._bus, self._robot, self._setting, self._ledger, self._log = bus, robot, setting, ledger, log
        self._settings: Settings | None = None  # as they are for this robot
        self._run = -1  # of the last command
        self._over = False
        self._due = 0.0  # s, when the next report may go out
        self._unreported = False  # a command has come that is not reported yet

    def drive_until_end(self, stopped: Callable[[], bool]) -> None:
        """Drive the robot until the run is over."""
        self._bus.listen(CLOCK)
        self._bus.listen(COMMAND, robot=self._setting.robot)
        self._bus.listen(SENSE, robot=self._setting.robot)
        while self._settings is None:
            if stopped():
                return
            self._bus.receive(LOOK)  # what comes before the map is of no use
            self._settings = self._fetch_settings()
        if self._settings.kinds:
            self._log(format_plan(self._setting.robot, self._settings))
        body = RosBody(self._setting, self._settings, monotonic())
        dt = 1 / self._settings.rate
        beat = monotonic()
        self._send_twist(body, beat)  # it stands, and says for want of what
        while not stopped() and not self._over:
            commanded = self._receive_from_fleet(body)
            now = monotonic()
            self._receive_from_ros(body, now)
            if commanded or now >= beat:
                self._send_twist(body, now)
                beat = now + dt
            self._send_report(body, now, dt)
            self._ledger.flush()
        if self._over:
            self._log("the run is over")

    def _send_twist(self, body: RosBody, now: float) -> None:
        """Send the robot its twist, and log why it stands."""
        twist, said = body.compute_twist(now)
        self._robot.send_twist(twist)
        for line in said:
            self._log(line)

    def _fetch_settings(self) -> Settings | None:
        """Return the settings of the fleet's scenario as they are for a robot of its kind; None: no world is there.

        Raises:
            ConfigError: the fleet has no such robot, or its scenario no such kind.
        """
        found = self._bus.fetch(MAP, timeout=1.0)
        if not found:
            return None
        scenario, robot = found[0].scenario, self._setting.robot
        if isinstance(scenario.starts, dict) and robot not in scenario.starts:
            raise ConfigError(f"--body {robot}: expected one of {', '.join(scenario.starts)}, got {robot!r}")
        return settings_of_named(scenario.settings, scenario.kinds, robot)

    def _receive_from_fleet(self, body: RosBody) -> bool:
        """Take in what has come from the fleet; return True if there is a new command among it."""
        commanded, room = False, MOST
        arrived = self._bus.receive(LOOK)
        while arrived is not None:
            match arrived:
                case Arrival(message=Clock(phase=phase)):
                    self._over = phase is Phase.OVER
                case Arrival(message=Sense() as sense):
                    body.take_sense(sense, monotonic())
                case Arrival(message=Command() as command):
                    if self._check_scenario(command.run):
                        commanded |= body.take_command(command, monotonic())
                        self._unreported = True
                case Link(up=False):
                    self._log("the fleet's router is away; waiting for it")
            room -= 1
            arrived = self._bus.receive(0.0) if room else None
        return commanded

    def _receive_from_ros(self, body: RosBody, now: float) -> None:
        """Take in what has come from ROS."""
        hear = self._robot.take_readings
        for odometry in hear(readings.ODOMETRY, readings.parse_odometry):
            body.take_odometry(odometry, now)
        for found in hear(readings.LOCALISATION, readings.parse_localisation):
            body.take_localisation(found, now)
        for scan in hear(readings.SCAN, readings.parse_scan):
            body.take_scan(scan, now)
        for pressed in hear(readings.STOP, readings.parse_stop):
            body.take_stop(pressed)

    def _send_report(self, body: RosBody, now: float, dt: float) -> None:
        """Report the last command, not faster than the scenario's rate: in lockstep the clock waits for that."""
        if self._unreported and now >= self._due and (report := body.make_report(now)) is not None:
            self._bus.send(BODY, report, robot=self._setting.robot)
            self._due = max(self._due, now - dt) + dt  # one may come a period early, if the one before came late
            self._unreported = False

    def _check_scenario(self, run: int) -> bool:
        """Return True if a run is of the same scenario; False: that is not known yet, and the robot stands.

        Raises:
            ConfigError: it is not.
        """
        if run != self._run and self._run >= 0:
            self._robot.stop_robot()
            found = self._fetch_settings()
            if found is None:
                return False
            if found != self._settings:
                raise ConfigError(
                    "the fleet has another scenario now: expected that of the beginning; start this program again"
                )
        self._run = run
        return True


def format_plan(robot: str, settings: Settings) -> str:
    """Return a sentence of what a fleet takes a robot for, from the settings as they are for it."""
    own = settings.robot
    return (
        f"the fleet plans with {robot} as its kind says: radius {own.radius:g} m, track width {own.track_width:g} m, "
        f"at most {own.top_speed:.2f} m/s and {own.wheel_acceleration:g} m/s2"
    )
