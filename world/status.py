"""The status of a run: all that tools want to know, in one message."""

from collections.abc import Mapping, Sequence

from swarm.messages import Event, Phase, PoolCounts, RobotStatus, Seen, State, Status
from world.welcome import progress
from world.world import World


def states(world: World, said: Mapping[str, State]) -> dict[str, State]:
    """Return the state of every robot: what it said last in this run, or else what the world has recorded."""
    return {name: said.get(name) or progress(name, world) for name in world.robots}


def status(
    world: World,
    phase: Phase,
    reason: str,
    seen: Mapping[str, Seen],
    said: Mapping[str, State],
    events: Sequence[Event],
) -> Status:
    """Return the status; ``events`` are the last ones, the newest last."""
    last = {event.robot: event for event in events}
    now = states(world, said)
    rows = zip(world.robots, world.poses(), world.commands, strict=True)
    return Status(
        scenario=world.settings.name, run=world.run, tick=world.tick, time=world.time, phase=phase,
        complete=world.complete, reason=reason, edits=world.edits, events=list(events), pool=_pool(world),
        robots=[
            RobotStatus(
                robot=name, liveness=seen[name].liveness, since=seen[name].since, pose=pose, state=now[name],
                waits=command.waits, event=last.get(name),
            )
            for name, pose, command in rows
        ],
    )  # fmt: skip


def _pool(world: World) -> PoolCounts | None:
    """Return how far the pool is; None if nothing was ever put in."""
    pool = world.dispatch.pool
    if not pool.given:
        return None
    return PoolCounts(given=pool.given, done=pool.done, taken=len(pool.taken), waiting=len(pool.waiting))
