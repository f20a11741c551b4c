from typing import Any

import pytest
from msgspec.structs import replace

from dashboard.fold.overlays import Joint, Overlays, in_words, robots_in_detail, wait_arrows
from dashboard.fold.scene import scene_of
from swarm.messages import Activity, Body, Broadcast, Map, Steering, Truth
from swarm.messages.traffic import Entry, Epoch, JointPlan, Record, TrafficBroadcast
from swarm.scenario.load import Scenario
from swarm.traffic.lattice.placement import cells_of


def body(robot: str, **changes: Any) -> Body:  # noqa: ANN401
    still = Body(
        robot=robot, x=3.0, y=3.0, yaw=0.0, left_v=0.0, right_v=0.0, left=0.3, front=1.6, right=1.6,
        heading=0.0, steering=Steering.TABLES, activity=Activity.DRIVE,
    )  # fmt: skip
    return replace(still, **changes)


def floor_of(scenario: Scenario) -> Map:
    settings, packed = scenario.to_wire()
    return Map(packed=packed, scenario=settings)


def overlays_of(scenario: Scenario, *, known: bool = True) -> Overlays:
    floor = floor_of(scenario)
    settings = replace(floor.scenario.settings, map=replace(floor.scenario.settings.map, known=known))
    return Overlays(scene_of(replace(floor, scenario=replace(floor.scenario, settings=settings))))


@pytest.mark.parametrize(("selected", "told"), [("r2", "r2"), (None, "r1"), ("nobody", "r1")])
def test_the_rules_told_are_those_of_the_selected_robot_or_the_first(
    paper: Scenario, selected: str | None, told: str
) -> None:
    truth = Truth(run=0, tick=1, time=0.05, bodies=[body("r1", left=1.6), body("r2")])
    rules = overlays_of(paper).overlay_at(truth, selected).rules
    assert rules.startswith(f"**{told}** drive, steering: tables")
    assert ("IF left_obs is near AND right_obs is far AND front_obs is far THEN" in rules) is (told == "r2")


def test_held_cells_lie_where_the_robots_hold_them(paper: Scenario) -> None:
    scenario = paper
    cells = cells_of(scenario.map, scenario.settings)
    cell = cells.cell_of(3.0, 3.0)
    bodies = [body("r1", held=[cell], waits=["r2", "gone"]), body("r2", x=9.0)]
    drawn = overlays_of(scenario).overlay_at(Truth(run=0, tick=1, time=0.05, bodies=bodies))
    ((x, y, width, height),) = drawn.held["r1"]
    assert x <= 3.0 <= x + width
    assert y <= 3.0 <= y + height
    assert drawn.held["r2"] == []
    assert drawn.waits == [((3.0, 3.0), (9.0, 3.0))]


def test_nobody_waits_for_a_robot_that_is_not_there() -> None:
    assert wait_arrows({"r1": body("r1", waits=["r9"])}) == []


EPOCH = Epoch(10, "r2")


def said(robot: str, tick: int, run: int = 0, **traffic: Any) -> Broadcast:  # noqa: ANN401
    own = Record(robot=robot, stamp=tick, x=0.0, y=0.0, goal=0, **traffic)
    return Broadcast(
        robot=robot, run=run, tick=tick, x=0.0, y=0.0, yaw=0.0, activity=Activity.DRIVE, target=0, distance=1.0,
        reached=[False], traffic=TrafficBroadcast(own=own),
    )  # fmt: skip


def planned(paper: Scenario) -> tuple[Overlays, list[tuple[float, float]], list[Body]]:
    """Two robots of one plan, r2 to go first along three cells in a row and r1 to come after it."""
    scenario = paper
    cells = cells_of(scenario.map, scenario.settings)
    first = cells.cell_of(3.0, 3.0)
    way = (first, first + 1, first + 2)
    plan = JointPlan(epoch=EPOCH, ways={"r2": way[1:], "r1": way}, after={"r1": (Entry(1, "r2", 0), Entry(2, "r2", 1))})
    overlays = overlays_of(scenario)
    overlays.hear(said("r2", 20, epoch=EPOCH, plan=plan))
    overlays.hear(said("r1", 21, epoch=EPOCH))
    spots = [cells.centre(cell) for cell in way]
    return overlays, spots, [body("r1", x=spots[0][0], y=spots[0][1]), body("r2", x=spots[1][0], y=spots[1][1])]


def drawn(overlays: Overlays, bodies: list[Body], tick: int = 30, run: int = 0) -> list[Joint]:
    return overlays.joint(Truth(run=run, tick=tick, time=tick / 20, bodies=bodies))


