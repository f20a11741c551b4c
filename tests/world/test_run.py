"""A run apart from driving: its end, edits at their times, what watchers get, faults for a time."""

from math import pi

import pytest

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.messages import Activity, Command, Edit, Event, Kind, Steering
from swarm.robot.tuning import SAFETY
from swarm.scenario.load import Scenario
from tests.shared import scenario_of
from tests.world.shared import command
from world import simulate
from world.bodies.edits import apply_edit
from world.bodies.movers import Patrol
from world.faults import SILENT, Drill, Faults, Health, Spell
from world.measure.progress import STALLED
from world.measure.verdict import PROVEN
from world.simulate import Simulation
from world.views.truth import make_truth
from world.world import World

DT = 0.05  # s
AT, THERE = Pose(2.5, 2.5, 0.0), Pose(4.5, 4.5, 0.0)


def world_of(*starts: Pose, scenario: Scenario | None = None) -> World:
    return World(scenario or scenario_of(), list(starts) or [AT], 1)


def say(world: World, **fields: object) -> Command:
    return command(tick=world.tick, **fields)  # type: ignore[arg-type]


# --- when it is over ---


def test_a_run_is_over_when_everybody_is_done() -> None:
    world = world_of(AT, THERE)
    done = {"activity": Activity.DONE, "unreachable": [0, 1]}
    world.step({"r1": say(world, **done), "r2": say(world)})
    assert not world.is_finished
    assert world.tasks.unfinished_robots == ["r2"]
    world.step({"r2": say(world, **done)})
    assert world.is_finished


def test_who_says_that_it_is_done_and_has_not_been_there_is_named_once_and_not_believed() -> None:
    world = world_of(AT)
    events = [world.step({"r1": say(world, activity=Activity.DONE, unreachable=[1])}) for _ in range(3)]
    texts = [[event.text for event in some if event.kind == "false_claim"] for some in events]
    assert texts == [["says it is done but has not reached target 1; not counted"], [], []]
    assert not world.is_finished


