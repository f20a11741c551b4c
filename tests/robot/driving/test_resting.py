"""What a robot does with what traffic grants it: tables with figures worked out by hand."""

from collections.abc import Sequence
from itertools import count
from math import pi
from typing import Any

import pytest
from msgspec.structs import replace

from swarm.fuzzy import Controller
from swarm.geometry import Pose, distance
from swarm.messages import Activity, Broadcast
from swarm.robot.driving.cell_pilot import CellPilot
from swarm.robot.driving.pilot import PilotInputs, PilotOutputs
from swarm.robot.driving.safety import STAND, DriveState
from swarm.robot.navigator import Navigator
from swarm.robot.tuning import SCALE
from swarm.scenario.prepare import planning_grid
from swarm.traffic.interface import MovingObstacle, TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of, traffic_settings
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.step import Traffic
from tests.robot.driving.shared import rolled, sense_of, to_a_stand, told
from tests.shared import ROOM, scenario_of

AT = Pose(4.5, 3.5, 0.0)  # the centre of a cell of 1 m
HALL = "#" * 21 + "\n" + ("#" + "." * 19 + "#\n") * 6 + "#" * 21 + "\n"
FAR = (18.5, 3.5)
STANDING = TrafficActivity.STANDING
RAYS = [1.6] * 15  # m; they see nothing


class Granting(Traffic):
    """Traffic that grants what a test says, and keeps what it is asked."""

    grants: TrafficOutputs
    due = True

    def is_due(self, tick: int, scan: Scan) -> bool:
        return self.due

    def step(self, inputs: TrafficInputs, cells: CellMap) -> TrafficOutputs:
        self.asked = inputs
        return self.grants


class Driven:
    """The pilot of a robot on a floor of 1 m cells."""

    def __init__(self, text: str = HALL, radius: float = 0.2) -> None:
        scenario = scenario_of(
            text, start={"poses": [[1.5, 1.5, 0.0]]}, targets=[[1.5, 1.5], [1.5, 1.5]], robot={"radius": radius}
        )
        settings = scenario.settings
        self.cells = cells_of(scenario.map, settings)
        self.traffic = Granting("r1", self.cells, traffic_settings(settings))
        self.pilot = CellPilot(self.traffic, self.cells, 0, settings, Controller(scenario.profile))
        self.navigator = Navigator(planning_grid(scenario), settings.robot.radius, settings.reach)

    def row(self, *, up: int = 0, count: int = 1, at: Pose = AT) -> tuple[int, ...]:
        """Return so many cells to the right of a pose, from its own one on, or from the one so many above it on."""
        first = self.cells.cell_of(at.x, at.y) + up * self.cells.columns
        return tuple(range(first, first + count))

    def drive(
        self,
        body: DriveState | Pose = AT,
        *,
        tick: int = 0,
        goal: tuple[float, float] = FAR,
        done: bool = False,
        anywhere: bool = False,
        target: int = 0,
        heard: Sequence[Broadcast] = (),
        **granted: Any,  # noqa: ANN401, fields of what traffic grants
    ) -> PilotOutputs:
        """Drive for a tick; unless it is said otherwise, two cells are granted and a robot is near."""
        body = DriveState(body, 0.0, 0.0) if isinstance(body, Pose) else body
        held = granted.get("held", self.row(count=2, at=body.pose))
        usual: dict[str, Any] = {
            "broadcast": None, "held": held, "drivable": held, "unconstrained": False,
            "waypoints": tuple(map(self.cells.centre, held)), "beside": (), "may_drive": True, "threats": (),
            "room": (), "looks": False, "exactly": False, "face": None, "waits": (),
            "activity": TrafficActivity.DRIVING, "events": (), "way": self.row(count=3, at=body.pose), "members": (),
        }  # fmt: skip
        self.traffic.grants = TrafficOutputs(**usual | granted)
        sense = replace(sense_of(body, tick), rays=RAYS, bearings=[None] * 3)
        return self.pilot.drive(
            PilotInputs(sense, body.pose, goal, None, None, done, anywhere, target, self.navigator, heard)
        )


# --- between two steps of coordination ---


