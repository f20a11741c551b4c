"""What a body does on each fault: twists, reports and lines, without ROS and without a fleet."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from swarm.bridge.body.body import BodyOptions, RosBody
from swarm.bridge.body.guard import FAULTS
from swarm.bridge.body.process import format_plan
from swarm.bridge.body.readings import Beams, Localisation, Odometry
from swarm.geometry import Pose, Twist, integrate
from swarm.kinds import settings_of
from swarm.messages import Activity, BodyReport, Command
from tests.robot.shared import FITS
from tests.shared import scenario_of

STEP = 0.05  # s
HERE, STANDS = Pose(0.0, 0.0, 0.0), Twist(0.0, 0.0)
SETTINGS = scenario_of().settings
FULL = Beams(-pi, pi / 180, 0.1, 3.5, np.full(360, 1.0, np.float32))
AHEAD = Beams(-pi / 4, pi / 180, 0.1, 3.5, np.full(90, 1.0, np.float32))
USUAL: dict[str, Any] = {
    "robot": "r2", "odometry": "/odom", "localisation": "/pose", "scan": "/scan", "command": "/cmd", "stop": "/stop",
}  # fmt: skip


@dataclass
class Run:
    """A body and a robot that obeys at once, in steps of one tick."""

    body: RosBody
    says: dict[str, bool] = field(default_factory=lambda: dict.fromkeys(("odom", "pose", "scan", "stop", "cmd"), True))
    obeys: float = 1.0  # share of the twist that the robot drives
    error: Pose = HERE
    pressed: bool = False
    scan: Beams = FULL
    left: float = 0.5  # m/s
    right: float = 0.5
    pose: Pose = HERE
    twist: Twist = STANDS
    placed: Pose | None = None  # where the fleet has it, if not where it was reported
    tick: int = 0
    now: float = 0.0
    lines: list[str] = field(default_factory=list)
    reports: list[BodyReport | None] = field(default_factory=list)
    twists: list[Twist] = field(default_factory=list)

    def steps(self, count: int) -> "Run":
        body = self.body
        for _ in range(count):
            self.tick += 1
            self.now = self.tick * STEP
            self.pose = integrate(self.pose, self.twist, STEP)
            x, y, yaw = self.pose
            if self.says["odom"]:
                body.take_odometry(Odometry(self.now, self.pose, self.twist), self.now)
            if self.says["pose"]:
                body.take_localisation(
                    Localisation(self.now, Pose(x + self.error.x, y + self.error.y, yaw + self.error.yaw)), self.now
                )
            if self.says["scan"]:
                body.take_scan(self.scan, self.now)
            if self.says["stop"]:
                body.take_stop(self.pressed)
            if self.says["cmd"]:
                body.take_command(command(self.tick, self.left, self.right), self.now)
            reported = next((one for one in reversed(self.reports) if one is not None), None)
            if (at := self.placed or reported) is not None:
                body.take_sense(structs.replace(FITS, x=at.x, y=at.y, yaw=at.yaw), self.now)
            told, said = body.compute_twist(self.now)
            self.twist = Twist(told.linear * self.obeys, told.angular * self.obeys)
            self.lines += said
            self.twists.append(told)
            self.reports.append(body.make_report(self.now))
        return self


def command(tick: int, left: float, right: float) -> Command:
    return Command(
        run=0, tick=tick, left=left, right=right, heading=0.0, activity=Activity.DRIVE, reached=[], unreachable=[],
        sent=False, replans=0,
    )  # fmt: skip


def run_of(**setting: Any) -> Run:  # noqa: ANN401
    return Run(RosBody(BodyOptions(**USUAL | setting), SETTINGS, 0.0))


def test_a_robot_with_all_that_it_was_asked_for_drives_and_reports() -> None:
    run = run_of().steps(40)
    assert run.lines == []
    assert set(run.twists) == {Twist(0.5, 0.0)}
    last = run.reports[-1]
    assert last is not None
    assert (last.run, last.tick) == (0, 40)
    assert last.x == pytest.approx(run.pose.x + 0.5 * STEP), "the pose at the next tick"
    assert (last.left, last.right) == (0.5, 0.5)
    assert last.rays == pytest.approx([0.8] * 15)


def silence(name: str) -> Callable[[Run], None]:
    return lambda run: run.says.update({name: False})


def carried_off(run: Run) -> None:
    run.says["pose"], run.pose = False, Pose(9.0, 0.0, 0.0)


# what goes wrong, what is said, by when [ticks], whether its body is still reported, and if rays are
CASES: Sequence[tuple[str, Callable[[Run], Any], str, int, bool, bool]] = (
    ("stop", lambda run: setattr(run, "pressed", True), "an emergency stop is pressed, by /stop", 1, True, True),
    ("odometry", silence("odom"), "nothing usable has come on /odom for 0.25 s", 7, False, False),
    ("jump", lambda run: setattr(run, "error", Pose(0.5, 0.0, 0.0)), "its localisation jumped 0.50 m in 0.00 s", 1, True, True),
    ("lost", carried_off, "its odometry jumped 8.55 m in 0.05 s; nobody knows where it is until /pose tells", 1, False, False),
    ("alone", silence("pose"), "nothing usable has come on /pose for 2 m of its way", 82, True, True),
    ("apart", lambda run: setattr(run, "placed", HERE),
     "the fleet has it elsewhere than it is; is it on the map, and was the world started with --body r2?", 46, True, True),
    ("scan", silence("scan"), "nothing usable has come on /scan for 0.5 s", 12, True, False),
    ("rays", lambda run: setattr(run, "scan", AHEAD), "the scan on /scan has no beam in the direction of ray 1 (48 degrees)", 12, True, False),
    ("wheels", lambda run: setattr(run, "obeys", 0.0), "its left wheel does not turn though it was told 0.50 m/s; is an emergency stop pressed?; it tries again in 2 s", 70, True, True),
    ("wheels", lambda run: setattr(run, "obeys", 0.5), "its left wheel does 0.25 m/s and was told 0.50 m/s; it tries again in 2 s", 80, True, True),
    ("command", silence("cmd"), "its brain has commanded nothing for 0.25 s", 7, True, True),
)  # fmt: skip


@pytest.mark.parametrize(("name", "breaks", "why", "within", "reported", "with_rays"), CASES)
def test_on_a_fault_it_stands_and_says_why_once(
    name: str, breaks: Callable[[Run], Any], why: str, within: int, reported: bool, with_rays: bool
) -> None:
    run = run_of().steps(20)
    breaks(run)
    run.steps(within)
    assert [masked(line) for line in run.lines] == [masked(f"r2 stands: {why}")]
    assert run.twists[-1] == STANDS
    last = run.reports[-1]
    assert (last is not None) is reported
    assert last is None or bool(last.rays) is with_rays


def masked(text: str) -> str:
    """Return a sentence without its speeds: how fast wheels were told to be is what the robot's brain says."""
    return re.sub(r"\d\.\d\d m/s", "V m/s", text)


