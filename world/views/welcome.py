"""The answer to a robot that joins: its place, the scenario, the map, and its progress by the world's own record."""

from msgspec import UNSET
from msgspec.structs import replace

from swarm.messages import State, Welcome
from world.fleet.publisher import Publisher
from world.world import World


def welcome(name: str, world: World, publisher: Publisher, session: str, sender: int) -> Welcome:
    """Return the welcome of a robot; ``session`` and ``sender`` are those of the world."""
    floor = publisher.floor
    return Welcome(
        robot=name, world=world.identity, session=session, sender=sender,
        scenario=replace(floor.scenario, starts=UNSET), packed=floor.packed, edits=floor.edits,
        start=world.starts[world.number(name)], state=progress(name, world) if world.tick else None,
        assigned=world.tasks.missions.orders.assigned(world.number(name)),
    )  # fmt: skip


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
