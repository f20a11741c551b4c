"""Draws a shared target's handovers for traffic.md: how far each robot is from target 1 over time, in two real runs.

The runs are the paper's mission with eight robots, with one difference. In the first, no robot tells its next target
(``then`` in its record), as a robot of another make may: no joint plan leads on through a target then, and each ends
there. In the second, they tell it.
"""

from functools import cache
from math import dist
from pathlib import Path
from typing import Final, NamedTuple

from docs.drawing import colour, framed
from swarm.maps.occupancy import Point
from swarm.robot.brain import Robot
from swarm.robot.mission import Mission
from swarm.scenario.load import load
from world.simulate import Simulation

SCENARIO: Final = Path(__file__).parents[1] / "scenarios" / "paper.yaml"
ROBOTS: Final = 8
SEED: Final = 1
EVERY: Final = 10  # ticks between two points of a line
AFTER: Final = 10.0  # s for which a robot is shown after it has reached the target
FROM: Final = 15.0  # s, the left edge: until then all are on their way
FAR, LONG = 8.0, 90.0  # m and s; the top edge, and the right one at least
WIDE, HIGH, LEFT, TOP, GAP = 760, 190, 52, 34, 66  # px: one panel, its margins, the gap between two
TITLES: Final = ("Before: no robot tells its next target", "After: plans lead on through the target")


class WithoutNext(Mission):
    """A mission that does not say which target comes next."""

    @property
    def stop_after_next(self) -> Point | None:
        """None."""
        return None


class TellsNoNext(Robot):
    """A robot that does not tell its next target."""

    def _begin(self, run: int) -> None:
        super()._begin(run)
        self.mission = WithoutNext(self._own_stops, returns=self._settings.return_home)


class Passing(NamedTuple):
    """A run until all robots have been at the first target."""

    reached: dict[str, float]  # s, when each robot reached it
    lines: dict[str, list[tuple[float, float]]]  # s and m, how far each was from it
    plans: int  # joint plans made until then

    @property
    def handover(self) -> float:
        """The mean time from one arrival to the next [s]."""
        times = self.reached.values()
        return (max(times) - min(times)) / (len(times) - 1)


@cache
def passing(kind: type[Robot]) -> Passing:
    """Drive robots of a kind until each has been at the first target, and ``AFTER`` longer."""
    run = Simulation.of(load(SCENARIO), ROBOTS, SEED)
    world = run.world
    starts = zip(world.robots, world.starts, strict=True)
    run.robots[:] = [kind(name, number, run.scenario, start) for number, (name, start) in enumerate(starts)]
    target = run.scenario.settings.targets[0]
    lines: dict[str, list[tuple[float, float]]] = {name: [] for name in world.robots}
    reached: dict[str, float] = {}
    plans = 0
    while len(reached) < ROBOTS or world.time < max(reached.values()) + AFTER:
        if world.tick % EVERY == 0:
            for name, pose in zip(world.robots, world.poses(), strict=True):
                if world.time <= reached.get(name, world.time) + AFTER:
                    lines[name].append((world.time, dist(pose[:2], target)))
        events = run.step().events
        plans += sum(event.kind == "joint_plan" for event in events) if len(reached) < ROBOTS else 0
        for number, name in enumerate(world.robots):
            time = world.tasks.missions.reached_at[number][0]
            if time is not None:
                reached.setdefault(name, time)
    return Passing(reached, lines, plans)


def svg() -> str:
    """Return the picture: a panel a run, a line a robot, a dot where it reaches the target."""
    runs = [passing(TellsNoNext), passing(Robot)]
    until = max(LONG, *(time for run in runs for line in run.lines.values() for time, _ in line))
    parts = []
    for number, (title, run) in enumerate(zip(TITLES, runs, strict=True)):
        told = f"{title}: one robot every {run.handover:.1f} s, {run.plans} joint plans"
        parts += _panel(told, run, TOP + number * (HIGH + GAP), until)
    height = TOP + 2 * HIGH + GAP + 28
    lines = (
        f"Eight robots in paper.yaml, seed {SEED}: metres from each robot straight to target 1, over seconds.",
        f"A dot: the robot reaches the target. Its line ends {AFTER:g} s later. Level lines: the robot waits.",
    )
    return framed("Handovers at target 1 before and after", LEFT + WIDE + 28, height, parts, lines)


def _panel(title: str, run: Passing, top: float, until: float) -> list[str]:
    def at(time: float, away: float) -> str:
        return f"{LEFT + WIDE * (time - FROM) / (until - FROM):.1f},{top + HIGH * (1 - away / FAR):.1f}"

    def line(points: list[tuple[float, float]], look: str) -> str:
        return f'<path d="M{" L".join(at(*point) for point in points)}" {look}/>'

    parts = [f'<text class="left bold" x="{LEFT}" y="{top - 10}">{title}</text>']
    for away in range(0, int(FAR) + 1, 2):
        x, y = at(FROM, away).split(",")
        parts.append(line([(FROM, away), (until, away)], 'class="faint"'))
        parts.append(f'<text x="{float(x) - 18:g}" y="{float(y) + 4:g}">{away} m</text>')
    for second in range(20, int(until) + 1, 10):
        x, y = at(second, 0.0).split(",")
        parts.append(line([(second, 0.0), (second, FAR)], 'class="faint"'))
        parts.append(f'<text x="{x}" y="{float(y) + 18:g}">{second} s</text>')
    window = f'x="{LEFT}" y="{top}" width="{WIDE}" height="{HIGH}" viewBox="{LEFT} {top} {WIDE} {HIGH}"'
    lines = [line(points, f'stroke="{colour(name)}" stroke-width="1.6"') for name, points in run.lines.items()]
    parts += [f"<svg {window}>", *lines, "</svg>"]
    for name, time in run.reached.items():
        x, y = at(time, min(run.lines[name], key=lambda point: abs(point[0] - time))[1]).split(",")
        parts.append(f'<circle cx="{x}" cy="{y}" r="3.5" fill="{colour(name)}" class="ink"/>')
        parts.append(f'<text x="{x}" y="{float(y) - 8:g}">{name}</text>')
    return parts
