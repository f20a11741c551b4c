"""Laws of the fold over messages, for any messages in any order."""

from hypothesis import given
from hypothesis import strategies as st

from dashboard.fold.progress import Progress, fold
from swarm.messages import Activity, Broadcast, Event, Message, State
from tests.messages.made import broadcast, clock, event, state, truth

STOPS = 3
robots = st.sampled_from(["a", "b", "c"])
ticks = st.integers(0, 60)


def mission(robot: str, tick: int) -> dict[str, object]:
    """What a robot truly is about at a tick: every message of that tick says the same."""
    reached = min(STOPS, tick // 15)
    activity = Activity.DONE if reached == STOPS else (Activity.GIVE_WAY if tick % 7 < 3 else Activity.DRIVE)
    return {
        "activity": activity,
        "target": reached,
        "distance": float(15 - tick % 15),
        "reached": [stop < reached for stop in range(STOPS)],
    }


@st.composite
def words(draw: st.DrawFn) -> Broadcast | State:
    robot, tick = draw(robots), draw(ticks)
    say = broadcast if draw(st.booleans()) else state
    return say(tick, robot, **mission(robot, tick))


@st.composite
def anything(draw: st.DrawFn) -> Message:
    """Any message of run 1, however contradictory."""
    kind, tick = draw(st.sampled_from(["broadcast", "state", "clock", "truth", "event"])), draw(ticks)
    changed = {
        "activity": draw(st.sampled_from(list(Activity))),
        "target": draw(st.integers(0, STOPS)),
        "reached": draw(st.lists(st.booleans(), min_size=STOPS, max_size=STOPS)),
    }
    match kind:
        case "broadcast":
            return broadcast(tick, draw(robots), **changed)
        case "state":
            return state(tick, draw(robots), **changed)
        case "clock":
            return clock(tick, robots=("a", "b", "c"))
        case "truth":
            return truth(tick)
    return event(tick)


START = fold(Progress(), clock(0, robots=("a", "b", "c")))


def run(messages: list[Message]) -> Progress:
    progress = START
    for message in messages:
        progress = fold(progress, message)
    return progress


def essence(progress: Progress) -> object:
    """What must not depend on the order: all but how long somebody waited, which only the order in time can tell."""
    return {
        name: (robot.tick, robot.activity, robot.target, robot.distance, robot.reached_at, robot.state_tick)
        for name, robot in progress.robots.items()
    }


@given(st.data(), st.lists(words(), max_size=20))
def test_the_order_of_arrival_does_not_matter(data: st.DataObject, messages: list[Message]) -> None:
    assert essence(run(messages)) == essence(run(data.draw(st.permutations(messages))))


@given(st.lists(words(), max_size=20))
def test_robots_do_not_touch_each_other(messages: list[Broadcast | State]) -> None:
    whole = run(list(messages))
    for name in ("a", "b", "c"):
        alone = run([message for message in messages if message.robot == name])
        assert alone.robot(name) == whole.robot(name)


@given(st.lists(anything(), max_size=20))
def test_progress_only_grows_within_a_run(messages: list[Message]) -> None:
    progress = START
    for name in ("a", "b", "c"):
        progress = fold(progress, state(0, name))
    for message in messages:
        after = fold(progress, message)
        assert after.run == progress.run
        assert after.tick >= progress.tick
        assert after.share >= progress.share
        for name, robot in progress.robots.items():
            new = after.robot(name)
            assert new.tick >= robot.tick
            assert new.waited >= robot.waited
            for before, now in zip(robot.reached_at, new.reached_at, strict=True):
                assert before is None or (now is not None and now <= before)
        progress = after


@given(st.lists(anything(), max_size=8), anything())
def test_hearing_it_twice_changes_nothing(messages: list[Message], message: Message) -> None:
    once = fold(run(messages), message)
    if not isinstance(message, Event):
        assert fold(once, message) == once


@given(st.lists(anything(), max_size=8), anything())
def test_the_former_run_cannot_disturb_the_new_one(messages: list[Message], late: Message) -> None:
    fresh = fold(run(messages), clock(0, run=2, robots=("a", "b", "c")))
    assert fresh.robots == {}
    assert fold(fresh, late) is fresh


@given(st.lists(anything(), max_size=20))
def test_a_share_is_a_share(messages: list[Message]) -> None:
    progress = run(messages)
    assert 0.0 <= progress.share <= 1.0
    assert all(0.0 <= robot.share <= 1.0 for robot in progress.robots.values())
