"""Detection of late wheels, from the commands and the wheels' speeds."""

from math import inf, pi
from random import Random

import pytest

from swarm.geometry import Pose, Twist
from swarm.messages import COMMAND
from swarm.motion.drive import ramp
from swarm.planning.grid import Grid
from swarm.robot.driving.lateness import DIFFERS, LateLimiter, Lateness
from swarm.robot.driving.safety import STAND, DriveState, SafetyFilter, WheelSpeeds
from swarm.robot.tuning import SAFETY
from swarm.traffic.interface import MovingObstacle
from swarm.traffic.lattice.placement import cells_of
from swarm.traffic.obstacles.detector import HALF_WIDTH
from tests.robot.driving import shared as driving
from tests.robot.driving.shared import SETTINGS, constraints, sense_of
from tests.shared import scenario_of

DT, ACCELERATION = 0.05, 2.0
MOST = ACCELERATION * DT
KEPT = round(COMMAND.timeout / DT)
HALL = scenario_of("#" * 30 + "\n" + ("#" + "." * 28 + "#\n") * 20 + "#" * 30 + "\n").map
WIDE = Grid.grown(HALL, driving.RADIUS, 0.8, 0.1)


def drive(late: int, ticks: int, wanted: tuple[float, float] = (0.6, 0.5)) -> list[int]:
    """Command the same speeds each tick to wheels that obey so many ticks late; count the commands under way."""
    lateness, wheels, queue = Lateness(ACCELERATION, DT), (0.0, 0.0), [(0.0, 0.0)] * late
    counted = []
    for tick in range(ticks):
        counted.append(len(lateness.compare(tick, wheels)))
        lateness.command(wanted)
        queue.append(wanted)
        left, right = queue.pop(0)
        wheels = (ramp(wheels[0], left, MOST), ramp(wheels[1], right, MOST))
    return counted


def test_wheels_that_obey_at_once_leave_nothing_under_way() -> None:
    assert drive(0, 40) == [0] * 40


@pytest.mark.parametrize("late", [1, 2, 4, 5])
def test_wheels_that_obey_late_are_found_out_at_the_first_command_and_remembered(late: int) -> None:
    counted = drive(late, 40)
    assert counted == [0, *(min(tick, KEPT) for tick in range(1, 40))]


def test_they_are_trusted_again_20_s_after_the_last_late_command() -> None:
    lateness = Lateness(ACCELERATION, DT)
    lateness.compare(0, (0.0, 0.0))
    lateness.command((0.6, 0.6))
    assert lateness.compare(1, (0.0, 0.0)) == ((0.6, 0.6),), "it should have begun to turn"
    counted = []
    for tick in range(2, 406):
        lateness.command((0.0, 0.0))
        counted.append(bool(lateness.compare(tick, (0.0, 0.0))))
    assert counted == [True] * 399 + [False] * 5, "20 s are 400 ticks, the first of them is that of the late command"


@pytest.mark.parametrize(("off", "late"), [(0.0, False), (0.9 * DIFFERS, False), (1.1 * DIFFERS, True)])
@pytest.mark.parametrize("side", [(1, 0), (0, 1), (-1, 0), (0, -1)])
def test_a_small_difference_of_either_wheel_is_none(off: float, late: bool, side: tuple[int, int]) -> None:
    lateness = Lateness(ACCELERATION, DT)
    lateness.compare(0, (0.3, 0.3))
    lateness.command((0.3, 0.3))
    assert bool(lateness.compare(1, (0.3 + off * side[0], 0.3 + off * side[1]))) is late


def test_the_newest_commands_are_given_oldest_first() -> None:
    lateness = Lateness(ACCELERATION, DT)
    for tick in range(9):
        lateness.compare(tick, (0.0, 0.0))
        lateness.command((0.1 * tick, 0.0))
    assert [round(left, 3) for left, _ in lateness.compare(9, (0.0, 0.0))] == [0.4, 0.5, 0.6, 0.7, 0.8]


@pytest.mark.parametrize(("pause", "kept"), [(1, KEPT), (KEPT + 1, KEPT), (KEPT + 2, 0)])
def test_after_a_pause_in_which_all_commands_ran_out_none_is_under_way(pause: int, kept: int) -> None:
    lateness = Lateness(ACCELERATION, DT)
    for tick in range(KEPT):
        lateness.compare(tick, (0.0, 0.0))
        lateness.command((0.6, 0.6))
    assert len(lateness.compare(KEPT - 1 + pause, (0.0, 0.0))) == kept


def towards_a_threat(*, limited: bool) -> list[tuple[float, float]]:
    """Drive straight at a threat that comes on, with answers 0.2 s late; list the gap [m] and the speed [m/s] then.

    The tables want to drive on all the time. ``limited`` says whether the limit near threats holds.
    """
    safety, lateness, queue = SafetyFilter(SETTINGS), Lateness(driving.ACCELERATION, driving.DT), [(0.0, 0.0)] * 4
    body, shown, seen = DriveState(Pose(3.0, 10.0, 0.0), 0.0, 0.0), 7.0, []
    for tick in range(200):
        gap = shown - body.pose.x - driving.RADIUS - HALF_WIDTH
        seen.append((gap, (body.left + body.right) / 2))
        late = lateness.compare(tick, (body.left, body.right))
        fastest = safety.near_threats(body, late, [MovingObstacle(shown, 10.0, -0.4, 0.0)], gap) if limited else inf
        limits = constraints(WIDE, body.pose)._replace(fastest=fastest)
        front = max(0.0, min(gap, driving.NOTHING))
        wanted = safety.limit_way_out(sense_of(body, tick, front=front), Twist(0.6, 0.0), limits)
        lateness.command(wanted)
        queue.append(wanted)
        body, shown = driving.rolled(body, queue.pop(0)), shown - 0.4 * driving.DT
    return seen


