"""The world's steering labels: given commands, compared with tables whose speeds are known."""

from math import degrees, nan, pi

import msgpack
import msgspec
import pytest

from swarm.bus.codec import decode
from swarm.fuzzy import Controller, load_profile
from swarm.geometry import Pose
from swarm.messages import COMMAND, VERSION, Activity, Command, Steering
from swarm.scenario.load import Scenario
from tests.shared import constant_rules, scenario_of, with_settings
from tests.world.shared import command
from world.bodies.roster import Roster
from world.bodies.sensors import FreeDistances
from world.measure.steering import BY, CLOSE, IDLE, SteeringWatch, classify
from world.simulate import Simulation
from world.views.truth import make_truth
from world.world import World

TABLES, TIGHTENED, TURNED, BLENDED, BRAKED = (
    Steering.TABLES, Steering.TIGHTENED, Steering.TURNED, Steering.BLENDED, Steering.BRAKED,
)  # fmt: skip
AT, BESIDE = Pose(2.5, 2.5, 0.0), Pose(4.5, 4.5, 3.1)
ROOM = scenario_of()
FAST, SLOW = 3.0 * 0.4, 1.0 * 0.4  # m/s: the middles of the paper's terms, times speed_scale
BEND = scenario_of(profile=constant_rules(load_profile("paper"), "fast", "slow"))  # always FAST left, SLOW right
RATE = FAST - SLOW  # m/s, between the rims

# fmt: off
LABELS: dict[str, tuple[tuple[float, float], Steering]] = {  # what is commanded where the tables say FAST, SLOW
    "unaltered":                           ((FAST, SLOW),                                   TABLES),
    "slower in the same ratio":            ((0.3 * FAST, 0.3 * SLOW),                       TABLES),
    "within what nobody is steered by":    ((FAST - CLOSE / 2, SLOW + CLOSE / 2),           TABLES),
    "a little more than that":             ((FAST, SLOW + 3 * CLOSE),                       BLENDED),
    "faster in the same ratio":            ((1.1 * FAST, 1.1 * SLOW),                       BLENDED),
    "backwards in the same ratio":         ((-0.3 * FAST, -0.3 * SLOW),                     BLENDED),
    "the same turn, less way on":          ((FAST - 0.2, SLOW - 0.2),                       TIGHTENED),
    "the same turn on the spot":           ((RATE / 2, -RATE / 2),                          TIGHTENED),
    "the same turn, all but on the spot":  ((RATE / 2 - CLOSE / 2, -RATE / 2 - CLOSE / 2), TIGHTENED),
    "all but the same turn and way on":    ((FAST + 1.4 * CLOSE, SLOW - 0.4 * CLOSE),       TIGHTENED),
    "the same turn, more way on":          ((FAST + 0.2, SLOW + 0.2),                       BLENDED),
    "the same turn backwards":             ((RATE / 2 - 0.1, -RATE / 2 - 0.1),              BLENDED),
    "on the spot, faster":                 ((RATE, -RATE),                                  TURNED),
    "on the spot, the other way round":    ((-RATE / 2, RATE / 2),                          TURNED),
    "straight on":                         ((0.6, 0.6),                                     BLENDED),
    "wheels swapped":                      ((SLOW, FAST),                                   BLENDED),
    "stands":                              ((0.0, 0.0),                                     BRAKED),
    "all but stands":                      ((CLOSE, -CLOSE),                                BRAKED),
}
# fmt: on


@pytest.mark.parametrize("name", LABELS)
def test_what_became_of_the_tables_speeds(name: str) -> None:
    commanded, label = LABELS[name]
    assert classify(commanded, (FAST, SLOW)) is label
    assert classify(commanded[::-1], (SLOW, FAST)) is label, "the mirror image"


# fmt: off
ODD: dict[str, tuple[tuple[float, float], tuple[float, float], Steering]] = {  # commanded, of the tables
    "tables that stand, and so do the wheels": ((0.0, 0.0),   (0.0, 0.0),   TABLES),
    "tables that stand, wheels that do not":   ((0.3, 0.3),   (0.0, 0.0),   BLENDED),
    "tables that back":                        ((-0.2, -0.1), (-0.4, -0.2), TABLES),
    "tables that back, with less way on":      ((-0.2, 0.0),  (-0.4, -0.2), TIGHTENED),
    "tables that turn on the spot":            ((0.2, -0.2),  (0.4, -0.4),  TABLES),
    "straight on, slower":                     ((0.2, 0.2),   (0.6, 0.6),   TABLES),
    "nothing was asked: stands":               ((0.0, 0.0),   (nan, nan),   BRAKED),
    "nothing was asked: turns":                ((0.2, -0.2),  (nan, nan),   TURNED),
    "nothing was asked: drives":               ((0.2, 0.2),   (nan, nan),   BLENDED),
}
# fmt: on


@pytest.mark.parametrize("name", ODD)
def test_odd_tables(name: str) -> None:
    commanded, tables, label = ODD[name]
    assert classify(commanded, tables) is label


# --- the three weights ---


