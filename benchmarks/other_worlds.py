"""Random worlds of another generator than the storm's, with judges that share nothing with its laws.

``python -m benchmarks.other_worlds --seeds 300 --start 0`` draws worlds, drives each in one process, and prints how
many were driven and how many were broken, by what. Walls are squares of 0.4 to 1.5 m: halls, rooms and mazes. Contacts
are judged by the recorded poses and the drawing, ways by a flood fill of the drawing: no lattice, no planner.
"""

import argparse
from collections import Counter, deque
from collections.abc import Iterator
from itertools import combinations
from math import ceil, floor, hypot, pi
from random import Random
from traceback import format_exc
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.errors import SwarmError
from swarm.fuzzy import load_profile
from swarm.maps.text import from_text
from swarm.scenario.check import check
from swarm.scenario.load import Scenario, checked
from world.faults import Faults
from world.simulate import Simulation

Grid = NDArray[np.bool_]  # [row, column], row 0 at the bottom; True is solid
At = tuple[float, float]  # m

BODY: Final = 0.2  # m, radius of a robot
FINE: Final = 0.05  # m, side of a pixel of the flood fill
SPARE: Final = 0.05  # m, beside a body, for a way to count
TOUCH: Final = 2e-3  # m; bodies that overlap by more touch
LANE: Final = 1.3  # m, the least width of a maze's lanes and of doors
APART: Final = 1.4  # m, between two starts, and between two last targets
LIMIT: Final = 300.0  # s
IDLE: Final = 120.0  # s in which nobody arrives or comes to another square metre: the run is over
OVER: Final = 60.0  # s after the last arrival in which a run has to end
PROVEN: Final = ("no way exists", "no plan exists")  # a jam that the robots have proven and said ends a run
NAMES: Final = frozenset({"stalled", "unsolvable", "no_plan_found", "unreachable"})  # events that say who is stuck


class Drawn(NamedTuple):
    """One world."""

    raw: dict[str, Any]  # the scenario's file
    solid: Grid
    side: float  # m, of a square
    faults: Faults


class Judged(NamedTuple):
    """What became of one world."""

    seed: int
    driven: bool  # False: refused, and why
    broken: tuple[str, ...]
    why: str = ""


def draw(seed: int) -> Drawn | None:
    """Return the world of a seed; None if there is no room for its robots."""
    chance = Random(f"other worlds {seed}")
    side = round(chance.uniform(0.4, 1.5), chance.choice((1, 2)))
    columns, rows = (max(4, round(chance.uniform(4.5, 13.0) / side)) for _ in range(2))
    solid = np.ones((rows + 2, columns + 2), np.bool_)
    chance.choice((_hall, _rooms, _maze))(solid[1:-1, 1:-1], ceil(LANE / side - 1e-9), chance)
    text = "".join("".join("#" if cell else "." for cell in row) + "\n" for row in solid[::-1])
    free = _pieces(solid, side, BODY + SPARE)
    label = Counter(free[free > 0].tolist()).most_common(1)
    robots = chance.choice((1, 2, 2, 3, 3, 4, 4, 5, 6, 8, 10, 12))
    spots = [tuple((index + 0.5) * FINE) for index in np.argwhere(free == label[0][0])[:, ::-1]] if label else []
    starts, ends = (_spread(spots, robots, chance) for _ in range(2))
    if len(starts) < robots or len(ends) < robots:
        return None
    rows_of_stops = [[*chance.sample(spots, chance.randrange(3)), end] for end in ends]
    raw: dict[str, Any] = {
        "name": f"other.{seed}", "map": {"text": text, "cell": side}, "robots": robots, "seed": seed, "limit": LIMIT,
        "return_home": False, "start": {"poses": [[*_cut(at), round(chance.uniform(-pi, pi), 3)] for at in starts]},
        "own_targets": [[list(_cut(at)) for at in row] for row in rows_of_stops],
        "radio": {"range": chance.choice((6.5, 8.0, 12.0, 50.0)), "loss": chance.choice((0.0, 0.0, 0.1, 0.3))},
        "sensors": {"noise": chance.choice((0.0, 0.0, 0.01, 0.03))},
    }  # fmt: skip
    if chance.random() < 0.2 and len(spots) > 1:
        a, b = chance.sample(spots, 2)
        raw["movers"] = [{"waypoints": [list(_cut(a)), list(_cut(b))], "speed": 0.25, "radius": 0.2}]
    late, slow = chance.choice((0.0, 0.0, 0.1, 0.2)), chance.choice((0.0, 0.0, 0.0, 0.2))
    held_up = chance.choice((0.0, 0.0, 20.0))
    return Drawn(raw, solid, side, Faults(late=late, slow=0.0 if late else slow, held_up=held_up))