def test_every_fault_of_the_table_has_a_case() -> None:
    assert {fault.name for fault in FAULTS} == {case[0] for case in CASES} | {"unknown", "no stop"}


def test_another_fault_of_the_scan_is_said_while_it_stands_for_one() -> None:
    run = run_of().steps(20)
    run.says["scan"] = False
    run.steps(12)
    run.says["scan"], run.scan = True, AHEAD
    run.steps(2)
    assert [line.partition(" on /scan ")[0] for line in run.lines] == [
        "r2 stands: nothing usable has come", "r2 stands: the scan"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("lacks", "why"),
    [
        ("odom", "nothing usable has come on /odom yet"),
        ("pose", "nothing usable has come on /pose yet"),
        ("scan", "nothing usable has come on /scan yet"),
        ("stop", "nothing usable has come on /stop yet, which tells of the emergency stop"),
        ("cmd", "its brain has not commanded anything yet"),
    ],
)
def test_what_it_was_asked_for_has_to_come_before_it_drives(lacks: str, why: str) -> None:
    run = run_of()
    run.says[lacks] = False
    run.steps(10)
    assert run.lines == [f"r2 stands: {why}"]
    assert set(run.twists) == {STANDS}
    run.says[lacks] = True
    run.steps(2)
    assert run.lines[1:] == ["r2 goes on"]
    assert run.twists[-1] == Twist(0.5, 0.0)


def test_with_odometry_alone_it_begins_where_the_fleet_has_it_and_a_jump_is_for_good() -> None:
    run = run_of(localisation=None, scan=None, stop=None)
    run.says.update(pose=False, scan=False, stop=False)
    run.steps(5)
    assert run.lines == ["r2 stands: the fleet has not told yet where it begins"]
    run.body.take_sense(structs.replace(FITS, x=2.5, y=4.0, yaw=pi / 2), run.now)
    run.steps(20)
    last = run.reports[-1]
    assert last is not None
    assert last.x == pytest.approx(2.5)
    assert last.yaw == pytest.approx(pi / 2)
    assert last.y > 4.3
    assert last.rays == []
    run.pose = Pose(0.0, 0.0, 0.0)
    run.steps(100)
    said = run.lines[-1]
    assert "nobody knows where it is until it stands where the fleet shows it and this program is started again" in said
    assert run.reports[-1] is None
    assert run.twists[-1] == STANDS


def test_poses_alone_are_enough() -> None:
    run = run_of(odometry=None)
    run.says["odom"] = False
    run.steps(40)
    last = run.reports[-1]
    assert last is not None
    assert last.left == pytest.approx(0.5)
    run.error = Pose(0.5, 0.0, 0.0)
    run.steps(1)
    assert run.lines[-1].startswith("r2 stands: its localisation jumped 0.5")
    run.steps(25)
    assert run.lines[-1] == "r2 goes on"


