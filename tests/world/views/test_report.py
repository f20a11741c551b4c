"""The report of a tiny run: four bodies, commands written by hand, no robots. Every field is worked out beside it.

The room is 8 m by 4 m inside walls, cells of 1 m, ten a row. A rim speed changes by 0.1 m/s a tick of 0.05 s.

r1 drives 0.24 m straight and says that it is at its target, 0.24 m ahead; twice it says that it holds another cell.
r2 creeps into the wall on the right. r4 creeps into r3, which stands, and both hold one cell; they then wait for each
other, for ever. r3 gives its only stop up.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.messages import Activity, Command
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import planning_grid
from tests.shared import scenario_of
from tests.world.shared import command
from world.views.metrics import shortest_length, shortest_lengths
from world.views.report import list_within, missing, report
from world.world import World

COLUMNS = 10
AT = (Pose(2.5, 2.5, 0.0), Pose(8.79, 3.5, 0.0), Pose(5.0, 1.5, 0.0), Pose(4.59, 1.5, 0.0))
STOPS = [[[2.74, 2.5]], [[8.5, 3.5], [8.5, 4.5]], [[0.5, 0.5]], [[5.6, 1.5]]]  # r3's lies in a wall
CELLS = {"r1": [22], "r2": [38, 39], "r3": [14, 15], "r4": [14]}  # row * 10 + column; 39 is of the wall
TICKS = 1220
DT = 0.05  # s
DRIVEN = 12  # ticks in which r1 is told 0.4 m/s: it drives at 0.1, 0.2, 0.3, nine times 0.4, then 0.3, 0.2, 0.1
LENGTH = DT * (0.6 + 9 * 0.4 + 0.6)  # m
ARRIVES = 14  # tick at which r1 is there and says so
PRESSES = 6  # ticks in which r2 and r4 are told 0.1 m/s: 5 mm each, two of them until they touch
TICK_WALL = {"p50": 0.01, "p99": 0.02, "p99.9": 0.03, "max": 0.04}  # s
WRONG = (100, 101, 102, 200)  # ticks in which r1 declares a cell beside its own


def scenario() -> Scenario:
    traffic = {"cell": 1.0, "offset": [0.0, 0.0]}
    return scenario_of(own_targets=STOPS, targets=[], return_home=False, reach=0.01, robots=4, traffic=traffic)


def r1(tick: int) -> dict[str, Any]:
    speed = 0.4 if tick < DRIVEN else 0.0
    note = [("joint_plan", "leads 2 robots")] if tick == 30 else []
    over = Activity.DONE if tick >= ARRIVES else Activity.DRIVE
    wrong = {"held": [23]} if tick in WRONG else {}
    return {"left": speed, "right": speed, "activity": over, "reached": [tick >= ARRIVES],
            "notes": note, "replans": 2 if tick > 50 else 1, **wrong}  # fmt: skip


def pressing(tick: int) -> dict[str, Any]:
    speed = 0.1 if tick < PRESSES else 0.0
    return {"left": speed, "right": speed}


def r2(tick: int) -> dict[str, Any]:
    shut = Activity.BLOCKED if 100 <= tick < 108 else Activity.DRIVE
    return pressing(tick) | {"activity": shut}


def r3(tick: int) -> dict[str, Any]:
    waits = {"activity": Activity.GIVE_WAY, "waits": ["r4"]} if tick >= PRESSES + 4 else {}
    return {"activity": Activity.DRIVE, "unreachable": [0], "replans": 7} | waits


def r4(tick: int) -> dict[str, Any]:
    return pressing(tick) | {"activity": Activity.DRIVE, "waits": ["r3"] if tick >= PRESSES + 4 else []}


HAND: dict[str, Callable[[int], dict[str, Any]]] = {"r1": r1, "r2": r2, "r3": r3, "r4": r4}


def run(ticks: int = TICKS) -> World:
    world = World(scenario(), list(AT), 1)
    for tick in range(ticks):
        commands: dict[str, Command] = {}
        for name, says in HAND.items():
            fields = {"activity": Activity.READY, "tick": tick, "held": CELLS[name], **says(tick)}
            commands[name] = command(heading=1.0, **fields)  # the tables would turn left: nobody drives as they say
        world.step(commands)
    return world


def summed_up(world: World, reason: str = "nobody moves") -> dict[str, Any]:
    return report(
        world, shortest_lengths(world), scenario="by hand", seed=17, robots_per_process=2, pace="2.0", wall_time=7.0,
        late_commands=3, tick_wall=TICK_WALL, reason=reason, not_reproducible=["why"], lost=["r2"],
    )  # fmt: skip


def flat(value: object, name: str = "") -> Iterator[tuple[str, Any]]:
    """Return every field with the way to it, ``a.b.c``."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from flat(item, f"{name}.{key}" if name else key)
    else:
        yield name, value