FAR = FreeDistances(1.6, 1.6, 1.6, [])
TIGHT = FreeDistances(0.5, 0.9, 1.3, [])


def unfed(scenario: Scenario, *starts: Pose) -> SteeringWatch:
    """Make a watch of robots that has been told nothing."""
    roster = Roster(scenario, [f"r{number}" for number in range(1, len(starts) + 1)])
    return SteeringWatch(roster, starts, 1.0 / scenario.settings.rate)


def watch_of(scenario: Scenario, *starts: Pose) -> SteeringWatch:
    """Make a watch of robots that are far from everything at tick 0."""
    watch = unfed(scenario, *starts)
    watch.note_distances(0, [FAR] * len(starts))
    return watch


def shares(tables: float, tightened: float, turned: float, blended: float, braked: float) -> dict[str, object]:
    return {
        "tables": pytest.approx(tables), "tightened": pytest.approx(tightened), "turned": pytest.approx(turned),
        "blended": pytest.approx(blended), "braked": pytest.approx(braked),
    }  # fmt: skip


# fmt: off
PLANTED: list[tuple[str, float, float]] = [  # what r1 commands; m, rad that it moves then
    ("unaltered",                  0.5, 0.2),
    ("slower in the same ratio",   0.3, -0.1),
    ("the same turn, less way on", 0.1, 0.3),
    ("on the spot, faster",        0.0, -1.0),
    ("straight on",                0.6, 0.0),
    ("faster in the same ratio",   0.4, 0.1),
    ("unaltered",                  0.0, 0.0),
    ("stands",                     0.1, 0.3),
]
BY_HAND = {  # of 8 ticks, 2 m and 2 rad
    "ticks":  shares(tables=3 / 8, tightened=1 / 8,  turned=1 / 8,  blended=2 / 8,  braked=1 / 8),
    "metres": shares(tables=0.4,   tightened=0.05,   turned=0.0,    blended=0.5,    braked=0.05),
    "angle":  shares(tables=0.15,  tightened=0.15,   turned=0.5,    blended=0.05,   braked=0.15),
    "scaled": {"time": 0.0, "mean": 1.0},
}
# fmt: on


def test_each_label_is_weighed_by_ticks_metres_and_angle() -> None:
    """r2 has nothing to do and stands: it is in no sum."""
    pose, idle = AT, command(0.0, 0.0, activity=Activity.DONE)
    watch = watch_of(BEND, AT, BESIDE)
    for name, metres, angle in PLANTED:
        commanded, label = LABELS[name]
        pose = Pose(pose.x, pose.y + metres, pose.yaw + angle)
        watch.look([command(*commanded), idle], [pose, BESIDE])
        assert watch.state.labels == [label, BRAKED]
    assert watch.report() == BY_HAND
    assert [sum(weights) for weights in zip(*watch.state.weights.values(), strict=True)] == pytest.approx([8, 2.0, 2.0])


def test_robots_are_summed_up_and_an_angle_is_the_shorter_way_round() -> None:
    watch = watch_of(BEND, AT, BESIDE)
    turned = Pose(4.5, 4.5, -3.1)  # 0.083 rad farther to the left
    watch.look([command(FAST, SLOW), command(0.3, 0.3)], [Pose(2.5, 2.5, -(2 * pi - 6.2)), turned])
    got = watch.report()
    assert got["ticks"] == got["angle"] == shares(tables=0.5, tightened=0.0, turned=0.0, blended=0.5, braked=0.0)
    assert set(got["metres"].values()) == {0.0}, "nobody drove: no share of anything"


@pytest.mark.parametrize("activity", Activity)
def test_a_robot_that_stands_is_braked_if_it_is_under_way(activity: Activity) -> None:
    watch = watch_of(BEND, AT)
    watch.look([command(0.0, 0.0, activity=activity)], [AT])
    assert watch.report()["ticks"]["braked"] == (activity not in IDLE)
    watch.look([command(FAST, SLOW, activity=activity)], [AT])
    assert watch.report()["ticks"]["tables"] == (1.0 if activity in IDLE else 0.5), "who drives is never idle"


def test_without_a_command_in_force_nothing_is_weighed() -> None:
    watch = watch_of(BEND, AT)
    watch.look([None], [Pose(2.6, 2.5, 0.4)])
    assert watch.state.labels == [None]
    assert all(set(watch.report()[by].values()) == {0.0} for by in BY)
    watch.look([command(FAST, SLOW)], [Pose(2.6, 2.5, 0.5)])
    assert watch.report()["angle"]["tables"] == 1.0, "of the 0.1 rad since then"


# --- what the tables are asked ---


def asked(sense: FreeDistances, heading: float, scale: float = 1.0, unit: float = 1.0) -> tuple[float, float]:
    """Ask the paper's tables, with degrees to the right."""
    paper = Controller(load_profile("paper"))
    by = unit * scale
    left, right = paper.wheel_speeds(sense.left / by, sense.front / by, sense.right / by, -degrees(heading))
    return 0.4 * left, 0.4 * right


