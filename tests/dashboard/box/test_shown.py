"""Which frames the box shows of what it hears, and when."""

from collections.abc import Mapping
from typing import Any, cast

import pytest

from dashboard.box import frames as telling
from dashboard.box.process import OVERVIEW_EVERY, Page
from dashboard.box.server import Server
from dashboard.fleet_listener import FleetListener
from dashboard.fold.overlays import DETAILED
from swarm.bus import Link
from swarm.messages import CLOCK, EVENTS, MAP, PLAN, TRUTH, Message
from tests.conftest import MakeBus
from tests.dashboard.drawn import floor
from tests.dashboard.rehearsal import RATE, Rehearsal
from tests.messages.made import clock, event, truth


class Shown:
    """Keeps what would be shown."""

    def __init__(self) -> None:
        self.selection: frozenset[str] = frozenset()
        self.is_watched = False
        self.frames: dict[str, Any] = {}

    def show(self, frames: Mapping[str, object]) -> None:
        self.frames |= frames


@pytest.fixture
def shown() -> Shown:
    return Shown()


@pytest.fixture
def page(make_bus: MakeBus, shown: Shown) -> Page:
    return Page(make_bus(), cast("Server", shown))


def test_only_what_is_new_is_shown(page: Page, shown: Shown) -> None:
    assert not page.has_new_poses
    first = floor(Rehearsal(1))
    for message in (first, clock(5), truth(6), event(6)):
        page.take(message)
    assert page.has_new_poses
    page.show()
    assert set(shown.frames) == {MAP.key, CLOCK.key, TRUTH.key, EVENTS.key, PLAN.key}
    assert (shown.frames[MAP.key], shown.frames[TRUTH.key]) == (first, truth(6))
    shown.frames.clear()
    page.take(truth(5))
    page.show()
    assert (page.has_new_poses, shown.frames) == (False, {})


def test_the_overview_comes_less_often_and_says_whether_the_box_is_connected(page: Page, shown: Shown) -> None:
    page.take(clock(5))
    page.take(Link(up=False))
    for number in range(1, OVERVIEW_EVERY + 1):
        page.show()
        assert (telling.OVERVIEW in shown.frames) is (number == OVERVIEW_EVERY)
    overview = shown.frames.pop(telling.OVERVIEW)()
    assert (overview.time, overview.link) == (0.25, False)
    page.show(last=True)
    assert telling.OVERVIEW in shown.frames


@pytest.mark.parametrize(
    ("selected", "plans", "rules"), [({"r2"}, ["r1"], ["r2"]), ({"nobody"}, [], []), (set(), [], None)]
)
def test_joint_plans_and_rules_are_those_of_selection(
    page: Page, shown: Shown, selected: set[str], plans: list[str], rules: list[str] | None
) -> None:
    """Robot r1 drives to its second stop, and r2 to its first, by a joint plan."""
    rehearsal = Rehearsal(3)
    messages: list[Message] = [floor(rehearsal)]
    messages += [message for tick in range(10 * RATE, 11 * RATE + 1) for _, message, _ in rehearsal.messages(tick)]
    for message in messages:
        page.take(message)
    shown.selection = frozenset(selected)
    page.show(last=True)
    assert [plan.leader for plan in shown.frames[telling.JOINT]] == plans
    assert all("r2" in plan.ways for plan in shown.frames[telling.JOINT])
    assert shown.frames[telling.LEARNED] is None, "the floor was given"
    assert (list(shown.frames[telling.RULES]) if telling.RULES in shown.frames else None) == rules


def test_where_robots_learn_the_floor_it_is_shown(page: Page, shown: Shown) -> None:
    rehearsal = Rehearsal(2)
    for message in (floor(rehearsal, known=False), rehearsal.clock(0), rehearsal.truth(0)):
        page.take(message)
    shown.selection = frozenset({"r1"})
    page.show(last=True)
    assert shown.frames[telling.LEARNED].cells == []
    assert shown.frames[telling.JOINT] == []


@pytest.mark.parametrize(
    ("robots", "watched", "selected", "heard"),
    [
        (3, True, set(), {"r1", "r2", "r3"}),
        (3, False, set(), set()),
        (DETAILED + 1, True, set(), set()),
        (DETAILED + 1, True, {"r2"}, {f"r{number}" for number in range(1, DETAILED + 1)}),
    ],
)
def test_of_a_few_robots_all_joint_plans_are_heard_while_a_browser_looks(
    page: Page,
    shown: Shown,
    monkeypatch: pytest.MonkeyPatch,
    robots: int,
    watched: bool,
    selected: set[str],
    heard: set[str],
) -> None:
    """In one plan are the robots that drive to their first stop by it; the last of nine is in another one."""
    rehearsal, second = Rehearsal(robots), 11 * RATE
    for message in (floor(rehearsal), rehearsal.clock(second), rehearsal.truth(second)):
        page.take(message)
    turned: list[frozenset[str]] = []
    monkeypatch.setattr(FleetListener, "turn_to", lambda listener, names: turned.append(names))
    shown.is_watched, shown.selection = watched, frozenset(selected)
    page.show(last=True)
    assert turned == [heard]
