"""The picture of a control surface: its colours, lines and labels, read back from the pixels."""

from itertools import combinations, pairwise
from math import floor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from swarm.errors import ConfigError
from swarm.fuzzy import Controller, load_profile
from swarm.fuzzy.explain import explain
from swarm.fuzzy.surface import COLOURS, CONTOUR, GAP, LEFT, SIDE, TOP, marks, surface

PAPER = Controller(load_profile("paper"))
FASTEST = 4.0  # m/s, at the bright end of the colours
PANELS = (LEFT, LEFT + SIDE + GAP)  # px, the left edges: of left_v, of right_v
DARKER = 0.6  # a contour line
AT = {"left_obs": 0.9, "front_obs": 1.2, "right_obs": 0.75, "head_ang": 15.0}

Pixels = NDArray[np.uint8]
Box = tuple[float, float, float, float]  # px: left, top, right, bottom


class Label(NamedTuple):
    text: str
    x: float  # px, of its anchor
    y: float
    box: Box


class Drawn(NamedTuple):
    pixels: Pixels  # [row, column]
    labels: list[Label]


def drawn(path: Path, monkeypatch: pytest.MonkeyPatch, **options: object) -> Drawn:
    """Draw a surface; give its pixels, and each text with where it was put."""
    labels: list[Label] = []
    write = ImageDraw.ImageDraw.text

    def note(self: ImageDraw.ImageDraw, xy: tuple[float, float], text: str, fill: str, font: ImageFont.FreeTypeFont,
             anchor: str = "la") -> None:  # fmt: skip
        labels.append(Label(text, *xy, self.textbbox(xy, text, font, anchor)))
        write(self, xy, text, fill, font, anchor=anchor)

    with monkeypatch.context() as patched:
        patched.setattr(ImageDraw.ImageDraw, "text", note)
        surface(PAPER, path, **options)  # type: ignore[arg-type]
    with Image.open(path) as picture:
        assert picture.format == "PNG"
        return Drawn(np.asarray(picture), labels)


def colour(share: float) -> NDArray[np.float64]:
    """Mix the two of the nine colours between which a share lies."""
    place = share * (len(COLOURS) - 1)
    below = min(floor(place), len(COLOURS) - 2)
    mixed: NDArray[np.float64] = COLOURS[below] * (1 - (place - below)) + COLOURS[below + 1] * (place - below)
    return mixed


