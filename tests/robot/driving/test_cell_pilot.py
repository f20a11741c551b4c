"""Driving in reserved cells, one robot stepped by hand: when it only turns, what its tables get, where it stays."""

import pytest

from swarm.geometry import Pose, Twist, integrate
from swarm.messages import Activity
from swarm.motion.drive import DifferentialDrive, ramp
from swarm.robot.brain import Robot
from swarm.robot.tuning import SCALE
from swarm.traffic.lattice.placement import cells_of
from swarm.traffic.obstacles.detector import HALTED
from tests.robot.shared import AT, robot, step
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
    while not simulation.world.is_finished:
        tick = simulation.step()
        sense, command = tick.senses["r1"], tick.commands["r1"]
        pose, wheels = Pose(sense.x, sense.y, sense.yaw), drive.rim_speeds(Twist(sense.linear, sense.angular))
        while any(wheels):
            left, right = (ramp(speed, 0.0, robot.wheel_acceleration * dt) for speed in wheels)
            pose, wheels = integrate(pose, drive.twist(left, right), dt), (left, right)
            assert set(cells.cells_under_disc(pose.x, pose.y, robot.radius)) <= set(command.held)
    assert simulation.world.tasks.complete


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
