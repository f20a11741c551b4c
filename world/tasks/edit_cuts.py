"""Whom an edit leaves without a way: the robots and targets to which a way leads now, and none after it."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Final

from swarm.maps.occupancy import Point
from swarm.messages import Edit, Kind
from world.bodies.bodies import Bodies
from world.tasks.reachable import Reachable
from world.tasks.tasks import Tasks

Cut = tuple[str, str]  # robot and the name of its target; ``POOL`` and the name of an errand
POOL: Final = "pool"
LOOKS: Final = 64  # targets without a way that are looked at, about 1 ms each: the world stands meanwhile


def find_cut_targets(tasks: Tasks, bodies: Bodies, edit: Edit, *, sensed: bool) -> tuple[bool, list[Cut]]:
    """Return whether an edit changes the floor, and the targets not reached yet whose last way it takes, homes too.

    It changes nothing, and looks at ``LOOKS`` targets that have no way, at most.

    Raises:
        ConfigError: the edit is refused.
    """
    floor = bodies.floor_after(edit, sensed=sensed)
    if edit.kind is Kind.FREE or floor == bodies.floor:
        return floor != bodies.floor, []
    before, after = (Reachable(bodies.roster, one) for one in (bodies.floor, floor))
    here = [(pose.x, pose.y) for pose in bodies.poses()]
    lost = list(islice(_find_lost_targets(tasks, after, here), LOOKS))
    led = [
        (who, what) for who, what, starts, there in lost if not all(before.wrong(*one, there) for one in starts.items())
    ]
    return True, led


def format_cut_targets(lost: Sequence[Cut]) -> str:
    """Return a clause that says whom an edit leaves without a way; "" if there is nobody.

    >>> format_cut_targets([("r1", "target 2"), ("r1", "home"), ("r2", "target 1")])
    '; no way leads r1 to target 2 and home, r2 to target 1 any more'
    """
    by: dict[str, list[str]] = {}
    for who, what in lost:
        by.setdefault(who, []).append(what)
    parts = [f"{'any robot' if who == POOL else who} to {_join_names(what)}" for who, what in by.items()]
    return f"; no way leads {', '.join(parts)} any more" if parts else ""


def _join_names(names: Sequence[str]) -> str:
    shown = [*names[:3], *([f"{len(names) - 3} more"] if len(names) > 3 else [])]
    return f"{', '.join(shown[:-1])} and {shown[-1]}" if len(shown) > 1 else shown[0]


def _find_lost_targets(
    tasks: Tasks, reachable: Reachable, here: Sequence[Point]
) -> Iterator[tuple[str, str, dict[int, Point], Point]]:
    """Yield each target that is left and that no way leads to: whose, its name, who from where [m], and where [m]."""
    for number, (name, row) in enumerate(zip(tasks.robots, tasks.missions.orders.rows, strict=True)):
        reached, given_up = tasks.missions.reached_at[number], tasks.commands[number].unreachable
        for stop, there in enumerate([] if row.pooled else row.stops):
            left = (reached[stop] is None or tasks.settings.patrol) and stop not in given_up
            if left and reachable.wrong(number, here[number], there):
                yield name, tasks.missions.label(number, stop), {number: here[number]}, there
    for name, errand in tasks.pool.open.items():
        withdrawn = tasks.missions.orders.is_withdrawn
        takers = {number: place for number, place in enumerate(here) if not withdrawn(number)}
        if all(reachable.wrong(*one, errand.at) for one in takers.items()):
            yield POOL, f"pool target {name}", takers, errand.at
