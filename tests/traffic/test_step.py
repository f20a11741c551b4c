"""Whole fleets on small maps, in physics: no contacts, no deadlocks, and impossible goals are reported."""

from itertools import count
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.messages.traffic import Collect, Epoch, JointPlan, Record, TrafficBroadcast
from swarm.scenario.load import Scenario
from swarm.settings import StartSettings
from swarm.traffic import step as traffic
from swarm.traffic.interface import TrafficActivity, TrafficInputs
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.settings import TrafficConstants
from swarm.traffic.step import Traffic
from tests.shared import mostly_long
from tests.traffic.maps import BAY, CORRIDOR, DOOR, TREE, Drawn
from world.faults import Faults
from world.simulate import Simulation
from world.world import World


def assert_clean(report: dict[str, Any]) -> None:
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["overlaps"] == report["traffic"]["outside"] == report["traffic"]["deadlocks"] == 0


@pytest.mark.parametrize("reach", mostly_long("whole missions again", [8.0, 5.0], 8.0))
@pytest.mark.parametrize(
    ("drawn", "starts", "goals"),
    [(BAY, "ab", "ba"), (BAY, "abc", "bac"), (TREE, "abc", "bca"), (DOOR, "ab", "ba"), (DOOR, "abcdefgh", "hgfedcba")],
    ids=["bay", "bay with a rester", "tree", "door", "door 8"],
)
def test_small_maps_complete(drawn: Drawn, starts: str, goals: str, reach: float) -> None:
    report = drawn.fleet(starts, goals, reach=reach, loss=0.3).run(200)
    assert report["complete"], report["reason"]
    assert_clean(report)


def test_a_corridor_swap_is_called_unsolvable_within_seconds() -> None:
    report = CORRIDOR.fleet("ab", "ba").run(60)
    assert not report["complete"]
    assert "no way exists for r1, r2" in report["reason"]
    assert report["sim_time"] < 20
    assert report["traffic"]["deadlocks"] == 1, "a run that stands for good says so in one word"
    assert_clean(report | {"traffic": report["traffic"] | {"deadlocks": 0}})


@pytest.mark.long("two simulated runs with faults")
def test_the_same_faults_twice_are_the_same_run() -> None:
    def digest(seed: int) -> str:
        run = DOOR.fleet("abcd", "dcba", loss=0.3, faults=Faults(held_up=10, suspended=30), seed=seed).run(30)
        return str(run["digest"])

    assert digest(1) == digest(1) != digest(2)


def test_one_target_for_all_is_taken_in_turn() -> None:
    homes = DOOR.points("aceg")
    target = DOOR.points("d")[0]
    scenario = DOOR.scenario(homes, [[target, home] for home in homes], loss=0.3)
    report = Simulation.of(scenario, 4, 1).run(300)
    assert report["complete"], report["reason"]
    assert_clean(report)


def test_a_last_target_for_all_is_left_to_the_next() -> None:
    target = DOOR.points("d")[0]
    scenario = DOOR.scenario(DOOR.points("aceg"), [[target]] * 4, loss=0.3)
    simulation = Simulation.of(scenario, 4, 1)
    report = simulation.run(300)
    assert report["complete"], report["reason"]
    assert_clean(report)
    assert simulation.world.is_finished, "who is done is done wherever it has been moved to"


def test_a_robot_alone_in_a_corridor_turns_to_an_aim_behind_it() -> None:
    drawn = Drawn("#" * 22, "#a" + "." * 18 + "b#", "#" * 22, side=1.0)
    (start,), ((x, y),) = drawn.points("b"), drawn.points("a")
    scenario = drawn.scenario([start], [[(x, y)]])
    away = (*start, 0.0)
    settings = msgspec.structs.replace(scenario.settings, start=StartSettings(poses=[away]))
    simulation = Simulation.of(Scenario(settings, scenario.map, scenario.profile), 1, 1)
    behind: list[float] = []  # m, from the body to the middle of each cell held

    def watch(world: World) -> None:
        (body,) = world.poses()
        said = [spoken.traffic.own for spoken in simulation.broadcasts.values() if spoken.traffic is not None]
        behind.extend(drawn.cells.centre(cell)[0] - body.x for own in said for cell in own.held)

    report = simulation.run(120, watch=watch)
    assert report["complete"], report["reason"]
    assert_clean(report)
    assert report["per_robot"]["r1"]["path_length"] < 1.1 * report["per_robot"]["r1"]["shortest_length"]
    assert max(behind) < 2 * drawn.side, "no cells far behind"


