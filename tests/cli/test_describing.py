"""What `swarm status ROBOT`, `logs`, `echo` and `order --wait` say, from messages that a table names; no bus."""

from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from swarm.bridge.errand import OrderEnd, OrderErrand, OrderOutcome
from swarm.cli.look import logs
from swarm.cli.look.silence import why
from swarm.cli.look.status import format_robot, format_status, robot_as_json
from swarm.cli.steer.order_progress import format_order_progress
from swarm.errors import ConfigError
from swarm.messages import (
    Account,
    Activity,
    Clock,
    Event,
    Liveness,
    Message,
    Order,
    Phase,
    RobotStatus,
    Seen,
    State,
    Status,
)

DRIVES = State(
    robot="r1", run=1, tick=618, activity=Activity.DRIVE, target=1, reached=[True, False, False], unreachable=[],
    distance=7.41, replans=2, assignment=3,
)  # fmt: skip
NOTHING = Account(
    targets=3, reached=[31.2, None, None], laps=0, path_length=12.34, shortest_length=None, waiting=4.5,
    waits_for={"r2": 3.5, "r4": 1.0}, replans=2, contacts=0, struck=0, stalled=0, unreachable=[], standing=6.0,
)  # fmt: skip


def event(text: str, *, run: int = 1, time: float = 7.0, robot: str | None = "r1", kind: str = "told") -> Event:
    return Event(run=run, tick=round(20 * time), time=time, robot=robot, kind=kind, text=text)


ROW = RobotStatus(
    robot="r1", liveness=Liveness.ALIVE, since=0.0, pose=(10.25, 8.61, 0.0), state=DRIVES, waits=["r2"], event=None,
    account=NOTHING, why="r2 (lost) stands on target 2", mission="order morning update 0",
    stops=[(10.0, 2.0), (16.5, 11.5), (2.0, 2.0)], home=True,
)  # fmt: skip
STATUS = Status(
    scenario="paper", run=1, tick=618, time=30.9, phase=Phase.RUNNING, complete=False, reason="", edits=0,
    robots=[ROW, replace(ROW, robot="r2", state=replace(DRIVES, robot="r2"))],
    events=[event("is at home", run=0, time=143.0), event("is at target 1"), event("waits", robot="r2")],
)  # fmt: skip


def test_one_robot_is_described_with_its_targets_its_waiting_and_its_events_of_this_run() -> None:
    assert format_robot(STATUS, "r1").splitlines() == [
        "r1 of paper: running at 30.9 s, run 1",
        "",
        "is         alive",
        "pose       10.25, 8.61 m, yaw 0 deg",
        "does       drive, target 2 of 3, 7.4 m left",
        "waits for  r2 (lost) stands on target 2",
        "has        order morning update 0, number 3",
        "target 1   10.00, 2.00 m  reached at 31.2 s",
        "target 2   16.50, 11.50 m  next",
        "home       2.00, 2.00 m  to come",
        "drove      12.3 m; paths planned after the first: 2",
        "waited     4.5 s: r2 3.5 s, r4 1.0 s; stood 6.0 s in all",
        "contacts   0",
        "",
        "last events of this run:",
        "     7.0 s  is at target 1",
    ]


# fmt: off
ODD: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {  # fields of the row and of its account: a line
    "gone":              ({"liveness": Liveness.GONE, "since": 12.0}, {}, "is         gone since 12.0 s"),
    "given up":          ({}, {"unreachable": [1]}, "target 2   16.50, 11.50 m  given up: no way leads there"),
    "more than told":    ({}, {"reached": [None] * 30}, "           and 27 more"),
    "of a patrol":       ({}, {"laps": 4}, "laps       4"),
    "stalled":           ({}, {"stalled": 2}, "stalled    2 times"),
    "touched":           ({}, {"contacts": 3, "struck": 1}, "contacts   3, 1 of them while it stood"),
    "the scenario's":    ({"state": replace(DRIVES, assignment=0), "mission": "the scenario's targets"}, {},
                          "has        the scenario's targets"),
    "done":              ({"state": replace(DRIVES, activity=Activity.DONE, target=3)}, {}, "does       done"),
    "waits for nobody":  ({"why": "", "waits": []}, {}, "waits for  nobody"),
}
# fmt: on


@pytest.mark.parametrize("name", ODD)
def test_what_is_odd_about_a_robot_has_its_line(name: str) -> None:
    fields, measured, line = ODD[name]
    row = replace(ROW, account=replace(NOTHING, **measured), **fields)
    assert line in format_robot(replace(STATUS, robots=[row]), "r1").splitlines()


