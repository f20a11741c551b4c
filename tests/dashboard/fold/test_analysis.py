"""An account is written and read to the last digit, and what an analysis makes of it."""

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from dashboard.fold import analysis
from dashboard.fold.account import Saved, read, saved, written
from swarm.bus.codec import encode
from swarm.errors import ConfigError
from swarm.messages import STATUS, Account, Activity, Liveness, Phase, RobotStatus, State, Status
from tests.messages.examples import example_of
from world.tasks.orders import MOST_TARGETS
from world.views.status import STOPS

NOTHING = Account(
    targets=2, reached=[None, None], laps=0, path_length=0.0, shortest_length=None, waiting=0.0, waits_for={},
    replans=0, contacts=0, struck=0, stalled=0, unreachable=[],
)  # fmt: skip
DONE = replace(NOTHING, reached=[4.05, 9.0], path_length=12.0, shortest_length=10.0, waiting=1.5, waits_for={"r2": 1.5})
HALF = replace(NOTHING, reached=[3.0, None], path_length=5.0, shortest_length=9.0, contacts=2, replans=3, struck=1)
ROUND = replace(DONE, laps=2)


def account(robots: Mapping[str, Account], phase: Phase = Phase.OVER, **fields: object) -> Saved:
    plain = Saved(
        scenario="small", world="here", run=0, time=20.0, phase=phase, complete=False, reason="", robots=dict(robots),
        contacts={"robot": 1, "wall": 0, "obstacle": 0}, clearance_min=0.25, heard={"world/truth": 7}, lost={},
    )  # fmt: skip
    return replace(plain, **fields)


def status_of(robots: Mapping[str, Account | None]) -> Status:
    status = example_of(Status)
    assert isinstance(status, Status)
    rows = [replace(status.robots[0], robot=name, account=one) for name, one in robots.items()]
    return replace(status, robots=rows)


numbers = st.floats(0.0, 1e9)
measured = st.builds(
    Account, targets=st.integers(0, 9), reached=st.lists(st.none() | numbers), laps=st.integers(0, 9),
    path_length=numbers, shortest_length=st.none() | numbers, waiting=numbers,
    waits_for=st.dictionaries(st.sampled_from(["r1", "r2"]), numbers), replans=st.integers(0, 9),
    contacts=st.integers(0, 9), struck=st.integers(0, 9), stalled=st.integers(0, 9),
    unreachable=st.lists(st.integers(0, 9)),
)  # fmt: skip


@given(st.dictionaries(st.sampled_from(["r1", "r2", "r3"]), measured), numbers, st.text())
def test_what_is_written_is_read_to_the_last_digit(robots: dict[str, Account], time: float, reason: str) -> None:
    one = account(robots, time=time, reason=reason)
    text = written(one)
    assert read(text) == one
    assert text.isascii(), "a viewer without a screen crashes at a glyph that its font lacks"


def test_the_account_of_a_status_is_what_the_world_has_measured() -> None:
    found = saved(status_of({"r1": DONE, "r2": HALF}), {"world/truth": 3}, {"world/truth": 1, "world/clock": 0})
    assert found is not None
    assert found.robots == {"r1": DONE, "r2": HALF}
    assert (found.heard, found.lost) == ({"world/truth": 3}, {"world/truth": 1})


def test_a_world_that_has_measured_nothing_gives_no_account() -> None:
    assert saved(status_of({"r1": DONE, "r2": None}), {}, {}) is None


# fmt: off
UNREADABLE = {
    "no JSON":         ("{", "expected an account of this version"),
    "another version": (written(account({"r1": DONE})).replace('"version": 1', '"version": 2'), "version"),
    "a field less":    (written(account({})).replace('"reason": "", ', ""), "reason"),
    "a time before 0": (written(account({})).replace('"time": 20.0', '"time": -1.0'), "time"),
}
# fmt: on


@pytest.mark.parametrize("name", UNREADABLE)
def test_another_text_is_refused_in_a_sentence(name: str) -> None:
    text, reason = UNREADABLE[name]
    with pytest.raises(ConfigError, match=reason):
        read(text)


def test_the_total_is_that_of_the_robots() -> None:
    total = analysis.analysed(account({"r1": DONE, "r2": HALF}), True, "f")["total"]
    assert total == {
        "targets": 4, "reached": 3, "path_length": 17.0, "shortest_length": 19.0, "detour": 1.2, "waiting": 1.5,
        "replans": 3, "contacts": 1,
    }  # fmt: skip