def test_a_run_reports_the_time_that_it_took(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter((100.0, 100.5))
    monkeypatch.setattr(simulate, "perf_counter", lambda: next(clock))
    report = Simulation.of(scenario_of(), 1, 1).run(limit=1.0)
    assert (report["wall_time"], report["real_time_factor"]) == (0.5, pytest.approx(2.0))


# fmt: off
VERDICTS = {  # a note: whether it ends the run after a while, and what it leaves to say
    "unsolvable":    (True, True),
    "no_plan_found": (False, True),
    "joint_plan":    (False, False),
}
# fmt: on


@pytest.mark.parametrize("kind", VERDICTS)
def test_a_jam_proven_to_have_no_way_out_ends_the_run_after_a_while(kind: str) -> None:
    ends, said = VERDICTS[kind]
    world = world_of(AT, THERE)
    waits = {"r2": say(world, activity=Activity.GIVE_WAY)}
    world.step({"r1": say(world, notes=[(kind, "in words")])} | waits)
    for _ in range(round(PROVEN / DT) - 2):
        world.step({"r1": say(world, notes=[(kind, "again")])})  # saying it again starts no new count
        assert not world.is_finished
    for _ in range(2):
        world.step({})
    assert world.is_finished is ends
    assert (world.measures.verdict.state.text == "again") is said
    assert world.time < 10.0, "nobody waits long for a run that is over"


def test_who_reaches_a_stop_takes_the_proof_back() -> None:
    world = world_of(Pose(6.9, 3.5, 0.0), THERE)
    waits = {"r2": say(world, activity=Activity.GIVE_WAY)}
    world.step({"r1": say(world, notes=[("unsolvable", "no way")], left=0.6, right=0.6)} | waits)
    while world.tasks.missions.left[0] == 0:
        world.step({"r1": say(world, left=0.6, right=0.6)})
    for _ in range(2 * round(PROVEN / DT)):
        world.step({})
    assert not world.is_finished
    assert world.measures.verdict.state.text == ""
    events = [event for _ in range(round(PROVEN / DT) + 2) for event in world.step(
        {"r1": say(world, notes=[("unsolvable", "no way")], activity=Activity.GIVE_WAY)} | waits)]  # fmt: skip
    assert world.is_finished, "it still holds, as its robot says again"
    assert world.measures.verdict.state.text == "no way"
    assert "unsolvable" not in [event.kind for event in events], "that is no news"


# fmt: off
VOICES = {  # who says that the jam has no solution, who waits, who drives about: whether the run ends
    "one robot's word":                   ("r1", "",   "",   False),
    "another one waits":                  ("r1", "r2", "",   True),
    "two say it":                         ("r1r2", "", "",   True),
    "only waiting":                       ("", "r1r2", "",   False),
    "it says so, waits, and is one":      ("r1", "r1", "",   False),
    "another one gets on":                ("r1", "r2", "r2", False),
    "the one that says so gets on":       ("r1", "r2", "r1", False),
}
# fmt: on


@pytest.mark.parametrize("name", VOICES)
def test_the_proof_of_a_jam_counts_if_nobody_gets_on_and_a_second_robot_says_so(name: str) -> None:
    says, waits, drives, ends = VOICES[name]
    world = world_of(Pose(2.5, 1.5, 0.0), Pose(2.5, 4.5, 0.0))
    for _ in range(round(1.5 * PROVEN / DT)):
        world.step({
            robot: say(
                world, left=0.6 * (robot in drives), right=0.6 * (robot in drives),
                activity=Activity.GIVE_WAY if robot in waits else Activity.DRIVE,
                notes=[("unsolvable", "no way")] * (robot in says),
            )
            for robot in world.robots
        })  # fmt: skip
    assert world.is_finished is ends


def test_a_robot_alone_needs_no_second_voice() -> None:
    world = world_of(AT)
    for _ in range(round(PROVEN / DT) + 2):
        world.step({"r1": say(world, notes=[("unsolvable", "no way")])})
    assert world.is_finished


# --- stops given up ---


def test_a_stop_given_up_is_said_once_and_one_that_is_not_there_never() -> None:
    world = world_of(AT)
    said = [world.step({"r1": say(world, unreachable=given_up)}) for given_up in ([], [0], [0], [0, 9], [0, 9, 1])]
    texts = [[event.text for event in events if event.kind == "unreachable"] for events in said]
    assert texts == [[], ["gives up target 1: no path leads there"], [], [], ["gives up home: no path leads there"]]


# --- who gets nowhere ---


def test_who_gets_nowhere_is_named_with_its_stop_and_whom_it_waits_for() -> None:
    world = world_of(AT, THERE)
    events: list[Event] = []
    for _ in range(round(STALLED / DT) + 2):
        commands = {"r1": say(world, waits=["r2", "r3"]), "r2": say(world, unreachable=[0, 1])}
        events += [event for event in world.step(commands) if event.kind == "stalled"]
    assert [(event.robot, event.text) for event in events] == [
        ("r1", "made no progress towards target 1 for 60 s: r2 is in its way to target 1")
    ]


# --- edits that the scenario plans ---

PLANNED = [
    {"at": 1.0, "kind": "wall", "low": [6.2, 1.2], "high": [6.8, 1.8]},
    {"at": 0.5, "kind": "obstacle", "low": [7.2, 1.2], "high": [7.8, 1.8]},
    {"at": 1.5, "kind": "free", "low": [6.2, 1.2], "high": [6.8, 1.8]},
    {"at": 1.2, "kind": "wall", "low": [2.2, 2.2], "high": [2.8, 2.8]},  # where a robot stands
]


def test_planned_edits_are_made_at_their_times_and_what_cannot_be_is_said() -> None:
    world = world_of(AT, scenario=scenario_of(edits=PLANNED))
    made: dict[float, list[tuple[str, str]]] = {}
    for _ in range(40):
        events = [event for event in world.step({}) if event.kind.startswith("edit")]
        if events:
            made[round(events[0].time, 2)] = [(event.kind, event.text) for event in events]
    assert made.pop(1.2)[0][0] == "edit_refused"
    assert made == {
        0.5: [("edit", "obstacle from (7.2, 1.2) to (7.8, 1.8)")],
        1.0: [("edit", "wall from (6.2, 1.2) to (6.8, 1.8)")],
        1.5: [("edit", "free from (6.2, 1.2) to (6.8, 1.8)")],
    }
    assert world.bodies.edits == 3


def test_an_edit_is_sensed_for_a_second_and_counted_for_ever() -> None:
    world = world_of(AT)
    edit = Edit(kind=Kind.WALL, low=(6.2, 1.2), high=(6.8, 1.8))
    world.edit(edit)
    heard = []
    for _ in range(30):
        sense = world.senses(lockstep=True)["r1"]
        heard.append((len(sense.edits), sense.edits_before))
        world.step({})
    assert heard == [(1, 0)] * 21 + [(0, 1)] * 9


# fmt: off
BEFORE = [  # rim speeds [m/s]; m, from the edge of the robot, below which no wall may be put up
    ((0.6, 0.6),   0.7**2 / 4 + 2 * 0.7 * DT + SAFETY.gap),  # it is 0.1 m/s faster by the next tick
    ((-0.6, 0.2),  0.7**2 / 4 + 2 * 0.7 * DT + SAFETY.gap),  # the faster wheel counts
    ((0.0, 0.2),   0.3**2 / 4 + 2 * 0.3 * DT + SAFETY.gap),
    ((0.0, 0.0),   0.0),
]
# fmt: on


@pytest.mark.parametrize(("wheels", "least"), BEFORE)
@pytest.mark.parametrize(("more", "allowed"), [(-0.001, False), (0.001, True)])
@pytest.mark.parametrize("late", [0, 1])
def test_how_near_to_a_robot_a_wall_may_be_put_up(
    wheels: tuple[float, float], least: float, more: float, allowed: bool, late: int
) -> None:
    """At 2 m/s2; the wall is the cell from 6 m on, the robot's radius 0.2 m. If it is sensed later, it drives on."""
    scenario = scenario_of()
    further = late * (max(map(abs, wheels)) + 2.0 * DT) * DT if any(wheels) else 0.0
    bodies = [("r1", Pose(6.0 - 0.2 - least - further - more, 3.5, 0.0), wheels, scenario.settings.robot)]
    wall, hole = (Edit(kind=kind, low=(6.2, 3.2), high=(6.8, 3.8)) for kind in (Kind.WALL, Kind.FREE))
    apply_edit(scenario.map, hole, bodies, DT)
    if allowed:
        assert apply_edit(scenario.map, wall, bodies, DT, late).cells[3, 6]
    else:
        with pytest.raises(ConfigError, match="r1 can stop before" if any(wheels) else "r1 stands there"):
            apply_edit(scenario.map, wall, bodies, DT, late)


# --- what watchers see ---


def test_the_truth_is_what_can_be_seen_from_outside() -> None:
    movers = [
        {"radius": 0.3, "waypoints": [[6.5, 1.5], [6.5, 4.5]], "speed": 0.5},
        {"size": [0.4, 0.2], "waypoints": [[7.5, 1.5], [7.5, 4.5]], "speed": 1.0},
    ]
    world = world_of(AT, scenario=scenario_of(movers=movers))
    world.senses(lockstep=True)
    world.step(
        {
            "r1": say(
                world, left=0.05, right=0.1, heading=0.3, scale=0.5, held=[3, 4], waits=["r9"], members=["r1", "r9"]
            )
        }
    )
    told = make_truth(world)
    (body,) = told.bodies
    pose = world.poses()[0]
    assert told.tick == 1
    assert told.time == pytest.approx(DT)
    assert (body.robot, body.x, body.y, body.yaw) == ("r1", pose.x, pose.y, pose.yaw)
    assert (body.left_v, body.right_v) == pytest.approx((0.05, 0.1))
    assert (body.heading, body.steering, body.activity, body.scale) == (0.3, Steering.BLENDED, Activity.DRIVE, 0.5)
    assert (body.held, body.waits, body.members) == ([3, 4], ["r9"], ["r1", "r9"])
    assert [(mover.radius, mover.size) for mover in told.movers] == [(0.3, (0.0, 0.0)), (0.0, (0.4, 0.2))]
    assert [(mover.x, mover.y, mover.yaw) for mover in told.movers] == [
        pytest.approx((6.5, 1.5 + 0.5 * DT, pi / 2)), pytest.approx((7.5, 1.5 + 1.0 * DT, pi / 2)),
    ]  # fmt: skip


# --- movers ---

# fmt: off
PLACES = {  # loop, time [s]: where it is on the way (0, 0), (3, 0), (3, 4) at 1 m/s
    "at the start":            (False, 0.0,   (0.0, 0.0, 0.0)),
    "on the first leg":        (False, 2.0,   (2.0, 0.0, 0.0)),
    "at the corner":           (False, 3.0,   (3.0, 0.0, pi / 2)),
    "on the second leg":       (False, 5.0,   (3.0, 2.0, pi / 2)),
    "turned round":            (False, 8.0,   (3.0, 3.0, -pi / 2)),
    "on the way back":         (False, 12.0,  (2.0, 0.0, pi)),
    "there again":             (False, 16.0,  (2.0, 0.0, 0.0)),
    "closing the loop":        (True, 9.5,    (1.5, 2.0, -2.2143)),
    "round again":             (True, 13.0,   (1.0, 0.0, 0.0)),
}
# fmt: on


@pytest.mark.parametrize("name", PLACES)
def test_where_a_mover_is_at_a_time(name: str) -> None:
    loop, time, place = PLACES[name]
    mover = {"radius": 0.3, "waypoints": [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]], "speed": 1.0, "loop": loop}
    (settings,) = scenario_of(movers=[mover]).settings.movers
    assert tuple(Patrol(settings).pose_at(time)) == pytest.approx(place, abs=1e-4)


