"""The report of a run: one JSON object, every field measured by the recorder or recomputed from its poses."""

from collections.abc import Sequence
from typing import Any, Final

from msgspec.structs import asdict

from world.tasks.orders import FATES
from world.views.metrics import compute_accounts, count_contacts
from world.world import World

NAMED: Final = 200  # characters for the stops of one robot, and for errands, in the sentence on what is missing
ROOM: Final = 440  # characters for each of at most four parts, half for what was cancelled: a status takes 2,000


def report(
    world: World,
    shortest: Sequence[float | None],
    *,
    scenario: str,
    seed: int,
    robots_per_process: int,
    pace: str,
    wall_time: float,
    late_commands: int,
    tick_wall: dict[str, float] | None,
    reason: str,
    not_reproducible: Sequence[str] = (),
    lost: Sequence[str] = (),
) -> dict[str, Any]:
    """Return the report of a run; ``wall_time`` in s, ``reason`` says why the run ended if it is not complete.

    ``shortest`` are the lengths [m] of ``shortest_lengths`` on the floor as it is at the end.
    ``avoidable_contacts`` are those that a robot could have avoided by stopping. A run has ``passed``, and its exit
    status is 0, if it is complete and has none of these. ``not_reproducible`` says why the run cannot be repeated bit
    for bit; ``lost`` are robots that stayed away. ``tick_wall`` [s] is the time of a tick on the wall clock, None where
    ticks do not follow the wall clock.
    """
    record = world.measures.recorder
    return {
        "scenario": scenario,
        "seed": seed,
        "robots": len(world.robots),
        "robots_per_process": robots_per_process,
        "pace": pace,
        "complete": world.tasks.complete,
        "passed": world.tasks.complete and not record.avoidable,
        "reason": "" if world.tasks.complete else reason,
        "lost": list(lost),
        "reproducible": not not_reproducible,
        "not_reproducible": list(not_reproducible),
        "sim_time": world.time,
        "wall_time": wall_time,
        "real_time_factor": world.time / wall_time if wall_time else 0.0,
        "ticks": world.tick,
        "late_commands": late_commands,
        "tick_wall": tick_wall,
        "contacts": count_contacts(world),
        "avoidable_contacts": record.avoidable,
        "clearance_min": record.judge.smallest,
        "steering": world.measures.steering.report(),
        "traffic": _traffic(world),
        **_pool(world),
        "per_robot": {
            name: {**asdict(account), **_orders(world, number)}
            for number, (name, account) in enumerate(compute_accounts(world, shortest).items())
        },
        "digest": record.digest,
    }


def _orders(world: World, number: int) -> dict[str, Any]:
    """Return the stops that a robot has had one after the other; nothing if it has had the scenario's only."""
    history = world.tasks.missions.history(number)
    if not history[-1].number:
        return {}
    fates, older = [one.fate for one in history], world.tasks.missions.orders.rows[number].older
    return {
        "orders": {fate: fates.count(fate) + older.get(fate, 0) for fate in (*FATES, "open")},
        "history": [
            {
                "number": one.number,
                "what": one.what,
                "stops": [list(stop) for stop in one.stops],  # as JSON has them
                "reached": one.reached,
                "fate": one.fate,
            }
            for one in history
        ],
    }


def _pool(world: World) -> dict[str, Any]:
    """Return how far the pool is, and what is left in it; nothing if nothing was ever put in."""
    pool = world.tasks.pool
    if not pool.given:
        return {}
    left = [
        {"errand": errand.name, "at": list(errand.at), "is": errand.stage.value, "since": errand.given}
        for errand in pool.open.values()
    ]
    minutes = world.time / 60
    rate = pool.done / minutes if minutes else 0.0
    return {"pool": {"given": pool.given, "done": pool.done, "per_minute": rate, "left": left}}


def _traffic(world: World) -> dict[str, Any]:
    """Return the counts of the traffic watch."""
    watch = world.measures.reservations.state.watch
    kinds = [fault.kind for fault in watch.faults]
    for_good = not world.tasks.complete and not watch.stuck and world.stands_for_good
    return {
        "conflicts": watch.conflicts,
        "joint_plans": watch.joint_plans,
        "deadlocks": watch.deadlocks + for_good,
        "stalled": sum(world.measures.progress.state.times),
        "longest_wait": watch.longest_wait,
        "settling": _settling_time(world),
        "overlaps": kinds.count("overlap"),
        "outside": kinds.count("outside"),
        "intrusions": kinds.count("intrusion"),
    }


def _settling_time(world: World) -> float:
    """Return for how long [s] a complete run went on after the last arrival at a stop, until nobody drove any more."""
    arrivals = [time for row in world.tasks.missions.reached_at for time in row if time is not None]
    return world.time - max(arrivals) if world.tasks.complete and arrivals else 0.0


def missing(world: World) -> str:
    """Return in one sentence what was cancelled or not reached, what of that had no path, and which robots stalled.

    It names as many as fit into a status message; ``per_robot`` of the report has all.
    """
    lacking, missions = [], world.tasks.missions
    everybody = zip(world.robots, missions.laps, missions.reached_at, world.tasks.commands, strict=True)
    for number, (name, laps, row, command) in enumerate(everybody):
        if laps:
            continue  # a patrol: it has been everywhere
        stops = [
            missions.label(number, stop) + (" (no path)" if stop in command.unreachable else "")
            for stop, time in enumerate(row)
            if time is None
        ]
        if stops:
            lacking.append(f"{name} {list_within(stops, ', ', NAMED)}")
    if left := list(world.tasks.pool.describe_left()):
        lacking.append(list_within(left, ", ", NAMED))
    cancelled = [f"{name}'s {what} was cancelled" for name, what in missions.dropped_targets]
    parts = [list_within(cancelled, ", ", ROOM // 2)] if cancelled else []
    if lacking:
        progress, verdict = world.measures.progress.state, world.measures.verdict.state.text
        stuck = [
            f"{name} made no progress for {longest:.0f} s"
            for name, times, longest in zip(world.robots, progress.times, progress.longest, strict=True)
            if times
        ]
        parts += [verdict[:ROOM]] if verdict else []
        parts += [f"not reached: {list_within(lacking, '; ', ROOM)}"]
        parts += [list_within(stuck, ", ", ROOM)] if stuck else []
    return "; ".join(parts)


def list_within(parts: Sequence[str], separator: str, room: int) -> str:
    """Return the first parts, as many as fit into ``room`` characters but at least one, and how many more there are.

    >>> list_within(["r1", "r2", "r3"], ", ", 8)
    'r1, r2 and 1 more'
    """
    fitting, length = 0, 0
    for part in parts:
        length += len(part) + len(separator)
        if fitting and length > room:
            break
        fitting += 1
    more = f" and {len(parts) - fitting} more" if fitting < len(parts) else ""
    return separator.join(parts[:fitting]) + more