def test_what_is_heard_between_two_steps_is_handed_over_in_the_next_and_nothing_is_said_twice() -> None:
    one = Driven()
    said = [Broadcast(robot=f"f{n}", run=0, tick=n, x=9.0, y=2.0, yaw=0.0, activity=Activity.DRIVE, target=0,
                      distance=0.0, reached=[]) for n in range(4)]  # fmt: skip
    note = TrafficNote("halted", ("r1",), "stopped")
    moves = []
    for tick, due in enumerate((True, False, False, True)):
        one.traffic.due = due
        moves.append(one.drive(tick=tick, heard=said[tick : tick + 1], events=(note,)))
        expected = {0: [0], 3: [1, 2, 3]}.get(tick)
        assert expected is None or [spoken.tick for spoken in one.traffic.asked.mute] == expected
    assert [len(move.notes) for move in moves] == [1, 0, 0, 1]
    assert len({move.held for move in moves}) == 1, "what was granted holds until the next step"


@pytest.mark.parametrize("changed", [{"goal": (10.5, 2.5)}, {"done": True, "anywhere": True}])
def test_another_goal_is_asked_for_at_once(changed: dict[str, Any]) -> None:
    one = Driven()
    one.drive(tick=0)
    one.traffic.due = False
    one.drive(tick=1)
    assert one.traffic.asked.tick == 0
    one.drive(tick=2, **changed)
    assert one.traffic.asked.tick == 2


# --- where it stands ---

# fmt: off
RESTS: dict[str, tuple[dict[str, Any], bool, float, float, bool]] = {
    # what traffic grants, done, from the goal [m], from the edge of its cell [m]: rests
    "in its last cell":                       ({},                                  False, 3.0,  0.24, True),
    "too near to the edge of it":             ({},                                  False, 3.0,  0.22, False),
    "it holds another cell":                  ({"held": 2},                         False, 3.0,  0.24, False),
    "nobody is near":                         ({"unconstrained": True},             False, 3.0,  0.24, False),
    "it has to stand exactly":                ({"exactly": True},                   False, 3.0,  0.24, False),
    "done, and near its stop":                ({},                                  True,  0.35, 0.24, True),
    "done, and not so near":                  ({},                                  True,  0.37, 0.24, False),
    "done, not so near, and waiting":         ({"waits": ("r1",)},                  True,  0.37, 0.24, True),
    "not done, and near its stop":            ({},                                  False, 0.37, 0.24, True),
    "not yet up to the next cell":            ({"way": 3},                          False, 3.0,  0.60, False),
    "up to the next cell":                    ({"way": 3},                          False, 3.0,  0.50, True),
    "it waits for a plan":                    ({"way": 3, "activity": STANDING},    False, 3.0,  0.60, True),
}
# fmt: on


@pytest.mark.parametrize("name", RESTS)
def test_a_robot_rests_in_its_last_cell_where_its_footprint_fits(name: str) -> None:
    """Its radius is 0.2 m and the margin 0.03 m; a robot that is done comes as near as nine tenths of 0.4 m.

    Who waits for the next cell drives up to 0.25 m from the point 0.31 m before it.
    """
    grants, done, away, edge, rests = RESTS[name]
    one, pose = Driven(), AT._replace(x=5.0 - edge)
    held = one.row(count=2 if "held" in grants else 1)
    way = one.row(count=grants.get("way", len(held)))
    up_to = (one.cells.leaning_point(held[-1], held[-1] + 1, 0.31),) if len(way) > len(held) else ()
    granted = {"held": held, "way": way, "waypoints": (*map(one.cells.centre, held), *up_to)}
    move = one.drive(pose, goal=(pose.x + away, pose.y), done=done, **grants | granted)
    assert (move.speeds == STAND) is rests


PASSAGE = "#######\n#.....#\n#######\n"
JUNCTION = "#######\n#.....#\n###.###\n#######\n"


@pytest.mark.parametrize(
    ("text", "x", "way", "held", "turns"),
    [
        (PASSAGE, 1.5, 2, 1, True),
        (PASSAGE, 3.5, 2, 1, True),
        (JUNCTION, 3.5, 2, 1, False),
        (PASSAGE, 3.5, 1, 1, False),
        (PASSAGE, 3.5, 2, 2, False),
    ],
    ids=["a dead end", "a passage", "a junction", "no way left", "it still holds the cell behind"],
)
def test_a_robot_turns_while_it_waits_in_a_passage(text: str, x: float, way: int, held: int, turns: bool) -> None:
    one = Driven(text)
    pose = Pose(x, len(text.splitlines()) - 1.5, pi)
    here = one.row(at=pose)[0]
    move = one.drive(
        pose, held=(here - 1, here)[-held:], waypoints=(one.cells.centre(here),), way=one.row(at=pose, count=way)
    )
    assert (move.speeds != STAND) is turns
    assert move.speeds.left == -move.speeds.right


