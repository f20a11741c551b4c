"""Random worlds of another generator than the storm's, with judges that share nothing with its laws.

``python -m benchmarks.other_worlds --seeds 300 --start 0`` draws worlds, drives each in one process, and prints how
many were driven and how many were broken, by what. Walls are squares of 0.4 to 1.5 m: halls, rooms and mazes. Contacts
are judged by the recorded poses and the drawing, ways by a flood fill of the drawing (with the storm it shares only
this flood fill): no lattice, no planner. A mission may take 300 s and the time of its robots one after the other.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from itertools import combinations, pairwise, product
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
from swarm.scenario.load import Scenario, check_values
from swarm.storm.free_space import FINE, SPARE, Grid, gaps, label_spaces, steps
from swarm.storm.workers import Lost, answers
from world.faults import Faults
from world.simulate import Simulation

At = tuple[float, float]  # m

BODY: Final = 0.2  # m, radius of a robot
TOUCH: Final = 2e-3  # m; bodies that overlap by more touch
LANE: Final = 1.3  # m, the least width of a maze's lanes and of doors
APART: Final = 1.4  # m, between two starts, and between two last targets
LIMIT: Final = 300.0  # s, and besides the time that the robots need one after the other
SLOWEST: Final = 0.2  # m/s along the shortest ways, if the robots drive one after the other: half of what they drive
IDLE: Final = 120.0  # s in which nobody arrives or comes to another square metre: the run is over
OVER: Final = 90.0  # s after the last arrival in which a run has to end: robots make way for 60 s, then stay
PROGRESS: Final = 100  # worlds between two lines
PROVEN: Final = ("no way exists", "no plan exists")  # a jam that the robots have proven and said ends a run
NAMES: Final = frozenset({"stalled", "unsolvable", "no_plan_found", "unreachable"})  # events that say who is stuck


class Drawn(NamedTuple):
    """One world."""

    raw: dict[str, Any]  # the scenario's file
    solid: Grid
    side: float  # m, of a square
    spaces: NDArray[np.int64]  # pieces of the floor, as ``label_spaces`` counts them
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
    free = label_spaces(solid, side, BODY + SPARE)
    label = Counter(free[free > 0].tolist()).most_common(1)
    robots = chance.choice((1, 2, 2, 3, 3, 4, 4, 5, 6, 8, 10, 12))
    inside = np.argwhere(free == label[0][0])[:, ::-1].tolist() if label else []
    spots = [(round((x + 0.5) * FINE, 3), round((y + 0.5) * FINE, 3)) for x, y in inside]
    starts, ends = (_spread(spots, robots, chance) for _ in range(2))
    if len(starts) < robots or len(ends) < robots:
        return None
    rows_of_stops = [[*chance.sample(spots, chance.randrange(3)), end] for end in ends]
    raw: dict[str, Any] = {
        "name": f"other.{seed}", "map": {"text": text, "cell": side}, "robots": robots, "seed": seed, "limit": 3600.0,
        "return_home": False, "start": {"poses": [[*at, round(chance.uniform(-pi, pi), 3)] for at in starts]},
        "own_targets": [[list(at) for at in row] for row in rows_of_stops],
        "radio": {"range": chance.choice((6.5, 8.0, 12.0, 50.0)), "loss": chance.choice((0.0, 0.0, 0.1, 0.3))},
        "sensors": {"noise": chance.choice((0.0, 0.0, 0.01, 0.03))},
    }  # fmt: skip
    if chance.random() < 0.2 and len(spots) > 1:
        raw["movers"] = [{"waypoints": [list(at) for at in chance.sample(spots, 2)], "speed": 0.25, "radius": 0.2}]
    late, slow = chance.choice((0.0, 0.0, 0.1, 0.2)), chance.choice((0.0, 0.0, 0.0, 0.2))
    held_up = chance.choice((0.0, 0.0, 20.0))
    return Drawn(raw, solid, side, free, Faults(late=late, slow=0.0 if late else slow, held_up=held_up))


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
    inner[:] = rows * columns > 1
    inner[:lane, :lane] = False
    stack = [(0, 0)] * (rows * columns > 1)
    seen = set(stack)
    while stack:
        row, column = stack[-1]
        near = [(row + a, column + b) for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0))]
        ways = [at for at in near if 0 <= at[0] < rows and 0 <= at[1] < columns]
        new = [at for at in ways if at not in seen]
        if not new:
            stack.pop()
            if chance.random() < 0.7:
                continue
        there = chance.choice(new or ways)
        (y, x), (top, right) = min((row, column), there), max((row, column), there)
        inner[y * step : top * step + lane, x * step : right * step + lane] = False
        stack += [there] * bool(new)
        seen.add(there)


def _spread(spots: list[At], count: int, chance: Random) -> list[At]:
    found: list[At] = []
    for _ in range(40 * count if spots else 0):
        at = chance.choice(spots)
        if len(found) < count and all(hypot(at[0] - x, at[1] - y) >= APART for x, y in found):
            found.append(at)
    return found


def _patience(drawn: Drawn) -> float:
    """Return the time [s] that the robots need one after the other, slowly, along the shortest ways of the drawing."""
    total, fits = 0, drawn.spaces > 0
    for pose, stops in zip(drawn.raw["start"]["poses"], drawn.raw["own_targets"], strict=True):
        pixels = [(floor(y / FINE), floor(x / FINE)) for x, y, *_ in (pose, *stops)]
        total += sum(steps(fits, a)[b] for a, b in pairwise(pixels))
    return float(total * FINE / SLOWEST)


def touched(drawn: Drawn, poses: NDArray[np.float64], movers: NDArray[np.float64]) -> Iterator[str]:
    """Yield what robots touched; ``poses`` and ``movers`` are (ticks, number, 2) [m]."""
    robots = poses.shape[1]
    places, where = np.unique(poses.reshape(-1, 2), axis=0, return_inverse=True)
    inside = (gaps(drawn.solid, drawn.side, places) < BODY - TOUCH)[where].reshape(len(poses), robots)
    pushed = (np.hypot(*(movers[:, None] - poses[:, :, None]).T) < 2 * BODY + TOUCH).any(axis=0).T  # [tick, robot]
    # a mover is stronger than a robot: whom it pushes into something can do nothing, and may be in it when it has gone
    if (_begins(inside) & ~pushed).any():
        yield "wall"
    for a, b in combinations(range(robots), 2):
        overlap = np.hypot(*(poses[:, a] - poses[:, b]).T) < 2 * BODY - TOUCH
        if (_begins(overlap) & ~pushed[:, a] & ~pushed[:, b]).any():
            yield "robot"
    for robot, mover in product(range(robots), range(movers.shape[1])):
        apart = movers[:, mover] - poses[:, robot]
        away = np.hypot(*apart.T)
        for tick in np.nonzero((away[2:] < 2 * BODY) & (away[1:-1] >= 2 * BODY))[0] + 2:
            towards = apart[tick - 2] / away[tick - 2]
            own = float((poses[tick, robot] - poses[tick - 2, robot]) @ towards)
            if own > 0.01 and own > float((movers[tick - 2, mover] - movers[tick, mover]) @ towards):
                yield "mover"


def _begins(contact: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the ticks in which contacts begin; the first axis is the tick."""
    return contact & ~np.concatenate((np.zeros_like(contact[:1]), contact[:-1]))


