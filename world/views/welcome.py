"""The answer to a robot that joins: its place, the scenario, the map, and its progress."""

from msgspec import UNSET
from msgspec.structs import replace

from swarm.messages import Welcome
from world.fleet.publisher import Publisher
from world.views.progress import progress
from world.world import World


def welcome(name: str, world: World, publisher: Publisher, session: str, sender: int) -> Welcome:
    """Return the welcome of a robot; ``session`` and ``sender`` are those of the world."""
    floor, number = publisher.floor, world.number(name)
    scenario = replace(floor.scenario, starts=UNSET, kinds=UNSET, profiles=UNSET)
    if kind := world.roster.kinds[number]:
        own = {} if floor.scenario.profiles is UNSET else floor.scenario.profiles
        profile = own.get(kind, scenario.profile)
        scenario = replace(scenario, settings=world.roster.settings_of(kind), profile=profile)
    return Welcome(
        robot=name, world=world.identity, session=session, sender=sender, scenario=scenario,
        packed=floor.packed, edits=floor.edits, start=world.starts[number],
        state=progress(name, world) if world.tick else None,
        assigned=world.tasks.missions.orders.assigned_stops(number),
    )  # fmt: skip
