"""Live progress in the terminal, or a plain line now and then if there is no terminal. It needs no Rerun."""

from collections.abc import Callable
from time import monotonic
from types import TracebackType
from typing import Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from dashboard import naming, palette
from dashboard.progress import Progress, Robot, fold, presence
from swarm.bus import Arrival, Presence
from swarm.messages import CLOCK, EVENT, STATE, Activity, Liveness, Message, Phase, Topic

FOLLOWED: Final[tuple[Topic[Any], ...]] = (CLOCK, STATE, EVENT)  # all that a terminal shows, beside presence
LINE_EVERY: Final = 5.0  # s, wall time between plain lines
DRAW_EVERY: Final = 0.25  # s, wall time between two pictures of the table
FACTOR_OVER: Final = 2.0  # s, wall time over which the real-time factor is taken
ROWS: Final = 40  # robots shown; a line counts the others


class Terminal:
    """The progress on a console. Use it in a ``with``; feed ``fold``, and call ``refresh`` a few times a second."""

    def __init__(self, console: Console, *, home: bool = True, clock: Callable[[], float] = monotonic) -> None:
        self.progress = Progress()
        self._console = console
        self._home = home
        self._clock = clock
        self._live: Live | None = None
        self._drawn_at = float("-inf")
        self._factor: float | None = None
        self._mark: tuple[int, float, float] | None = None  # run, wall and simulated time at which the factor began
        # by robot: its run and assignment, and how many reached stops of that are printed already
        self._told: dict[str, tuple[tuple[int, int], int]] = {}
        self._phase_told: tuple[int, Phase] | None = None

    def __enter__(self) -> "Terminal":
        if self._console.is_terminal:
            self._live = Live(self.renderable(), console=self._console, auto_refresh=False, transient=False)
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.refresh(final=True)
        if self._live is not None:
            self._live.stop()

    def start_again(self, run: int, *, home: bool) -> None:
        """Forget the runs before ``run``, that of another set-up; ``home`` says whether its mission returns."""
        self._home, self.progress = home, Progress(run=run, tokens=self.progress.tokens)

    def fold(self, arrived: object) -> None:
        """Take in what ``Bus.receive`` returned."""
        match arrived:
            case Arrival(message=message):
                self.take(message)
            case Presence(role="robot"):
                self.progress = presence(self.progress, arrived.id, arrived.session, arrived.alive)

    def take(self, message: Message) -> None:
        """Take in a message."""
        self.progress = fold(self.progress, message)

    def refresh(self, *, final: bool = False) -> None:
        """Show the progress if it is time to, or if it is the ``final`` call."""
        now = self._clock()
        self._measure(now)
        if self._live is not None:
            if final or now - self._drawn_at >= DRAW_EVERY:
                self._drawn_at = now
                self._live.update(self.renderable(), refresh=True)
        elif not self._console.is_terminal:
            for line in self._news():
                self._console.print(line, markup=False, highlight=False, soft_wrap=True)
            if final or now - self._drawn_at >= LINE_EVERY:
                self._drawn_at = now
                self._console.print(self.line(), markup=False, highlight=False, soft_wrap=True)

    def renderable(self) -> RenderableType:
        """Return a headline about the run and a table with one row per robot."""
        progress = self.progress
        table = Table(box=SIMPLE_HEAD, pad_edge=False)
        for name in ("robot", "stops", "target"):
            table.add_column(name, no_wrap=True)
        table.add_column("left", justify="right", no_wrap=True)
        table.add_column("doing", no_wrap=True)
        table.add_column("waited", justify="right", no_wrap=True)
        for number, name in enumerate(progress.order[:ROWS]):
            robot = progress.robot(name)
            colour = palette.hexadecimal(palette.robot(number))
            doing, style = self._doing(name, robot)
            waited = progress.seconds(robot.waited)
            table.add_row(
                Text(name, style=f"bold {colour}"),
                Text(bar(robot), style=colour),
                naming.stop_of(robot, robot.target, self._home) if robot.stops else "",
                f"{robot.distance:.1f} m" if robot.activity is not Activity.DONE and robot.stops else "",
                Text(doing, style=style),
                f"{waited:.1f} s" if waited else "",
            )
        if len(progress.order) > ROWS:
            table.caption = f"and {len(progress.order) - ROWS} more"
        return Group(Text(self._headline(), style="bold"), table)

    def line(self) -> str:
        """Return the progress as one plain line."""
        progress = self.progress
        some = progress.order[:8]
        each = ", ".join(f"{name} {naming.lane(progress.robot(name), self._home)}" for name in some)
        more = f", and {len(progress.order) - len(some)} more" if len(progress.order) > len(some) else ""
        return f"{self._headline()}{': ' if each else ''}{each}{more}"

    def _headline(self) -> str:
        progress = self.progress
        if progress.run < 0:
            return "waiting for the world"
        factor = f", {self._factor:.1f} x real time" if self._factor is not None else ""
        ticks = [robot.tick for robot in progress.robots.values()]  # a robot's message may be newer than the world's
        now = max(progress.time, progress.seconds(max(ticks, default=0)))
        return f"{now:6.1f} s  {progress.phase.value}, {progress.share:4.0%} of all stops{factor}"

    def _doing(self, name: str, robot: Robot) -> tuple[str, str]:
        heard = self.progress.heard(name)
        if heard is not Liveness.ALIVE:
            return heard.value, "bold red"
        waits = self.progress.waits(name)
        if waits:
            return f"{naming.lane(robot, self._home)} {waits:.0f} s", "yellow"
        return naming.words(robot.activity), "dim" if robot.activity is Activity.DONE else ""

    def _news(self) -> list[str]:
        """Return a line for each reached stop and each change of phase that is not printed yet."""
        progress = self.progress
        said = []
        if progress.run >= 0 and self._phase_told != (progress.run, progress.phase):
            self._phase_told = (progress.run, progress.phase)
            said.append(f"{progress.time:6.1f} s  {progress.phase.value}")
        for name, robot in progress.robots.items():
            mission = (progress.run, robot.assignment)
            of, before = self._told.get(name, (mission, 0))
            if of != mission:
                before = 0
            if robot.reached > before:
                self._told[name] = (mission, robot.reached)
                ticks = sorted((tick, stop) for stop, tick in enumerate(robot.reached_at) if tick is not None)
                said += [
                    f"{progress.seconds(tick):6.1f} s  {name} reached "
                    f"{naming.stop_of(robot, stop, self._home)} ({rank} of {robot.stops})"
                    for rank, (tick, stop) in enumerate(ticks, start=1)
                    if rank > before
                ]
        return said

    def _measure(self, now: float) -> None:
        """Measure the real-time factor over the last seconds."""
        progress = self.progress
        if self._mark is None or self._mark[0] != progress.run or progress.phase is not Phase.RUNNING:
            self._mark = (progress.run, now, progress.time)
        elif now - self._mark[1] >= FACTOR_OVER:
            self._factor = (progress.time - self._mark[2]) / (now - self._mark[1])
            self._mark = (progress.run, now, progress.time)


def bar(robot: Robot) -> str:
    """Return a robot's stops as text: ``#`` reached, ``>`` under way, ``x`` given up, ``.`` to come.

    >>> bar(Robot(reached_at=(10, 90, None, None), target=2))
    '##>.'
    """
    if robot.stops > 24:
        return f"{robot.reached}/{robot.stops}"
    marks = dict.fromkeys(robot.unreachable, "x") | {robot.target: ">"}
    return "".join("#" if tick is not None else marks.get(stop, ".") for stop, tick in enumerate(robot.reached_at))
