"""Driving in reserved cells, one robot stepped by hand: when it only turns, what its tables get, where it stays."""

from math import pi
from unittest.mock import Mock

import pytest

from swarm.geometry import Pose, Twist, integrate
from swarm.messages import Activity
from swarm.motion.drive import DifferentialDrive, ramp
from swarm.robot.brain import Robot
from swarm.robot.tuning import SCALE
from swarm.traffic.cells_of import cells_of
from swarm.traffic.halting import HALTED
from swarm.traffic.interface import TrafficInputs, TrafficOutputs
from tests.robot.shared import AT, STOPS, pilot_of, robot, step
from tests.shared import scenario_of
from world.simulate import Simulation

FAR = 1.6  # m, what a ray measures that sees nothing
LISTENED = 40  # ticks, after which a robot that hears nobody drives

# --- what is left when all is done ---

HERE, THERE = [AT.x, AT.y], [7.5, 3.5]
PUSHED = Pose(5.5, 3.5, 0.0)  # away from its last stop


@pytest.mark.parametrize(("other_wants", "stays"), [([THERE], True), ([HERE], False), ([THERE, HERE], False)])
def test_a_robot_goes_back_to_its_last_stop_unless_another_wants_to_be_there(
    other_wants: list[list[float]], stays: bool
) -> None:
    scenario = scenario_of(own_targets=[[HERE], other_wants], targets=[], return_home=False, robots=2)
    one = Robot("r1", 0, scenario, AT)
    assert step(one, 0, bearings=[None]).command.activity is Activity.DONE
    said = [step(one, tick, pose=PUSHED, bearings=[None]) for tick in range(1, 20)]
    assert {outputs.command.activity for outputs in said} == {Activity.DRIVE if stays else Activity.DONE}
    told = [outputs.broadcast.traffic for outputs in said if outputs.broadcast is not None]
    assert {(one.own.done, one.own.idle) for one in told if one is not None} == {(True, not stays)}


# --- what it holds while nobody is near ---


def test_a_robot_alone_with_weak_brakes_holds_all_cells_that_they_lead_through() -> None:
    hall = scenario_of(
        "#" * 21 + "\n" + ("#" + "." * 19 + "#\n") * 6 + "#" * 21 + "\n",
        start={"poses": [[*AT]]}, targets=[[18.5, 5.5], [2.5, 5.5]], return_home=False,
        robot={"wheel_acceleration": 0.5},
    )  # fmt: skip
    simulation, cells, robot = Simulation.of(hall, 1, 1), cells_of(hall.map, hall.settings), hall.settings.robot
    drive, dt = DifferentialDrive(robot.track_width), 1.0 / hall.settings.rate
    while not simulation.world.finished:
        tick = simulation.step()
        sense, command = tick.senses["r1"], tick.commands["r1"]
        pose, wheels = Pose(sense.x, sense.y, sense.yaw), drive.rim_speeds(Twist(sense.linear, sense.angular))
        while any(wheels):
            left, right = (ramp(speed, 0.0, robot.wheel_acceleration * dt) for speed in wheels)
            pose, wheels = integrate(pose, drive.twist(left, right), dt), (left, right)
            assert set(cells.touched(pose.x, pose.y, robot.radius)) <= set(command.held)
    assert simulation.world.complete


# --- when it only turns ---


def test_something_unexplained_ahead_lets_it_turn_and_not_drive_on() -> None:
    """Its middle rays see something that is on no map and that nobody told of."""
    for near, drives in ((FAR, True), (0.3, False)):
        one = robot()
        for tick in range(LISTENED):
            step(one, tick)
        rays = [FAR] * 5 + [near] * 5 + [FAR] * 5
        commands = [step(one, LISTENED + tick, front=near, rays=rays).command for tick in range(HALTED)]
        assert all((command.left + command.right > 0.1) is drives for command in commands)


# --- what the tables are told ---


def test_alone_in_the_open_the_tables_are_told_the_distances_as_they_are() -> None:
    one = robot()
    commands = [step(one, tick).command for tick in range(2 * LISTENED)]
    assert any(command.unconstrained for command in commands)
    assert all(command.scale == 1.0 for command in commands if command.unconstrained)
    assert all(SCALE.turning <= command.scale <= 1.0 for command in commands), "never farther than they are known to be"


# fmt: off
SCALES = {  # room [m], heading error [rad]: scale
    "as much room as in the open":   (0.8,  0.0,     1.0),
    "more room than in the open":    (3.0,  0.0,     1.0),
    "three quarters of it":          (0.6,  0.0,     0.75),
    "half of it":                    (0.4,  0.0,     0.5),
    "hardly any room":               (0.24, 0.0,     0.4),
    "the aim is behind":             (0.8,  pi,      0.3),
    "the aim is to the right":       (0.8,  -pi / 2, 0.65),
    "half the room, aim to the left": (0.4, pi / 2,  0.325),
}
# fmt: on


