"""What a robot does in its last held cell, and what it says that it does: tables with figures worked out by hand."""

from math import pi
from unittest.mock import Mock

import pytest

from swarm.geometry import Pose
from swarm.messages import Activity
from swarm.robot.brain import Robot
from swarm.robot.cell_pilot import CellPilot
from swarm.robot.safety import DriveState
from swarm.traffic.traffic import TrafficActivity, TrafficInputs, TrafficOutputs
from tests.robot.driving import sense_of
from tests.robot.shared import AT, pilot_of, robot, step
from tests.shared import scenario_of


def pilot() -> CellPilot:
    return pilot_of(robot())


def granted(**fields: object) -> Mock:
    usual = {"held": (1,), "way": (1, 2), "unconstrained": False, "exactly": False, "waits": ()}
    return Mock(**usual | fields)


# fmt: off
RESTS: dict[str, tuple[dict[str, object], bool, float, float, bool]] = {
    # what traffic grants, done, from the goal [m], from the edge of its cell [m]: rests
    "in its last cell":                       ({},                                  False, 3.0,  0.24, True),
    "too near to the edge of it":             ({},                                  False, 3.0,  0.22, False),
    "it holds another cell":                  ({"held": (1, 2)},                    False, 3.0,  0.24, False),
    "nobody is near":                         ({"unconstrained": True},             False, 3.0,  0.24, False),
    "it has to stand exactly":                ({"exactly": True},                   False, 3.0,  0.24, False),
    "done, and near its stop":                ({},                                  True,  0.35, 0.24, True),
    "done, and not so near":                  ({},                                  True,  0.37, 0.24, False),
    "done, not so near, and waiting":         ({"waits": ("r1",)},                  True,  0.37, 0.24, True),
    "not done, and near its stop":            ({},                                  False, 0.37, 0.24, True),
}
# fmt: on


@pytest.mark.parametrize("name", RESTS)
def test_a_robot_rests_in_its_last_cell_where_its_footprint_fits(name: str) -> None:
    """Its radius is 0.2 m and the margin 0.03 m; a robot that is done comes as near as nine tenths of 0.4 m."""
    fields, done, away, edge, rests = RESTS[name]
    one = pilot()
    cell = one._cells.cell_of(AT.x, AT.y)
    held = {(1,): (cell,), (1, 2): (cell, cell + 1)}
    x, y = one._cells.centre(cell)
    pose = Pose(x + one._cells.side / 2 - edge, y, 0.0)
    grants = granted(**{"held": (1,)} | fields)
    grants.held = held[grants.held]
    assert one._rests(Mock(pose=pose, goal=(pose.x + away, y), done=done), grants) is rests


@pytest.mark.parametrize(
    ("neighbours", "way", "held", "turns"),
    [((), 2, 1, True), ((8, 9), 2, 1, True), ((7, 8, 9), 2, 1, False), ((8,), 1, 1, False), ((8,), 2, 2, False)],
)
def test_a_robot_turns_while_it_waits_in_a_passage(
    neighbours: tuple[int, ...], way: int, held: int, turns: bool
) -> None:
    one = pilot()
    one._cells = Mock(neighbours={1: neighbours})
    assert one._turns_meanwhile(granted(way=(1, 2)[:way], held=(1, 2)[:held])) is turns


# fmt: off
SAYS = {  # idle, done, from the goal [m], what traffic says: what the robot says
    "nothing is left for it":         (True,  True,  3.0,  TrafficActivity.CUT_OFF,  Activity.DONE),
    "done, and at its stop":          (False, True,  0.39, TrafficActivity.CUT_OFF,  Activity.DONE),
    "done, and away from it":         (False, True,  0.41, TrafficActivity.WAITING,  Activity.GIVE_WAY),
    "near its stop, and not done":    (False, False, 0.39, TrafficActivity.CUT_OFF,  Activity.BLOCKED),
    "it looks at a silent robot":     (False, False, 3.0,  TrafficActivity.LOOKING,  Activity.BLOCKED),
    "it stands for another":          (False, False, 3.0,  TrafficActivity.STANDING, Activity.GIVE_WAY),
    "it leads others out":            (False, False, 3.0,  TrafficActivity.LEADING,  Activity.GIVE_WAY),
}
# fmt: on


@pytest.mark.parametrize("name", SAYS)
def test_what_a_robot_says_that_it_does(name: str) -> None:
    idle, done, away, activity, says = SAYS[name]
    inputs = Mock(pose=AT, goal=(AT.x + away, AT.y), done=done, sense=Mock(stopped=False))
    assert pilot()._activity(inputs, Mock(activity=activity), idle=idle) is says


