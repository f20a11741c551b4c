"""Bodies, contacts and rays, compared with the closed form of the arc and an independent ray caster."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, distance, from_frame, integrate
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.text import from_text
from tests.shared import ROOM
from world.bodies.physics import Physics
from world.bodies.shapes import Contact

RADIUS, TOP, DT = 0.2, 1.6, 0.05
WIDE = from_text("#" * 40 + "\n" + ("#" + "." * 38 + "#\n") * 38 + "#" * 40 + "\n", 1.0)
SMALL = from_text(ROOM, 1.0)

twists = st.builds(Twist, st.floats(-1.6, 1.6), st.floats(-8.0, 8.0))
angles = st.floats(-pi, pi, exclude_min=True)


def alike(floor: OccupancyMap, poses: list[Pose]) -> Physics:
    """Put robots of one size on a floor."""
    return Physics(floor, [RADIUS] * len(poses), poses, [TOP] * len(poses), DT)


@given(st.builds(Pose, st.floats(15, 25), st.floats(15, 25), angles), st.lists(twists, min_size=1, max_size=20))
def test_a_free_body_ends_each_step_exactly_on_its_arc(pose: Pose, way: list[Twist]) -> None:
    physics = alike(WIDE, [pose])
    for twist in way:
        before = physics.pose(0)
        assert physics.roll([twist]) == []
        expected = integrate(before, twist, DT)
        assert distance(physics.pose(0), expected) < 1e-9
        assert abs(physics.pose(0).yaw - expected.yaw) % (2 * pi) == pytest.approx(0.0, abs=1e-9)


def reads(physics: Physics, robot: int, rays: list[float], reach: float) -> list[float]:
    measured: list[float] = physics.cast_all(np.array([robot]), np.array(rays), reach)[0].tolist()
    return measured


def drive(physics: Physics, ticks: int, *twists: Twist) -> list[Contact]:
    return [contact for _ in range(ticks) for contact in physics.roll(twists)]


AHEAD, BACK, STAND = Twist(1.0, 0.0), Twist(-1.0, 0.0), Twist(0.0, 0.0)


def test_a_wall_stops_a_body_and_the_touch_counts_once_however_long_it_lasts() -> None:
    physics = alike(SMALL, [Pose(7.5, 3.5, 0.0)])
    assert drive(physics, 60, AHEAD) == [Contact(0, "wall", None)]
    assert physics.pose(0).x == pytest.approx(9.0 - RADIUS, abs=1e-6)


def test_a_second_touch_after_letting_go_counts_again() -> None:
    physics = alike(SMALL, [Pose(8.5, 3.5, 0.0)])
    for _ in range(3):
        assert drive(physics, 20, AHEAD) == [Contact(0, "wall", None)]
        assert drive(physics, 10, BACK) == []


def test_an_obstacle_is_told_from_a_wall() -> None:
    floor = from_text("#####\n#...#\n#..o#\n#####\n", 1.0)
    physics = alike(floor, [Pose(1.5, 1.5, 0.0)])
    assert drive(physics, 40, AHEAD) == [Contact(0, "obstacle", None)]


def test_two_robots_that_meet_each_count_the_touch_once() -> None:
    physics = alike(SMALL, [Pose(3.0, 3.5, 0.0), Pose(5.0, 3.5, pi)])
    assert drive(physics, 40, AHEAD, AHEAD) == [Contact(0, "robot", 1), Contact(1, "robot", 0)]
    assert distance(physics.pose(0), physics.pose(1)) == pytest.approx(2 * RADIUS, abs=1e-6)


@pytest.mark.parametrize(
    ("middle", "order"),
    [
        (0, [(0, 1), (0, 2), (1, 0), (2, 0)]),
        (1, [(0, 1), (1, 0), (1, 2), (2, 1)]),
        (2, [(0, 2), (1, 2), (2, 0), (2, 1)]),
    ],
)
@pytest.mark.parametrize("mirrored", [False, True])
def test_contacts_of_one_tick_come_in_the_order_of_the_robots(
    middle: int, order: list[tuple[int, int]], mirrored: bool
) -> None:
    """Two robots drive into a third one from both sides."""
    sides = [(-0.42, AHEAD), (0.42, BACK)]
    placed = sides[::-1] if mirrored else sides
    placed.insert(middle, (0.0, STAND))
    physics = alike(SMALL, [Pose(5.0 + dx, 3.5, 0.0) for dx, _ in placed])
    assert physics.roll([twist for _, twist in placed]) == [Contact(robot, "robot", other) for robot, other in order]


@pytest.mark.parametrize(
    ("start", "twist", "at"),
    [
        (Pose(2.0, 3.5, pi), AHEAD, (1.0, 3.5)),  # the wall's face, beside the robot's centre
        (Pose(3.0, 2.0, -pi / 4), AHEAD, (3.8, 1.0)),
    ],
)
def test_a_contact_is_where_the_shapes_meet(start: Pose, twist: Twist, at: tuple[float, float]) -> None:
    physics = alike(SMALL, [start])
    for _ in range(60):
        if physics.roll([twist]):
            break
    (where,) = physics.touched_at.values()
    assert where == pytest.approx(at, abs=0.03)
    assert distance(physics.pose(0), Pose(*where, 0.0)) == pytest.approx(RADIUS, abs=0.01)


def test_who_is_told_to_stop_stops_in_that_tick() -> None:
    physics = alike(SMALL, [Pose(3.0, 3.5, 0.0), Pose(3.0, 2.0, 0.0)])
    drive(physics, 4, AHEAD, Twist(0.0, 1.0))
    drive(physics, 9, STAND, STAND)
    assert physics.poses() == [pytest.approx((3.2, 3.5, 0.0)), pytest.approx((3.0, 2.0, 0.2))]


def test_several_boxes_are_each_where_they_have_come_to() -> None:
    physics = alike(WIDE, [Pose(20.0, 20.0, 0.0)])
    for x, y in ((21.0, 20.0), (19.0, 20.0)):
        physics.add_mover(Pose(x, y, 0.0), None, (0.4, 0.2))
    physics.roll([STAND], [Pose(21.0, 20.0, pi / 2), Pose(18.9, 20.0, 0.0)])
    assert reads(physics, 0, [0.0, pi / 2, pi, -pi / 2], 1.6) == pytest.approx([0.7, 1.6, 0.7, 1.6], abs=1e-6)


def test_nothing_is_driven_through_even_at_top_speed() -> None:
    thin = from_text("#####\n" + "#.#.#\n" * 3 + "#####\n", 0.5)
    physics = Physics(thin, [0.05], [Pose(0.75, 1.25, 0.0)], [4.0], 0.5)
    assert {contact.kind for contact in drive(physics, 5, Twist(4.0, 0.0))} == {"wall"}
    assert physics.pose(0).x < 1.0


def test_who_stands_stays() -> None:
    physics = alike(SMALL, [Pose(3.0, 3.5, 1.0)])
    drive(physics, 100, STAND)
    assert physics.pose(0) == Pose(3.0, 3.5, 1.0)


# --- rays ---


def test_a_robot_does_not_see_itself_but_sees_the_other_which_hides_no_target() -> None:
    physics = alike(SMALL, [Pose(3.0, 3.5, 0.0), Pose(4.0, 3.5, 0.0)])
    assert reads(physics, 0, [0.0, pi], 1.6) == pytest.approx([0.6, 1.6], abs=1e-6)
    assert reads(physics, 1, [pi, 0.0], 1.6) == pytest.approx([0.6, 1.6], abs=1e-6)
    assert reads(physics, 1, [0.0], 9.0) == pytest.approx([4.8], abs=1e-6)
    assert physics.sees((3.0, 3.5), (5.0, 3.5))
    assert not physics.sees((3.0, 3.5), (9.5, 3.5)), "that is in the wall"


def test_a_floor_that_lies_elsewhere_and_turned_is_seen_and_touched_alike() -> None:
    origin = Pose(-7.0, 3.0, 0.6)
    start = Pose(*from_frame(origin, 8.0, 3.5), 0.6)
    physics = alike(OccupancyMap(SMALL.cells, 1.0, origin), [start])
    assert reads(physics, 0, [0.0, pi], 1.6) == pytest.approx([0.8, 1.6])
    assert [physics.sees(start[:2], from_frame(origin, x, 3.5)) for x in (8.9, 9.5)] == [True, False]
    assert set(drive(physics, 60, AHEAD)) == {Contact(0, "wall", None)}
    assert distance(physics.pose(0), Pose(*from_frame(origin, 9.0 - RADIUS, 3.5), 0.6)) < 1e-3


@pytest.mark.parametrize(("length", "width"), [(0.8, 0.2), (0.2, 0.8)])
def test_a_box_is_as_long_and_as_wide_as_it_is_and_turns(length: float, width: float) -> None:
    for yaw, along in ((0.0, length), (pi / 2, width), (pi, length)):
        physics = alike(WIDE, [Pose(20.0, 20.0, 0.0)])
        physics.add_mover(Pose(21.0, 20.0, yaw), None, (length, width))
        assert reads(physics, 0, [0.0], 1.6) == pytest.approx([1.0 - RADIUS - along / 2])
        physics.add_mover(Pose(20.0, 21.0, 0.0), 0.3, None)
        assert reads(physics, 0, [pi / 2], 1.6) == pytest.approx([1.0 - RADIUS - 0.3])
        assert physics.sees((20.0, 20.0), (22.0, 20.0)), "what moves hides nothing from the infrared sensor"


def test_movers_come_to_where_they_are_said_to_be() -> None:
    physics = alike(WIDE, [Pose(20.0, 20.0, 0.0)])
    physics.add_mover(Pose(21.0, 20.0, 0.0), 0.3, None)
    for tick in range(1, 11):
        physics.roll([STAND], [Pose(21.0 + 0.02 * tick, 20.0, 0.0)])
        assert reads(physics, 0, [0.0], 1.6) == pytest.approx([0.5 + 0.02 * tick], abs=1e-6)