CLEAR = Scan((0.0,), (1.6,), lambda bearings: [1.6] * len(bearings))
BODY = Scan((0.0,), (0.5,), lambda bearings: [1.6] * len(bearings))
WALL = Scan((0.0,), (0.5,), lambda bearings: [0.5] * len(bearings))
ASKS = Record(robot="r2", stamp=40, x=0.0, y=0.0, goal=0, need="r1", held=())

# fmt: off
DUE = {
    # slot, what the rays show, who is heard: in which of five ticks after the 40th a step is due
    "at its turns to speak, and in the middle between two": (0, CLEAR, None, [False, True, False, True, False]),
    "another slot":                                        (1, CLEAR, None, [True, False, True, False, True]),
    "near a wall":                                         (0, WALL,  None, [False, True, False, True, False]),
    "near a body that is on no map":                       (0, BODY,  None, [True] * 5),
    "while it leads":                                      (0, CLEAR, ASKS, [True] * 5),
}
# fmt: on


@pytest.mark.parametrize("name", DUE)
def test_a_step_is_due_in_every_second_tick_and_in_each_while_it_leads_or_a_body_is_near(name: str) -> None:
    slot, scan, heard, expected = DUE[name]
    drawn = Drawn("....", "a.cb", "....")
    traffic, pose = Traffic("r1", drawn.cells, TrafficConstants(), slot=slot), drawn.pose(drawn.at("a")[0])
    x, y = drawn.points("b")[0]
    records = [] if heard is None else [replace(heard, x=x, y=y, held=drawn.at("b"))]
    said = [TrafficBroadcast(own=record, others=()) for record in records]
    assert traffic.is_due(0, CLEAR), "there was no step yet"
    for tick in range(41):
        traffic.step(TrafficInputs(tick, pose, None, heard=said if tick == 40 else ()), drawn.cells)
    due = []
    for tick in range(41, 46):
        due.append(traffic.is_due(tick, scan))
        if due[-1]:
            traffic.step(TrafficInputs(tick, pose, None), drawn.cells)
    assert due == expected
    assert traffic.is_due(61, CLEAR), "ticks were left out"


@pytest.mark.parametrize(("listens", "gap"), [(False, 4), (True, 2)])
def test_it_speaks_twice_as_often_while_it_or_another_listens(listens: bool, gap: int) -> None:
    drawn, settings = Drawn("....", "a.cb", "...."), TrafficConstants()
    traffic, (x, y) = Traffic("r1", drawn.cells, settings), drawn.points("b")[0]
    spoken = []
    for tick in range(2 * settings.listen):
        other = Record(robot="r2", stamp=tick, x=x, y=y, goal=0, held=drawn.at("b"), listens=listens)
        heard = [TrafficBroadcast(own=other, others=())]
        if (
            traffic.step(TrafficInputs(tick, drawn.pose(drawn.at("a")[0]), None, heard=heard), drawn.cells).broadcast
            is not None
        ):
            spoken.append(tick)
    first = [tick for tick in spoken if tick < settings.listen]
    later = [tick for tick in spoken if tick >= settings.listen]
    assert first == list(range(0, settings.listen, 2)), "in the first slot, if it is told none"
    assert later == list(range(later[0], 2 * settings.listen, gap))


@pytest.mark.parametrize(("pause", "listens"), [(20, False), (21, True)])
def test_a_robot_that_was_away_for_more_ticks_than_the_gap_listens_again(pause: int, listens: bool) -> None:
    drawn, settings = Drawn("a.b"), TrafficConstants()
    traffic, pose, (goal,) = Traffic("r1", drawn.cells, settings), drawn.pose(drawn.at("a")[0]), drawn.points("b")
    for tick in (*range(50), 49 + pause):
        granted = traffic.step(TrafficInputs(tick, pose, goal), drawn.cells)
        assert (granted.activity is TrafficActivity.LISTENING) is (tick < settings.listen or (tick > 49 and listens))


