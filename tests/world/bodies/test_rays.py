"""The compiled rays of the world, compared with pymunk's segment queries in random scenes.

Where a ray grazes a corner or a disc, the last bit of a number decides whether it hits. So each scene is given to pymunk
three times: with all shapes a little larger, a little smaller, and as they are. What it measures among the larger ones
is the least that a ray may read, among the smaller ones the most. Where these two agree, the ray has to read what it
measures among the shapes as they are.
"""

from collections.abc import Sequence
from math import cos, hypot, pi, sin
from typing import Final, NamedTuple

import numpy as np
import pymunk
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm.geometry import Pose, from_frame
from world.bodies import rays

ROWS, COLUMNS = 6, 8  # cells
EDGE: Final = 1e-6  # m, by which shapes are seen larger or smaller
CLOSE: Final = 1e-6  # m, how near the judge a ray has to be
SHARP: Final = 1e-4  # m: where least and most differ by no more, the ray does not graze
ROUNDING: Final = 1e-9  # m
EVERYTHING: Final = pymunk.ShapeFilter()

Place = tuple[float, float]


class Disc(NamedTuple):
    x: float  # m
    y: float
    radius: float


class Box(NamedTuple):
    x: float  # m
    y: float
    yaw: float  # rad
    half_length: float  # m
    half_width: float


class Scene(NamedTuple):
    """Solid cells of a floor, discs and boxes; rays start in the first disc."""

    solid: frozenset[tuple[int, int]]  # row, column
    side: float  # m, of a cell
    origin: Pose  # of the floor, in the map's frame
    discs: tuple[Disc, ...]  # the robot that looks comes first
    boxes: tuple[Box, ...]
    yaw: float  # rad, of the robot that looks

    def cast(self, angles: Sequence[float], reach: float) -> list[float]:
        """Ask the compiled code: from the first disc's centre."""
        return self.cast_from_edge(angles, 0.0, reach)

    def cast_from_edge(self, angles: Sequence[float], radius: float, reach: float) -> list[float]:
        """Ask it for the first disc as a robot of ``radius``: from its edge."""
        discs = self._discs()
        discs[0, 2] = radius
        at = np.zeros(1, np.int64), np.array([self.yaw]), discs, self._boxes(), np.array(angles)
        return [float(distance) for distance in rays.cast_all(*self._floor(), *at, reach)[0]]

    def sees_each(self, a: Place, *places: Place) -> list[bool]:
        """Ask it to which places no wall is between."""
        return [bool(one) for one in rays.are_in_sight(*self._floor(), *a, np.array(places))]

    def _floor(self) -> tuple[NDArray[np.uint8], float, float, float, float]:
        cells = np.zeros((ROWS, COLUMNS), np.uint8)
        for cell in self.solid:
            cells[cell] = 1
        return (cells, self.side, *self.origin)

    def _discs(self) -> NDArray[np.float64]:
        return np.array(self.discs, np.float64)

    def _boxes(self) -> NDArray[np.float64]:
        return np.array(self.boxes, np.float64).reshape(-1, 5)


def space_of(scene: Scene, wider: float, walls_only: bool = False) -> pymunk.Space:
    """Put the scene's shapes into pymunk, each ``wider`` [m] on every side, without the robot that looks.

    One pair of sides is moved by twice as much: no ray that meets a corner exactly meets the wider one's too.
    """
    space = pymunk.Space()

    def add(corners: list[Place]) -> None:
        space.add(pymunk.Poly(space.static_body, corners))

    for row, column in scene.solid:
        low_x, low_y = column * scene.side - wider, row * scene.side - 2 * wider
        high_x, high_y = (column + 1) * scene.side + wider, (row + 1) * scene.side + 2 * wider
        corners = ((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y))
        add([from_frame(scene.origin, x, y) for x, y in corners])
    if walls_only:
        return space
    for x, y, yaw, half_length, half_width in scene.boxes:
        along, across = half_length + wider, half_width + 2 * wider
        corners = ((along, across), (-along, across), (-along, -across), (along, -across))
        add([from_frame(Pose(x, y, yaw), u, v) for u, v in corners])
    for x, y, radius in scene.discs[1:]:
        space.add(pymunk.Circle(space.static_body, radius + wider, (x, y)))
    return space


def first_hit(space: pymunk.Space, start: Place, heading: float, reach: float) -> float:
    """Measure with pymunk; its ``alpha`` is the share of the way, and 0 from inside a shape."""
    end = (start[0] + reach * cos(heading), start[1] + reach * sin(heading))
    hit = space.segment_query_first(start, end, 0.0, EVERYTHING)
    return reach if hit is None else hit.alpha * reach


