"""One robot, stepped by hand: how long it uses what it heard, and what it takes over from the process before it."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import pytest
from msgspec.structs import replace

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.messages import RADIO, Activity, Broadcast, State
from swarm.messages.traffic import Record, TrafficBroadcast
from swarm.robot.brain import Robot
from swarm.robot.tuning import REPLAN
from swarm.traffic.lattice.placement import cells_of
from tests.robot.shared import AT, STOPS, robot, scenario, step


def said(tick: int, robot: str = "r1", run: int = 0) -> Broadcast:
    """What another robot says that drives near."""
    return Broadcast(
        robot=robot, run=run, tick=tick, x=3.6, y=3.5, yaw=0.0, activity=Activity.DRIVE, target=2, distance=3.0,
        reached=[],
    )  # fmt: skip


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
    held = tuple(sorted(cells.cells_under_disc(3.6, 3.5, 0.2)))
    record = Record(robot="r1", stamp=tick, x=3.6, y=3.5, goal=held[0], held=held)
    return replace(said(tick), traffic=TrafficBroadcast(own=record))


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


LASTS = round(RADIO.timeout / 0.05)  # ticks
ON_WAY = said(STUCK_TICKS)
# fmt: off
HEARD: dict[str, tuple[list[Broadcast], bool]] = {  # all at the end, in this order: whether the new plan leads round (3.6, 3.5)
    "nobody":                             ([],                                              False),
    "who stands on the way":              ([ON_WAY],                                        True),
    "until the radio's timeout":          ([replace(ON_WAY, tick=STUCK_TICKS - LASTS)],     True),
    "and no longer":                      ([replace(ON_WAY, tick=STUCK_TICKS - LASTS - 1)], False),
    "who has gone on since":              ([replace(ON_WAY, tick=STUCK_TICKS - 9), replace(ON_WAY, x=5.5, y=1.5)], False),
    "in whatever order that comes":       ([replace(ON_WAY, x=5.5, y=1.5), replace(ON_WAY, tick=STUCK_TICKS - 9)], False),
    "itself":                             ([replace(ON_WAY, robot="r2")],                   False),
    "another run":                        ([replace(ON_WAY, run=1)],                        False),
}
# fmt: on


@pytest.mark.parametrize("name", HEARD)
def test_a_new_plan_leads_round_who_stands_on_the_way(name: str) -> None:
    heard, leads_round = HEARD[name]
    one, plans = robot(), []
    for tick in range(STUCK_TICKS + 1):
        plan = step(one, tick, *(heard if tick == STUCK_TICKS else [])).plan
        plans += [plan] if plan is not None else []
    first, anew = (min(distance(point, (3.6, 3.5)) for point in dense(plan.points)) for plan in plans)
    assert first < 0.2
    assert (anew > 2 * scenario().settings.robot.radius) is leads_round