def test_halted_with_its_body_in_a_walls_cell_a_robot_keeps_a_way_out() -> None:
    drawn = Drawn("#######", "#a...b#", "#.....#", "#######")
    traffic = Traffic("r1", drawn.cells, TrafficConstants())
    (x, y), (goal,) = drawn.cells.centre(drawn.at("a")[0]), drawn.points("b")
    pose = Pose(x + 0.5, y + 0.6, 0.0)  # over the wall above, and over two cells of the floor
    for tick in range(200):
        measured = 0.4 if 100 <= tick < 150 else 1.6
        granted = traffic.step(
            TrafficInputs(tick, pose, goal, scan=Scan((0.0,), (measured,), lambda _: (1.6,))), drawn.cells
        )
        assert drawn.cells.stands[granted.held[-1]]
        assert granted.activity is not TrafficActivity.CUT_OFF


def test_a_robot_at_rest_makes_room() -> None:
    report = Drawn("#######", "a..c..b", "###.###").fleet("ac", "bc").run(120)
    assert report["complete"], report["reason"]
    assert_clean(report)
    assert report["traffic"]["joint_plans"] >= 1


def test_a_dead_robot_is_driven_round() -> None:
    simulation = Drawn("....", "a.cb", "....").fleet("ac", "bc", faults=Faults(killed={"r2": 0.0}))
    report = simulation.run(100, over=lambda world: world.tasks.missions.reached_at[0] != [None])
    assert report["per_robot"]["r1"]["reached"] != [None]
    assert report["contacts"]["robot"] == 0


@pytest.mark.parametrize("late", [0.05, 0.1, 0.2])
def test_robots_that_answer_late_complete(late: float) -> None:
    report = DOOR.fleet("abcd", "hgfe", faults=Faults(late=late)).run(300)
    assert report["complete"], report["reason"]
    assert_clean(report)


@pytest.mark.long("minutes of simulated traffic")
def test_the_leader_dies_with_its_plan_just_made() -> None:
    simulation = DOOR.fleet("abcdefgh", "hgfedcba", faults=Faults(kill_leader_at=0.0))
    report = simulation.run(90)
    assert list(simulation.drill.dead) == ["r1"]
    assert report["contacts"]["robot"] == 0
    arrived = {robot for robot, one in report["per_robot"].items() if one["reached"] != [None]}
    dead = simulation.world.poses()[0]
    stood_in = set(DOOR.cells.cells_under_disc(dead.x, dead.y, 0.2))
    goals = dict(zip(simulation.world.robots, DOOR.at("hgfedcba"), strict=True))
    assert arrived >= {robot for robot, goal in goals.items() if goal not in stood_in} - {"r1"}
    assert len(arrived) >= 6


@pytest.mark.parametrize(
    "places",
    [
        ((0.45, 0.0), (1.95, 0.0)),  # both reach into the cell between them
        ((1.45, 0.3), (0.95, 0.1)),  # both are in it, back to back
        ((1.0, 0.3), (1.5, -0.2)),  # they have to pass each other in it
    ],
)
def test_bodies_that_start_in_one_cell_part(places: tuple[tuple[float, float], tuple[float, float]]) -> None:
    drawn = Drawn(".......", "a.....b", ".......")
    x, y = drawn.cells.centre(drawn.at("a")[0] + 1)
    starts = [(x + dx, y + dy) for dx, dy in places]
    report = Simulation.of(drawn.scenario(starts, [[point] for point in drawn.points("ba")]), 2, 1).run(100)
    assert report["complete"], report["reason"]
    assert report["contacts"]["robot"] == 0


def test_cells_too_large_for_the_radio_are_refused() -> None:
    with pytest.raises(ConfigError, match="too short for cells"):
        Traffic("r0", BAY.cells, TrafficConstants(radio_range=3.0))


