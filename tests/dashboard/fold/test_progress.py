from typing import Any

import pytest

from dashboard.fold import phrases
from dashboard.fold.progress import EVENTS_KEPT, Progress, fold
from swarm.bus import Presence
from swarm.messages import Activity, Clock, Event, Liveness, Message, Phase
from tests.messages.made import broadcast, clock, event, state, truth


def folded(*messages: Message, progress: Progress | None = None) -> Progress:
    progress = progress or Progress()
    for message in messages:
        progress = fold(progress, message)
    return progress


def test_a_broadcast_says_where_a_robot_is_and_what_it_is_about() -> None:
    robot = folded(clock(), broadcast(4, target=1, distance=2.5, reached=[True, False, False])).robot("a")
    assert (robot.activity, robot.target, robot.distance) == (Activity.DRIVE, 1, 2.5)
    assert robot.reached_at == (4, None, None)
    assert (robot.stops, robot.reached_count) == (3, 1)


@pytest.mark.parametrize("new", [clock(0, run=2), truth(0, run=2), event(0, run=2)])
def test_a_restart_clears_everything_but_who_is_there(new: Message) -> None:
    before = folded(clock(10), broadcast(4, reached=[True, True, True]), event(5))
    after = fold(fold(before, Presence("robot", "a", "session", True)), new)
    assert (after.run, after.tick, after.share) == (2, 0, 0.0)
    assert after.robot("a").reached_at == ()
    assert after.events == ((new,) if isinstance(new, Event) else ())
    assert after.order == ("a", "b")
    assert after.tokens == {"a": frozenset({"session"})}


def test_waiting_is_counted_from_the_tick_it_began() -> None:
    progress = folded(
        clock(),
        state(20),
        state(40, activity=Activity.GIVE_WAY),
        broadcast(60, activity=Activity.GIVE_WAY),
        clock(80),
    )
    assert progress.robot("a").since == 40
    assert progress.waits("a") == pytest.approx(2.0)
    assert progress.waits("b") == 0.0
    done = folded(state(100), progress=progress)
    assert done.seconds(done.robot("a").waited) == pytest.approx(3.0)
    assert done.waits("a") == 0.0


def test_the_share_counts_robots_not_heard_yet() -> None:
    progress = folded(clock(), broadcast(4, reached=[True, True, False]))
    assert progress.share == pytest.approx(2 / 6)


# fmt: off
LEGS = {  # what a robot says, in order -> the share of its way
    "nothing yet":          ((),                                                                            0.0),
    "a leg begins":         ((state(10, distance=8.0),),                                                    0.0),
    "a quarter of the leg": ((state(10, distance=8.0), state(20, distance=6.0)),                            0.25 / 3),
    "a detour":             ((state(10, distance=8.0), state(20, distance=6.0), state(30, distance=12.0)),  0.0),
    "the next leg":         ((state(10, distance=8.0), state(20, target=1, distance=4.0, reached=[True, False, False]),
                              state(30, target=1, distance=1.0, reached=[True, False, False])),             1.75 / 3),
    "all reached":          ((state(10, target=3, distance=0.0, reached=[True] * 3),),                      1.0),
    "other stops":          ((state(10, distance=8.0), state(20, assignment=1, distance=2.0, reached=[False]),
                              state(30, assignment=1, distance=1.0, reached=[False])),                      0.5),
}
# fmt: on


@pytest.mark.parametrize("name", LEGS)
def test_the_way_to_the_next_stop_counts_by_its_length(name: str) -> None:
    said, share = LEGS[name]
    assert folded(clock(), *said).robot("a").share == pytest.approx(share)


def test_seconds_follow_the_worlds_own_rate() -> None:
    slow = Clock(run=1, tick=100, time=10.0, phase=Phase.RUNNING, robots=[], present=[])
    assert folded(slow).seconds(50) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ((broadcast(90), clock(100)), Liveness.ALIVE),
        ((broadcast(70), clock(100)), Liveness.STALE),
        ((broadcast(70), state(60), clock(100)), Liveness.ALIVE),
        ((broadcast(70), state(30), clock(100)), Liveness.STALE),
        ((broadcast(70), clock(100, phase=Phase.PAUSED)), Liveness.ALIVE),
        ((broadcast(99), clock(100, robots=("b",))), Liveness.GONE),
        ((clock(10),), Liveness.ALIVE),
        ((clock(100),), Liveness.STALE),
    ],
)
def test_silence_makes_stale(said: tuple[Message, ...], expected: Liveness) -> None:
    assert folded(clock(), *said).radio_freshness("a") is expected


def test_tokens_say_who_is_gone_and_sessions_are_told_apart() -> None:
    progress = folded(clock(), broadcast(4))
    for session, alive, expected in (
        ("one", True, Liveness.ALIVE),
        ("two", True, Liveness.ALIVE),
        ("one", False, Liveness.ALIVE),
        ("two", False, Liveness.GONE),
        ("three", True, Liveness.ALIVE),
    ):
        progress = fold(progress, Presence("robot", "a", session, alive))
        assert progress.radio_freshness("a") is expected


def test_the_truth_moves_the_clock_and_only_forward() -> None:
    progress = folded(clock(), truth(20), truth(10), broadcast(15))
    assert (progress.tick, progress.time) == (20, 1.0)


def test_a_run_that_is_over_stays_over() -> None:
    progress = folded(clock(10), clock(20, phase=Phase.OVER), clock(20), clock(19, phase=Phase.PAUSED))
    assert progress.phase is Phase.OVER


def test_few_events_are_kept() -> None:
    progress = folded(clock(), *(event(tick) for tick in range(EVENTS_KEPT + 5)))
    assert [each.tick for each in progress.events] == list(range(5, EVENTS_KEPT + 5))


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"target": 1}, "to 2"),
        ({"target": 2}, "home"),
        ({"activity": Activity.GIVE_WAY}, "gives way"),
        ({"activity": Activity.BLOCKED}, "blocked"),
        ({"activity": Activity.DONE, "target": 3}, "done"),
        ({"activity": Activity.READY}, "ready"),
        ({"reached": []}, "ready"),
    ],
)
def test_a_lane_says_what_a_robot_is_about(changed: dict[str, Any], expected: str) -> None:
    assert phrases.lane_label(folded(clock(), broadcast(4, **changed)).robot("a"), home=True) == expected