def test_a_joint_plan_is_a_line_from_each_member_along_its_way(paper: Scenario) -> None:
    overlays, spots, bodies = planned(paper)
    [plan] = drawn(overlays, bodies)
    assert plan.leader == "r2"
    assert {robot: len(line) for robot, line in plan.ways.items()} == {"r1": 3, "r2": 2}
    assert [line[0] for line in plan.ways.values()] == spots[:2], "lines begin at the robots"
    (x1, y1), (x2, y2) = (line[-1] for line in plan.ways.values())
    assert ((x1 + x2) / 2, (y1 + y2) / 2) == pytest.approx(spots[2]), "side by side about the middle of the cell"
    assert x1 != x2


def test_a_line_is_as_long_as_the_way_still_to_come(paper: Scenario) -> None:
    overlays, spots, bodies = planned(paper)
    bodies[0] = replace(bodies[0], x=spots[1][0])  # it has not said so yet
    assert [len(line) for line in drawn(overlays, bodies)[0].ways.values()] == [2, 2]
    overlays.hear(said("r1", 40, epoch=EPOCH, left=2, entered=2))
    assert [len(line) for line in drawn(overlays, bodies)[0].ways.values()] == [2]
    overlays.hear(said("r2", 41))
    assert drawn(overlays, bodies) == []


def test_the_order_stands_where_two_have_still_to_go(paper: Scenario) -> None:
    overlays, spots, bodies = planned(paper)
    assert [(turn.at, turn.robots) for turn in drawn(overlays, bodies)[0].turns] == [(spots[2], "r2 > r1")]
    overlays.hear(said("r2", 40, epoch=EPOCH, left=1, entered=1))
    assert drawn(overlays, bodies)[0].turns == []


def test_the_newest_word_counts(paper: Scenario) -> None:
    overlays, _, bodies = planned(paper)
    overlays.hear(said("r1", 5))
    assert len(drawn(overlays, bodies)[0].ways) == 2


def test_who_is_silent_for_long_or_not_there_has_no_line(paper: Scenario) -> None:
    overlays, _, bodies = planned(paper)
    assert drawn(overlays, bodies, tick=1000) == []
    [plan] = drawn(overlays, bodies[:1])
    assert len(plan.ways) == 1


def test_a_plan_ends_with_its_run(paper: Scenario) -> None:
    overlays, _, bodies = planned(paper)
    assert drawn(overlays, bodies, run=1) == []
    overlays.hear(said("r1", 1, run=1))
    assert drawn(overlays, bodies, run=1) == []


def test_a_learned_floor_has_the_cells_told_lately_in_this_run(paper: Scenario) -> None:
    overlays, (height, width) = overlays_of(paper, known=False), paper.map.shape

    def cells(tick: int, run: int = 0) -> list[int]:
        learned = overlays.learned_floor(Truth(run=run, tick=tick, time=tick / 20, bodies=[]))
        assert learned is not None
        size = (learned.rows * learned.resolution, learned.columns * learned.resolution)
        assert size == pytest.approx((height * paper.map.resolution, width * paper.map.resolution))
        return learned.cells

    assert cells(0) == []
    overlays.hear(replace(said("r1", 100), walls=[7, 3]))
    overlays.hear(replace(said("r2", 500), walls=[3]))
    assert cells(600) == [3, 7]
    assert cells(900) == [3], "what nobody tells again is forgotten"
    overlays.hear(replace(said("r1", 1, run=1), walls=[5]))
    assert cells(2, run=1) == [5]
    assert cells(900) == [], "of the former run, nothing is known any more"


def test_a_floor_that_was_given_is_not_learned(paper: Scenario) -> None:
    overlays = overlays_of(paper)
    overlays.hear(replace(said("r1", 100), walls=[7]))
    assert overlays.overlay_at(Truth(run=0, tick=101, time=5.05, bodies=[])).learned is None


def test_long_orders_are_cut() -> None:
    assert in_words(tuple(f"r{number}" for number in range(1, 11))).endswith("> r8 > +2")


@pytest.mark.parametrize(
    ("robots", "selected", "expected"),
    [(8, "r1", 8), (9, "r3", ("r3",)), (9, None, ("r1",)), (9, "nobody", ("r1",)), (0, None, ())],
)
def test_whose_details_are_drawn(robots: int, selected: str | None, expected: int | tuple[str, ...]) -> None:
    names = tuple(f"r{number}" for number in range(1, robots + 1))
    assert robots_in_detail(names, selected) == (names if isinstance(expected, int) else expected)