def test_a_robot_that_is_done_and_kept_from_its_place_for_a_minute_stays_where_it_is() -> None:
    one = pilot()

    def settles(second: float, away: float, *, done: bool = True) -> bool:
        return one._settles(Mock(pose=AT, goal=(AT.x + away, AT.y), done=done, sense=Mock(tick=round(20 * second))))

    assert not settles(0.0, 3.0), "it may have been woken there"
    assert not settles(60.0, 3.0)
    assert settles(60.1, 3.0)
    assert not settles(61.0, 0.39), "back at its place the time runs again"
    assert not settles(121.0, 3.0)
    assert settles(121.1, 3.0)
    assert not settles(122.0, 3.0, done=False), "it has other stops"


def test_a_map_is_expected_to_be_seen_from_the_edge_of_the_footprint() -> None:
    """The room is free from 1 m on to the left; a ray begins 0.2 m from the centre and reaches 1.6 m."""
    one = robot()
    scan = pilot_of(one)._scan(Mock(pose=AT, navigator=one._navigator, sense=Mock(rays=[1.6] * 15)))
    assert scan._expected([0.0, pi]) == pytest.approx([1.6, 1.3])


def test_a_robot_alone_keeps_the_cells_of_the_ticks_in_which_a_last_command_is_obeyed() -> None:
    """A command counts for 0.25 s: five ticks."""
    one, seen = robot(), set[tuple[bool, int, bool]]()
    for tick in range(60):
        command = step(one, tick).command
        count = len(pilot_of(one)._under_way(Mock(tick=tick), Mock(left=0.0, right=0.0))) if tick > 50 else 0
        seen.add((command.unconstrained, pilot_of(one)._rolls, count >= 5))
    assert (True, 5, True) in seen
    assert {rolls for unconstrained, rolls, _ in seen if not unconstrained} <= {0}


def test_what_is_looked_ahead_to_is_the_fourth_cell_of_the_way_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hall is open: nothing hides a cell. The robot holds less than that while it listens."""
    hall = "#" * 21 + "\n" + ("#" + "." * 19 + "#\n") * 6 + "#" * 21 + "\n"
    stops = [[x, AT.y] for x in (18.5, 17.5, 16.5)]
    one, grants = Robot("r2", 1, scenario_of(hall, targets=stops), AT), list[TrafficOutputs]()
    plain = pilot_of(one)._traffic.step

    def listening(inputs: TrafficInputs) -> TrafficOutputs:
        grants.append(plain(inputs))
        return grants[-1]

    monkeypatch.setattr(pilot_of(one)._traffic, "step", listening)
    found = set[int]()
    for tick in range(40):
        step(one, tick)
        way = grants[-1].way
        if len(way) > 1 and not grants[-1].exactly:
            assert pilot_of(one)._drawn_to == pilot_of(one)._cells.centre(way[:5][-1])
            found.add(len(way))
    assert max(found) > 5


@pytest.mark.parametrize(("edge", "above"), [(0.22, True), (0.24, False)])
def test_the_cells_that_it_would_drive_over_are_those_under_its_radius_and_margin(edge: float, above: bool) -> None:
    """It drives straight on, ``edge`` [m] below the upper edge of its row: 0.2 m and 0.03 m do not fit into 0.22 m."""
    one = pilot()
    cell = one._cells.cell_of(AT.x, AT.y)
    x, y = one._cells.centre(cell)
    body = DriveState(Pose(x, y + one._cells.side / 2 - edge, 0.0), 0.0, 0.0)
    one._drawn_to = (x + 2.0, body.pose.y)
    swept = one._sweeps(Mock(sense=sense_of(body)), body)
    assert cell in swept
    assert (cell + one._cells.columns in swept) is above
    assert cell - one._cells.columns not in swept


@pytest.mark.parametrize(("held", "target", "new"), [(1, 0, True), (2, 0, False), (3, 0, False), (3, 1, True)])
def test_getting_nowhere_begins_anew_in_the_last_cell_and_for_another_stop(held: int, target: int, new: bool) -> None:
    one = pilot()
    one._getting_on = Mock(look=Mock(return_value=0))
    one._nowhere(Mock(target=0), granted())
    one._nowhere(Mock(target=target), granted(held=(1, 2, 3)[:held]))
    assert one._getting_on.look.call_args.kwargs["new"] is new
