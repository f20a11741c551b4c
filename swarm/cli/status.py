"""The text of `swarm status`: a line on the run, and one on each robot."""

from math import degrees
from typing import Final

from swarm.cli.columns import aligned
from swarm.messages import Liveness, RobotStatus, Status

HEAD: Final[tuple[str, ...]] = (
    "robot", "is", "x, y [m]", "yaw [deg]", "does", "target", "left [m]", "waits for", "last event",
)  # fmt: skip


def shown(status: Status) -> str:
    """Return the status as text."""
    head = f"{status.scenario}: {status.phase.value} at {status.time:.1f} s, run {status.run}"
    end = f", not complete: {status.reason}" if status.reason else ", complete" * status.complete
    pool = status.pool
    errands = (
        [f"pool: {pool.done} of {pool.given} targets done, {pool.taken} under way, {pool.waiting} waiting"]
        if pool is not None
        else []
    )
    return "\n".join([head + end, *errands, aligned([HEAD, *map(_row, status.robots)])])


def _row(robot: RobotStatus) -> tuple[str, ...]:
    x, y, yaw = robot.pose
    state, event = robot.state, robot.event
    since = "" if robot.liveness is Liveness.ALIVE else f" since {robot.since:.1f} s"
    left = state.target < len(state.reached)
    return (
        robot.robot,
        robot.liveness.value + since,
        f"{x:.2f}, {y:.2f}",
        f"{degrees(yaw):.0f}",
        _does(robot),
        f"{state.target + 1} of {len(state.reached)}" if left else "none left",
        f"{state.distance:.1f}" if left else "",
        robot.why or ", ".join(robot.waits),
        f"{event.time:.1f} s: {event.text}" if event is not None else "",
    )


def _does(robot: RobotStatus) -> str:
    """Return what a robot does; of one that is not there, nothing: what it said last is over."""
    return robot.state.activity.value if robot.liveness in {Liveness.ALIVE, Liveness.STALE} else "-"