@pytest.mark.parametrize("told_of", [True, False])
def test_a_robot_gets_out_of_the_way_of_what_comes_at_it(told_of: bool) -> None:
    """It comes across from the right at 0.5 m/s, to where the robot would be, which sees nothing of it by itself."""
    one, body, nearest = Driven(), DriveState(AT, 0.0, 0.0), 9.0
    floor = tuple(cell for cell, beside in enumerate(one.cells.neighbours) if beside)
    for tick in range(50):
        threat = MovingObstacle(AT.x + 0.8, AT.y - 1.2 + 0.5 * 0.05 * tick, 0.0, 0.5)
        threats = (threat,) if told_of else ()
        speeds = one.drive(body, tick=tick, drivable=floor, way=one.row(count=9), threats=threats).speeds
        body = rolled(body, speeds)
        nearest = min(nearest, distance(body.pose, (threat.x, threat.y + 0.5 * 0.05)))
    assert (nearest > 0.45) is told_of, "0.2 m and 0.25 m are their radii"


# --- what it says that it does ---

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
    move = Driven().drive(goal=(AT.x + away, AT.y), done=done, anywhere=idle, activity=activity)
    assert move.activity is says


def test_a_robot_that_is_done_and_kept_from_its_place_for_a_minute_in_all_stays_where_it_is() -> None:
    one, tick = Driven(), count()

    def settles(away: float, *, done: bool = True, ticks: int = 1) -> bool:
        for _ in range(ticks):
            one.drive(goal=(AT.x + away, AT.y), done=done, tick=next(tick))
        return one.traffic.asked.goal is None

    assert not settles(3.0, ticks=600)
    assert not settles(0.39, ticks=100), "it is back at its place for a while"
    assert not settles(3.0, ticks=600)
    assert settles(3.0)
    assert not settles(3.0, done=False), "it has other stops"
    assert not settles(3.0, ticks=1200), "then the time runs again"
    assert settles(3.0)


# --- what it tells traffic ---


@pytest.mark.parametrize(("yaw", "expected"), [(0.0, 1.6), (pi, 1.3)])
def test_a_map_is_expected_to_be_seen_from_the_edge_of_the_footprint(yaw: float, expected: float) -> None:
    """The room is free from 1 m on to the left; a ray begins 0.2 m from the centre and reaches 1.6 m."""
    one = Driven(ROOM)
    one.drive(Pose(2.5, 3.5, yaw))
    ahead = min(one.traffic.asked.scan.readings, key=lambda reading: abs(reading.bearing))
    assert ahead.bearing == pytest.approx(0.0)
    assert (ahead.measured, ahead.expected) == pytest.approx((1.6, expected))


@pytest.mark.parametrize("unconstrained", [True, False])
def test_a_robot_alone_keeps_the_cells_of_the_ticks_in_which_a_last_command_is_obeyed(unconstrained: bool) -> None:
    """A command counts for 0.25 s: five ticks."""
    one, body = Driven(), DriveState(AT, 0.0, 0.0)
    for tick in range(10):
        speeds = one.drive(body, tick=tick, unconstrained=unconstrained, drivable=one.row(count=9)).speeds
        body = rolled(body, speeds)
    one.drive(body, tick=10)
    stands = told(body, speeds, 5) if unconstrained else to_a_stand(body)
    assert tuple(one.traffic.asked.braking[-1]) == pytest.approx(stands[-1][:2])


def sweeps(one: Driven, pose: Pose = AT, **granted: Any) -> tuple[int, ...]:  # noqa: ANN401
    """Return the cells that traffic is told a robot would drive over, once it has been granted something."""
    for tick in (0, 4):
        one.drive(pose, tick=tick, drivable=(*one.row(count=9), *one.row(up=1, count=9)), **granted)
    return one.traffic.asked.sweeps


@pytest.mark.parametrize(("edge", "above"), [(0.22, True), (0.24, False)])
def test_the_cells_that_it_would_drive_over_are_those_under_its_radius_and_margin(edge: float, above: bool) -> None:
    """It drives straight on, ``edge`` [m] below the upper edge of its row: 0.2 m and 0.03 m do not fit into 0.22 m."""
    one, pose = Driven(), AT._replace(y=4.0 - edge)
    swept = sweeps(one, pose, exactly=True, waypoints=(AT[:2], (AT.x + 5.0, pose.y)))
    own, other = one.row(count=15), one.row(up=1, count=15)
    assert swept[0] == own[0]
    assert 1 < len(set(swept) & set(own)) < 5, "no farther than in the next seconds"
    assert (other[1] in swept) is above
    assert set(swept) <= {*own, *other}, "ahead of it"