SINKS = 0.003  # m, as deep as two shapes press into each other before the solver parts them
CREPT = 0.01 + SINKS / 2  # m, to the touch, and into it and back
SHARED = (PRESSES - 2) * DT * 0.1 / 2  # m, r4 pushes r3 along at half its speed: bodies are of one mass
WAITED = TICKS - (PRESSES + 4)  # ticks that r3 and r4 wait for each other
TOLD = DRIVEN + 2 * PRESSES  # robot ticks in which somebody is told to drive
STANDING = (ARRIVES - DRIVEN) + 2 * (TICKS - PRESSES) + TICKS  # and in which somebody under way is not
UNTOLD = DT * 0.6 + SHARED  # m, r1 after its last such tick, and r3, which is pushed
WAYS = LENGTH + 2 * CREPT + 2 * SHARED  # m, of all

# fmt: off
STEERING = {  # nobody was given any sense to ask the tables about, and nobody turns
    **{f"steering.{by}.{label}": 0.0 for by in ("ticks", "metres", "angle")
       for label in ("braked", "tables", "tightened", "turned", "blended")},
    "steering.ticks.blended": pytest.approx(TOLD / (TOLD + STANDING)),
    "steering.ticks.braked": pytest.approx(STANDING / (TOLD + STANDING)),
    "steering.metres.blended": pytest.approx(1.0 - UNTOLD / WAYS, abs=0.02),
    "steering.metres.braked": pytest.approx(UNTOLD / WAYS, abs=0.02),
    "steering.scaled.time": 0.0, "steering.scaled.mean": 1.0,
}
ALWAYS: dict[str, Any] = {
    "scenario": "by hand", "seed": 17, "robots": 4, "robots_per_process": 2, "pace": "2.0", "complete": False, "passed": False, "reason": "nobody moves",
    "lost": ["r2"], "reproducible": False, "not_reproducible": ["why"],
    "sim_time": pytest.approx(TICKS * DT), "wall_time": 7.0, "real_time_factor": pytest.approx(TICKS * DT / 7.0),
    "ticks": TICKS, "late_commands": 3, **{f"tick_wall.{name}": seconds for name, seconds in TICK_WALL.items()},
    "contacts.robot": 1, "contacts.wall": 1, "contacts.obstacle": 0, "avoidable_contacts": 2,  # r3 and r4 touch once, though each says so
    "clearance_min": pytest.approx(0.0, abs=SINKS),
    **STEERING,
}
ROBOTS: dict[str, dict[str, Any]] = {
    "r1": {"targets": 1, "reached": [pytest.approx(ARRIVES * DT)], "path_length": pytest.approx(LENGTH),
           "shortest_length": pytest.approx(0.24), "waiting": 0.0, "standing": 0.0, "replans": 2, "contacts": 0, "struck": 0,
           "stalled": 0, "laps": 0, "unreachable": []},
    "r2": {"targets": 2, "reached": [None, None], "path_length": pytest.approx(CREPT, abs=SINKS),
           "shortest_length": pytest.approx(0.29 + 1.0), "waiting": pytest.approx(8 * DT), "standing": pytest.approx((TICKS - PRESSES) * DT), "replans": 0, "contacts": 1,
           "struck": 0, "stalled": 1, "laps": 0, "unreachable": []},
    "r3": {"targets": 1, "reached": [None], "path_length": pytest.approx(SHARED, abs=1e-6), "shortest_length": None,
           "waiting": pytest.approx(WAITED * DT), "waits_for.r4": pytest.approx(WAITED * DT), "standing": 0.0, "replans": 7, "contacts": 1, "struck": 1, "stalled": 0,
           "laps": 0, "unreachable": [0]},
    "r4": {"targets": 1, "reached": [None], "path_length": pytest.approx(0.01 + SHARED, abs=1e-6),
           "shortest_length": pytest.approx(1.01), "waiting": 0.0, "standing": pytest.approx((TICKS - PRESSES) * DT), "replans": 0, "contacts": 1, "struck": 0, "stalled": 1, "laps": 0, "unreachable": []},
}
TRAFFIC: dict[str, Any] = {  # what the watch saw
    "conflicts": 2, "joint_plans": 1,
    "deadlocks": 1,  # r3 and r4
    "stalled": 2,  # r2 and r4; r3 has nothing left to do
    "longest_wait": pytest.approx((TICKS - PRESSES - 1) * DT),  # r3's, from the tick after the last push
    "settling": 0.0,  # the run is not complete
    "overlaps": 1,  # r3 and r4 both hold cell 14, all the time
    "outside": 2,  # r1, twice
    "intrusions": 0,
}
# fmt: on


