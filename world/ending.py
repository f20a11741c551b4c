"""Whether a run has an end of its own: nobody has anything left to do, or a jam has no solution."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Final

from swarm.messages import Edit
from world.fleet.liveness import LOST
from world.measure.progress import STALLED
from world.measure.recorder import WAITING
from world.views.standing import fallen_silent

if TYPE_CHECKING:
    from world.world import World

AWAY: Final = 90.0  # s of absence after which the run ends without a robot if all others are finished


def finished(world: "World") -> bool:
    """Return True if no robot has anything left to do, or if the robots have proven that their jam has no solution."""
    unfinished = world.unfinished
    if not unfinished or world.missions.any_stopped or world.planned_orders.left:
        return not unfinished and not world.plans_matter
    return _is_jammed(world)


def stands_for_good(world: "World") -> bool:
    """Return True if nobody that speaks gets on with what is left: a jam without a solution, or all have stalled."""
    standing = enumerate(world.progress.standing(world.time))
    left = [seconds for number, seconds in standing if isfinite(seconds) and not fallen_silent(world, number)]
    return bool(left) and not world.missions.any_stopped and (min(left) >= STALLED or _is_jammed(world))


def _is_jammed(world: "World") -> bool:
    standing = dict(zip(world.robots, world.progress.standing(world.time), strict=True))
    waiting = [world.robots[number] for number, one in enumerate(world.commands) if one.activity in WAITING]
    return world.verdict.ends(world.time, standing, waiting)


def plans_matter(world: "World", recent: Sequence[Edit]) -> bool:
    """Return True if a request or errand waits, or an edit that may open a way to a stop given up does, or was lately.

    ``recent`` are the edits that robots may not have heard of.
    """
    frees = "free" in [edit.kind for edit in world.planned.left] + [edit.kind for edit in recent]
    lacking = world.settings.retry_stops and any(command.unreachable for command in world.commands)
    now = bool(world.planned_orders.left) or (frees and (lacking or bool(world.dispatch.pool.waiting)))
    return now or world.dispatch.matters(world.poses(), world.traffic.watch.cells, world.commands, world.tick)


def waits_for(world: "World", present: Sequence[str]) -> list[str]:
    """Return the robots that have something left to do, without places that nobody has taken and that have no order."""
    here = set(present)
    return [name for name in world.unfinished if name in here or not world.untouched(name)]


def rests(world: "World", members: Sequence[str]) -> bool:
    """Return True if nothing would happen in a run until somebody asks for something; ``members`` are there."""
    awaited = waits_for(world, members) or world.planned.left or world.plans_matter
    return not awaited and not any(map(any, world.wheels))


def is_lost(away: Mapping[str, float], given_up: Path | None) -> bool:
    """Return True if robots have all been ``away`` [s] for too long; that is sooner for those that nobody starts again.

    The launcher writes their names to the file ``given_up``.
    """
    if any(time < LOST for time in away.values()):
        return False
    hopeless: list[str] = []
    if given_up is not None:
        with suppress(OSError, ValueError):
            hopeless = given_up.read_text(encoding="utf-8").split()
    return all(time >= AWAY or name in hopeless for name, time in away.items())
