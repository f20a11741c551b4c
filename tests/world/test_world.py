"""The world: sensors, wheels, commands that expire, the radio model, clearances, and which reports it accepts."""

from math import pi

import pytest

from swarm.geometry import Pose
from swarm.maps.text import from_text
from swarm.messages import COMMAND, Command, Edit, Event, Kind, Order, Sense
from swarm.scenario.load import Scenario
from tests.shared import ROOM, scenario_of, with_settings
from tests.world.shared import command
from world.bodies.radio_model import RadioModel
from world.host.last_messages import merge_commands
from world.measure.clearance import ClearanceJudge
from world.simulate import Simulation
from world.world import World

AT = Pose(2.5, 2.5, 0.0)


def world_of(*starts: Pose, scenario: Scenario | None = None, seed: int = 1) -> World:
    return World(scenario or scenario_of(), list(starts) or [AT], seed)


def drive(world: World, left: float, right: float, **fields: object) -> Command:
    return command(left, right, run=world.run, tick=world.tick, **fields)


# --- sensors ---


def test_the_three_sectors_look_where_their_names_say() -> None:
    free = 1.6
    for yaw, expected in ((0.0, (None, 0.3, None)), (pi / 2, (None, None, 0.3)), (-pi / 2, (0.3, None, None))):
        sense = world_of(Pose(8.5, 3.5, yaw)).senses(lockstep=True)["r1"]
        for got, wanted in zip((sense.left, sense.front, sense.right), expected, strict=True):
            if wanted is None:
                assert got > 0.35 or got == free
            else:
                assert got == pytest.approx(wanted, abs=0.15)
        assert min(sense.left, sense.front, sense.right) == pytest.approx(0.3, abs=0.1)


def test_in_the_open_every_sensor_reads_its_range() -> None:
    sense = world_of(Pose(5.0, 3.0, 0.3)).senses(lockstep=True)["r1"]
    assert (sense.left, sense.front, sense.right) == (1.6, 1.6, 1.6)


def test_a_bearing_is_none_behind_a_wall_and_signed_like_yaw_in_sight() -> None:
    walled = "##########\n#........#\n####.#####\n#........#\n#........#\n##########\n"
    scenario = scenario_of(walled, targets=[[7.5, 1.5], [7.5, 4.5]])
    sense = World(scenario, [Pose(2.5, 1.5, 0.5)], 1).senses(lockstep=True)["r1"]
    assert sense.bearings[0] == pytest.approx(-0.5)
    assert sense.bearings[1] is None
    assert len(sense.bearings) == 3, "home too"


def test_sensor_noise_is_bounded_seeded_and_each_robots_own() -> None:
    noisy = with_settings(scenario_of(), sensors={"noise": 0.2, "bearing_noise_deg": 5.0})
    starts = (Pose(8.3, 3.5, 0.0), AT)
    one, same, other = (world_of(*starts, scenario=noisy, seed=seed) for seed in (1, 1, 2))
    readings = [ticks(world, 30) for world in (one, same, other)]
    assert readings[0] == readings[1]
    assert readings[0] != readings[2]
    fronts = [sense["r1"].front for sense in readings[0]]
    assert all(0.0 <= front <= 1.6 for front in fronts)
    assert len(set(fronts)) > 20
    alone = world_of(starts[0], scenario=noisy)
    assert [senses["r1"].front for senses in ticks(alone, 30)] == fronts


def ticks(world: World, count: int) -> list[dict[str, Sense]]:
    """Return what robots that stand sense, tick by tick."""
    found = []
    for _ in range(count):
        found.append(world.senses(lockstep=True))
        world.step({})
    return found


def test_asking_for_the_senses_changes_nothing() -> None:
    noisy = with_settings(scenario_of(), sensors={"noise": 0.2, "bearing_noise_deg": 5.0}, radio={"loss": 0.3})
    asked, left_alone = (Simulation.of(noisy, 2, 1) for _ in range(2))
    for tick in range(60):
        if tick == 30:
            for simulation in (asked, left_alone):
                simulation.world.edit(Edit(kind=Kind.WALL, low=(7.2, 1.2), high=(7.8, 1.8)))
                simulation.world.request("r1", Order(id="a", targets=[(2.5, 2.5), (4.5, 4.5), (7.5, 2.5)]))
        first, again = (asked.world.senses(lockstep=True) for _ in range(2))
        assert first == again
        assert asked.step() == left_alone.step()


# --- wheels and commands ---


