"""What `swarm status` says: the clock, and of each robot its mission, its pose and whether it is alive."""

from collections.abc import Sequence
from typing import Any

import msgspec

from dashboard.progress import Progress, fold
from swarm.messages import Clock, State, Truth


def table(clock: Clock, states: Sequence[State], truth: Truth | None) -> dict[str, Any]:
    """Return the status as values of JSON. Poses [m, m, rad] are null as long as no truth of this run has come."""
    progress = fold(Progress(), clock)
    for message in (*states, truth):
        progress = progress if message is None else fold(progress, message)
    said = {state.robot: msgspec.to_builtins(state) for state in states}
    poses = {name: robot.pose for name, robot in progress.robots.items()}
    robots = {
        name: {"heard": progress.heard(name).value, "pose": pose(poses.get(name))} | said.get(name, {})
        for name in sorted({*clock.robots, *said})
    }
    return {"clock": msgspec.to_builtins(clock), "robots": robots}


def pose(known: tuple[float, float, float] | None) -> dict[str, float] | None:
    """Return a pose by its parts, rounded to millimetres and milliradians.

    >>> pose((1.23456, 2.0, -0.5))
    {'x': 1.235, 'y': 2.0, 'yaw': -0.5}
    """
    if known is None:
        return None
    return {name: round(value, 3) for name, value in zip(("x", "y", "yaw"), known, strict=True)}