@pytest.mark.parametrize("name", SCALES)
def test_the_less_room_and_the_more_turn_the_smaller_is_the_scale(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tables' distances are divided by 40 % to 100 %, as is room, and by 70 % less if the aim is behind."""
    room, heading, scale = SCALES[name]
    pilot = pilot_of(robot())
    monkeypatch.setattr(pilot, "_nowhere", lambda inputs, granted: 0.0)
    for held, exactly, unconstrained, expected in (
        ((1, 2), False, False, scale), ((1,), False, False, scale), ((1, 2), True, False, scale),
        ((1, 2), False, True, 1.0), ((1,), True, False, 0.15),
    ):  # fmt: skip
        granted = Mock(held=held, exactly=exactly, unconstrained=unconstrained)
        assert pilot._scaled(Mock(), granted, room, heading) == pytest.approx(expected)


@pytest.mark.parametrize(("nowhere", "scale"), [(5.0, 1.0), (5.05, 0.15), (10.0, 0.15), (10.05, 0.02)])
def test_the_longer_it_gets_nowhere_the_farther_all_seems(
    nowhere: float, scale: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seed 996133: a robot circled before the tip of a wall at 0.15 for good; at 0.02 the tables turn to the aim."""
    pilot = pilot_of(robot())
    monkeypatch.setattr(pilot, "_nowhere", lambda inputs, granted: nowhere)
    granted = Mock(held=(1, 2), exactly=False, unconstrained=False)
    assert pilot._scaled(Mock(), granted, 9.0, 0.0) == pytest.approx(scale)


def to_and_fro(tick: int, x: float = AT.x) -> Pose:
    """Return where a robot is that gets on all the time, and nowhere: within a cell, facing away from its stop."""
    return Pose(x + (0.2 if tick // 20 % 2 else 0.0), AT.y, 3.0)


LONG = 100  # ticks: 5 s
OPEN = [FAR] * 15
BLOCKED = [FAR] * 5 + [0.3] * 5 + [FAR] * 5


def helped_at(nearer_at: int | None = None, blocked: int = 0) -> int:
    """Return the tick at which a robot that gets nowhere is told that all is far, and that it stays so.

    Of every ten ticks something unexplained is before it in ``blocked``.
    """
    one, scales = robot(), []
    for tick in range(7 * LONG):
        x = AT.x if nearer_at is None or tick < nearer_at else AT.x + 1.3
        rays = BLOCKED if tick > LISTENED and tick % HALTED < blocked else OPEN
        command = step(one, tick, pose=to_and_fro(tick, x), rays=rays).command
        scales.append(command.scale)
        if command.unconstrained:
            assert command.scale in {SCALE.turning, SCALE.detour, 1.0}
    first = scales.index(SCALE.turning)
    farther = scales.index(SCALE.detour)
    assert farther - first >= LONG
    assert set(scales[first:farther]) == {SCALE.turning}, "to a robot that comes no nearer"
    assert set(scales[farther:]) == {SCALE.detour}, "then nearly everything is"
    return first


def test_a_robot_that_comes_no_nearer_for_long_is_told_that_all_is_far() -> None:
    """Then the tables turn to the aim. A cell nearer, and the time runs again."""
    assert LONG < helped_at() <= LISTENED + LONG + 1
    assert LONG < helped_at(nearer_at=LONG - 10) - (LONG - 10) <= LONG + 2


def test_standing_before_something_unexplained_is_no_circling() -> None:
    """What comes and goes stops it again and again: that time does not count."""
    waits = helped_at(blocked=HALTED // 2) - helped_at()
    assert 0.2 * LONG < waits < 2 * LONG


# --- the room that it asks for ---


def test_traffic_is_told_the_cells_that_the_tables_would_drive_it_over(monkeypatch: pytest.MonkeyPatch) -> None:
    one, told = robot(), []
    traffic = pilot_of(one)._traffic
    plain = traffic.step

    def listening(inputs: TrafficInputs) -> TrafficOutputs:
        told.append(inputs.sweeps)
        return plain(inputs)

    monkeypatch.setattr(traffic, "step", listening)
    for tick in range(2 * LISTENED):
        step(one, tick)
    cells = traffic.cells
    here, stop = cells.cell_of(AT.x, AT.y), cells.cell_of(*STOPS[0])
    assert here in told[-1]
    assert stop not in told[-1], "no farther than in the next seconds"
    assert all(cells.centre(cell)[0] > AT.x - cells.side for cell in told[-1]), "ahead of it"
    assert len(told[-1]) > 1
    for tick in range(2 * LISTENED, 2 * LISTENED + 2 * LONG):
        step(one, tick, pose=to_and_fro(tick))
    assert told[-1] == (), "who gets nowhere asks for nothing"
