"""The collector of what happened since the last drawing, so that it is drawn at once. Pure: no clock, no I/O.

If there are too many frames, some are dropped. Changes of activity, paths and events are never dropped.
"""

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from dashboard.fold import naming
from dashboard.fold.account import Saved
from dashboard.fold.contacts import touches
from dashboard.fold.overlays import Overlay
from dashboard.fold.progress import Progress
from swarm.messages import Account, Activity, Clock, Event, Liveness, Message, Phase, Plan, Point, Truth

BODIES: Final = 4000  # bodies in one batch; more frames than that are thinned out evenly
ROWS: Final = 40  # robots in the summary


@dataclass(slots=True)
class Batch:
    """The content of one drawing. Times are seconds since the run began."""

    frames: list[Truth] = field(default_factory=list)
    distances: list[list[float]] = field(default_factory=list)  # m, of each robot at each frame
    lanes: list[tuple[float, str, str]] = field(default_factory=list)  # time, robot, new activity
    paths: list[tuple[float, dict[str, tuple[Point, ...]]]] = field(default_factory=list)  # time, robot -> path
    events: list[Event] = field(default_factory=list)
    summaries: list[tuple[float, str]] = field(default_factory=list)  # time, markdown
    overlays: list[Overlay] = field(default_factory=list)

    def thinned(self) -> "Batch":
        """Drop frames evenly until few enough are left to be drawn in time; the last frame stays."""
        bodies = sum(len(frame.bodies) for frame in self.frames)
        step = -(-bodies // BODIES)
        if step > 1:
            last = len(self.frames) - 1
            kept = [k for k in range(len(self.frames)) if (last - k) % step == 0]
            self.frames = [self.frames[k] for k in kept]
            self.distances = [self.distances[k] for k in kept]
        return self


class Collector:
    """The collector of a run's changes: it compares the progress before and after each message."""

    def __init__(self, progress: Progress, home: bool) -> None:
        self._home = home
        self._order = progress.order
        self._mark: tuple[int, Phase] | None = None
        self._batch = Batch()
        self._lane: dict[str, str] = {}
        self._planned: frozenset[str] = frozenset()  # robots in joint plans
        self._begun = progress.time  # s
        self._knows_past = False
        self.contacts: int | None = None  # of the run, as the world has counted them
        for name in progress.order:
            self._lanes(progress, name, progress.time)
        if any(robot.path for robot in progress.robots.values()):
            self._paths(progress, progress.time)
        self._batch.events.extend(progress.events)

    def take(self, progress: Progress, message: Message) -> None:
        """Note what a message changed; it is already folded into ``progress``."""
        match message:
            case Truth():
                self._batch.frames.append(message)
                self._batch.distances.append([progress.robot(name).distance for name in self._order])
                self._sum_up(progress)
                planned = frozenset(body.robot for body in message.bodies if body.members)
                if planned != self._planned:
                    self._planned = planned
                    self._paths(progress, message.time)
            case Clock():
                self._sum_up(progress)
            case Event():
                self._batch.events.append(message)
            case Plan():
                self._paths(progress, progress.seconds(message.tick))
        name = getattr(message, "robot", None)
        if name in self._lane:
            self._lanes(progress, name, progress.seconds(progress.robot(name).tick))

    def knows_past(self) -> None:
        """Note that what happened before this collector began is drawn already."""
        self._knows_past = True

    def look_back(self, progress: Progress, account: Saved) -> None:
        """Collect, once, what an account says of the time before this collector began: the stops of each robot."""
        if self._knows_past:
            return
        self._knows_past = True
        for name, row in account.robots.items():
            if name in self._lane and not row.laps and not progress.robot(name).assignment:
                self._batch.lanes += [(time, name, word) for time, word in past(row, self._home) if time < self._begun]

    def lay_over(self, overlay: Overlay) -> None:
        """Note an overlay of the floor."""
        self._batch.overlays.append(overlay)

    def batch(self) -> Batch:
        """Return what was collected and begin an empty batch."""
        batch, self._batch = self._batch, Batch()
        return batch.thinned()

    def _sum_up(self, progress: Progress) -> None:
        """Write the summary once a second and at each change of phase."""
        mark = (int(progress.time), progress.phase)
        if mark != self._mark:
            self._mark = mark
            self._batch.summaries.append((progress.time, summary(progress, self._home, self.contacts)))

    def _lanes(self, progress: Progress, name: str, time: float) -> None:
        word = naming.lane(progress.robot(name), self._home)
        if self._lane.get(name) != word:
            self._lane[name] = word
            self._batch.lanes.append((max(0.0, time), name, word))

    def _paths(self, progress: Progress, time: float) -> None:
        """Note all paths; a robot that follows a joint plan does not follow its own path."""
        paths = {name: () if name in self._planned else progress.robot(name).path for name in self._order}
        self._batch.paths.append((time, paths))


def past(row: Account, home: bool) -> list[tuple[float, str]]:
    """Return to which stop a robot drove from when on [s], from the times at which it reached its stops."""
    stops = len(row.reached)
    times = [0.0, *sorted(time for time in row.reached if time is not None)]
    return [(time, naming.stop_lane(_first_left(row, time), stops, home)) for time in times]


def _first_left(row: Account, now: float) -> int:
    """Return the first stop that was not reached by a time, or the number of stops."""
    left = [stop for stop, time in enumerate(row.reached) if time is None or time > now]
    return left[0] if left else len(row.reached)


def summary(progress: Progress, home: bool, contacts: int | None = None) -> str:
    """Return the run as markdown: the totals, and a table with one row per robot."""
    rows = [
        f"**{totals(progress, contacts)}**",
        "",
        "| robot | reached | to | left | doing | waited |",
        "|---|---|---|---|---|---|",
    ]
    for name in progress.order[:ROWS]:
        robot = progress.robot(name)
        heard = progress.heard(name)
        doing = naming.words(robot.activity) if heard is Liveness.ALIVE else f"**{heard.value}**"
        to = naming.stop_of(robot, robot.target, home) if robot.stops else "-"
        left = f"{robot.distance:.1f} m" if robot.stops and robot.activity is not Activity.DONE else "-"
        waited = f"{progress.seconds(robot.waited):.0f} s"
        rows.append(f"| {name} | {robot.reached} of {robot.stops} | {to} | {left} | {doing} | {waited} |")
    if len(progress.order) > ROWS:
        rows.append(f"\nand {len(progress.order) - ROWS} more")
    return "\n".join(rows)


def totals(progress: Progress, contacts: int | None = None) -> str:
    """Return a line about the whole fleet: the time, the stops, how many drive, wait or are away, the contacts.

    ``contacts`` are those that the world has counted; None: those among the last events.
    """
    robots = [progress.robot(name) for name in progress.order]
    reached, stops = (sum(getattr(robot, field) for robot in robots) for field in ("reached", "stops"))
    here = [name for name in progress.order if progress.heard(name) is Liveness.ALIVE]
    doing = Counter(progress.robot(name).activity for name in here)
    parts = [f"{count} {naming.words(activity)}" for activity in Activity if (count := doing[activity])]
    parts += [f"{len(robots) - len(here)} not heard"] * (len(here) < len(robots))
    seen = len(touches(event for event in progress.events if event.run == progress.run))
    return (
        f"{progress.time:.0f} s, {progress.phase.value}: {reached} of {stops} targets reached ({progress.share:.0%}); "
        f"{', '.join(parts) or 'nobody there'}; {seen if contacts is None else contacts} contacts"
    )
