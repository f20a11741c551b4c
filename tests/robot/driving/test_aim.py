"""Aims: the farthest point of the way that a straight line reaches through reserved cells, clear of walls."""

from dataclasses import replace
from math import cos, hypot, pi, sin

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st

from swarm.geometry import Pose, distance, from_frame
from swarm.maps.occupancy import WALL, OccupancyMap, Point
from swarm.motion.drive import gap_to_boxes
from swarm.planning.grid import Grid
from swarm.planning.path import line_is_free
from swarm.robot.driving.aim import Aiming, distance_along
from swarm.robot.tuning import AIM
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.settings import NEAR, TrafficConstants
from tests.robot.driving.shared import RADIUS, cells_as_shape, room, solid
from tests.traffic.maps import BAY, DOOR, SIDE, Drawn, lane

COLUMNS = DOOR.cells.columns
A = DOOR.at("a")[0]
GRID = Grid.grown(DOOR.occupancy, RADIUS, resolution=0.1)
WALLS = solid(DOOR.occupancy)
origins = st.builds(Pose, st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-pi, pi))


def aiming(drawn: Drawn = DOOR) -> Aiming:
    return Aiming(drawn.cells, RADIUS)


def middles(cells: tuple[int, ...], drawn: Drawn = DOOR) -> list[Point]:
    return [drawn.cells.centre(cell) for cell in cells]


# --- which point ---


def test_on_a_straight_way_it_aims_at_the_last_waypoint() -> None:
    held = (A, A + 1, A + 2)
    assert aiming().choose(GRID, Pose(*middles(held)[0], pi), held, middles(held)) == middles(held)[-1]


def test_it_aims_no_farther_than_a_straight_way_goes() -> None:
    held = (A, A + 1, A + 1 - COLUMNS)
    waypoints = middles(held)
    assert aiming().choose(None, Pose(*waypoints[0], 0.0), held, waypoints) == waypoints[1]
    stairs = (*held, A + 2 - COLUMNS)
    assert aiming().choose(None, Pose(*waypoints[1], 0.0), stairs, middles(stairs)) == waypoints[2]


def test_near_a_corner_it_aims_between_its_waypoints_and_not_back() -> None:
    held = (A + 2, A + 2 - COLUMNS)
    here, there = middles(held)
    pose = Pose(here[0] - 0.54, here[1] - 0.26, -pi / 2)  # beside the corner that it has to drive round
    x, y = aiming().choose(None, pose, (A + 1, *held), (here, there))
    assert x == pytest.approx(here[0])
    assert there[1] < y < here[1]


OPEN = Drawn(*["." * 8] * 6)
B = 2 * OPEN.cells.columns + 3  # a cell in the middle


@pytest.mark.parametrize("longer", [False, True])
def test_between_its_waypoints_means_on_the_line_to_the_second(longer: bool) -> None:
    """It comes from below and has to drive round a corner to the right; the way may go on upwards."""
    up = OPEN.cells.columns
    x, y = OPEN.cells.centre(B)
    waypoints = (B, B + 1, *[B + 1 + 2 * up] * longer)
    held = (B - up, *waypoints, B + 1 + up)
    pose = Pose(x + 0.26, y - 0.54, 0.0)
    aim = aiming(OPEN).choose(None, pose, held, middles(waypoints, OPEN))
    assert aim[1] == pytest.approx(y)
    assert x + 0.1 < aim[0] < x + SIDE - 0.1


@pytest.mark.parametrize(("off", "hidden"), [(0.1, False), (0.34, False), (0.42, True)])
def test_for_a_stop_near_the_edge_of_its_cell_it_aims_at_the_middle(off: float, hidden: bool) -> None:
    """Beside the last cell nothing is held: there the footprint would lie over the edge."""
    x, y = OPEN.cells.centre(B)
    stop = (x + SIDE, y + off)
    aim = aiming(OPEN).choose(None, Pose(x, y, 0.0), (B, B + 1), [(x, y), stop])
    assert aim == pytest.approx((x + SIDE, y) if hidden else stop)


@pytest.mark.parametrize(("off", "to_stop"), [(0.385, True), (0.395, False)])
def test_along_the_edge_of_its_cells_it_keeps_a_centimetre_at_least(off: float, to_stop: bool) -> None:
    """Half a cell is 0.6 m and the radius 0.2 m: 0.39 m beside the middle a centimetre is left."""
    x, y = OPEN.cells.centre(B)
    stop = (x + SIDE, y + off)
    aim = aiming(OPEN).choose(None, Pose(x, y + off, 0.0), (B, B + 1), [(x, y), stop])
    assert (aim == stop) is to_stop