def judge(seed: int) -> Judged | None:
    """Drive the world of a seed and judge it; None: there is no such world."""
    drawn = draw(seed)
    if drawn is None:
        return None
    try:
        settings = check_values(drawn.raw, "other worlds")
        scenario = Scenario(settings, from_text(drawn.raw["map"]["text"], drawn.side), load_profile("paper"))
        check(scenario, settings.count, seed)
        simulation = Simulation.of(scenario, settings.count, seed, drawn.faults)
    except SwarmError as refused:
        return Judged(seed, False, (), str(refused))
    world, track, others, named = simulation.world, [], [], set[str | None]()
    seen: set[tuple[int, int, int]] = set()
    since, limit = 0.0, LIMIT
    try:
        while not world.is_finished and world.time < limit and world.time - since < IDLE:
            poses = world.poses()
            track.append([pose[:2] for pose in poses])
            others.append([pose[:2] for pose in world.mover_poses()])
            events = simulation.step().events
            named |= {event.robot for event in events if event.kind in NAMES}
            squares = {(number, floor(pose.x), floor(pose.y)) for number, pose in enumerate(poses)} - seen
            arrived = any(event.kind == "reached" for event in events)
            seen, since = set() if arrived else seen | squares, world.time if squares or arrived else since
            limit = LIMIT + _patience(drawn) if limit == LIMIT <= world.time else limit
    except Exception:
        return Judged(seed, True, ("exception",), format_exc().strip().splitlines()[-1])
    report = simulation.report(0.0, limit)
    rows = report["per_robot"]
    behind = [name for name, row in rows.items() if None in row["reached"]]
    broken = set(touched(drawn, np.array(track), np.array(others).reshape(len(track), -1, 2)))
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
    """Judge worlds and print what was broken, and every 100 worlds how many were judged."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--start", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1, help="worlds that are driven side by side")
    asked = parser.parse_args()
    found: list[Judged] = []
    seeds = range(asked.start, asked.start + asked.seeds)
    for seed, got in answers(judge, seeds, workers=asked.workers):
        if (judged := Judged(seed, True, ("lost",), got.why) if isinstance(got, Lost) else got) is not None:
            found.append(judged)
            if judged.broken or not judged.driven:
                print(f"{seed}: {', '.join(judged.broken) or 'refused'}: {judged.why[:200]}", flush=True)
            if len(found) % PROGRESS == 0:
                print(f"{len(found)} judged, {sum(bool(one.broken) for one in found)} broken", flush=True)
    driven, broken = sum(judged.driven for judged in found), sum(bool(judged.broken) for judged in found)
    kinds = ", ".join(f"{kind} {n}" for kind, n in Counter(kind for judged in found for kind in judged.broken).items())
    jams = sum(any(proof in judged.why for proof in PROVEN) for judged in found if judged.driven)
    print(f"| worlds | refused | driven | jams proven and said | broken | kinds |\n|{' --- |' * 6}")
    print(f"| {len(found)} | {len(found) - driven} | {driven} | {jams} | {broken} | {kinds} |")


if __name__ == "__main__":
    main()