def test_as_json_one_robot_has_all_that_the_world_tells_of_it() -> None:
    told = msgspec.json.decode(msgspec.json.encode(robot_as_json(STATUS, "r1")))
    assert (told["robot"], told["run"], told["phase"]) == ("r1", 1, "running")
    assert told["account"]["waits_for"] == {"r2": 3.5, "r4": 1.0}
    assert [one["text"] for one in told["events"]] == ["is at target 1"]
    assert set(RobotStatus.__struct_fields__) <= told.keys()


@pytest.mark.parametrize("tell", [format_robot, robot_as_json])
def test_a_robot_that_is_none_is_refused_with_what_may_be_meant(tell: Any) -> None:  # noqa: ANN401
    with pytest.raises(ConfigError, match="status: expected a robot of the fleet, got 'r11'; did you mean 'r1'"):
        tell(STATUS, "r11")


def test_the_table_has_a_line_for_each_robot() -> None:
    assert [line.split()[0] for line in format_status(STATUS).splitlines()] == ["paper:", "robot", "r1", "r2"]


def test_a_line_of_the_log_has_run_time_and_robot() -> None:
    assert logs.format_event(event("is at target 1", run=2, time=121.75)) == "run 2    121.75 s  r1   is at target 1"
    assert logs.format_event(event("the run is paused", robot=None)) == "run 1      7.00 s  -    the run is paused"


# --- why nothing comes ---

CLOCK = Clock(run=1, tick=618, time=30.9, phase=Phase.RUNNING, robots=["r1", "r2"], present=["r1", "r2"])
WAITING = replace(CLOCK, phase=Phase.WAITING)
# fmt: off
SILENT = {  # key, clock: what is said
    "of no topic":            ("nokey", CLOCK, "it is in no row of the table of topics"),
    "a wrong letter":         ("world/evnets", CLOCK, "it is in no row of the table of topics; did you mean 'world/events'?"),
    "the last part only":     ("state", CLOCK, "it is in no row of the table of topics; did you mean 'robot/r1/state'?"),
    "too short":              ("r2/sense", CLOCK, "it is in no row of the table of topics; did you mean 'robot/r2/sense'?"),
    "of no robot":            ("robot/r9/state", CLOCK, "the fleet has no robot 'r9'; known: r1, r2"),
    "as the table has it":    ("robot/{robot}/plan", CLOCK, "the fleet has no robot '{robot}'; known: r1, r2"),
    "a request":              ("robot/r1/order", CLOCK, "it takes requests, and nobody publishes on it"),
    "nobody's":               ("robot/r9/*/x", CLOCK, "it stands for no key of the table of topics"),
    "of a fleet that waits":  ("robot/r1/sense", WAITING, "the fleet waits, for its robots or for `swarm go`"),
    "of a run that is paused": ("robot/*/sense", replace(CLOCK, phase=Phase.PAUSED), "the run is paused"),
    "on change":              ("world/event", CLOCK, "it comes on change only"),
    "late":                   ("robot/*/sense", CLOCK, "nobody has sent one"),
    "without a world":        ("world/truth", None, "the fleet has no world that answers"),
    "without world or row":   ("evnt", None, "it is in no row of the table of topics"),
}
# fmt: on


@pytest.mark.parametrize("name", SILENT)
def test_it_is_said_why_nothing_comes_on_a_key(name: str) -> None:
    key, clock, said = SILENT[name]
    assert why(key, clock) == said


# --- order --wait ---

ORDER = Order(id="morning", targets=[(10.0, 2.0), (16.5, 11.5)], home=True)
DONE = replace(DRIVES, activity=Activity.DONE, target=3, reached=[True, True, True])
LOST = replace(CLOCK, presence={"r1": Seen(Liveness.LOST, 20.0)})
REPLACED = event(
    "order morning update 0 (number 3): 2 left; superseded by order b update 0 (number 4)", kind="superseded"
)
REACHED = replace(STATUS, robots=[replace(ROW, account=replace(NOTHING, reached=[31.2, 40.0, 51.5]))])


def wait() -> OrderErrand:
    return OrderErrand("r1", ORDER, 3, run=1)