def test_a_robot_with_another_goal_leaves_the_plan_that_led_to_the_old_one() -> None:
    floor = Drawn("abcd", "efgh")
    ways = {"r1": floor.at("cb"), "r2": floor.at("aefghd")}
    epoch = Epoch(50, "r1")
    plan = JointPlan(epoch=epoch, ways=ways, after={})
    r2 = Traffic("r2", floor.cells, TrafficConstants())
    (c, d), (x, y) = floor.points("cd"), floor.points("a")[0]
    told: list[tuple[tuple[int, ...], tuple[str, ...]]] = []
    for tick in range(70):
        own = Record(robot="r1", stamp=tick, x=c[0], y=c[1], goal=floor.at("b")[0], held=floor.at("c"))
        if tick >= 50:
            own = replace(own, collect=Collect(epoch, ("r1", "r2")), plan=plan if tick >= 55 else None)
        goal = d if tick < 60 else floor.points("b")[0]
        out = r2.step(TrafficInputs(tick, Pose(x, y, 0.0), goal, heard=[TrafficBroadcast(own=own)]), floor.cells)
        told.append((out.way, out.members))
    assert told[59] == (floor.at("aefghd"), ("r1", "r2"))
    assert told[60] == (floor.at("ab"), ())


# fmt: off
LEADS_ON: dict[str, tuple[str, str, bool]] = {  # the stop told as the next, the one that follows: it stays in the plan
    "as it told":        ("h", "h", True),
    "another one":       ("h", "b", False),
}
# fmt: on


@pytest.mark.parametrize("through", [True, False])
@pytest.mark.parametrize("name", LEADS_ON)
def test_a_plan_that_leads_on_through_a_target_stays_when_that_was_reached(name: str, through: bool) -> None:
    next_, follows, stays = LEADS_ON[name]
    floor = Drawn("abcd", "efgh")
    ways, epoch = {"r1": floor.at("cb"), "r2": floor.at("aefgh")}, Epoch(50, "r1")
    plan = JointPlan(epoch=epoch, ways=ways, after={}, through=through)
    r2 = Traffic("r2", floor.cells, TrafficConstants())
    (c, e), (x, y) = floor.points("ce"), floor.points("a")[0]
    told: list[tuple[tuple[int, ...], tuple[str, ...]]] = []
    for tick in range(70):
        own = Record(robot="r1", stamp=tick, x=c[0], y=c[1], goal=floor.at("b")[0], held=floor.at("c"))
        if tick >= 50:
            own = replace(own, collect=Collect(epoch, ("r1", "r2")), plan=plan if tick >= 55 else None)
        goal, then = (e, floor.points(next_)[0]) if tick < 60 else (floor.points(follows)[0], None)
        heard = [TrafficBroadcast(own=own)]
        out = r2.step(TrafficInputs(tick, Pose(x, y, 0.0), goal, then=then, heard=heard), floor.cells)
        if out.broadcast is not None and 30 <= tick < 60:
            assert out.broadcast.own.then == floor.at(next_)[0]
        told.append((out.way, out.members))
    assert told[59] == (floor.at("aefgh"), ("r1", "r2"))
    assert told[60][1] == (("r1", "r2") if stays and through else ())


def test_a_robot_kept_from_a_cell_that_it_holds_gives_it_up_and_takes_another_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    floor = Drawn("abc", "def")
    (x, y), goal = floor.points("ac")
    a, b = floor.at("ab")
    ticks = count()

    class KeptOnce:
        def check(self, progress: object, body: int, goal: int, **_: object) -> int | None:
            return b if next(ticks) == 60 else None

    monkeypatch.setattr(traffic, "BlockageChecker", KeptOnce)
    r1 = Traffic("r1", floor.cells, TrafficConstants())
    outs = [r1.step(TrafficInputs(tick, Pose(x, y, 0.0), goal), floor.cells) for tick in range(62)]
    assert (outs[59].held[:2], outs[59].way, outs[59].events) == ((a, b), floor.at("abc"), ())
    assert [(event.kind, event.text) for event in outs[60].events] == [
        ("halted", f"gave up cell {b}: a moving obstacle blocks the way into it")
    ]
    assert (outs[60].held, outs[60].way) == ((a,), floor.at("adefc"))
