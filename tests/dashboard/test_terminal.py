import re
from io import StringIO
from typing import Any

import pytest
from msgspec.structs import replace
from rich.console import Console
from rich.text import Text

from dashboard.fold.progress import RobotProgress
from dashboard.terminal import ROWS, Terminal, format_bar, print_wrapped
from swarm.bus import Arrival, Presence
from swarm.messages import Activity, Event, Message, Phase, PoolCounts
from tests.dashboard.drawn import floor
from tests.dashboard.mixed import floor as mixed_floor
from tests.dashboard.rehearsal import RATE, Rehearsal
from tests.messages.made import broadcast, clock, state


class Wall:
    """A wall clock that stands where it is put."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Screen(Terminal):
    """A terminal that writes into a text."""

    def __init__(self, *messages: object, on_terminal: bool = False, **options: Any) -> None:  # noqa: ANN401
        self.wall, self.out = Wall(), StringIO()
        console = Console(file=self.out, force_terminal=on_terminal, width=100, no_color=True)
        super().__init__(console, **{"clock": self.wall} | options)
        self.hear(*messages)

    def hear(self, *messages: object) -> None:
        for message in messages:
            self.take(message)
            self.refresh()

    @property
    def text(self) -> str:
        return self.out.getvalue()

    @property
    def table(self) -> str:
        """The table as it is now."""
        console = Console(file=(out := StringIO()), width=100)
        console.print(self.renderable())
        return out.getvalue()


def played(screen: Screen, rehearsal: Rehearsal, factor: float) -> Screen:
    with screen:
        for tick in range(rehearsal.ticks + 1):
            for topic, message, _ in rehearsal.messages(tick):
                screen.take(Arrival(topic, {}, message))
            screen.wall.now += 1 / RATE / factor
            screen.refresh()
    return screen


def test_without_a_terminal_there_are_plain_lines() -> None:
    rehearsal = Rehearsal(2)
    text = played(Screen(), rehearsal, factor=2.0).text
    lines = text.splitlines()
    assert sum("reached" in line for line in lines) == 2 * 4
    assert "r1 reached home (4 of 4)" in text
    regular = [line for line in lines if "of the way" in line]
    seconds = rehearsal.ticks / RATE / 2.0
    assert len(regular) == pytest.approx(seconds / 5.0, abs=2)
    assert regular[-1].endswith("100% of the way, 2.0 x real time: r1 done, r2 done")
    assert text.isascii()


def test_the_table_names_kinds_if_the_fleet_has_them() -> None:
    """They are told when the terminal begins, or by the map of the world."""
    first = tuple(message for _, message, _ in Rehearsal(2).messages(0))
    plain, told, heard = Screen(*first), Screen(*first, kinds={"r1": "cart"}), Screen(*first, mixed_floor())
    assert "robot reached target" in " ".join(plain.table.split())
    for part in ("robot kind reached target", "r1 cart >...", "r2 >..."):
        assert part in " ".join(told.table.split())
    assert "r2 cart" in " ".join(heard.table.split())
    heard.hear(floor(Rehearsal(2)))
    assert heard.table == plain.table
    told.start_again(1, home=True)
    told.hear(clock(run=1, robots=("r1", "r2")))
    assert "cart" not in told.table


def test_in_a_terminal_there_is_one_row_a_robot() -> None:
    rows = Text.from_ansi(played(Screen(on_terminal=True), Rehearsal(3), factor=20.0).text).plain.splitlines()[-4:]
    assert [row.split()[:1] for row in rows if row.strip()] == [["r1"], ["r2"], ["r3"]]
    assert all("####" in row and row.rstrip().endswith(" s") for row in rows if row.strip())


def test_who_is_silent_is_told_apart_from_who_is_gone() -> None:
    there = [Presence("robot", robot, "session", True) for robot in ("a", "b")]
    said = (clock(40), broadcast(40, activity=Activity.GIVE_WAY), clock(100))
    table = Screen(*said, *there, Presence("robot", "b", "session", False)).table
    assert "silent" in table
    assert "gone" in table


def test_who_waits_is_said_with_for_how_long() -> None:
    waits = [broadcast(tick, activity=Activity.GIVE_WAY) for tick in (40, 99)]
    assert "gives way 3 s" in Screen(clock(0), *waits, clock(100)).table


def test_a_large_fleet_is_summed_up() -> None:
    names = tuple(f"r{number}" for number in range(ROWS + 7))
    screen = Screen(clock(0, robots=names))
    assert f"{ROWS + 7} robots: {ROWS + 7} ready" in screen.table
    assert "r3" not in screen.table
    for tick, distance in ((40, 5.0), (2000, 2.0)):
        screen.take(clock(tick, robots=names))
        for name in names:
            activity = Activity.GIVE_WAY if name == "r3" else Activity.DRIVE
            screen.take(broadcast(tick, name, activity=activity, distance=distance))
    assert f"{ROWS + 7} robots: {ROWS + 6} driving, 1 giving way; 1 needs attention" in screen.table
    assert [word for word in screen.table.split() if word[:1] == "r" and word[1:].isdigit()] == ["r3"]
    assert screen.line().endswith("needs attention: r3 gives way 98 s")


def test_the_headline_says_how_far_the_pool_is() -> None:
    told = Screen(replace(clock(100), pool=PoolCounts(given=7, done=3, taken=2, waiting=2)))
    assert "running,   0% of the way, 3 of 7 pool targets done" in told.line()


def test_before_the_world_speaks_it_says_so() -> None:
    assert Screen().line() == "waiting for the world"


def test_a_restart_tells_the_stops_anew() -> None:
    screen = Screen()
    for run in (1, 2):
        screen.hear(clock(0, run=run), broadcast(9, run=run, reached=[True, False, False]))
    assert screen.text.count("a reached 1 (1 of 3)") == 2


def reached_in(screen: Screen) -> list[str]:
    return [line.split(maxsplit=2)[2] for line in screen.text.splitlines() if "reached" in line]


def test_the_stops_of_each_order_are_told() -> None:
    said = ((20, 0, [True, True, False]), (40, 1, [False, False]), (60, 1, [True, False]), (80, 1, [True, True]))
    states = [state(tick, assignment=assignment, reached=reached) for tick, assignment, reached in said]
    stops = ["1 (1 of 3)", "2 (2 of 3)", "1 (1 of 2)", "2 (2 of 2)"]
    assert reached_in(Screen(clock(0), *states)) == [f"a reached {stop}" for stop in stops]


# fmt: off
LAST = {  # the scenario returns home, number of the assignment: the name of the last stop
    "of the scenario":        (True,  0, "home"),
    "of a scenario that stays": (False, 0, "2"),
    "of an order":            (True,  1, "2"),
}
# fmt: on


@pytest.mark.parametrize("name", LAST)
def test_only_the_last_stop_of_a_scenario_that_returns_is_home(name: str) -> None:
    home, assignment, expected = LAST[name]
    screen = Screen(clock(0), state(20, assignment=assignment, reached=[True, False], target=1), home=home)
    assert screen.line().endswith(f"a {'home' if expected == 'home' else 'to 2'}, b ready")
    screen.hear(state(40, assignment=assignment, reached=[True, True], target=2))
    assert reached_in(screen)[1].endswith(f"a reached {expected} (2 of 2)")


def event(kind: str, text: str = "", robot: str | None = "a", tick: int = 50) -> Event:
    return Event(run=1, tick=tick, time=tick / 20, robot=robot, kind=kind, text=text)


DONE = state(40, activity=Activity.DONE, reached=[True] * 3, target=3)
# fmt: off
SAID: dict[str, tuple[list[Message], list[str]]] = {  # what is heard -> the lines of trouble
    "a contact":               ([event("contact", "touches wall")],                       ["2.5 s  a touches wall"]),
    "a contact told twice":    ([event("contact", "touches wall")] * 2,                   ["2.5 s  a touches wall"]),
    "two contacts":            ([event("contact", "touches wall", tick=tick) for tick in (20, 30)],
                                ["1.0 s  a touches wall", "1.5 s  a touches wall"]),
    "two robots that touch":   ([event("contact", "touches robot b"), event("contact", "touches robot a", "b")],
                                ["2.5 s  a touches robot b"]),
    "three robots that touch": ([event("contact", f"touches robot {b}", a) for a, b in ("ab", "ba", "bc", "cb")],
                                ["2.5 s  a touches robot b", "2.5 s  b touches robot c"]),
    "they touch once more":    ([event("contact", "touches robot b", tick=20), event("contact", "touches robot a", "b", tick=50)],
                                ["1.0 s  a touches robot b", "2.5 s  b touches robot a"]),
    "who is gone":             ([event("gone", "x")],
                                ["2.5 s  a is gone: its process has ended; it stands until it is started again"]),
    "who is gone when done":   ([DONE, event("gone", "x"), event("left", "x"), event("lost", "x")], []),
    "who touches when done":   ([DONE, event("contact", "touches robot b")],              ["2.5 s  a touches robot b"]),
    "who is gone at the end":  ([clock(45, phase=Phase.OVER), event("gone", "x")],        []),
    "who is lost":             ([event("lost", "x")],
                                ["2.5 s  a is lost: it has been away for long, and the run may end without it"]),
    "no way to a stop":        ([event("unreachable", "gives up target 2: no path leads there")],
                                ["2.5 s  a gives up target 2: no path leads there"]),
    "no way for any":          ([event("unsolvable", "no way exists for a, b to reach their targets together")],
                                ["2.5 s  a says that no way exists for a, b to reach their targets together"]),
    "a body that is silent":   ([event("body_silent", "has reported no body for 0.25 s"), event("body_back", "reports its body again")],
                                ["2.5 s  a has reported no body for 0.25 s", "2.5 s  a reports its body again"]),
    "a refused change":        ([event("edit_refused", "outside", None)],
                                ["2.5 s  a change of the floor was refused: outside"]),
    "what needs no attention": ([event("joint_plan", "made a joint plan"), event("reached", "is at target 1")], []),
}
# fmt: on


@pytest.mark.parametrize("quiet", [False, True])
@pytest.mark.parametrize("on_terminal", [False, True])
@pytest.mark.parametrize("name", SAID)
def test_trouble_is_said_once_in_words_whatever_else_is_shown(name: str, on_terminal: bool, quiet: bool) -> None:
    heard, expected = SAID[name]
    with Screen(on_terminal=on_terminal, quiet=quiet) as screen:
        screen.hear(clock(0), *heard)
    lines = [line.strip() for line in Text.from_ansi(screen.text).plain.splitlines()]
    assert [line for line in lines if re.match(r"[\d.]+ s  [abc] ", line) and "reached" not in line] == expected
    assert not quiet or lines == expected, "quiet prints nothing else"


def test_what_the_launcher_has_told_is_not_told_again() -> None:
    screen = Screen(clock(0), quiet=True)
    screen.explain(["a"], ["gone", "lost"])
    told = ((20, "gone"), (30, "back"), (40, "gone"), (60, "lost"))
    screen.hear(*(event(kind, "is back", tick=tick) for tick, kind in told), event("gone", robot="b", tick=80))
    assert [line.split(";")[0].strip() for line in screen.text.splitlines()] == [
        "1.5 s  a is back",
        "2.0 s  a is gone: its process has ended",
        "4.0 s  b is gone: its process has ended",
    ]


def test_a_terminal_breaks_lines_between_words_only_and_a_file_never() -> None:
    address = "http://127.0.0.1:36657/?token=" + 60 * "x"
    for on_terminal, lines in (
        (True, ["watch it:", f"    {address}", "    or not"]),
        (False, [f"watch it: {address} or not"]),
    ):
        out = StringIO()
        print_wrapped(Console(file=out, force_terminal=on_terminal, width=80), f"watch it: {address} or not")
        assert out.getvalue().splitlines() == lines


def test_the_end_is_told_once() -> None:
    with Screen() as screen:
        screen.hear(clock(7, phase=Phase.OVER))
    assert sum(line.endswith("  over") for line in screen.text.splitlines()) == 1


@pytest.mark.parametrize(
    ("robot", "expected"),
    [
        (RobotProgress(), ""),
        (RobotProgress(reached_at=(1, None, None), target=1), "#>."),
        (RobotProgress(reached_at=(1, None, 9), target=3, unreachable=(1,)), "#x#"),
        (RobotProgress(reached_at=(1, *[None] * 40), target=1), "1/41"),
    ],
)
def test_bar(robot: RobotProgress, expected: str) -> None:
    assert format_bar(robot) == expected


def test_a_fleet_that_waits_for_go_says_so_once_and_again_when_something_changes() -> None:
    screen = Screen(held=True)
    for count, message in enumerate((clock(0, phase=Phase.WAITING), state(0)), start=1):
        screen.take(message)
        for _ in range(30):
            screen.wall.now += 1.0
            screen.refresh()
        assert screen.text.count("waiting for `swarm go`") == count


@pytest.mark.parametrize("kind", ["order", "edit", "stop", "go_on", "home", "cancel", "cancelled", "pool"])
@pytest.mark.parametrize("quiet", [False, True])
def test_what_somebody_asked_for_is_in_the_log_unless_only_trouble_is(kind: str, quiet: bool) -> None:
    robot = None if kind in {"edit", "pool"} else "a"
    screen = Screen(clock(20), event(kind, "was asked", robot), quiet=quiet)
    assert (f"{robot or kind}: was asked" in screen.text) is not quiet