def _hall(inner: Grid, lane: int, chance: Random) -> None:
    inner[:] = False
    rows, columns = inner.shape
    for _ in range(chance.randrange(1 + rows * columns // 12)):
        row, column = chance.randrange(rows), chance.randrange(columns)
        inner[row : row + chance.randint(1, 2), column : column + chance.randint(1, 2)] = True


def _rooms(inner: Grid, lane: int, chance: Random) -> None:
    """Draw walls right across, each with one or two doors."""
    inner[:] = False
    for view in (inner, inner.T):
        along = lane
        while along < view.shape[0] - lane and chance.random() < 0.8:
            view[along] = True
            for _ in range(chance.randint(1, 2)):
                door = chance.randrange(max(1, view.shape[1] - lane + 1))
                view[along, door : door + lane] = False
            along += lane + 1 + chance.randrange(3)


def _maze(inner: Grid, lane: int, chance: Random) -> None:
    """Draw lanes between walls one square thick, by a walk that turns back, and open some walls for loops."""
    step = lane + 1
    rows, columns = ((size + 1) // step for size in inner.shape)
    if not rows or not columns:
        inner[:] = False
        return
    stack, seen = [(0, 0)], {(0, 0)}
    inner[:lane, :lane] = False
    while stack:
        row, column = stack[-1]
        near = [(row + a, column + b) for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0))]
        ways = [at for at in near if 0 <= at[0] < rows and 0 <= at[1] < columns]
        new = [at for at in ways if at not in seen]
        if not new and chance.random() < 0.7:
            stack.pop()
            continue
        there = chance.choice(new or ways)
        low, high = min((row, column), there), max((row, column), there)
        inner[low[0] * step : high[0] * step + lane, low[1] * step : high[1] * step + lane] = False
        if new:
            seen.add(there)
            stack.append(there)
        else:
            stack.pop()


def _spread(spots: list[Any], count: int, chance: Random) -> list[At]:
    found: list[At] = []
    for _ in range(40 * count if spots else 0):
        at = chance.choice(spots)
        if len(found) < count and all(hypot(at[0] - x, at[1] - y) >= APART for x, y in found):
            found.append(at)
    return found


def _cut(at: At) -> tuple[float, float]:
    return round(float(at[0]), 3), round(float(at[1]), 3)


def _gaps(solid: Grid, side: float, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance [m] from each point (n, 2) to the nearest solid square."""
    rows, columns = np.nonzero(solid)
    least = np.full(len(points), np.inf)
    for x, y in zip(columns * side, rows * side, strict=True):
        dx = np.maximum(np.maximum(x - points[:, 0], points[:, 0] - x - side), 0.0)
        dy = np.maximum(np.maximum(y - points[:, 1], points[:, 1] - y - side), 0.0)
        least = np.minimum(least, np.hypot(dx, dy))
    return least


def _pieces(solid: Grid, side: float, radius: float) -> NDArray[np.int64]:
    """Return for each pixel the piece of floor that a disc's centre can be moved in; 0: the disc does not fit."""
    shape = tuple(floor(size * side / FINE) for size in solid.shape)
    ys, xs = np.mgrid[: shape[0], : shape[1]]
    fits = _gaps(solid, side, (np.stack([xs.ravel(), ys.ravel()], 1) + 0.5) * FINE).reshape(shape) >= radius
    pieces = np.zeros(shape, np.int64)
    for piece, start in enumerate(map(tuple, np.argwhere(fits)), 1):
        ready = deque([start] if not pieces[start] else ())
        while ready:
            row, column = ready.popleft()
            if fits[row, column] and not pieces[row, column]:
                pieces[row, column] = piece
                ready.extend(((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)))
    return pieces


def _touched(drawn: Drawn, poses: NDArray[np.float64], movers: NDArray[np.float64]) -> Iterator[str]:
    """Yield what robots touched; ``poses`` and ``movers`` are (ticks, number, 2) [m]."""
    robots = poses.shape[1]
    if (_gaps(drawn.solid, drawn.side, np.unique(poses.reshape(-1, 2), axis=0)) < BODY - TOUCH).any():
        yield "wall"
    for a, b in combinations(range(robots), 2):
        if (np.hypot(*(poses[:, a] - poses[:, b]).T) < 2 * BODY - TOUCH).any():
            yield "robot"
    for robot in range(robots):
        for mover in range(movers.shape[1]):
            apart = movers[:, mover] - poses[:, robot]
            away = np.hypot(*apart.T)
            for tick in np.nonzero((away[2:] < 0.4) & (away[1:-1] >= 0.4))[0] + 2:
                towards = apart[tick - 2] / away[tick - 2]
                own = float((poses[tick, robot] - poses[tick - 2, robot]) @ towards)
                if own > 0.01 and own > float((movers[tick - 2, mover] - movers[tick, mover]) @ towards):
                    yield "mover"


def judge(seed: int) -> Judged | None:
    """Drive the world of a seed and judge it; None: there is no such world."""
    drawn = draw(seed)
    if drawn is None:
        return None
    try:
        settings = checked(drawn.raw, "other worlds")
        scenario = Scenario(settings, from_text(drawn.raw["map"]["text"], drawn.side), load_profile("paper"))
        check(scenario, settings.robots, seed)
        simulation = Simulation.of(scenario, settings.robots, seed, drawn.faults)
    except SwarmError as refused:
        return Judged(seed, False, (), str(refused))
    world, track, others, named = simulation.world, [], [], set[str | None]()
    seen: set[tuple[int, int, int]] = set()
    since = 0.0
    try:
        while not world.finished and world.time < LIMIT and world.time - since < IDLE:
            poses = world.poses()
            track.append([pose[:2] for pose in poses])
            others.append([pose[:2] for pose in world.mover_poses()])
            events = simulation.step().events
            named |= {event.robot for event in events if event.kind in NAMES}
            squares = {(number, floor(pose.x), floor(pose.y)) for number, pose in enumerate(poses)} - seen
            arrived = any(event.kind == "reached" for event in events)
            seen, since = set() if arrived else seen | squares, world.time if squares or arrived else since
    except Exception:
        return Judged(seed, True, ("exception",), format_exc().strip().splitlines()[-1])
    report = simulation.report(0.0, LIMIT)
    rows = report["per_robot"]
    behind = [name for name, row in rows.items() if None in row["reached"]]
    broken = set(_touched(drawn, np.array(track), np.array(others).reshape(len(track), -1, 2)))
    if any(row["unreachable"] for row in rows.values()):
        broken.add("given up")  # every stop was drawn where a way leads
    if behind and world.time - since >= IDLE and not set(behind) & named:
        broken.add("silent")
    if behind and not any(proof in report["reason"] for proof in PROVEN) and not drawn.raw.get("movers"):
        broken.add("stands" if world.time - since >= IDLE else "slow")
    if not behind and world.time - max(time for row in rows.values() for time in row["reached"]) > OVER:
        broken.add("goes on")
    return Judged(seed, True, tuple(sorted(broken)), report["reason"])


def main() -> None:
    """Judge worlds and print what was broken."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--start", type=int, default=0)
    asked = parser.parse_args()
    found = []
    for seed in range(asked.start, asked.start + asked.seeds):
        if (judged := judge(seed)) is not None:
            found.append(judged)
            if judged.broken or not judged.driven:
                print(f"{seed}: {', '.join(judged.broken) or 'refused'}: {judged.why[:200]}", flush=True)
    driven, broken = sum(judged.driven for judged in found), sum(bool(judged.broken) for judged in found)
    kinds = ", ".join(f"{kind} {n}" for kind, n in Counter(kind for judged in found for kind in judged.broken).items())
    jams = sum(any(proof in judged.why for proof in PROVEN) for judged in found if judged.driven)
    print(
        "| worlds | refused | driven | jams proven and said | broken | kinds |\n| --- | --- | --- | --- | --- | --- |"
    )
    print(f"| {len(found)} | {len(found) - driven} | {driven} | {jams} | {broken} | {kinds} |")


if __name__ == "__main__":
    main()
