"""Why a robot does not get on, in a sentence for people: who stands where, and whether that robot still speaks."""

from typing import TYPE_CHECKING, Final

from swarm.geometry import distance
from swarm.messages import COMMAND, Activity
from world.fleet.liveness import LOST

if TYPE_CHECKING:
    from world.world import World

NAMED: Final = 3  # robots in one sentence


def why(world: "World", number: int) -> str:
    """Return why a robot does not get on: whom it waits for, by its own word; "": it does, or does not say."""
    command, stop = world.commands[number], world.missions.left[number]
    if stop is None or fallen_silent(world, number):
        return ""
    there, label = world.missions.stops(number)[stop], world.missions.label(number, stop)
    said = [_hinders(world, other, there, label) for other in command.waits if other in world.robots]
    if not said and command.activity is Activity.BLOCKED:
        return f"no way to {label} is open now"
    return ", ".join([*said[:NAMED], *([f"and {len(said) - NAMED} more"] if len(said) > NAMED else [])])


def fallen_silent(world: "World", number: int) -> str:
    """Return "lost" or "silent" for a robot whose last command is so old, "" for one that speaks."""
    age = (world.tick - world.commands[number].tick) * world.dt
    return "lost" if age >= LOST else "silent" if age > COMMAND.timeout + world.dt else ""


def _hinders(world: "World", name: str, there: tuple[float, float], label: str) -> str:
    """Return what a robot does to another one whose target ``label`` is ``there`` [m]."""
    number = world.number(name)
    state = fallen_silent(world, number) or ("told to stop" if world.missions.stopped(number) else "")
    on = distance(world.physics.pose(number), there) < 2 * world.settings.robot.radius  # two bodies have no room
    return f"{name}{f' ({state})' if state else ''} {f'stands on {label}' if on else f'is in its way to {label}'}"
