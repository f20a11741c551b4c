"""A check of joint plans that shares no code with the planner."""

from collections.abc import Collection, Mapping, Sequence


def list_plan_faults(
    steps: Sequence[Sequence[int]],
    *,
    starts: Sequence[int],
    goals: Sequence[int],
    joined: Mapping[int, Collection[int]],
) -> list[str]:
    """List everything that is wrong with a joint plan, in words; the list for a good plan is empty.

    ``joined`` maps each cell to stand in to the cells joined to it. ``steps`` holds one cell per robot for each time
    step.
    """
    found: list[str] = []
    if not steps:
        return ["no steps at all"]
    if tuple(steps[0]) != tuple(starts):
        found.append(f"starts at {tuple(steps[0])}, not at {tuple(starts)}")
    if tuple(steps[-1]) != tuple(goals):
        found.append(f"ends at {tuple(steps[-1])}, not at {tuple(goals)}")
    for time, at in enumerate(steps):
        if len(at) != len(starts):
            found.append(f"time {time}: {len(at)} robots, not {len(starts)}")
            return found
        seen: dict[int, int] = {}
        for robot, cell in enumerate(at):
            if cell not in joined:
                found.append(f"time {time}: robot {robot} in cell {cell}, where nobody can stand")
            if cell in seen:
                found.append(f"time {time}: robots {seen[cell]} and {robot} both in cell {cell}")
            seen[cell] = robot
    for time in range(1, len(steps)):
        found.extend(_faulty_moves(time, steps[time - 1], steps[time], joined))
    return found


def _faulty_moves(
    time: int, old: Sequence[int], new: Sequence[int], joined: Mapping[int, Collection[int]]
) -> list[str]:
    found = []
    moved_to = {a: b for a, b in zip(old, new, strict=True) if a != b}
    for robot, (a, b) in enumerate(zip(old, new, strict=True)):
        if a != b and b not in joined.get(a, ()):
            found.append(f"time {time}: robot {robot} jumps from cell {a} to cell {b}")
    reported: set[int] = set()
    for first in sorted(moved_to):
        ring = [first]
        while ring[-1] in moved_to and moved_to[ring[-1]] not in ring:
            ring.append(moved_to[ring[-1]])
        if moved_to.get(ring[-1]) == first and first not in reported:
            reported.update(ring)
            word = "swap places" if len(ring) == 2 else "move in a ring"
            found.append(f"time {time}: robots {word} over cells {ring}")
    return found