def test_a_robot_that_answers_late_has_stopped_when_a_threat_that_it_sees_is_near() -> None:
    within = {limited: [v for gap, v in towards_a_threat(limited=limited) if gap < 0.1] for limited in (False, True)}
    assert max(within[False]) > 0.4, "without the limit it should drive at the threat"
    assert max(within[True]) < 0.1
    assert max(v for _, v in towards_a_threat(limited=True)) > 0.55, "far from the threat it drives as fast as ever"


def towards_a_wall(seed: int, ticks: int, *, expected: bool) -> float:
    """Let tables that change their mind drive near the hall's wall, wheels ``ticks`` late; return the least gap [m].

    ``expected`` says whether the filter checks from where the wheels will obey the next command.
    """
    draw, speeds, tables = Random(seed), (0.4, 0.6, 0.9, 1.2), (0.9, 0.9)
    safety, lateness, queue = SafetyFilter(SETTINGS), Lateness(ACCELERATION, DT), [(0.0, 0.0)] * ticks
    body, least = DriveState(Pose(26.5, 10.0, draw.uniform(-1.0, 1.0)), 0.0, 0.0), inf
    for tick in range(160):
        tables = (draw.choice(speeds), draw.choice(speeds)) if draw.random() < 0.2 else tables
        lateness.compare(tick, (body.left, body.right))
        then = safety.state_after(body, lateness.expected_commands()) if expected else body
        wanted = safety.check(sense_of(then, tick), tables, constraints(WIDE, then.pose))
        lateness.command(wanted)
        queue.append(wanted)
        body = driving.rolled(body, queue.pop(0))
        least = min(least, 29.0 - body.pose.x - driving.RADIUS)  # the wall begins at 29 m
    return least


@pytest.mark.parametrize("late", range(6))
def test_a_robot_that_answers_late_keeps_as_far_from_a_wall_as_any(late: int) -> None:
    assert min(towards_a_wall(seed, late, expected=True) for seed in range(20)) > SAFETY.gap - 0.002


def test_without_the_delay_in_mind_it_would_touch_the_wall() -> None:
    assert towards_a_wall(69, 5, expected=False) < -0.005


def test_after_the_late_commands_the_body_is_where_the_wheels_bring_it() -> None:
    safety, body = SafetyFilter(SETTINGS), DriveState(Pose(5.0, 5.0, 0.3), 0.1, -0.2)
    commands = [(0.6, 0.4), (0.2, 0.9), (-0.4, 0.4)]
    there = safety.state_after(body, commands)
    for wanted in commands:
        body = driving.rolled(body, wanted)
    assert (*there.pose, there.left, there.right) == pytest.approx((*body.pose, body.left, body.right))
    assert safety.state_after(body, ()) == body


def wander_in_cells(seed: int, limiter: LateLimiter | None) -> bool:
    """Let tables that change their mind drive in four cells, each command late by other ticks; return True if inside.

    The wheels keep a command until a newer one is there: some are never obeyed, others for six ticks.
    """
    draw, tables, inside = Random(seed), (0.9, 0.9), True
    floor = cells_of(HALL, SETTINGS)
    first = floor.cell_of(10.0, 10.0)
    held = (first, first + 1, first + floor.columns, first + floor.columns + 1)
    body, lateness = DriveState(Pose(*floor.centre(first), draw.uniform(-pi, pi)), 0.0, 0.0), Lateness(ACCELERATION, DT)
    commands, obeyed = [WheelSpeeds(0.0, 0.0)], 0
    for tick in range(200):
        tables = (draw.choice((-0.4, 0.4, 1.2)), draw.choice((-0.4, 0.4, 1.2))) if draw.random() < 0.2 else tables
        late = lateness.compare(tick, (body.left, body.right)) or (commands[-1],)
        speeds = WheelSpeeds(*tables)
        commands.append(limiter.limit(speeds, body, late, WIDE, floor, held) if limiter is not None else speeds)
        lateness.command(commands[-1])
        obeyed = max(obeyed, len(commands) - 1 - draw.choice((0, 0, 1, 3, 5)))
        body = driving.rolled(body, commands[obeyed])
        inside = inside and set(floor.cells_under_disc(body.pose.x, body.pose.y, driving.RADIUS - 1e-6)) <= set(held)
    return inside


def test_a_robot_stays_in_its_cells_however_late_its_commands_are() -> None:
    limiter = LateLimiter(SafetyFilter(SETTINGS), SETTINGS)
    assert not any(wander_in_cells(seed, None) for seed in range(10)), "the tables alone should drive out"
    assert all(wander_in_cells(seed, limiter) for seed in range(30))


@pytest.mark.parametrize(("toward", "drives"), [(pi, True), (pi / 2, True), (0.0, False)])
def test_a_body_a_little_beyond_its_cells_may_drive_back_and_along_but_no_further(toward: float, drives: bool) -> None:
    floor = cells_of(HALL, SETTINGS)
    cell = floor.cell_of(10.0, 10.0)
    held = (cell, cell + floor.columns, cell - 1, cell + floor.columns - 1)
    x, y = floor.centre(cell)
    beyond = Pose(x + floor.side / 2 - driving.RADIUS + 0.01, y, toward)
    limiter, late = LateLimiter(SafetyFilter(SETTINGS), SETTINGS), (STAND,) * 5
    speeds = limiter.limit(WheelSpeeds(0.3, 0.3), DriveState(beyond, 0.0, 0.0), late, WIDE, floor, held)
    assert any(speeds) is drives
    assert floor.room_in(held, beyond.x, beyond.y, driving.RADIUS) == pytest.approx(driving.RADIUS - 0.01)