def label_of(watch: SteeringWatch, command: Command) -> Steering | None:
    watch.look([command], [AT])
    return watch.state.labels[0]


@pytest.mark.parametrize(
    ("heading", "scale", "unit"), [(0.4, 1.0, 1.0), (-1.0, 1.0, 1.0), (0.4, 0.8, 1.0), (0.4, 0.7, 1.3)]
)
def test_the_tables_are_asked_with_the_sense_given_and_the_heading_and_scale_told(
    heading: float, scale: float, unit: float
) -> None:
    watch = unfed(with_settings(ROOM, robot={"distance_scale": unit}), AT)
    watch.note_distances(0, [TIGHT])
    speeds = asked(TIGHT, heading, scale, unit)
    assert label_of(watch, command(*speeds, heading=heading, scale=scale)) is TABLES
    assert label_of(watch, command(*speeds, heading=heading, scale=0.9 * scale)) is not TABLES
    assert label_of(watch, command(*asked(TIGHT, heading, scale, 1.1 * unit), heading=heading)) is not TABLES


def test_a_heading_to_the_left_is_positive_and_believed() -> None:
    watch = watch_of(ROOM, AT)
    speeds = asked(FAR, 1.0)
    assert speeds[0] < speeds[1], "to the left"
    assert label_of(watch, command(*speeds, heading=1.0)) is TABLES
    assert label_of(watch, command(*speeds, heading=-1.0)) is BLENDED


def test_a_late_command_is_judged_by_the_sense_that_it_answers() -> None:
    watch = unfed(ROOM, AT)
    speeds = asked(TIGHT, 0.0)
    lasting = round(COMMAND.timeout / 0.05)
    watch.note_distances(0, [TIGHT])
    for tick in range(1, lasting + 1):
        watch.note_distances(tick, [FAR])
        assert label_of(watch, command(*speeds, tick=0)) is TABLES
        assert label_of(watch, command(*speeds, tick=tick)) is not TABLES
    watch.note_distances(lasting + 1, [FAR])
    assert label_of(watch, command(*speeds, tick=0)) is BLENDED, "forgotten: no such command is in force"
    assert label_of(watch, command(*speeds, tick=99)) is BLENDED, "of a tick that nobody was told of"


def test_each_robot_is_judged_by_its_own_sense() -> None:
    watch = unfed(ROOM, AT, BESIDE)
    watch.note_distances(0, [TIGHT, FAR])
    commands = [command(*asked(TIGHT, 0.0)), command(*asked(TIGHT, 0.0))]
    watch.look(commands, [AT, BESIDE])
    assert watch.state.labels == [TABLES, BLENDED]


def test_scales_are_told_by_their_time_and_mean() -> None:
    watch = watch_of(ROOM, AT)
    for scale in (1.0, 0.4, 0.8, 1.0):
        watch.look([command(0.2, 0.2, scale=scale)], [AT])
    watch.look([command(0.0, 0.0, scale=0.4, activity=Activity.DONE)], [AT])  # asks nothing
    assert watch.report()["scaled"] == {"time": pytest.approx(2 * 0.05), "mean": pytest.approx(0.6)}


# --- in a world ---


def test_a_label_that_a_robot_gives_itself_changes_nothing() -> None:
    world = World(ROOM, [AT], 1)
    fields = msgspec.to_builtins(command(0.3, -0.3)) | {"v": VERSION, "steering": "tables"}
    world.step({"r1": decode(msgpack.packb(fields), Command, COMMAND.limit)})
    assert world.measures.steering.state.labels == [TURNED]


def test_the_world_judges_the_sense_it_gave_and_the_commands_in_force() -> None:
    world = World(BEND, [AT], 1)
    lasting = round(COMMAND.timeout / world.dt)
    labels = []
    for tick in range(lasting + 3):
        world.step({"r1": command(FAST, SLOW)} if tick == 0 else {})
        labels.append(world.measures.steering.state.labels[0])
    assert labels == [TABLES] * (lasting + 1) + [None] * 2
    assert make_truth(world).bodies[0].steering is None


def test_in_a_run_every_metre_is_some_labels(paper: Scenario) -> None:
    simulation = Simulation.of(paper, 3, 1)
    simulation.run(limit=30.0)
    watch, record = simulation.world.measures.steering, simulation.world.measures.recorder
    assert sum(weights[1] for weights in watch.state.weights.values()) == pytest.approx(sum(record.counts.path_length))
    assert all(sum(watch.report()[by].values()) == pytest.approx(1.0) for by in BY)


def test_tables_that_see_no_aim_steer_less_of_the_angle(paper: Scenario) -> None:
    """What a robot says of its heading is true here: so the share tells how much of the way the tables found."""
    blind = Scenario(paper.settings, paper.map, constant_rules(paper.profile, "medium", "medium"))
    shares = [Simulation.of(scenario, 2, 1).run(limit=60.0)["steering"]["angle"] for scenario in (paper, blind)]
    assert shares[0]["tables"] > 0.5 > shares[1]["tables"]
