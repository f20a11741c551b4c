"""The laws of driving: a robot's body is inside the cells that it holds, and can stop inside them."""

from collections.abc import Sequence
from typing import Final

from swarm.geometry import Pose, Twist, integrate
from swarm.messages import COMMAND, Sense
from swarm.motion.drive import DifferentialDrive, ramp
from swarm.settings import RobotSettings
from swarm.storm.history.history import History
from swarm.storm.history.run_facts import EXACT, Found, cells_at, find_pushes, was_pushed
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap

RimSpeeds = tuple[float, float]  # left, right [m/s]

CREEPS: Final = 0.3  # m/s; a slower robot stops within 2.5 cm, which the margin of its cells covers


def no_body_outside(history: History) -> Found:
    """Check that each body is inside the cells that its robot holds."""
    pushed = find_pushes(history)
    radii = [body.radius for body in history.bodies]
    held: dict[str, Sequence[int]] = {}
    outside: set[str] = set()
    inside: dict[str, tuple[Pose, Sequence[int]]] = {}  # robots that were inside; no new check while nothing changes
    for moment in history.moments[:-1]:
        held |= {name: command.held for name, command in moment.commands.items()}
        cells = cells_at(history, moment.tick)
        for number, (name, pose) in enumerate(zip(history.robots, moment.poses, strict=True)):
            if name not in held or name in history.mute or inside.get(name) == (pose, held[name]):
                continue
            touched = cells.cells_under_disc(pose.x, pose.y, radii[number] - EXACT)
            out = [cell for cell in touched if cell not in held[name]]
            if out and name not in outside and not was_pushed(pushed, number, moment.tick):
                yield moment.tick, (name,), f"{name} is in cell {out[0]}, which it does not hold"
            outside = outside | {name} if out else outside - {name}
            if out:
                inside.pop(name, None)
            else:
                inside[name] = (pose, held[name])


def room_to_brake(history: History) -> Found:
    """Check that a robot that brakes now stops inside the cells that it holds.

    With late answers, the commands under way are carried out first.
    """
    pushed = find_pushes(history)
    bodies, moments = history.bodies, history.moments
    for index, moment in enumerate(moments[:-1]):
        cells = cells_at(history, moment.tick)
        for number, name in enumerate(history.robots):
            if name not in moment.commands or name in history.mute or was_pushed(pushed, number, moment.tick):
                continue
            sense, robot = moment.senses[name], bodies[number]
            under_way = _under_way(history, index, number) if history.late else []
            if not under_way and abs(sense.linear) < CREEPS:
                continue
            rest = _rest(moment.poses[number], sense, under_way, robot, history.dt)
            held = {OUTSIDE, *moment.commands[name].held}
            out = _touched_bodies(cells, rest, robot) - held
            if out and _touched_bodies(cells, moment.poses[number], robot) <= held:
                text = f"{name} drives too fast to stop before cell {min(out)}, which it does not hold"
                yield moment.tick, (name,), text


def _under_way(history: History, index: int, number: int) -> list[RimSpeeds]:
    """Return the rim speeds [m/s] that a robot's wheels follow until they follow its command of a moment."""
    name, tick, found = history.robots[number], history.moments[index].tick, []
    for moment in history.moments[index:-1]:
        obeyed = moment.obeyed[number]
        if obeyed >= tick:
            break
        command = history.moments[obeyed].commands.get(name)
        expired = command is None or (moment.tick - obeyed) * history.dt > COMMAND.timeout
        found.append((0.0, 0.0) if expired or command is None else (command.left, command.right))
    return found


def _touched_bodies(cells: CellMap, pose: Pose, robot: RobotSettings) -> frozenset[int]:
    return frozenset(cells.cells_under_disc(pose.x, pose.y, robot.radius - EXACT))


def _rest(pose: Pose, sense: Sense, under_way: Sequence[RimSpeeds], robot: RobotSettings, dt: float) -> Pose:
    """Return the pose in which a body stops if it carries out the commands under way and then brakes."""
    drive, most = DifferentialDrive(robot.track_width), robot.wheel_acceleration * dt
    left, right = drive.rim_speeds(Twist(sense.linear, sense.angular))
    for wanted in under_way:
        left, right = ramp(left, wanted[0], most), ramp(right, wanted[1], most)
        pose = integrate(pose, drive.twist(left, right), dt)
    while left or right:
        left, right = ramp(left, 0.0, most), ramp(right, 0.0, most)
        pose = integrate(pose, drive.twist(left, right), dt)
    return pose