# fmt: off
ENDS: dict[str, tuple[Message, OrderEnd | None]] = {  # the end that one message is
    "on its way":            (DRIVES, None),
    "all reached, it says":  (DONE, None),
    "measured":              (REACHED, OrderEnd(OrderOutcome.DONE, "r1: order morning is done: 3 targets reached, the last at 51.5 s")),
    "not measured":          (STATUS, None),
    "another's are":         (replace(REACHED, robots=[replace(REACHED.robots[0], robot="r2")]), None),
    "those after it are":    (replace(REACHED, robots=[replace(REACHED.robots[0], state=replace(DRIVES, assignment=4))]), None),
    "in the run before":     (replace(REACHED, run=0), None),
    "given up":              (replace(DONE, reached=[True, False, False], unreachable=[1, 2]),
                              OrderEnd(OrderOutcome.GIVEN_UP, "r1: order morning is not done: it has given up target 2, home")),
    "replaced":              (REPLACED, OrderEnd(OrderOutcome.REPLACED, "r1: order morning is not done: 2 left; superseded by order b update 0 (number 4)")),
    "cancelled":             (replace(REPLACED, kind="cancelled", text="order morning update 0 (number 3): 2 left; cancelled"),
                              OrderEnd(OrderOutcome.CANCELLED, "r1: order morning is not done: 2 left; cancelled")),
    "it replaces":           (replace(REPLACED, text="the scenario's targets (number 0): 4 left; superseded by order morning update 0 (number 3)"), None),
    "another's replaced":    (replace(REPLACED, robot="r2"), None),
    "told something":        (replace(REPLACED, kind="reached"), None),
    "lost":                  (LOST, OrderEnd(OrderOutcome.LOST, "r1: order morning is not done: r1 is lost; it goes on if a process takes its place")),
    "gone":                  (replace(LOST, presence={"r1": Seen(Liveness.GONE, 20.0)}), None),
    "another is lost":       (replace(LOST, presence={"r2": Seen(Liveness.LOST, 20.0)}), None),
    "over":                  (replace(CLOCK, phase=Phase.OVER), OrderEnd(OrderOutcome.OVER, "r1: order morning is not done: the run is over")),
    "started again":         (replace(CLOCK, run=2), OrderEnd(OrderOutcome.AGAIN, "r1: order morning is not done: the run was started again, without it")),
    "the clock":             (CLOCK, None),
}
# fmt: on


@pytest.mark.parametrize("name", ENDS)
def test_an_order_ends_with_what_ends_it(name: str) -> None:
    message, end = ENDS[name]
    assert wait().apply_message(message) == end


def test_the_world_is_asked_when_the_robot_says_it_has_nothing_left_of_the_order() -> None:
    one = wait()
    assert (one.apply_message(DRIVES), one.asks, one.end_of_lost_order()) == (None, False, None)
    assert (one.apply_message(DONE), one.asks, one.end_of_lost_order()) == (None, True, None)
    other = replace(DRIVES, assignment=4)
    assert (one.apply_message(other), one.asks, one.end_of_lost_order()) == (
        None,
        True,
        OrderEnd(OrderOutcome.DONE, "r1: order morning is done"),
    )


# fmt: off
LINES: dict[str, tuple[list[Message], str]] = {
    "nothing yet":   ([], ""),
    "not taken yet": ([replace(DRIVES, assignment=2)], ""),
    "drives":        ([DRIVES], "r1: drive, target 2 (2 of 3), 7.4 m left"),
    "home":          ([replace(DRIVES, target=2)], "r1: drive, home (3 of 3), 7.4 m left"),
    "one target":    ([replace(DRIVES, target=0, reached=[False])], "r1: drive, home, 7.4 m left"),
    "waits":         ([replace(DRIVES, activity=Activity.GIVE_WAY, waits=["r2", "r3"])],
                      "r1: give_way, target 2 (2 of 3), 7.4 m left, waits for r2, r3"),
    "stopped":       ([replace(DRIVES, activity=Activity.STOPPED)],
                      "r1: stopped, target 2 (2 of 3), 7.4 m left; `swarm go-on r1` ends that"),
    "fleet waits":   ([DRIVES, WAITING], "r1: the fleet waits, for its robots or for `swarm go`"),
    "gone":          ([DRIVES, replace(LOST, presence={"r1": Seen(Liveness.GONE, 20.0)})], "r1: is gone"),
}
# fmt: on


@pytest.mark.parametrize("name", LINES)
def test_the_progress_of_an_order_is_a_line(name: str) -> None:
    messages, expected = LINES[name]
    one = wait()
    assert [one.apply_message(message) for message in messages] == [None] * len(messages)
    assert format_order_progress(one) == expected
