"""One robot, stepped by hand: how long it uses what it heard, and what it takes over from the process before it."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import msgspec
import pytest

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.messages import RADIO, Activity, Broadcast, State
from swarm.messages.traffic import Record, TrafficBroadcast
from swarm.robot.brain import Robot
from swarm.robot.tuning import REPLAN
from swarm.traffic.cells_of import cells_of
from tests.robot.shared import AT, STOPS, robot, scenario, step
from tests.shared import scenario_of


def said(tick: int, robot: str = "r1", run: int = 0) -> Broadcast:
    """What another robot says that drives near."""
    return Broadcast(
        robot=robot, run=run, tick=tick, x=3.6, y=3.5, yaw=0.0, activity=Activity.DRIVE, target=2, distance=3.0,
        reached=[],
    )  # fmt: skip


def knows(one: Robot, tick: int) -> list[tuple[str, int]]:
    """List whom a robot counts as near it, and when each spoke."""
    return [(broadcast.robot, broadcast.tick) for broadcast in one._near(tick)]


# --- how long it believes what it heard ---

LASTS = round(RADIO.timeout / 0.05)  # ticks


def test_what_was_heard_counts_until_the_radios_timeout_and_no_longer() -> None:
    one, known = robot(), []
    for tick in range(LASTS + 3):
        step(one, tick, *[said(0)] * (tick == 0))
        known.append(knows(one, tick))
    assert known == [[("r1", 0)]] * (LASTS + 1) + [[]] * 2


def test_the_newest_of_each_robot_counts_in_whatever_order_it_comes() -> None:
    one = robot()
    step(one, 10, said(10))
    step(one, 15, said(3))  # older than what is known
    assert knows(one, 15) == [("r1", 10)]
    step(one, 16, said(16))
    assert knows(one, 16) == [("r1", 16)]


@pytest.mark.parametrize("heard", [said(0, robot="r2"), said(0, run=1)], ids=["itself", "another run"])
def test_itself_and_other_runs_are_not_heard(heard: Broadcast) -> None:
    one = robot()
    step(one, 0, heard)
    assert knows(one, 0) == []


# --- a process that takes another's place ---

# fmt: off
LEFT = {  # reached, given up: where it goes on
    "at the start":           ([False] * 4,                [],     0),
    "one reached":            ([True, False, False, False], [],     1),
    "one given up":           ([False] * 4,                [0],    1),
    "the second given up":    ([True, False, False, False], [1],    2),
    "two given up":           ([False] * 4,                [0, 1], 2),
    "on its way home":        ([True, False, True, False],  [1],    3),
}
# fmt: on


@pytest.mark.parametrize("name", LEFT)
def test_a_mission_goes_on_with_all_that_was_reached_and_given_up(name: str) -> None:
    reached, given_up, target = LEFT[name]
    one = robot()
    one.resume(
        State(robot="r2", run=3, tick=70, activity=Activity.DRIVE, target=target, reached=reached,
              unreachable=given_up, distance=1.0, replans=2)
    )  # fmt: skip
    command = step(one, 71, run=3, pose=Pose(5.5, 4.5, 0.0)).command  # away from home
    assert (command.run, command.reached, command.unreachable) == (3, reached, given_up)
    assert one.mission.target == target


def test_who_was_not_told_to_go_begins_at_the_beginning() -> None:
    one = robot()
    one.resume(State(robot="r2", run=3, tick=0, activity=Activity.READY, target=0, reached=[True] * 4, unreachable=[1],
                     distance=1.0, replans=2))  # fmt: skip
    command = step(one, 1, run=3).command
    assert (command.reached, command.unreachable) == ([False] * 4, [])


def test_a_new_run_forgets_the_last_one() -> None:
    one = robot()
    step(one, 0, said(0))
    command = step(one, 0, pose=Pose(7.5, 3.5, 0.0)).command
    assert command.reached == [True, False, False, False]
    command = step(one, 0, run=1).command
    assert (command.run, command.reached, command.activity) == (1, [False] * 4, Activity.DRIVE)


# --- what it says, and when ---


def test_a_robot_speaks_in_its_own_slot_and_says_that_it_did() -> None:
    every, listens = scenario().settings.radio.every, 30  # ticks; it speaks twice as often while it listens
    for number in range(every):
        one = Robot("r2", number, scenario(), AT)
        for tick in range(listens):
            step(one, tick)
        for tick in range(listens, listens + 2 * every):
            outputs = step(one, tick)
            assert (outputs.broadcast is not None) is outputs.command.sent is ((tick + number) % every == 0)


def test_its_state_is_told_on_change_and_once_a_second() -> None:
    one = robot()
    told = [tick for tick in range(50) if step(one, tick).state is not None]
    assert told == [0, 20, 40]
    assert step(one, 50, pose=Pose(7.5, 3.5, 0.0)).state is not None, "it has reached a stop"


def test_a_stop_is_reached_within_reach_and_each_in_its_turn() -> None:
    one, near = robot(), 0.4
    assert step(one, 0, pose=Pose(7.5 - near - 0.01, 3.5, 0.0)).command.reached == [False] * 4
    assert step(one, 1, pose=Pose(4.5, 2.5, 0.0)).command.reached == [False] * 4, "that one is the third"
    assert step(one, 2, pose=Pose(7.5 - near + 0.01, 3.5, 0.0)).command.reached == [True, False, False, False]
    plan = step(robot(), 0).plan
    assert plan is not None
    assert plan.points[-1] == pytest.approx(tuple(STOPS[0]))


# --- when it plans anew ---

STUCK_TICKS = round(REPLAN.stuck / 0.05) + 1  # the first tick that is later
RETRY_TICKS = round(REPLAN.again / 0.05) + 1


def keeping(tick: int) -> Broadcast:
    """A robot on the way that holds the cell it stands in."""
    cells = cells_of(scenario().map, scenario().settings)
    held = tuple(sorted(cells.touched(3.6, 3.5, 0.2)))
    record = Record(robot="r1", stamp=tick, x=3.6, y=3.5, goal=held[0], held=held)
    return msgspec.structs.replace(said(tick), traffic=TrafficBroadcast(own=record))


def plans_anew(poses: Callable[[int], Pose], heard: Callable[[int], list[Broadcast]], ticks: int = 180) -> list[int]:
    """Step a robot whose poses are given; list the ticks at which it planned once more for the same stop."""
    one = robot()
    counts = [0, *(step(one, tick, *heard(tick), pose=poses(tick)).command.replans for tick in range(ticks))]
    return [tick for tick, (before, now) in enumerate(pairwise(counts)) if now == before + 1]


def at(x: float, y: float = 3.5) -> Pose:
    return Pose(x, y, 0.0)


MIDDLE = at(2.7, 3.0)  # of a cell
CREEPS = 0.21  # m in 4 s: just more than its radius


def creeping(tick: int) -> Pose:
    """Get on by just more than a robot's radius in the time in which it counts as stuck."""
    return at(2.5 + CREEPS * tick / STUCK_TICKS)


