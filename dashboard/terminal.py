"""Live progress in the terminal, or a plain line now and then if there is no terminal. It needs no Rerun."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from itertools import product
from operator import itemgetter
from textwrap import TextWrapper
from time import monotonic
from types import MappingProxyType
from typing import Any, Final, Self

from msgspec import UNSET
from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from dashboard.fold import palette, phrases
from dashboard.fold.progress import Progress, RobotProgress, fold
from swarm.bus import Arrival
from swarm.messages import CLOCK, EVENT, STATE, Activity, Event, Liveness, Map, Phase, Topic

FOLLOWED: Final[tuple[Topic[Any], ...]] = (CLOCK, STATE, EVENT)  # all that a terminal shows, beside presence
LEAVING: Final = frozenset({"gone", "left", "lost", "stale"})  # kinds of events
LINE_EVERY: Final = 5.0  # s, wall time between plain lines
DRAW_EVERY: Final = 0.25  # s, wall time between two pictures of the table
FACTOR_OVER: Final = 2.0  # s, wall time over which the real-time factor is taken
ROWS: Final = 12  # robots of a fleet whose rows are all shown; of a larger one, those that need attention
WRAPPED: Final[dict[str, Any]] = {"subsequent_indent": "    ", "break_long_words": False, "break_on_hyphens": False}
LONG: Final = 10.0  # s; a robot that waits longer needs attention


class Terminal:
    """The progress on a console. Use it in a ``with``; feed ``take``, and call ``refresh`` a few times a second."""

    def __init__(
        self,
        console: Console,
        *,
        home: bool = True,
        quiet: bool = False,
        held: bool = False,
        kinds: Mapping[str, str] = MappingProxyType({}),
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self.progress = Progress()
        self._console = console
        self._home = home
        self._quiet = quiet  # no progress, only trouble
        self._held = held  # the robots start when somebody says so
        self._kinds = kinds  # of the robots, by name; a map tells them too
        self._clock = clock
        self._live: Live | None = None
        self._drawn_at = float("-inf")
        self._factor: float | None = None
        self._mark: tuple[int, float, float] | None = None  # run, wall and simulated time at which the factor began
        # by robot: its run and assignment, and how many reached stops of that are printed already
        self._told: dict[str, tuple[tuple[int, int], int]] = {}
        self._trouble: list[tuple[float, str]] = []  # lines not printed yet, with their time [s]
        self._explained: set[tuple[str | None, str]] = set()  # robot and kind of events that somebody else tells
        self._phase_told: tuple[int, Phase] | None = None
        self._line_told = ""

    def __enter__(self) -> Self:
        if self._console.is_terminal and not self._quiet:
            self._live = Live(self.renderable(), console=self._console, auto_refresh=False, transient=False)
            self._live.start()
        return self

    def __exit__(self, *fault: object) -> None:
        self.refresh(final=True)
        if self._live is not None:
            self._live.stop()

    def start_again(self, run: int, *, home: bool, kinds: Mapping[str, str] = MappingProxyType({})) -> None:
        """Forget the runs before ``run``, that of another set-up; ``home`` says whether its mission returns.

        ``kinds`` are those of its robots, by name; empty if it has none.
        """
        self._kinds = kinds
        self._home, self.progress = home, Progress(run=run, tokens=self.progress.tokens)
        self._held = True

    def explain(self, robots: Iterable[str], kinds: Iterable[str]) -> None:
        """Leave out the next event of each of these kinds about each of these robots: somebody else tells it."""
        self._explained |= set(product(robots, kinds))

    def take(self, arrived: object) -> None:
        """Take in what ``Bus.receive`` returned, or a message."""
        before, self.progress = self.progress, fold(self.progress, arrived)
        message = arrived.message if isinstance(arrived, Arrival) else arrived
        if isinstance(message, Map):
            self._kinds = {} if message.scenario.kinds is UNSET else message.scenario.kinds
        if isinstance(message, Event) and self.progress is not before and (words := self._words(message)):
            self._trouble.append((message.time, words))

    def refresh(self, *, final: bool = False) -> None:
        """Show the progress if it is time to, or if it is the ``final`` call."""
        now = self._clock()
        self._measure(now)
        news = [] if self._quiet or self._console.is_terminal else self._find_news()
        for time, words in sorted(news + self._trouble, key=itemgetter(0)):
            print_wrapped(self._console, f"{time:6.1f} s  {words}")
        self._trouble.clear()
        if self._quiet:
            return
        if self._live is not None:
            if final or now - self._drawn_at >= DRAW_EVERY:
                self._drawn_at = now
                self._live.update(self.renderable(), refresh=True)
        elif not self._console.is_terminal and (final or now - self._drawn_at >= LINE_EVERY):
            self._drawn_at, line = now, self.line()
            if line != self._line_told:  # the clock stands, and nothing has changed: it was said
                print_wrapped(self._console, line)
            self._line_told = line

    def _words(self, event: Event) -> str:
        """Return the words for trouble or a request; "" for an event that needs no attention."""
        if (event.robot, event.kind) in self._explained:
            self._explained.remove((event.robot, event.kind))
            return ""
        if any(phrases.is_same_touch(event, other) for other in self.progress.events):
            return ""
        over = self.progress.phase is Phase.OVER or (event.robot is not None and self._is_done(event.robot))
        if words := phrases.request_words(event):
            return "" if self._quiet else words
        return "" if over and event.kind in LEAVING else phrases.describe_trouble(event)

    def _is_done(self, name: str) -> bool:
        robot = self.progress.robot(name)
        return robot.activity is Activity.DONE and robot.reached_count == robot.stops > 0

    def renderable(self) -> RenderableType:
        """Return a headline about the run and a table with one row per robot."""
        progress = self.progress
        table = Table(box=SIMPLE_HEAD, pad_edge=False)
        for name in ("robot", *(["kind"] if self._kinds else []), "reached", "target"):
            table.add_column(name, no_wrap=True)
        table.add_column("way", justify="right", no_wrap=True)
        table.add_column("left", justify="right", no_wrap=True)
        table.add_column("doing", no_wrap=True)
        table.add_column("waited", justify="right", no_wrap=True)
        shown = self._robots_to_show()
        for number, name in enumerate(progress.order):
            if name not in shown:
                continue
            robot = progress.robot(name)
            colour = palette.hexadecimal(palette.robot(number))
            doing, style, _ = self._describe_activity(name, robot)
            waited = progress.seconds(robot.waited)
            table.add_row(
                Text(name, style=f"bold {colour}"),
                *([self._kinds.get(name, "")] if self._kinds else []),
                Text(format_bar(robot), style=colour),
                phrases.stop_of(robot, robot.target, self._home) if robot.stops else "",
                f"{robot.share:.0%}" if robot.stops else "",
                f"{robot.distance:.1f} m" if robot.activity is not Activity.DONE and robot.stops else "",
                Text(doing, style=style),
                f"{waited:.1f} s" if waited else "",
            )
        parts: list[RenderableType] = [Text(self._headline(), style="bold")]
        if len(progress.order) > ROWS:
            parts.append(Text(self._totals()))
        return Group(*parts, table) if shown else Group(*parts)

    def _robots_to_show(self) -> list[str]:
        """Return the robots that get a row: all of a small fleet, of a large one the first that need attention."""
        order = self.progress.order
        return [*(order if len(order) <= ROWS else filter(self._needs_attention, order))][:ROWS]

    def _needs_attention(self, name: str) -> bool:
        robot = self.progress.robot(name)
        if self.progress.phase is Phase.WAITING:
            return False
        away = self._describe_absence(name) is not None
        return away or robot.activity is Activity.BLOCKED or bool(robot.unreachable) or self.progress.waits(name) > LONG

    def _describe_absence(self, name: str) -> Liveness | None:
        """Return how a robot is missed, None for one that is there or need not be: it is done, or the run is over."""
        heard = self.progress.radio_freshness(name)
        if heard is Liveness.ALIVE or self._is_done(name):
            return None
        return heard if self.progress.phase is not Phase.OVER or heard is Liveness.LOST else None

    def _totals(self) -> str:
        """Return how many robots do what."""
        doing = Counter(self._describe_activity(name, self.progress.robot(name))[2] for name in self.progress.order)
        needy = sum(map(self._needs_attention, self.progress.order))
        told = ", ".join(phrases.count_words(count, word) for word, count in doing.most_common())
        more = f" ({ROWS} shown)" if needy > ROWS else ""
        attention = f"; {needy} need{'s' if needy == 1 else ''} attention{more}" if needy else ""
        return f"{len(self.progress.order)} robots: {told}{attention}"

    def line(self) -> str:
        """Return the progress as one plain line."""
        progress = self.progress
        if len(progress.order) > ROWS:
            needy = [
                f"{name} {self._describe_activity(name, progress.robot(name))[0]}" for name in self._robots_to_show()
            ]
            return f"{self._headline()}: {self._totals()}{': ' if needy else ''}{', '.join(needy)}"
        each = ", ".join(f"{name} {phrases.lane_label(progress.robot(name), self._home)}" for name in progress.order)
        return f"{self._headline()}{': ' if each else ''}{each}"

    def _headline(self) -> str:
        progress = self.progress
        if progress.run < 0:
            return "waiting for the world"
        factor = f", {self._factor:.1f} x real time" if self._factor is not None else ""
        ticks = [robot.tick for robot in progress.robots.values()]  # a robot's message may be newer than the world's
        now = max(progress.time, progress.seconds(max(ticks, default=0)))
        pool = f", {progress.pool.done} of {progress.pool.given} pool targets done" if progress.pool else ""
        held = " for `swarm go`" if self._held and progress.phase is Phase.WAITING else ""
        return f"{now:6.1f} s  {progress.phase.value}{held}, {progress.way:4.0%} of the way{pool}{factor}"

    def _describe_activity(self, name: str, robot: RobotProgress) -> tuple[str, str, str]:
        """Return what a robot does, the style of it, and the word under which it is counted."""
        if (away := self._describe_absence(name)) is not None:
            if self.progress.phase is Phase.WAITING:
                return "starts", "dim", "starts"
            word = "silent" if away is Liveness.STALE else away.value
            return word, "bold red", word
        word = phrases.activity_word(robot.activity)
        waits = self.progress.waits(name)
        if waits:
            return f"{word} {waits:.0f} s", "yellow", word
        return word, "dim" if robot.activity is Activity.DONE else "", word

    def _find_news(self) -> list[tuple[float, str]]:
        """Return the time [s] and words of what is not printed yet: changes of phase, and stops of a small fleet."""
        progress = self.progress
        said: list[tuple[float, str]] = []
        if progress.run >= 0 and self._phase_told != (progress.run, progress.phase):
            self._phase_told = (progress.run, progress.phase)
            said.append((progress.time, progress.phase.value))
        for name, robot in progress.robots.items() if len(progress.order) <= ROWS else ():
            mission = (progress.run, robot.assignment)
            of, before = self._told.get(name, (mission, 0))
            if of != mission:
                before = 0
            if robot.reached_count > before:
                self._told[name] = (mission, robot.reached_count)
                ticks = sorted((tick, stop) for stop, tick in enumerate(robot.reached_at) if tick is not None)
                said += [
                    (
                        progress.seconds(tick),
                        f"{name} reached {phrases.stop_of(robot, stop, self._home)} ({rank} of {robot.stops})",
                    )
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


def print_wrapped(console: Console, text: str) -> None:
    """Print lines of words. A terminal gets them wrapped between words, so that an address stays in one piece."""
    if console.is_terminal:
        text = "\n".join(map(TextWrapper(console.width, **WRAPPED).fill, text.splitlines()))
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def format_bar(robot: RobotProgress) -> str:
    """Return a robot's stops as text: ``#`` reached, ``>`` under way, ``x`` given up, ``.`` to come.

    >>> format_bar(RobotProgress(reached_at=(10, 90, None, None), target=2))
    '##>.'
    """
    if robot.stops > 24:
        return f"{robot.reached_count}/{robot.stops}"
    marks = dict.fromkeys(robot.unreachable, "x") | {robot.target: ">"}
    return "".join("#" if tick is not None else marks.get(stop, ".") for stop, tick in enumerate(robot.reached_at))