def test_wheels_change_no_faster_than_they_can() -> None:
    world = world_of()
    most = 2.0 * world.dt
    for tick in range(1, 6):
        world.step({"r1": drive(world, 0.6, 0.6)})
        assert world.senses(lockstep=True)["r1"].linear == pytest.approx(min(0.6, tick * most))


def test_a_command_beyond_the_top_speed_is_cut_there() -> None:
    world = world_of(Pose(2.5, 3.5, 0.0))
    for _ in range(40):
        world.step({"r1": drive(world, 20.0, 20.0)})
    assert world.senses(lockstep=True)["r1"].linear == pytest.approx(1.6)


def test_a_command_expires_and_the_body_stops() -> None:
    world = world_of()
    for _ in range(10):
        world.step({"r1": drive(world, 0.4, 0.4)})
    speeds = []
    for _ in range(20):
        world.step({})
        speeds.append(world.senses(lockstep=True)["r1"].linear)
    lasting = round(COMMAND.timeout / world.dt)
    assert speeds[: lasting - 1] == pytest.approx([0.4] * (lasting - 1))
    assert speeds[-1] == 0.0
    assert sum(speed == pytest.approx(0.4) for speed in speeds) <= lasting


def test_what_happens_at_a_tick_is_sensed_at_the_next() -> None:
    world = world_of(AT, Pose(4.5, 2.5, 0.0))
    world.step({"r1": drive(world, 0.0, 0.0), "r2": drive(world, 0.0, 0.0)}, [("r1", 0)])
    senses = world.senses(lockstep=True)
    assert world.tick == 1
    assert senses["r2"].hears == [("r1", 0)]
    assert senses["r1"].hears == []
    world.step({"r1": drive(world, 0.0, 0.0), "r2": drive(world, 0.0, 0.0)})
    assert world.senses(lockstep=True)["r2"].hears == []


# --- whom it believes ---


def test_a_false_claim_is_told_once_and_not_counted() -> None:
    world = world_of()
    events = [world.step({"r1": drive(world, 0.0, 0.0, reached=[True, False])}) for _ in range(3)]
    assert [event.kind for event in events[0]] == ["false_claim"]
    assert events[0][0].text == "says it reached target 1 but is 5.10 m away; not counted"
    assert events[1] == events[2] == []
    assert not world.tasks.complete
    assert world.tasks.missions.reached_at == [[None, None]]


@pytest.mark.parametrize("claims", [True, False])
def test_a_stop_counts_once_when_the_body_is_there_whatever_the_robot_says(claims: bool) -> None:
    world = world_of(Pose(6.9, 3.5, 0.0), scenario=scenario_of(return_home=False))
    events: list[Event] = []
    while not events:
        there = world.poses()[0].x >= 7.5 - world.settings.reach
        events = world.step({"r1": drive(world, 0.6, 0.6, reached=[claims and there])})
    assert [(event.kind, event.text) for event in events] == [("reached", "is at target 1")]
    assert world.tasks.missions.reached_at[0][0] == pytest.approx(world.time - world.dt), (
        "at the tick that it is seen there"
    )
    assert world.step({"r1": drive(world, 0.0, 0.0, reached=[claims])}) == []


@pytest.mark.parametrize(("away", "counts"), [(0.299, True), (0.301, False)])
def test_a_stop_counts_within_the_reach(away: float, counts: bool) -> None:
    world = world_of(Pose(7.5 - away, 3.5, 0.0), scenario=with_settings(scenario_of(), reach=0.3))
    world.step({"r1": drive(world, 0.0, 0.0, reached=[True, False])})
    assert (world.tasks.missions.reached_at[0][0] is not None) is counts


def test_flags_of_stops_that_are_not_there_are_ignored() -> None:
    world = world_of(Pose(7.4, 3.5, 0.0))
    assert len(world.step({"r1": drive(world, 0.0, 0.0, reached=[True] * 9)})) == 2  # target 1, and home: its start
    assert world.tasks.complete


def test_a_touch_is_an_event_and_counts_by_kind_in_the_report() -> None:
    world = world_of(Pose(3.0, 3.5, 0.0), Pose(5.0, 3.5, pi))
    events = []
    for _ in range(60):
        events += world.step({name: drive(world, 0.6, 0.6) for name in world.robots})
    assert [(event.robot, event.text) for event in events] == [("r1", "touches robot r2"), ("r2", "touches robot r1")]
    assert [event.at for event in events] == [pytest.approx((4.0, 3.5), abs=0.02)] * 2
    assert [dict(counts) for counts in world.measures.recorder.counts.contact_counts] == [{"robot": 1}, {"robot": 1}]
    assert world.measures.recorder.judge.smallest == pytest.approx(0.0, abs=0.06)