# fmt: off
PLANS_ANEW: dict[str, tuple[Callable[[int], Pose], Callable[[int], list[Broadcast]], list[int]]] = {
    "it gets nowhere":            (lambda tick: AT,       lambda tick: [],               [STUCK_TICKS, 2 * STUCK_TICKS]),
    "it creeps on":               (creeping,              lambda tick: [],               []),
    "it lets somebody pass":      (lambda tick: MIDDLE,   lambda tick: [keeping(tick)],  []),
    "it strays from its path":    (lambda tick: AT if tick < 3 else at(3.5, 1.6),
                                                          lambda tick: [],               [RETRY_TICKS, RETRY_TICKS + STUCK_TICKS]),
}
# fmt: on


@pytest.mark.parametrize("name", PLANS_ANEW)
def test_it_plans_anew_where_it_gets_nowhere_and_not_at_every_tick(name: str) -> None:
    poses, heard, ticks = PLANS_ANEW[name]
    assert plans_anew(poses, heard) == [pytest.approx(tick, abs=1) for tick in ticks]


def dense(points: Sequence[Point]) -> list[Point]:
    """Return a polyline's points and many between them."""
    return [
        (a[0] + (b[0] - a[0]) * k / 50, a[1] + (b[1] - a[1]) * k / 50) for a, b in pairwise(points) for k in range(51)
    ]


def test_a_new_plan_leads_round_who_stands_on_the_way() -> None:
    one, plans = robot(), []
    for tick in range(STUCK_TICKS + 1):
        plan = step(one, tick, said(tick)).plan
        plans += [plan] if plan is not None else []
    first, anew = (min(distance(point, (3.6, 3.5)) for point in dense(plan.points)) for plan in plans)
    assert first < 0.2
    assert anew > 2 * scenario().settings.robot.radius


# --- what it learns of an unknown floor ---


def test_a_stop_that_the_learned_cells_no_longer_lead_to_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot has a path when it learns of a wall; before it gives up, it forgets all walls and looks again."""
    text = "#" * 10 + "\n" + ("#" + "." * 8 + "#\n") * 4 + "#" * 10 + "\n"
    one = Robot("r1", 0, scenario_of(text, map={"text": text, "cell": 1.0, "known": False}, targets=STOPS), AT)
    assert step(one, 0).command.unreachable == []
    forgotten: list[float] = []
    monkeypatch.setattr(one._ground, "look", lambda sense, robot_at: True)
    monkeypatch.setattr(one._ground, "forget", forgotten.append)
    monkeypatch.setattr(one._pilot, "learn", lambda floor, news: True)
    monkeypatch.setattr(one._pilot, "can_reach", lambda here, goal: goal != tuple(STOPS[0]))
    assert step(one, 1).command.unreachable == [0]
    assert len(forgotten) == 1
