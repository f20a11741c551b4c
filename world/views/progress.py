"""How far a robot has come, by the world's own record."""

from swarm.messages import State
from world.world import World


def progress(name: str, world: World) -> State:
    """Return how far a robot has come: not what it says, but where the world has seen it."""
    number = world.number(name)
    command, reached_at = world.tasks.commands[number], world.tasks.missions.reached_at[number]
    stop = world.tasks.missions.left[number]
    return State(
        robot=name, run=world.run, tick=world.tick, activity=command.activity, distance=0.0, replans=command.replans,
        target=len(reached_at) if stop is None else stop, reached=[time is not None for time in reached_at],
        unreachable=[stop for stop in command.unreachable if stop < len(reached_at)],
        laps=world.tasks.missions.laps[number], assignment=world.tasks.missions.orders.rows[number].number,
    )  # fmt: skip