def test_every_field_of_a_report_is_what_a_hand_works_out() -> None:
    world = run()
    got = dict(flat(summed_up(world)))
    expected = ALWAYS | {"digest": world.measures.recorder.digest}
    expected |= dict(flat(TRAFFIC, "traffic")) | dict(flat(ROBOTS, "per_robot"))
    assert sorted(got) == sorted(expected), "no field that nobody has worked out"
    for name, value in expected.items():
        assert got[name] == value, name


def test_a_complete_run_needs_no_reason_and_a_clock_that_stood_gives_no_factor() -> None:
    floor = scenario_of(targets=[[2.5, 2.5]], return_home=False)
    world = World(floor, [AT[0]], 1)
    for _ in range(2):
        world.step({"r1": command(reached=[True], activity=Activity.DONE)})
    summary = report(
        world, shortest_lengths(world), scenario="s", seed=1, robots_per_process=1, pace="max",
        wall_time=0.0, late_commands=0, tick_wall=None, reason="late",
    )  # fmt: skip
    assert (summary["complete"], summary["reason"], summary["real_time_factor"]) == (True, "", 0.0)
    assert missing(world) == ""


def test_what_is_missing_is_one_sentence() -> None:
    assert missing(run(30)) == "not reached: r2 target 1, target 2; r3 target 1 (no path); r4 target 1"
    assert missing(run()).endswith("; r4 target 1; r2 made no progress for 61 s, r4 made no progress for 61 s")
    world = run(30)
    world.measures.verdict.state.text = "no way exists for r1, r2 to reach their targets together"
    assert missing(world).startswith(f"{world.measures.verdict.state.text}; not reached: r2 target 1, ")


def test_a_status_message_takes_the_sentence_however_many_robots_there_are() -> None:
    robots = 256
    world = World(scenario_of(map={"text": "\n".join(["." * 20] * 20)}), [Pose(1.0, 1.0, 0.0)] * robots, 1)
    world.measures.verdict.state.text = "x" * 2000
    assert "not reached: r001 target 1, home; r002" in missing(world)
    assert len(missing(world)) < 2000


def test_the_shortest_way_is_from_stop_to_stop_or_there_is_none() -> None:
    grid = planning_grid(scenario())
    assert shortest_length(grid, (2.5, 2.5), [(4.5, 2.5), (4.5, 3.5), (4.5, 2.5)]) == pytest.approx(4.0)
    assert shortest_length(grid, (2.5, 2.5), []) == 0.0
    assert shortest_length(grid, (2.5, 2.5), [(4.5, 2.5), (0.5, 0.5), (4.5, 2.5)]) is None


@given(st.lists(st.text("ab", min_size=1, max_size=50), min_size=1), st.integers(1, 100))
def test_a_list_fits_and_counts_what_it_leaves_out(parts: list[str], room: int) -> None:
    text = list_within(parts, ", ", room)
    names, _, more = text.partition(" and ")
    kept = names.split(", ")
    assert kept == parts[: len(kept)]
    assert len(kept) + (int(more.removesuffix(" more")) if more else 0) == len(parts)
    assert len(names) <= max(room, len(parts[0]))
