import re
from io import StringIO

import pytest
from msgspec.structs import replace
from rich.console import Console
from rich.text import Text

from dashboard.fold.progress import RobotProgress
from dashboard.terminal import ROWS, Terminal, bar, tell
from swarm.bus import Arrival, Presence
from swarm.messages import RADIO, Activity, Event, Message, Phase, PoolCounts
from tests.dashboard.fold.test_progress import broadcast, clock, state
from tests.dashboard.rehearsal import RATE, Rehearsal


class Wall:
    """A wall clock that stands where it is put."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def arrival(message: Message) -> Arrival:
    return Arrival(RADIO, {}, message)  # the topic plays no part


def played(terminal: Terminal, wall: Wall, rehearsal: Rehearsal, factor: float) -> None:
    with terminal:
        for tick in range(rehearsal.ticks + 1):
            for _, message, _ in rehearsal.messages(tick):
                terminal.take(arrival(message))
            wall.now += 1 / RATE / factor
            terminal.refresh()


def test_without_a_terminal_there_are_plain_lines() -> None:
    out, wall, rehearsal = StringIO(), Wall(), Rehearsal(2)
    played(Terminal(Console(file=out, force_terminal=False, width=80), clock=wall), wall, rehearsal, factor=2.0)
    lines = out.getvalue().splitlines()
    assert sum("reached" in line for line in lines) == 2 * 4
    assert "r1 reached home (4 of 4)" in out.getvalue()
    regular = [line for line in lines if "of the way" in line]
    seconds = rehearsal.ticks / RATE / 2.0
    assert len(regular) == pytest.approx(seconds / 5.0, abs=2)
    assert regular[-1].endswith("100% of the way, 2.0 x real time: r1 done, r2 done")
    assert out.getvalue().isascii()


def test_in_a_terminal_there_is_one_row_a_robot() -> None:
    out, wall = StringIO(), Wall()
    console = Console(file=out, force_terminal=True, width=100)
    played(Terminal(console, clock=wall), wall, Rehearsal(3), factor=20.0)
    with console.capture() as capture:
        terminal = Terminal(console, clock=wall)
        terminal.take(arrival(clock(40)))
        terminal.take(arrival(broadcast(40, activity=Activity.GIVE_WAY)))
        terminal.take(arrival(clock(100)))
        terminal.take(Presence("robot", "a", "session", True))
        terminal.take(Presence("robot", "b", "session", True))
        terminal.take(Presence("robot", "b", "session", False))
        console.print(terminal.renderable())
    assert "silent" in capture.get()
    assert "gone" in capture.get()


def test_who_waits_is_said_with_for_how_long() -> None:
    console = Console(file=StringIO(), width=100)
    terminal = Terminal(console)
    for message in (
        clock(0),
        broadcast(40, activity=Activity.GIVE_WAY),
        broadcast(99, activity=Activity.GIVE_WAY),
        clock(100),
    ):
        terminal.take(arrival(message))
    with console.capture() as capture:
        console.print(terminal.renderable())
    assert "gives way 3 s" in capture.get()


def test_a_large_fleet_is_summed_up() -> None:
    console = Console(file=StringIO(), width=100)
    terminal = Terminal(console)
    terminal.take(arrival(clock(0, robots=tuple(f"r{number}" for number in range(ROWS + 7)))))
    with console.capture() as capture:
        console.print(terminal.renderable())
    assert f"{ROWS + 7} robots: {ROWS + 7} ready" in capture.get()
    assert "r3" not in capture.get()
    for tick in (40, 2000):
        terminal.take(arrival(clock(tick, robots=tuple(f"r{number}" for number in range(ROWS + 7)))))
        for number in range(ROWS + 7):
            waits = Activity.GIVE_WAY if number == 3 else Activity.DRIVE
            terminal.take(arrival(broadcast(tick, f"r{number}", activity=waits, distance=5.0 if tick == 40 else 2.0)))
    with console.capture() as capture:
        console.print(terminal.renderable())
    assert f"{ROWS + 7} robots: {ROWS + 6} driving, 1 giving way; 1 needs attention" in capture.get()
    assert [word for word in capture.get().split() if word[:1] == "r" and word[1:].isdigit()] == ["r3"]
    assert terminal.line().endswith("needs attention: r3 gives way 98 s")


def test_the_headline_says_how_far_the_pool_is() -> None:
    terminal = Terminal(Console(file=StringIO()), clock=Wall())
    terminal.take(arrival(replace(clock(100), pool=PoolCounts(given=7, done=3, taken=2, waiting=2))))
    assert "running,   0% of the way, 3 of 7 pool targets done" in terminal.line()


def test_before_the_world_speaks_it_says_so() -> None:
    assert Terminal(Console(file=StringIO())).line() == "waiting for the world"


def test_a_restart_tells_the_stops_anew() -> None:
    out, wall = StringIO(), Wall()
    terminal = Terminal(Console(file=out, width=80), clock=wall)
    for run in (1, 2):
        terminal.take(arrival(clock(0, run=run)))
        terminal.take(arrival(broadcast(9, run=run, reached=[True, False, False])))
        terminal.refresh()
    assert out.getvalue().count("a reached 1 (1 of 3)") == 2


def lines_of(out: StringIO) -> list[str]:
    return [line for line in out.getvalue().splitlines() if "reached" in line]


def test_the_stops_of_each_order_are_told() -> None:
    out, wall = StringIO(), Wall()
    terminal = Terminal(Console(file=out, width=80), clock=wall)
    terminal.take(arrival(clock(0)))
    for tick, assignment, reached in (
        (20, 0, [True, True, False]),
        (40, 1, [False, False]),
        (60, 1, [True, False]),
        (80, 1, [True, True]),
    ):
        terminal.take(arrival(state(tick, assignment=assignment, reached=reached)))
        terminal.refresh()
    assert [line.split(maxsplit=2)[2] for line in lines_of(out)] == [
        "a reached 1 (1 of 3)",
        "a reached 2 (2 of 3)",
        "a reached 1 (1 of 2)",
        "a reached 2 (2 of 2)",
    ]


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
    out, wall = StringIO(), Wall()
    terminal = Terminal(Console(file=out, width=80), home=home, clock=wall)
    terminal.take(arrival(clock(0)))
    terminal.take(arrival(state(20, assignment=assignment, reached=[True, False], target=1)))
    assert terminal.line().endswith(f"a {'home' if expected == 'home' else 'to 2'}, b ready")
    terminal.take(arrival(state(40, assignment=assignment, reached=[True, True], target=2)))
    terminal.refresh()
    assert lines_of(out)[1].endswith(f"a reached {expected} (2 of 2)")


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
    out = StringIO()
    console = Console(file=out, force_terminal=on_terminal, width=80, no_color=True)
    with Terminal(console, quiet=quiet, clock=Wall()) as terminal:
        for message in (clock(0), *heard):
            terminal.take(arrival(message))
            terminal.refresh()
    lines = [line.strip() for line in Text.from_ansi(out.getvalue()).plain.splitlines()]
    assert [line for line in lines if re.match(r"[\d.]+ s  [abc] ", line) and "reached" not in line] == expected
    assert not quiet or lines == expected, "quiet prints nothing else"


def test_what_the_launcher_has_told_is_not_told_again() -> None:
    out = StringIO()
    with Terminal(Console(file=out, width=80), quiet=True, clock=Wall()) as terminal:
        terminal.take(arrival(clock(0)))
        terminal.explain(["a"], ["gone", "lost"])
        for tick, kind in ((20, "gone"), (30, "back"), (40, "gone"), (60, "lost")):
            terminal.take(arrival(event(kind, "is back", tick=tick)))
        terminal.take(arrival(event("gone", robot="b", tick=80)))
    assert [line.split(";")[0].strip() for line in out.getvalue().splitlines()] == [
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
        tell(Console(file=out, force_terminal=on_terminal, width=80), f"watch it: {address} or not")
        assert out.getvalue().splitlines() == lines


def test_the_end_is_told_once() -> None:
    out, wall = StringIO(), Wall()
    with Terminal(Console(file=out, width=80), clock=wall) as terminal:
        terminal.take(arrival(clock(7, phase=Phase.OVER)))
        terminal.refresh()
    assert sum(line.endswith("  over") for line in out.getvalue().splitlines()) == 1


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
    assert bar(robot) == expected


def test_a_fleet_that_waits_for_go_says_so_once_and_again_when_something_changes() -> None:
    out, wall = StringIO(), Wall()
    terminal = Terminal(Console(file=out, force_terminal=False, width=80), held=True, clock=wall)
    waiting = clock(0, phase=Phase.WAITING)
    terminal.take(arrival(waiting))
    for _ in range(30):
        wall.now += 1.0
        terminal.refresh()
    assert out.getvalue().count("waiting for `swarm go`") == 1
    terminal.take(arrival(state(0, robot="a")))
    for _ in range(30):
        wall.now += 1.0
        terminal.refresh()
    assert out.getvalue().count("waiting for `swarm go`") == 2


@pytest.mark.parametrize("kind", ["order", "edit", "stop", "go_on", "home", "cancel", "cancelled", "pool"])
@pytest.mark.parametrize("quiet", [False, True])
def test_what_somebody_asked_for_is_in_the_log_unless_only_trouble_is(kind: str, quiet: bool) -> None:
    out = StringIO()
    terminal = Terminal(Console(file=out, force_terminal=False, width=80), quiet=quiet)
    terminal.take(arrival(clock(20)))
    robot = None if kind in {"edit", "pool"} else "a"
    terminal.take(arrival(Event(run=1, tick=20, time=1.0, robot=robot, kind=kind, text="was asked")))
    terminal.refresh()
    assert (f"{robot or kind}: was asked" in out.getvalue()) is not quiet