def test_where_nothing_is_reached_it_aims_at_the_first_waypoint_wherever_that_lies() -> None:
    x, y = OPEN.cells.centre(B)
    stop, pose = (x, y + 0.42), Pose(x - 0.1, y, 0.0)
    assert aiming(OPEN).choose(None, pose, (B,), [stop]) == stop
    assert aiming(OPEN).choose(None, pose, (B,), [stop, (x + 3 * SIDE, y + 0.42)]) == stop


def test_where_no_other_point_is_to_be_reached_it_aims_at_the_first() -> None:
    held = (A, A + 1 - COLUMNS)  # they meet in a corner alone
    (x, y), _ = waypoints = middles(held)
    assert aiming().choose(None, Pose(x - 0.36, y + 0.36, 0.0), held, waypoints[:1]) == waypoints[0]
    assert aiming().choose(None, Pose(x, y, 0.0), (A,), [waypoints[0], DOOR.cells.centre(A + 3)]) != waypoints[1]


def test_a_point_where_it_is_already_is_no_aim() -> None:
    held = (A, A + 1)
    here, there = middles(held)
    near = Pose(there[0] + 0.9 * AIM.nearest, there[1], 0.0)
    x, _ = aiming().choose(None, near, held, [here, there])
    assert x < there[0], "it is there; what is left is a place on the way"
    assert aiming().choose(None, Pose(*there, 0.0), held, [there]) == there, "unless there is no other"


def test_where_a_place_beside_the_middle_is_hidden_it_aims_at_the_middle() -> None:
    """A stop in a corner of its cell, from round a corner."""
    held = (A + 1, A + 2, A + 2 - COLUMNS)
    here, corner, below = middles(held)
    stop = (below[0] - 0.3, below[1] - 0.3)
    pose = Pose(corner[0] + 0.36, corner[1] - 0.1, -pi / 2)
    points = [corner, stop]
    held_now = (A + 2, A + 2 - COLUMNS)
    aim = aiming().choose(None, pose, held_now, points)
    assert aim in {below, stop}
    hidden = aiming().choose(None, Pose(here[0], here[1], 0.0), held, [here, corner, stop])
    assert hidden == corner


@example(x=-0.0546875, y=0.01953125, way=[1, COLUMNS, 1], walled=False)  # 0.6 mm short of the gap to a shut cell
@given(
    x=st.floats(-0.36, 0.36),
    y=st.floats(-0.36, 0.36),
    way=st.lists(st.sampled_from([1, -1, COLUMNS, -COLUMNS]), min_size=1, max_size=4),
    walled=st.booleans(),
)
def test_no_aim_lies_beyond_cells_that_are_shut_or_behind_a_wall(
    x: float, y: float, way: list[int], walled: bool
) -> None:
    """The footprint follows the straight line there, judged by shapely."""
    cells, start = DOOR.cells, DOOR.at("d")[0] - 3
    held = [start]
    for step in way:
        if held[-1] + step in cells.neighbours[held[-1]] and held[-1] + step not in held:
            held.append(held[-1] + step)
    waypoints = middles(tuple(held))
    pose = Pose(waypoints[0][0] + x, waypoints[0][1] + y, 0.0)
    assume(cells.can_fit_disc(held, pose.x, pose.y, RADIUS + AIM.gap))
    aim = aiming().choose(GRID if walled else None, pose, held, waypoints)
    if aim == waypoints[0]:
        return  # the middle of the cell that it is in: all that is left
    line = shapely.LineString([(pose.x, pose.y), aim]).buffer(RADIUS, quad_segs=32)
    assert shapely.covers(shapely.buffer(cells_as_shape(cells, held), 1e-6), line)
    assert not walled or line.distance(WALLS) > 0.0
    others = [point for point in waypoints[1:] if distance(pose, point) > AIM.nearest]
    for point in others[others.index(aim) + 1 :] if aim in others else others:
        straight = shapely.LineString([(pose.x, pose.y), point]).buffer(RADIUS + AIM.gap, quad_segs=32)
        leaves = not shapely.covers(shapely.buffer(cells_as_shape(cells, held), -1e-3), straight)  # or nearly
        assert leaves or (walled and straight.distance(WALLS) < 2e-3), "a farther one could have been chosen"