def test_wheels_that_do_not_turn_are_tried_again_more_and_more_seldom() -> None:
    run = run_of()
    run.obeys = 0.0
    run.steps(round(60 / STEP))
    waits = [line.rsplit("again in ", 1)[1] for line in run.lines if "again in" in line]
    assert waits[:4] == ["2 s", "4 s", "8 s", "16 s"]
    assert {line for line in run.lines if "again in" not in line} == {"r2 goes on"}
    run.obeys = 1.0
    run.steps(round(40 / STEP))
    assert run.lines[-1] == "r2 goes on"
    run.obeys = 0.0
    run.steps(80)
    assert run.lines[-1].endswith("again in 2 s"), "it has driven well meanwhile"


def test_a_robot_that_is_as_slow_to_start_as_many_are_is_no_fault() -> None:
    run = run_of()
    run.steps(1)
    for tick in range(100):
        run.twist = Twist(min(0.5, tick * STEP * 0.5), 0.0)  # 0.5 m/s2; the scenario says 2
        pose = integrate(run.pose, run.twist, STEP)
        run.pose, run.now = pose, run.now + STEP
        run.body.take_odometry(Odometry(run.now, pose, run.twist), run.now)
        run.body.take_localisation(Localisation(run.now, pose), run.now)
        run.body.take_scan(FULL, run.now)
        run.body.take_command(command(tick + 10, 0.5, 0.5), run.now)
        assert run.body.compute_twist(run.now) == (Twist(0.5, 0.0), [])


def test_a_command_that_comes_again_has_the_same_report() -> None:
    run = run_of().steps(5)
    first = run.body.make_report(run.now)
    run.body.take_odometry(Odometry(run.now + 0.01, Pose(0.13, 0.0, 0.0), run.twist), run.now + 0.01)
    assert not run.body.take_command(command(5, 0.5, 0.5), run.now + 0.02)
    assert run.body.make_report(run.now + 0.02) is first
    assert run.body.take_command(command(6, 0.5, 0.5), run.now + 0.03)
    assert run.body.make_report(run.now + 0.03) is not first


def test_a_turn_is_commanded_by_the_track_width_of_the_robots_own_driver() -> None:
    run = run_of(track_width=0.16)
    run.left, run.right = -0.1, 0.1
    run.steps(2)
    assert run.twists[-1].linear == 0.0
    assert run.twists[-1].angular == pytest.approx(0.2 / 0.16)
    last = run.reports[-1]
    assert last is not None
    assert last.left == pytest.approx(-0.1)
    assert last.right == pytest.approx(0.1)


def test_a_scanner_that_is_mounted_backwards_sees_behind_and_not_ahead() -> None:
    run = run_of(mounted=Pose(0.0, 0.0, pi))
    run.scan = AHEAD
    run.steps(2)
    assert run.lines == ["r2 stands: the scan on /scan has no beam in the direction of ray 0 (35 degrees)"]
    run = run_of(mounted=Pose(0.0, 0.0, pi))
    run.scan = Beams(0.0, pi / 180, 0.1, 3.5, np.array([0.7] * 90 + [1.0] * 181 + [0.5] * 90, np.float32))
    run.steps(2)
    last = run.reports[-1]
    assert last is not None
    left, front, right = last.rays[4], last.rays[7], last.rays[10]
    assert (left, front, right) == pytest.approx((0.8, 0.8, 0.8))
    assert run.twists[-1] == Twist(0.5, 0.0)


def test_no_command_is_faster_than_the_robots_top_speed() -> None:
    run = run_of()
    run.left, run.right = 50.0, -50.0
    run.steps(2)
    top = SETTINGS.robot.top_speed
    assert run.twists[-1] == Twist(0.0, -2 * top / SETTINGS.robot.track_width)


KINDS = scenario_of(
    kinds={
        "cart": {"radius": 0.3, "track_width": 0.8, "speed_scale": 0.1, "sensors": {"rays": 3, "range": 1.0}},
        "scout": {},
    },
    robots={"cart": 1, "scout": 1},
).settings  # fmt: skip


# the kind, what its wheels are told [m/s], the twist that comes of that, and its rays in a room of 1 m around
@pytest.mark.parametrize(("kind", "wheels", "twist", "rays"), [
    ("cart", (0.1, 0.3), (0.2, 0.25), [0.7] * 9),
    ("cart", (2.0, 2.0), (0.4, 0.0), [0.7] * 9),
    ("scout", (0.1, 0.3), (0.2, 0.5), [0.8] * 15),
    ("scout", (2.0, 2.0), (1.6, 0.0), [0.8] * 15),
])  # fmt: skip
def test_a_body_has_the_wheels_the_speed_and_the_rays_of_its_kind(
    kind: str, wheels: tuple[float, float], twist: tuple[float, float], rays: list[float]
) -> None:
    run = Run(RosBody(BodyOptions(**USUAL), settings_of(KINDS, kind), 0.0), left=wheels[0], right=wheels[1]).steps(2)
    assert run.twists[-1] == pytest.approx(twist)
    last = run.reports[-1]
    assert last is not None
    assert last.rays == pytest.approx(rays)


def test_what_the_fleet_takes_a_body_for_is_a_sentence() -> None:
    assert format_plan("r1", settings_of(KINDS, "cart")) == (
        "the fleet plans with r1 as its kind says: radius 0.3 m, track width 0.8 m, at most 0.40 m/s and 2 m/s2"
    )