def assert_judged(scene: Scene, angles: Sequence[float], read: Sequence[float], reach: float, radius: float) -> None:
    """Hold what rays from an edge read, ``radius`` [m] off the centre, against the three judges."""
    x, y, _ = scene.discs[0]
    spaces = [space_of(scene, wider) for wider in (EDGE, 0.0, -EDGE)]
    for angle, got in zip(angles, read, strict=True):
        least, exact, most = (
            max(0.0, first_hit(space, (x, y), scene.yaw + angle, radius + reach) - radius) for space in spaces
        )
        assert least - ROUNDING <= got <= most + ROUNDING, (angle, least, got, most)
        meets = least - ROUNDING <= exact <= most + ROUNDING  # pymunk may miss a corner that it should meet exactly
        if meets and most - least <= SHARP:
            assert got == pytest.approx(exact, abs=CLOSE), angle


# --- what is drawn: anything, and what lies exactly on edges, in corners and along cells ---

turns = st.floats(-pi, pi) | st.sampled_from([k * pi / 4 for k in range(-4, 5)])
lengths = st.floats(0.05, 1.5) | st.sampled_from([0.25, 0.5, 1.0])
solids = st.frozensets(st.tuples(st.integers(0, ROWS - 1), st.integers(0, COLUMNS - 1)), max_size=20)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    side = draw(st.sampled_from([0.5, 1.0]) | st.floats(0.1, 1.0))
    origin = Pose(draw(st.floats(-9.0, 9.0)), draw(st.floats(-9.0, 9.0)), draw(turns))
    origin = draw(st.sampled_from([Pose(0.0, 0.0, 0.0), origin]))

    def place() -> Place:
        u = draw(st.floats(-1.0, COLUMNS + 1.0) | st.integers(0, 2 * COLUMNS).map(lambda k: k / 2))
        v = draw(st.floats(-1.0, ROWS + 1.0) | st.integers(0, 2 * ROWS).map(lambda k: k / 2))
        return from_frame(origin, u * side, v * side)

    discs = [Disc(*place(), draw(lengths)) for _ in range(draw(st.integers(1, 4)))]
    boxes = [Box(*place(), draw(turns), draw(lengths), draw(lengths)) for _ in range(draw(st.integers(0, 3)))]
    return Scene(draw(solids), side, origin, tuple(discs), tuple(boxes), draw(turns))


many = settings(max_examples=300)
reaches = st.floats(0.01, 12.0) | st.sampled_from([0.5, 1.0, 1.6])


AT_A_CORNER = Scene(
    frozenset(), 0.6592734975111059, Pose(0.0, 0.0, 0.0), (Disc(0.0, 1.3185469950222117, 1.0),),
    (Box(0.0, 2.6370939900444235, 3 * pi / 4, 0.5, 0.5), Box(0.0, 0.0, 0.0, 1.0, 1.0)), -pi / 2,
)  # fmt: skip


@many
@example(AT_A_CORNER, [pi], 1.0)
@given(scenes(), st.lists(turns, min_size=1, max_size=6), reaches)
def test_a_ray_from_a_centre_ends_where_pymunks_does(scene: Scene, angles: list[float], reach: float) -> None:
    assert_judged(scene, angles, scene.cast(angles, reach), reach, 0.0)


@many
@given(scenes(), st.lists(turns, min_size=1, max_size=6), reaches)
def test_a_ray_from_an_edge_ends_where_pymunks_does(scene: Scene, angles: list[float], reach: float) -> None:
    radius = scene.discs[0].radius
    read = scene.cast_from_edge(angles, radius, reach)
    assert all(0.0 <= distance <= reach for distance in read)
    assert_judged(scene, angles, read, reach, radius)


@many
@given(scenes(), st.data())
def test_two_places_see_each_other_unless_pymunk_hits_a_wall_between(scene: Scene, data: st.DataObject) -> None:
    (ax, ay), (bx, by) = (
        from_frame(
            scene.origin,
            data.draw(st.floats(-1.0, COLUMNS + 1.0)) * scene.side,
            data.draw(st.floats(-1.0, ROWS + 1.0)) * scene.side,
        )
        for _ in range(2)
    )
    assume(hypot(bx - ax, by - ay) > 10 * EDGE)
    wide, narrow = (
        space_of(scene, wider, walls_only=True).segment_query_first((ax, ay), (bx, by), 0.0, EVERYTHING)
        for wider in (EDGE, -EDGE)
    )
    seen, itself = scene.sees_each((ax, ay), (bx, by), (ax, ay))
    assert seen is (wide is None) or (wide is not None and narrow is None), "either way where the sight grazes a wall"
    assert itself


@many
@given(scenes(), turns)
def test_a_ray_reads_nothing_free_if_and_only_if_it_starts_inside_something(scene: Scene, angle: float) -> None:
    x, y, _ = scene.discs[0]
    wide, narrow = (space_of(scene, wider).point_query_nearest((x, y), 0.0, EVERYTHING) for wider in (EDGE, -EDGE))
    (read,) = scene.cast([angle], 5.0)
    if narrow is not None:
        assert read == 0.0
    if wide is None:
        assert read > 0.0


# --- edges, one by one ---