@pytest.mark.parametrize("beside", [AIM.gap + 0.01, (AIM.gap + AIM.tight_gap) / 2, AIM.tight_gap / 2])
def test_from_beside_a_wall_the_next_cell_is_aimed_at(beside: float) -> None:
    corridor = Drawn("########", "#a....b#", "########")
    (a,) = corridor.at("a")
    held, (x, y) = (a, a + 1, a + 2), corridor.cells.centre(a)
    pose = Pose(x, y - SIDE / 2 + RADIUS + beside, 0.0)
    grid = Grid.grown(corridor.occupancy, RADIUS, resolution=0.1)
    assert room(solid(corridor.occupancy), pose) == pytest.approx(beside)
    chosen = aiming(corridor).choose(grid, pose, held, middles(held, corridor))
    assert chosen[0] > x


def half_wall() -> CellMap:
    """Return 3 x 3 cells. The cell in the middle is half wall: no robot can stand in it, but one may pass through."""
    solid = np.zeros((36, 36), dtype=np.uint8)
    solid[12:24, 12:17] = WALL
    return CellMap(OccupancyMap(solid, SIDE / 12, Pose(0.0, 0.0, 0.0)), side=SIDE, radius=0.23)


HALF = half_wall()
HALF_GRID = Grid.grown(HALF.occupancy, RADIUS, resolution=0.1)
MIDDLE = 4


@given(x=st.floats(1.93, 2.17), back=st.floats(0.0, 0.97), up=st.booleans())
def test_from_room_beside_its_way_in_a_cell_that_is_half_wall_the_aims_lead_back(
    x: float, back: float, up: bool
) -> None:
    """Not to the middle of that cell, which is no place to drive to: a robot drove to and fro before it for ever."""
    assert not HALF.stands[MIDDLE]
    way = (MIDDLE, MIDDLE + HALF.columns, MIDDLE + HALF.columns - 1) if up else (MIDDLE, 1, 0)
    pose = Pose(x, 2 * SIDE - back if up else SIDE + back, 0.0)
    there, points = Aiming(HALF, RADIUS), [HALF.centre(cell) for cell in way]
    for _ in range(40):
        aim = there.choose(HALF_GRID, pose, way, points)
        assert line_is_free(HALF_GRID, (pose.x, pose.y), aim, AIM.tight_gap)
        share = min(1.0, 0.05 / distance(pose, aim))
        pose = Pose(pose.x + share * (aim[0] - pose.x), pose.y + share * (aim[1] - pose.y), 0.0)
        if HALF.cell_of(pose.x, pose.y) == way[1]:
            return
    pytest.fail(f"it is still at {pose}")


def test_behind_a_corner_in_a_narrow_lane_the_aim_is_on_the_path_back_also_beyond_what_is_held() -> None:
    """The lane's middle is on the edge of two columns: the cell above on its left is not held yet."""
    floor = lane()
    cells = CellMap(floor, side=SIDE, radius=0.23)
    grid, pose = Grid.grown(floor, RADIUS, resolution=0.1), Pose(1.25, 2.0, pi / 2)
    way = (4, 7, 8)
    aim = Aiming(cells, RADIUS).choose(grid, pose, (3, *way), [cells.centre(cell) for cell in way])
    assert aim[1] > 2.6, "out of the lane"
    assert line_is_free(grid, (pose.x, pose.y), aim, AIM.tight_gap)


def test_the_floor_as_it_is_known_shuts_an_aim_off() -> None:
    grid = Grid.grown(BAY.occupancy, RADIUS, resolution=0.1)
    (c,) = BAY.at("c")
    above = c + BAY.cells.columns
    held = (c, above, above + 2)
    points = middles(held, BAY)
    assert aiming(BAY).choose(grid, Pose(*points[0], 0.0), (*held, above + 1), points) == points[1]


def test_who_stands_gets_the_same_answer_until_something_changes() -> None:
    one, held = aiming(), (A, A + 1)
    here, there = middles(held)
    pose = Pose(*here, 0.0)
    assert one.choose(GRID, pose, held, [here, there]) == there
    assert one.choose(GRID, pose, held[:1], [here]) == here
    assert one.choose(None, pose, held, [here, there]) == there


# --- what walls alone leave in sight ---