# --- spells of faults ---


def test_a_spell_begins_and_ends_at_its_ticks() -> None:
    for health in (Health.HELD_UP, Health.SUSPENDED, Health.AWAY):
        drill = Drill(Faults(spells=(Spell("r1", health, 3, 4), Spell("r2", Health.HELD_UP, 5, 1))), 1, DT)
        seen = [drill.health("r1", tick * DT, leads=False) for tick in range(10)]
        assert seen == [Health.WELL] * 3 + [health] * 4 + [Health.WELL] * 3
        assert drill.struck == ({"r1"} if health in SILENT else set())
        assert [drill.health("r2", tick * DT, leads=False) for tick in range(4, 7)] == [
            Health.WELL, Health.HELD_UP, Health.WELL,
        ]  # fmt: skip


def test_a_process_born_again_goes_on_with_the_mission_and_the_floor_of_now() -> None:
    spell = Spell("r1", Health.AWAY, 120, 40)
    scenario = scenario_of(targets=[[4.5, 2.5], [7.5, 3.5]], return_home=False)
    simulation = Simulation.of(scenario, 1, 1, Faults(spells=(spell,)))
    first = simulation.robots[0]
    reached = []
    for tick in range(180):
        if tick == 140:
            simulation.world.edit(Edit(kind=Kind.WALL, low=(6.2, 1.2), high=(6.8, 1.8)))
        said = simulation.step()
        assert ("r1" in said.commands) is not (120 <= tick < 160)
        if "r1" in said.commands:
            reached.append(list(said.commands["r1"].reached))
    assert simulation.robots[0] is not first
    assert reached[119] == [True, False], "the first target is near"
    assert reached[120] == [True, False]
    assert not simulation.robots[0].has_missed_edits(simulation.world.senses(lockstep=True)["r1"])


def test_held_up_a_robot_thinks_and_speaks_and_stands() -> None:
    spell = Spell("r1", Health.HELD_UP, 0, 40)
    simulation = Simulation.of(scenario_of(), 1, 1, Faults(spells=(spell,)))
    before = simulation.world.poses()
    said = [simulation.step() for _ in range(40)]
    assert simulation.world.poses() == before
    assert sum(bool(one.spoken) for one in said) == 30 / 2 + 2, "while it listens twice as often"
    assert all((one.commands["r1"].left, one.commands["r1"].right) == (0.0, 0.0) for one in said)