def test_each_pixel_has_the_colour_of_the_speed_there_and_contour_lines_are_darker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Heading from left to right, the front distance upwards; the two sides as given."""
    held = {"left_obs": 0.9, "right_obs": 0.75}
    pixels = drawn(tmp_path / "a.png", monkeypatch, at=held).pixels

    def speeds(column: int, row: int) -> tuple[float, float]:
        heading, front = -180 + (column + 0.5) / SIDE * 360, 1.6 * (1 - (row + 0.5) / SIDE)
        return PAPER.wheel_speeds(0.9, front, 0.75, heading)

    lines = 0
    for column in range(1, SIDE, 7):
        for row in range(1, SIDE, 11):
            here, beside, above = speeds(column, row), speeds(column - 1, row), speeds(column, row - 1)
            for panel, speed, *others in zip(PANELS, here, beside, above, strict=True):
                line = any(floor(speed / CONTOUR + 1e-9) != floor(other / CONTOUR + 1e-9) for other in others)
                lines += line
                expected = colour(speed / FASTEST) * (DARKER if line else 1.0)
                got = pixels[TOP + row, panel + column]
                assert np.abs(got - expected).max() <= 1.001, (panel, column, row)
    assert lines > 20


# fmt: off
TICKS = {  # two inputs: the values marked at the axis of the first, and of the second
    ("head_ang", "front_obs"): ((-180, -120, -60, 0, 60, 120, 180), (0, 0.4, 0.8, 1.2, 1.6)),
    ("left_obs", "head_ang"):  ((0, 0.4, 0.8, 1.2, 1.6), (-180, -120, -60, 0, 60, 120, 180)),
}
# fmt: on


@pytest.mark.parametrize("axes", TICKS)
def test_the_axes_are_marked_and_labelled_where_their_values_lie(
    axes: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    across, up = TICKS[axes]
    pixels, labels = drawn(tmp_path / "a.png", monkeypatch, x=axes[0], y=axes[1])
    black = (pixels == 0).all(axis=-1)
    for panel in PANELS:
        columns = [panel + SIDE * k / (len(across) - 1) for k in range(len(across))]
        rows = [TOP + SIDE * (1 - k / (len(up) - 1)) for k in range(len(up))]
        below = np.flatnonzero(black[TOP + SIDE + 3, panel - 10 : panel + SIDE + 10]) + panel - 10
        assert list(below) == pytest.approx(columns, abs=1)
        beside = np.flatnonzero(black[TOP - 10 : TOP + SIDE + 10, panel - 4]) + TOP - 10
        assert list(beside) == pytest.approx(rows[::-1], abs=1)
        for value, column in zip(across, columns, strict=True):
            near = [one for one in labels if one.text == f"{value:g}" and one.y > TOP + SIDE]
            assert any(one.x == pytest.approx(column) for one in near), value
        for value, row in zip(up, rows, strict=True):
            near = [one for one in labels if one.text == f"{value:g}" and panel - LEFT < one.x < panel]
            assert any(one.y == pytest.approx(row) for one in near), value


# fmt: off
MARKS = {  # the ends of a universe: the values marked
    (0.0, 0.5):      [0, 0.1, 0.2, 0.3, 0.4, 0.5],
    (0.0, 1.0):      [0, 0.2, 0.4, 0.6, 0.8, 1.0],
    (0.0, 2.5):      [0, 0.5, 1.0, 1.5, 2.0, 2.5],
    (0.25, 3.0):     [0.5, 1.0, 1.5, 2.0, 2.5, 3.0],
    (0.0, 5.5):      [0, 1, 2, 3, 4, 5],
    (-6.0, 6.0):     [-6, -4, -2, 0, 2, 4, 6],
    (0.0, 25.0):     [0, 5, 10, 15, 20, 25],
    (0.0, 60.0):     [0, 10, 20, 30, 40, 50, 60],
    (-90.0, 90.0):   [-90, -60, -30, 0, 30, 60, 90],
    (-180.0, 180.0): [-180, -120, -60, 0, 60, 120, 180],
    (-270.0, 270.0): [-270, -180, -90, 0, 90, 180, 270],
    (0.0, 1000.0):   [0, 1000],
}
# fmt: on


@pytest.mark.parametrize("universe", MARKS)
def test_marks_are_few_and_round(universe: tuple[float, float]) -> None:
    assert marks(*universe) == pytest.approx(MARKS[universe])


def test_the_colour_scale_goes_from_rest_below_to_the_fastest_above(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pixels, labels = drawn(tmp_path / "a.png", monkeypatch)
    scale = next(one.x for one in labels if one.text == "m/s")
    strip = pixels[TOP : TOP + SIDE, int(scale) + 5].astype(float)
    for row in range(0, SIDE, 17):
        assert np.abs(strip[row] - colour(1 - row / (SIDE - 1))).max() <= 1.001
    beside = {one.text: one.y for one in labels if one.x > scale}
    assert beside == {f"{speed}": pytest.approx(TOP + SIDE * (1 - speed / FASTEST)) for speed in range(5)}


@pytest.mark.parametrize("axes", [("head_ang", "front_obs"), ("left_obs", "right_obs")])
def test_texts_lie_in_the_picture_and_on_nothing_else(
    axes: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pixels, labels = drawn(tmp_path / "a.png", monkeypatch, x=axes[0], y=axes[1], at=AT)
    height, width, _ = pixels.shape
    assert (width, height) == (996, 500)
    boxes = [one.box for one in labels] + [(left, TOP, left + SIDE, TOP + SIDE) for left in PANELS]
    for left, top, right, bottom in boxes:
        assert 0 <= left < right <= width
        assert 0 <= top < bottom <= height
    for one, other in combinations(boxes, 2):
        assert one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1], (one, other)
    named = [one.text for one in labels]
    others = sorted(set(AT) - set(axes))
    assert all(name in named[0] for name in ("paper", *others)), "what is held, and at what"
    assert [one for one in named if one.startswith(("left_v", "right_v"))] == ["left_v [m/s]", "right_v [m/s]"]
    for first, second in pairwise(one for one in labels if one.text.endswith("_v [m/s]")):
        assert (second.x - first.x, second.y - first.y) == (PANELS[1] - PANELS[0], 0), "each over its own panel"


def test_a_cross_marks_the_point_asked_about_in_both_panels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = drawn(tmp_path / "a.png", monkeypatch, at={name: AT[name] for name in ("left_obs", "right_obs")}).pixels
    marked = drawn(tmp_path / "b.png", monkeypatch, at=AT | {"head_ang": 375.0}).pixels  # the same as 15 degrees
    rows, columns = np.nonzero((plain != marked).any(axis=-1))
    for panel in PANELS:
        inside = (columns >= panel) & (columns < panel + SIDE) & (rows >= TOP) & (rows < TOP + SIDE)
        column, row = panel + SIDE * (15 + 180) / 360, TOP + SIDE * (1 - 1.2 / 1.6)
        for places, middle in ((columns[inside], column), (rows[inside], row)):
            assert (places.min() + places.max()) / 2 == pytest.approx(middle, abs=1.5)
            assert 10 <= places.max() - places.min() <= 20
        strip = {tuple(pixel) for pixel in marked[round(row) - 3 : round(row) + 4, round(column) - 5].tolist()}
        assert {(255, 255, 255), (0, 0, 0)} <= strip, "seen on any colour"


def test_what_is_not_held_is_far_off_and_straight_ahead(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    far = {"left_obs": 1.6, "right_obs": 1.6}
    by_default, told = (drawn(tmp_path / "a.png", monkeypatch, at=at) for at in (None, far))
    assert (by_default.pixels == told.pixels).all()
    ahead = drawn(tmp_path / "a.png", monkeypatch, x="left_obs", at={"head_ang": 0.0})
    assert (drawn(tmp_path / "b.png", monkeypatch, x="left_obs").pixels == ahead.pixels).all()


def test_an_explanation_draws_its_own_point(tmp_path: Path) -> None:
    by_explaining, by_hand = tmp_path / "a.png", tmp_path / "b.png"
    explain(0.9, 1.2, 0.75, 15.0, surface_png=by_explaining)
    surface(PAPER, by_hand, at=AT)
    assert by_explaining.read_bytes() == by_hand.read_bytes()


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"x": "front"}, "unknown input 'front'; did you mean 'front_obs'?"),
        ({"x": "front_obs"}, "expected two different inputs for its axes, got 'front_obs' twice"),
        ({"path": "surface.jpg"}, r"expected a file ending in .png, got .*surface.jpg"),
        ({"path": "missing/surface.png"}, "cannot be written: No such file or directory"),
    ],
)
def test_a_surface_that_cannot_be_drawn(arguments: dict[str, str], expected: str, tmp_path: Path) -> None:
    path = tmp_path / arguments.pop("path", "surface.png")
    with pytest.raises(ConfigError, match=expected):
        surface(PAPER, path, x=arguments.get("x", "head_ang"))
