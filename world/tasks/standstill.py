"""Why a robot does not get on, in a sentence for people: who stands where, and whether that robot still speaks."""

from collections.abc import Sequence
from typing import Final

from swarm.geometry import Pose, distance
from swarm.messages import COMMAND, Activity
from world.tasks.tasks import Tasks

LOST: Final = 20.0  # s of absence after which a robot counts as lost
NAMED: Final = 3  # robots in one sentence


def why(tasks: Tasks, number: int, poses: Sequence[Pose], tick: int) -> str:
    """Return why a robot does not get on: whom it waits for, by its own word; "": it does, or does not say."""
    command, stop = tasks.commands[number], tasks.missions.left[number]
    if stop is None or classify_silence(tasks, number, tick):
        return ""
    there, label = tasks.missions.stops(number)[stop], tasks.missions.label(number, stop)
    said = []
    for name in command.waits:
        if name in tasks.robots:
            other = tasks.robots.index(name)
            near = distance(poses[other], there) < tasks.roster.radius(number) + tasks.roster.radius(other)  # no room
            said.append(
                _how_it_hinders(tasks, other, tick, f"stands on {label}" if near else f"is in its way to {label}")
            )
    if not said and command.activity is Activity.BLOCKED:
        return f"no way to {label} is open now"
    return ", ".join([*said[:NAMED], *([f"and {len(said) - NAMED} more"] if len(said) > NAMED else [])])


def classify_silence(tasks: Tasks, number: int, tick: int) -> str:
    """Return "lost" or "silent" for a robot whose last command is so old at a tick, "" for one that speaks."""
    dt = 1.0 / tasks.settings.rate
    age = (tick - tasks.commands[number].tick) * dt
    return "lost" if age >= LOST else "silent" if age > COMMAND.timeout + dt else ""


def _how_it_hinders(tasks: Tasks, number: int, tick: int, what: str) -> str:
    """Return what a robot does to another one, and whether it can be asked to move."""
    state = classify_silence(tasks, number, tick) or ("told to stop" if tasks.missions.is_stopped(number) else "")
    return f"{tasks.robots[number]}{f' ({state})' if state else ''} {what}"
