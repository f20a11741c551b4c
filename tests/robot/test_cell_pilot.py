"""Driving by holds, one robot stepped by hand: when it only turns, and where it stays when all is done."""

import pytest

from swarm.geometry import Pose, Twist, integrate
from swarm.messages import Activity
from swarm.robot.brain import Robot
from swarm.robot.cell_pilot import CIRCLES
from swarm.robot.kinematics import DifferentialDrive, ramp
from swarm.traffic.cells_of import cells_of
from tests.robot.shared import AT, robot, step
from tests.shared import scenario_of
from world.simulate import Simulation

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
    drive, dt = DifferentialDrive(robot.track_width, robot.wheel_radius), 1.0 / hall.settings.rate
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


@pytest.mark.parametrize(("front", "drives"), [(1.6, True), (0.3, False)])
def test_something_unexplained_ahead_lets_it_turn_and_not_drive_on(front: float, drives: bool) -> None:
    one = robot()
    for tick in range(LISTENED):
        step(one, tick)
    commands = [step(one, LISTENED + tick, front=front).command for tick in range(10)][3:]
    assert all((command.left + command.right > 0.1) is drives for command in commands)


@pytest.mark.parametrize(("walls", "side"), [("#", 1.2), (".", 0.4)])
def test_between_walls_a_robot_that_faces_away_turns_on_the_spot_though_it_is_alone(walls: str, side: float) -> None:
    """The paper's tables find no room to turn round there."""
    beside = "\n".join(["#" + walls * 10 + "#"] * 3)
    text = f"{'#' * 12}\n{beside}\n#..........#\n{beside}\n{'#' * 12}\n"
    start = Pose(4.2, 5.4, 3.0)
    scenario = scenario_of(
        text, map={"text": text, "cell": 1.2}, start={"poses": [[*start]]}, targets=[[12.0, 5.4]],
    )  # fmt: skip
    one = Robot("r1", 0, scenario, start)
    said = [step(one, tick, pose=start, bearings=[None] * 2, left=side, right=side).command for tick in range(60)]
    alone = [command for command in said if command.unconstrained]
    assert len(alone) > 20
    assert all((command.left == -command.right != 0.0) is (walls == "#") for command in alone)


@pytest.mark.parametrize("nearer_at", [None, 100])
def test_a_robot_alone_that_comes_no_nearer_for_long_is_turned_to_its_aim(nearer_at: int | None) -> None:
    """Its pose is held, facing away from its stop: the tables drive on and on. A cell nearer, and the time runs anew."""
    one, commands = robot(), []
    for tick in range(400):
        x = AT.x if nearer_at is None or tick < nearer_at else AT.x + 1.0
        commands.append(step(one, tick, pose=Pose(x, AT.y, 3.0)).command)
    alone = next(tick for tick, command in enumerate(commands) if command.unconstrained)
    helped = (nearer_at or alone) + round(CIRCLES / 0.05)
    assert helped < len(commands) - 100, "within a quarter of a minute"
    assert all(command.left + command.right > 0.0 for command in commands[alone : helped - 1]), "the tables drive on"
    assert all(command.left == -command.right != 0.0 for command in commands[helped + 1 :])