@pytest.mark.parametrize(("straight", "above"), [(5, False), (4, True)])
def test_what_is_looked_ahead_to_is_the_fourth_cell_of_the_way_at_most(straight: int, above: bool) -> None:
    """The hall is open: nothing hides a cell. Then the way turns to the left."""
    one = Driven()
    turn = [one.row(up=up, count=straight)[-1] for up in (1, 2)]
    swept = sweeps(one, way=(*one.row(count=straight), *turn))
    assert (set(swept) <= set(one.row(count=9))) is not above


# --- what its tables are told ---

# fmt: off
SCALES = {  # room [m], heading error [rad]: scale
    "as much room as in the open":   (0.8,  0.0,     1.0),
    "more room than in the open":    (3.0,  0.0,     1.0),
    "three quarters of it":          (0.6,  0.0,     0.75),
    "half of it":                    (0.4,  0.0,     0.5),
    "hardly any room":               (0.24, 0.0,     0.4),
    "the aim is behind":             (0.8,  pi,      0.3),
    "the aim is to the right":       (0.8,  -pi / 2, 0.65),
    "half the room, aim to the left": (0.4, pi / 2,  0.325),
}
# fmt: on


@pytest.mark.parametrize("name", SCALES)
def test_the_less_room_and_the_more_turn_the_smaller_is_the_scale(name: str) -> None:
    """The tables' distances are divided by 40 % to 100 %, as is room, and by 70 % less if the aim is behind."""
    room, heading, scale = SCALES[name]
    assert_scale(room, heading, scale, radius=0.18)


@pytest.mark.parametrize("name", SCALES)
def test_in_lanes_all_room_counts_as_far_between_others(name: str) -> None:
    room, heading, _ = SCALES[name]
    assert_scale(room, heading, 0.15 * (1.0 - 0.7 * abs(heading) / pi), radius=0.2)


def assert_scale(room: float, heading: float, scale: float, *, radius: float) -> None:
    """Check the scale between others, alone and at a place; 1 m is a lane for a ``radius`` [m] of 0.2."""
    one, pose = Driven(radius=radius), Pose(5.5, 1.0 + room, -heading)  # the hall's lower wall is at 1 m
    floor = tuple(cell for cell, beside in enumerate(one.cells.neighbours) if beside)
    for held, exactly, unconstrained, expected in (
        (2, False, False, scale), (1, False, False, scale), (2, True, False, scale),
        (2, False, True, 1.0), (1, True, False, 0.15),
    ):  # fmt: skip
        move = one.drive(
            pose, held=one.row(at=pose, count=held), drivable=floor, exactly=exactly, unconstrained=unconstrained,
            waypoints=((5.5, 1.5), (8.5, pose.y)),
        )  # fmt: skip
        assert move.scale == pytest.approx(expected)


# fmt: off
ANEW: dict[str, tuple[range, dict[str, Any], int]] = {  # ticks, what is so at those: from which tick on time counts
    "nothing":                      (range(0),        {},                  0),
    "more cells":                   (range(60, 999),  {"held": 3},         0),
    "its last cell":                (range(60, 61),   {"held": 1},         60),
    "another stop":                 (range(60, 999),  {"target": 1},       60),
    "a cell nearer":                (range(60, 999),  {"way": (1, 2)},     60),
    "an unexpected obstacle":       (range(10, 30),   {"may_drive": False}, 20),
}
# fmt: on


@pytest.mark.parametrize("name", ANEW)
def test_the_longer_it_gets_nowhere_the_farther_all_seems(name: str) -> None:
    """Seed 996133: a robot circled before the tip of a wall at 0.15 for good; at 0.02 the tables turn to the aim."""
    ticks, fields, begins = ANEW[name]
    one = Driven()
    for tick in range(begins + 203):
        now = fields if tick in ticks else {}
        held = {"held": one.row(count=now.get("held", 2)), "drivable": one.row(count=9), "unconstrained": True}
        move = one.drive(tick=tick, **now | held)
        nowhere = (tick - begins) * 0.05  # s
        assert move.scale == (SCALE.detour if nowhere > 10.01 else SCALE.turning if nowhere > 5.01 else 1.0)
        if nowhere > 5.1:
            assert one.traffic.asked.sweeps == (), "who gets nowhere asks for nothing"