ALONE: Final = Scene(frozenset(), 1.0, Pose(0.0, 0.0, 0.0), (Disc(2.5, 2.5, 0.25),), (), 0.0)
WALL: Final = ALONE._replace(solid=frozenset({(2, 5)}))  # from x = 5 to 6, y = 2 to 3
DISC: Final = ALONE._replace(discs=(*ALONE.discs, Disc(5.5, 2.5, 0.5)))
BOX: Final = ALONE._replace(boxes=(Box(5.5, 2.5, 0.0, 0.5, 0.25),))
TURNED: Final = ALONE._replace(boxes=(Box(5.5, 2.5, pi / 2, 0.25, 0.5),))  # the same box, named the other way round


def at(scene: Scene, x: float, y: float) -> Scene:
    """Put the robot that looks elsewhere."""
    return scene._replace(discs=(Disc(x, y, 0.25), *scene.discs[1:]))


# fmt: off
EDGES: dict[str, tuple[Scene, float, float, float]] = {  # scene, angle, reach: how far a ray from the centre gets
    "nothing there":                      (ALONE, 0.0, 4.0, 4.0),
    "a wall":                             (WALL, 0.0, 4.0, 2.5),
    "a disc":                             (DISC, 0.0, 4.0, 2.5),
    "a box":                              (BOX, 0.0, 4.0, 2.5),
    "a turned box":                       (TURNED, 0.0, 4.0, 2.5),
    "a wall out of range":                (WALL, 0.0, 2.49, 2.49),
    "a disc out of range":                (DISC, 0.0, 2.49, 2.49),
    "a box out of range":                 (BOX, 0.0, 2.49, 2.49),
    "a wall just in range":               (WALL, 0.0, 2.51, 2.5),
    "a disc just in range":               (DISC, 0.0, 2.51, 2.5),
    "a box just in range":                (BOX, 0.0, 2.51, 2.5),
    "a wall behind":                      (WALL, pi, 4.0, 4.0),
    "a disc behind":                      (DISC, pi, 4.0, 4.0),
    "a box behind":                       (BOX, pi, 4.0, 4.0),
    "in a wall":                          (at(WALL, 5.5, 2.5), 0.7, 4.0, 0.0),
    "in a disc":                          (at(DISC, 5.6, 2.5), 0.7, 4.0, 0.0),
    "in a disc's middle":                 (at(DISC, 5.5, 2.5), 0.7, 4.0, 0.0),
    "in a box":                           (at(BOX, 5.6, 2.5), 0.7, 4.0, 0.0),
    "at a wall's face":                   (at(WALL, 5.0, 2.5), 0.0, 4.0, 0.0),
    "at a disc's edge":                   (at(DISC, 5.0, 2.5), 0.0, 4.0, 0.0),
    "at a box's face":                    (at(BOX, 5.0, 2.5), 0.0, 4.0, 0.0),
    "past a wall":                        (at(WALL, 2.5, 3.001), 0.0, 4.0, 4.0),
    "past a disc":                        (at(DISC, 2.5, 3.001), 0.0, 4.0, 4.0),
    "past a box":                         (at(BOX, 2.5, 2.751), 0.0, 4.0, 4.0),
    "just not past a wall":               (at(WALL, 2.5, 2.999), 0.0, 4.0, 2.5),
    "just not past a box":                (at(BOX, 2.5, 2.749), 0.0, 4.0, 2.5),
    "off the floor":                      (at(WALL, -3.5, 2.5), 0.0, 12.0, 8.5),
    "off the floor and away from it":     (at(WALL, -3.5, 2.5), pi, 12.0, 12.0),
}
# fmt: on


@pytest.mark.parametrize("name", EDGES)
def test_an_edge_case(name: str) -> None:
    scene, angle, reach, expected = EDGES[name]
    assert scene.cast([angle], reach) == [pytest.approx(expected, abs=CLOSE)]
    assert_judged(scene, [angle], scene.cast([angle], reach), reach, 0.0)


def test_a_tangent_to_a_disc_may_go_either_way_but_no_further() -> None:
    for off in (-1e-12, 0.0, 1e-12):
        (read,) = at(DISC, 2.5, 3.0 + off).cast([0.0], 4.0)
        assert read == 4.0 or read == pytest.approx(3.0, abs=1e-4)


def test_the_nearest_of_several_things_counts_and_the_own_disc_does_not() -> None:
    scene = DISC._replace(solid=frozenset({(2, 7)}), boxes=(Box(4.0, 2.5, 0.3, 0.1, 0.1),))
    (read,) = scene.cast([0.0], 9.0)
    assert read == pytest.approx(1.5 - 0.1 / cos(0.3), abs=CLOSE)
    assert scene._replace(boxes=()).cast([0.0], 9.0) == [pytest.approx(2.5)]
    assert scene._replace(boxes=(), discs=ALONE.discs).cast([0.0], 9.0) == [pytest.approx(4.5)]


def test_a_place_sees_itself_and_nothing_behind_a_wall_wherever_the_floor_lies() -> None:
    scene = WALL._replace(origin=Pose(3.0, -1.0, 0.5))
    here, hidden = from_frame(scene.origin, 2.5, 2.5), from_frame(scene.origin, 7.5, 2.5)
    assert scene.sees_each(here, here, hidden) == [True, False]
