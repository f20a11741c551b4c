"""The status of a run: all that tools want to know, in one message."""

from collections.abc import Mapping, Sequence
from typing import Final

from msgspec.structs import replace

from swarm.messages import Event, Phase, RobotStatus, Seen, State, Status
from swarm.messages.short_ids import shorten_ids
from world.tasks.standstill import why
from world.views.metrics import clearance_min, compute_accounts, count_contacts
from world.views.progress import progress
from world.world import World

STOPS: Final = 20  # targets of one robot: a status has room for a thousand robots


def states(world: World, said: Mapping[str, State]) -> dict[str, State]:
    """Return the state of every robot: what it said last in this run, or what the world has recorded since.

    A state is lost with a world that was killed after it came and before it was saved.
    """
    return {name: _newest(said.get(name), progress(name, world), world) for name in world.robots}


def _newest(said: State | None, recorded: State, world: World) -> State:
    """Return what a robot said, unless its last command is newer and tells another activity."""
    command = world.tasks.commands[world.number(recorded.robot)]
    if said is None or (command.tick > said.tick and command.activity is not said.activity):
        same = said is not None and said.target == recorded.target
        return replace(recorded, distance=said.distance) if said is not None and same else recorded
    return said


def status(
    world: World,
    phase: Phase,
    reason: str,
    seen: Mapping[str, Seen],
    said: Mapping[str, State],
    events: Sequence[Event],
    shortest: Sequence[float | None],
) -> Status:
    """Return the status; ``events`` are the last ones, the newest last, ``shortest`` is as in ``compute_accounts``."""
    last = {event.robot: event for event in events if event.run == world.run}
    now, measured = states(world, said), compute_accounts(world, shortest)
    poses = world.poses()
    rows = zip(world.robots, poses, world.tasks.commands, world.tasks.missions.orders.rows, strict=True)
    return Status(
        scenario=world.settings.name, run=world.run, tick=world.tick, time=world.time, phase=phase,
        complete=world.tasks.complete, reason=reason, edits=world.bodies.edits, events=list(events),
        pool=world.tasks.pool.counts,
        contacts=count_contacts(world), clearance_min=clearance_min(world), world=world.identity,
        robots=[
            RobotStatus(
                robot=name, liveness=seen[name].liveness, since=seen[name].since, pose=pose, state=now[name],
                waits=command.waits, event=last.get(name), account=measured[name],
                why=why(world.tasks, number, poses, world.tick),
                mission=shorten_ids(row.what), stops=row.stops[:STOPS], home=row.home,
            )
            for number, (name, pose, command, row) in enumerate(rows)
        ],
    )  # fmt: skip
