"""The collector of what happened since the last drawing, so that it is drawn at once. Pure: no clock, no I/O.

If there are too many frames, some are dropped. Changes of activity, paths and events are never dropped.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from dashboard.fold import phrases
from dashboard.fold.overlays import Overlay
from dashboard.fold.progress import Progress
from dashboard.fold.state import RunState
from swarm.messages import (
    Account,
    Activity,
    Clock,
    Event,
    Events,
    Liveness,
    Message,
    Phase,
    Plan,
    Point,
    Status,
    Truth,
)

BODIES: Final = 4000  # bodies in one batch; more frames than that are thinned out evenly
ROWS: Final = 40  # robots in the summary
OVERLAY: Final = 0.75  # s, simulated, at least between two overlays within a batch; every batch ends with one
OVERLAYS: Final = 10  # most overlays in one batch, about, if time runs faster


@dataclass(slots=True)
class Batch:
    """The content of one drawing. Times are seconds since the run began."""

    frames: list[tuple[Truth, list[float]]] = field(default_factory=list)  # with the distance of each robot [m]
    lanes: list[tuple[float, str, str]] = field(default_factory=list)  # time, robot, new activity
    paths: list[tuple[float, dict[str, list[Point]]]] = field(default_factory=list)  # time, robot -> path
    events: list[Event] = field(default_factory=list)
    summaries: list[tuple[float, str]] = field(default_factory=list)  # time, markdown
    overlays: list[Overlay] = field(default_factory=list)

    def thin_frames(self) -> "Batch":
        """Drop frames evenly until few enough are left to be drawn in time; the last frame stays."""
        bodies = sum(len(frame.bodies) for frame, _ in self.frames)
        step = max(1, -(-bodies // BODIES))
        self.frames = self.frames[(len(self.frames) - 1) % step :: step]
        return self


class Collector:
    """The collector of a run's changes: it is told what is news, and takes the rest from the state.

    It is for the robots that it began with; the rules of the robot ``selected`` are shown.
    """

    def __init__(self, state: RunState, selected: str | None = None) -> None:
        assert state.scene is not None
        self.run, self.robots = state.progress.run, state.progress.order
        self._state, self._selected = state, selected
        self._home, self._kinds = state.scene.settings.return_home, state.scene.kinds
        self._mark: tuple[int, Phase] | None = None
        self._batch = Batch()
        self._lane: dict[str, str] = {}
        self._planned: frozenset[str] = frozenset()  # robots in joint plans
        self._begun = state.progress.time  # s
        self._contacts: int | None = None  # of the run, as the world has counted them
        self._truth: Truth | None = None  # the newest that no overlay shows
        self._laid = 0.0  # s, simulated time of the last overlay
        self._collected = 0.0  # s, simulated time of the last batch
        self._gap = OVERLAY
        for name in self.robots:
            self._note_lane(name, self._begun)
        if any(plan.points for plan in state.paths.values()):
            self._note_paths(self._begun)
        self._batch.events.extend(state.progress.events)

    def take(self, news: Message) -> None:
        """Note what a message has changed; the state has taken it in."""
        progress = self._state.progress
        match news:
            case Truth():
                self._note_frame(news)
            case Clock():
                self._sum_up()
            case Event():
                self._batch.events.append(news)
            case Events():
                self._batch.events.extend(news.events)
            case Plan():
                self._note_paths(progress.seconds(news.tick))
            case Status() if news.run == self.run:
                self._note_measured(news)
        name = getattr(news, "robot", None)
        if name in self._lane:
            self._note_lane(name, progress.seconds(progress.robot(name).tick))

    def batch(self) -> Batch:
        """Return what was collected and begin an empty batch."""
        self._lay_over()
        time = self._state.progress.time
        self._gap = max(OVERLAY, (time - self._collected) / OVERLAYS)
        batch, self._batch, self._collected = self._batch, Batch(), time
        return batch.thin_frames()

    def _note_frame(self, truth: Truth) -> None:
        self._truth = truth
        self._batch.frames.append((truth, [self._state.progress.robot(name).distance for name in self.robots]))
        self._sum_up()
        planned = frozenset(body.robot for body in truth.bodies if body.members)
        if planned != self._planned:
            self._planned = planned
            self._note_paths(truth.time)
        if truth.time >= self._laid + self._gap:
            self._lay_over()

    def _note_measured(self, status: Status) -> None:
        """Note the contacts; at first also the stops of each robot in the time before this collector began."""
        first, self._contacts = self._contacts is None, sum(status.contacts.values())
        for row in status.robots if first else ():
            name, account = row.robot, row.account
            own = name in self._lane and not self._state.progress.robot(name).assignment  # the scenario's stops
            if own and account is not None and not account.laps:
                lanes = trip_starts(account, self._home)
                self._batch.lanes += [(time, name, word) for time, word in lanes if time < self._begun]

    def _lay_over(self) -> None:
        if self._truth is not None and self._state.overlays is not None:
            self._batch.overlays.append(self._state.overlays.overlay_at(self._truth, self._selected))
            self._laid, self._truth = self._truth.time, None

    def _sum_up(self) -> None:
        """Write the summary once a second and at each change of phase."""
        progress = self._state.progress
        mark = (int(progress.time), progress.phase)
        if mark != self._mark:
            self._mark = mark
            self._batch.summaries.append((progress.time, summary(progress, self._home, self._contacts, self._kinds)))

    def _note_lane(self, name: str, time: float) -> None:
        word = phrases.lane_label(self._state.progress.robot(name), self._home)
        if self._lane.get(name) != word:
            self._lane[name] = word
            self._batch.lanes.append((max(0.0, time), name, word))

    def _note_paths(self, time: float) -> None:
        """Note all paths; a robot that follows a joint plan does not follow its own path."""
        paths = {name: plan.points for name, plan in self._state.paths.items() if name not in self._planned}
        self._batch.paths.append((time, paths))


def trip_starts(row: Account, home: bool) -> list[tuple[float, str]]:
    """Return to which stop a robot drove from when on [s], from the times at which it reached its stops."""
    stops = len(row.reached)
    times = [0.0, *sorted(time for time in row.reached if time is not None)]
    return [(time, phrases.stop_label(_first_left(row, time), stops, home)) for time in times]


def _first_left(row: Account, now: float) -> int:
    """Return the first stop that was not reached by a time, or the number of stops."""
    left = [stop for stop, time in enumerate(row.reached) if time is None or time > now]
    return left[0] if left else len(row.reached)


def summary(
    progress: Progress, home: bool, contacts: int | None = None, kinds: Mapping[str, str] = MappingProxyType({})
) -> str:
    """Return the run as markdown: the totals, and a table with one row per robot.

    ``kinds`` are those of the robots, by name; empty if the fleet has none.
    """
    rows = [
        f"**{format_totals(progress, contacts)}**",
        "",
        f"| robot | {'kind | ' if kinds else ''}reached | to | left | doing | waited |",
        f"|{'---|' * (7 if kinds else 6)}",
    ]
    for name in progress.order[:ROWS]:
        robot = progress.robot(name)
        heard = progress.radio_freshness(name)
        doing = phrases.activity_word(robot.activity) if heard is Liveness.ALIVE else f"**{heard.value}**"
        to = phrases.stop_of(robot, robot.target, home) if robot.stops else "-"
        left = f"{robot.distance:.1f} m" if robot.stops and robot.activity is not Activity.DONE else "-"
        waited = f"{progress.seconds(robot.waited):.0f} s"
        who = f"{name} | {kinds.get(name, '-')}" if kinds else name
        rows.append(f"| {who} | {robot.reached_count} of {robot.stops} | {to} | {left} | {doing} | {waited} |")
    if len(progress.order) > ROWS:
        rows.append(f"\nand {len(progress.order) - ROWS} more")
    return "\n".join(rows)


def format_totals(progress: Progress, contacts: int | None = None) -> str:
    """Return a line about the whole fleet: the time, the stops, how many drive, wait or are away, the contacts.

    ``contacts`` are those that the world has counted; None: those among the last events.
    """
    robots = [progress.robot(name) for name in progress.order]
    reached, stops = sum(robot.reached_count for robot in robots), sum(robot.stops for robot in robots)
    here = [name for name in progress.order if progress.radio_freshness(name) is Liveness.ALIVE]
    doing = Counter(progress.robot(name).activity for name in here)
    parts = [f"{count} {phrases.activity_word(activity)}" for activity in Activity if (count := doing[activity])]
    parts += [f"{len(robots) - len(here)} not heard"] * (len(here) < len(robots))
    seen = len(phrases.select_contacts(event for event in progress.events if event.run == progress.run))
    return (
        f"{progress.time:.0f} s, {progress.phase.value}: {reached} of {stops} targets reached ({progress.share:.0%}); "
        f"{', '.join(parts) or 'nobody there'}; {seen if contacts is None else contacts} contacts"
    )