# --- the radio model ---


def hears(positions: list[tuple[float, float]], seed: int = 1, sees: bool = True, **radio: object) -> list[list[int]]:
    settings = with_settings(scenario_of(), radio=radio).settings.radio
    poses = [Pose(x, y, 0.0) for x, y in positions]
    rows = RadioModel(settings, seed, lambda a, b: sees).hears(poses, [(number, 7) for number in range(len(poses))])
    return [[sender for sender, _ in row] for row in rows]


def test_the_radio_reaches_as_far_as_its_range_and_no_one_hears_himself() -> None:
    assert hears([(0, 0), (3, 0), (6.5, 0)], range=3.5) == [[1], [0, 2], [1]]
    assert hears([(0, 0), (3, 0), (6.5, 0)], range=3.4) == [[1], [0], []]


def test_walls_stop_the_radio_only_where_the_scenario_says_so() -> None:
    assert hears([(0, 0), (1, 0)], sees=False, line_of_sight=True) == [[], []]
    assert hears([(0, 0), (1, 0)], sees=False, line_of_sight=False) == [[1], [0]]


def test_loss_takes_its_share_drawn_with_the_seed() -> None:
    settings = with_settings(scenario_of(), radio={"loss": 0.3}).settings.radio
    poses = [Pose(float(x), 0.0, 0.0) for x in range(5)]

    def heard(seed: int) -> list[list[list[tuple[int, int]]]]:
        radio = RadioModel(settings, seed, lambda a, b: True)
        return [radio.hears(poses, [(number, tick) for number in range(5)]) for tick in range(500)]

    count = sum(len(row) for rows in heard(1) for row in rows)
    assert 0.67 < count / (500 * 20) < 0.73
    assert heard(1) == heard(1)
    assert heard(1) != heard(2)
    assert hears([(0, 0), (1, 0)], loss=1.0) == [[], []]


# --- the judge of gaps ---

# fmt: off
GAPS = {
    "in the middle of the room":   ([[(5.0, 3.0)]],                         3.0 - 1.0 - 0.2),
    "near the left wall":          ([[(1.5, 3.0)]],                         0.3),
    "touching the wall":           ([[(1.2, 3.0)]],                         0.0),
    "a little inside the wall":    ([[(1.1, 3.0)]],                         -0.1),
    "two apart":                   ([[(4.0, 3.0), (5.0, 3.0)]],             0.6),
    "two overlapping":             ([[(4.0, 3.0), (4.3, 3.0)]],             -0.1),
    "three, the last two nearest": ([[(2.0, 3.0), (5.0, 3.0), (5.5, 3.0)]], 0.1),
    "the nearest was long ago":    ([[(1.4, 3.0)]] + [[(5.0, 3.0)]] * 600,  0.2),
    "the nearest is the last":     ([[(5.0, 3.0)]] * 600 + [[(1.4, 3.0)]],  0.2),
}
# fmt: on


@pytest.mark.parametrize("name", GAPS)
def test_the_judge_of_gaps_on_named_cases(name: str) -> None:
    ticks, expected = GAPS[name]
    judge = ClearanceJudge(from_text(ROOM, 1.0), [0.2] * len(ticks[0]))
    for positions in ticks:
        judge.observe(positions)
    assert judge.smallest == pytest.approx(expected)


def test_without_anything_to_touch_the_gap_is_infinite() -> None:
    judge = ClearanceJudge(from_text("...\n...\n", 1.0), [0.2])
    judge.observe([(1.0, 1.0)])
    assert judge.smallest == float("inf")


@pytest.mark.parametrize("late_first", [True, False])
def test_of_two_commands_within_a_tick_nothing_told_once_is_lost(late_first: bool) -> None:
    late = command(0.1, tick=4, notes=[("joint_plan", "leads 8 robots")], sent=True)
    latest = command(0.3, tick=5, notes=[("halted", "something is near")])
    got = merge_commands(late, latest) if late_first else merge_commands(latest, late)
    assert (got.tick, got.left, got.sent) == (5, 0.3, True)
    assert got.notes == [("joint_plan", "leads 8 robots"), ("halted", "something is near")]