# fmt: off
DETOURS: Mapping[str, tuple[Mapping[str, Account], float | None]] = {
    "of those that were everywhere":   ({"r1": DONE, "r2": HALF}, 1.2),
    "of nobody":                       ({"r2": HALF}, None),
    "not of laps, whose way is longer": ({"r1": ROUND}, None),
    "not without a shortest way":      ({"r1": replace(DONE, shortest_length=None)}, None),
    "weighed by length":               ({"r1": DONE, "r2": replace(DONE, path_length=30.0, shortest_length=30.0)}, 42 / 40),
}
# fmt: on


@pytest.mark.parametrize("name", DETOURS)
def test_the_way_against_the_shortest(name: str) -> None:
    robots, expected = DETOURS[name]
    assert analysis.analysed(account(robots), True, "f")["total"]["detour"] == pytest.approx(expected)


# fmt: off
NOTES = {
    "whole":     (Phase.OVER,    True,  None,        []),
    "unended":   (Phase.RUNNING, True,  None,        ["the recording ends before the run; the numbers are those of 20.0 s, without the shortest ways"]),
    "killed":    (Phase.RUNNING, False, None,        ["the recording is cut: its dashboard was killed; the numbers are those of 20.0 s, without the shortest ways"]),
    "cut":       (Phase.OVER,    False, None,        ["the recording is cut at its end, but it has the numbers of the whole run"]),
    "continued": (Phase.RUNNING, False, "run.2.rrd", ["was killed", "run.2.rrd goes on with this run"]),
}
# fmt: on


@pytest.mark.parametrize("name", NOTES)
def test_what_an_analysis_lacks_is_said(name: str) -> None:
    phase, whole, later, expected = NOTES[name]
    notes = analysis.analysed(account({"r1": HALF}, phase), whole, "f", later)["notes"]
    assert len(notes) == len(expected)
    assert all(part in note for note, part in zip(notes, expected, strict=True))


def test_the_table_has_a_row_for_each_robot_and_the_total() -> None:
    rows = analysis.table(analysis.analysed(account({"r1": DONE, "r2": HALF}), True, "f"))
    assert [list(row) for row in rows] == [
        ["robot", "targets at [s]", "way [m]", "shortest [m]", "ratio", "waited [s]", "for", "contacts", "replans"],
        ["r1", "4.0, 9.0", "12.0", "10.0", "1.20", "1.5", "r2 1.5", "0", "0"],
        ["r2", "3.0, -", "5.0", "9.0", "-", "0.0", "-", "2", "3"],
        ["total", "3 of 4", "17.0", "19.0", "1.20", "1.5", "", "1", "3"],
    ]
    patrol = analysis.table(analysis.analysed(account({"r1": ROUND}), True, "f"))
    assert [row[-1] for row in patrol] == ["laps", "2", ""]


def test_the_lines_say_the_end_the_contacts_and_the_losses() -> None:
    late = account({"r1": HALF}, reason="time limit of 20 s", lost={"world/truth": 2, "world/event": 1})
    assert analysis.lines(analysis.analysed(late, True, "f")) == [
        "small, run 0: not complete after 20.0 s: time limit of 20 s",
        "contacts: 1 robot, 0 wall, 0 obstacle; smallest gap 0.25 m",
        "messages to the dashboard: 7 heard, 3 lost (2 of world/truth, 1 of world/event)",
    ]
    calm = account({"r1": DONE}, Phase.PAUSED, clearance_min=None)
    first, _, *rest = analysis.lines(analysis.analysed(calm, True, "f"))
    assert first == "small, run 0: not over after 20.0 s"
    assert rest[0].endswith("smallest gap none")
    assert rest[1] == "messages to the dashboard: 7 heard, 0 lost"


def test_the_largest_status_of_a_thousand_robots_fits_its_message() -> None:
    """With every stop reached at an odd time, and a full list of robots waited for."""
    odd = 12345.600000000001
    most = replace(
        NOTHING, targets=MOST_TARGETS, reached=[odd] * MOST_TARGETS, path_length=odd, shortest_length=odd, waiting=odd,
        waits_for={f"r{n}": odd for n in range(981, 1001)},
    )  # fmt: skip
    said = State(
        robot="r1000", run=0, tick=9999999, activity=Activity.GIVE_WAY, target=0, reached=[False] * MOST_TARGETS,
        unreachable=[], distance=odd, replans=0,
    )  # fmt: skip
    row = RobotStatus(
        robot="r1000", liveness=Liveness.ALIVE, since=odd, pose=(odd, odd, 1.0), state=said, waits=["r999"],
        event=None, account=most, stops=[(odd, odd)] * STOPS, mission=f"order {'x' * 64} update 1",
    )  # fmt: skip
    status = replace(status_of({}), robots=[row] * 1000)
    assert len(encode(status, as_json=True)) < STATUS.limit