def test_beyond_is_the_farthest_middle_that_walls_alone_leave_in_sight() -> None:
    one, pose = aiming(), Pose(*DOOR.cells.centre(A), 0.0)
    wall = A + 6  # in its row
    way = tuple(range(A + 1, A + 8))
    assert not DOOR.cells.stands[wall]
    aim = DOOR.cells.centre(A + 1)
    assert one.beyond(GRID, pose, way[:3], aim) == DOOR.cells.centre(A + 3), "held or not"
    assert one.beyond(GRID, pose, way, aim) == DOOR.cells.centre(wall - 1)
    assert one.beyond(GRID, pose, way[6:], aim) == aim
    assert one.beyond(GRID, pose, (), aim) == aim


# --- cells as boxes ---


def test_shut_are_the_cells_beside_the_held_ones() -> None:
    held = (A, A + 1)
    boxes = aiming().shut_boxes(held)
    assert len(boxes) == 4 * 3 - 2
    half = SIDE / 2
    for x, y in middles(held):
        assert gap_to_boxes(boxes, x, y) == pytest.approx(half)
    around = shapely.union_all([shapely.box(*box) for box in boxes.tolist()])
    assert around.intersection(cells_as_shape(DOOR.cells, held)).area == pytest.approx(0.0)
    assert around.union(cells_as_shape(DOOR.cells, held)).area == pytest.approx(12 * SIDE**2)
    assert aiming().shut_boxes(held[::-1]).tolist() == boxes.tolist()


@given(origins, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-pi, pi))
def test_on_a_lattice_that_lies_elsewhere_and_turned_places_and_boxes_are_the_same(
    origin: Pose, x: float, y: float, yaw: float
) -> None:
    there = Aiming(CellMap(replace(DOOR.occupancy, origin=origin), side=SIDE, radius=0.23), RADIUS)
    held, pose = (A, A + 1, A + 1 - COLUMNS), Pose(*DOOR.cells.centre(A), yaw)
    pose = pose._replace(x=pose.x + x, y=pose.y + y)
    moved = Pose(*from_frame(origin, pose.x, pose.y), yaw + origin.yaw)
    assert there.shut_boxes(held).tolist() == aiming().shut_boxes(held).tolist()
    assert there.to_lattice_frame(moved) == pytest.approx(pose, abs=1e-9)


@given(origins)
def test_on_a_lattice_that_lies_elsewhere_and_turned_the_aim_is_the_same_place(origin: Pose) -> None:
    floor = replace(DOOR.occupancy, origin=origin)
    there = Aiming(CellMap(floor, side=SIDE, radius=0.23), RADIUS)
    grid = Grid.grown(floor, RADIUS, resolution=0.1)
    held = (A, A + 1, A + 1 - COLUMNS)
    points = middles(held)
    for here in (*points[:2], (points[0][0] + 0.2, points[0][1] - 0.2)):
        aim = aiming().choose(GRID, Pose(*here, 0.0), held, points)
        moved = Pose(*from_frame(origin, *here), origin.yaw)
        found = there.choose(grid, moved, held, [from_frame(origin, *point) for point in points])
        assert found == pytest.approx(from_frame(origin, *aim), abs=1e-6)


# --- lengths and rooms ---


def test_the_way_is_measured_from_where_it_is_over_the_waypoints_beyond_the_first() -> None:
    assert distance_along(Pose(0.0, 0.0, 1.0), [(9.0, 9.0), (3.0, 4.0), (3.0, 10.0)]) == pytest.approx(11.0)
    assert distance_along(Pose(0.0, 0.0, 1.0), [(3.0, 4.0)]) == pytest.approx(5.0)


@given(angle=st.floats(-pi, pi), x=st.floats(-1.0, 1.0), y=st.floats(-1.0, 1.0))
def test_who_stands_as_near_its_place_as_it_has_to_touches_no_other_cell(angle: float, x: float, y: float) -> None:
    settings = TrafficConstants()
    a = A + 2
    middle = DOOR.cells.centre(a)
    place = DOOR.cells.move_inside(a, (middle[0] + x, middle[1] + y), settings.standing_room)
    stands = (place[0] + NEAR * cos(angle), place[1] + NEAR * sin(angle))
    assert hypot(stands[0] - place[0], stands[1] - place[1]) == pytest.approx(NEAR)
    assert DOOR.cells.cells_under_disc(*stands, settings.radius + settings.margin) == (a,)
