"""Maps of ROS map_server."""

from io import BytesIO
from math import pi
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from PIL import Image

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.maps.images import Pixels, from_image
from swarm.maps.load import load_map
from swarm.maps.occupancy import FREE, UNKNOWN, WALL
from swarm.maps.ros import Description, from_pixels, from_yaml
from tests.maps.drawings import P2, P5, P5_WIDE, YAML, hand_made_png, png
from tests.shared import DATA, needs_data


def description(
    mode: Literal["trinary", "scale", "raw"] = "trinary", free: float = 0.196, negate: bool = False
) -> Description:
    return Description("map.pgm", 0.05, (0.0, 0.0, 0.0), 0.65, free, negate, mode)


def read(content: bytes, how: Description) -> list[list[int]]:
    cells: list[list[int]] = from_pixels(from_image(content), how).cells.tolist()
    return cells


def test_description() -> None:
    assert from_yaml(YAML.encode()) == Description("map.pgm", 0.05, (-10.0, 2.5, 0.3), 0.65, 0.196, False, "trinary")
    for truth in ("1", "true", "True", "yes", '"1"'):
        assert from_yaml(YAML.replace("negate: 0", f"negate: {truth}").encode()).negate
    turned = from_yaml(YAML.replace("0.3]", "4.0]").encode())
    assert from_pixels(from_image(P5), turned).origin.yaw == pytest.approx(4.0 - 2 * pi)


@pytest.mark.parametrize("content", [P5, P2], ids=["P5", "P2"])
def test_a_pixel_of_205_is_unknown_under_the_usual_threshold_and_free_under_another(content: bytes) -> None:
    assert read(content, description()) == [[FREE, FREE, WALL], [WALL, UNKNOWN, FREE]]
    assert read(content, description(free=0.25)) == [[FREE, FREE, WALL], [WALL, FREE, FREE]]


def test_negated_white_is_occupied() -> None:
    assert read(P5, description(negate=True)) == [[WALL, WALL, FREE], [FREE, WALL, WALL]]


def test_values_of_two_bytes_and_other_maxima() -> None:
    assert read(P5_WIDE, description()) == [[FREE, WALL]]
    assert read(b"P5 3 1 2\n\x00\x01\x02", description()) == [[WALL, UNKNOWN, FREE]]


def test_scale_is_unknown_between_the_thresholds_and_where_transparent() -> None:
    opaque, clear = np.array([[0.1, 0.5, 0.9, 0.9]]), np.array([[1.0, 1.0, 1.0, 0.5]])
    assert from_pixels(Pixels(opaque, clear), description("scale")).cells.tolist() == [[WALL, UNKNOWN, FREE, UNKNOWN]]


def test_raw_is_a_percentage_whatever_negate_says() -> None:
    values = np.array([[0, 10, 50, 100, 101, 255]]) / 255
    for negate in (False, True):
        cells = from_pixels(Pixels(values, None), description("raw", negate=negate)).cells.tolist()
        assert cells == [[FREE, FREE, UNKNOWN, WALL, UNKNOWN, UNKNOWN]]


def test_colours_are_averaged_and_so_is_alpha_in_trinary() -> None:
    file = BytesIO()
    Image.fromarray(np.array([[[255, 255, 0], [0, 0, 0], [255, 255, 255]]], np.uint8)).save(file, "PNG")
    assert read(file.getvalue(), description()) == [[UNKNOWN, WALL, FREE]]
    black = np.zeros((1, 2))
    assert from_pixels(Pixels(black, np.array([[1.0, 0.0]])), description()).cells.tolist() == [[WALL, WALL]]
    assert from_pixels(Pixels(black, np.array([[1.0, 0.0]])), description("scale")).cells.tolist() == [[WALL, UNKNOWN]]


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
def test_every_kind_of_png_has_its_brightness(mode: str) -> None:
    file = BytesIO()
    grey = np.array([[0, 255], [255, 0]], np.uint8)
    if mode == "I;16":
        Image.fromarray(grey.astype(np.uint16) * 257).save(file, "PNG")
    else:
        Image.fromarray(grey).convert(mode).save(file, "PNG")
    np.testing.assert_allclose(from_image(file.getvalue()).brightness, [[0, 1], [1, 0]])


BAD_YAML = {
    "no image": (YAML.replace("image: map.pgm\n", ""), "field 'image' is missing"),
    "an unknown key": (YAML.replace("free_thresh", "free_tresh"), "field 'free_tresh'; did you mean 'free_thresh'"),
    "a key twice": (YAML + "negate: 1\n", "line 8, column 1: expected YAML, got key 'negate' is given twice"),
    "no number": (YAML.replace("0.050000", "fine"), "resolution: expected float, got 'fine'"),
    "infinite": (YAML.replace("0.050000", ".inf"), "resolution: expected float <= 10000.0, got inf"),
    "not a number": (YAML.replace("0.65", ".nan"), "occupied_thresh: expected float"),
    "negative": (YAML.replace("0.050000", "-0.05"), "resolution: expected float >= 0.0001, got -0.05"),
    "two numbers of origin": (YAML.replace(", 0.3]", "]"), "origin: expected array of length 3"),
    "far away": (YAML.replace("-10.0", "1e300"), r"origin\[0\]: expected float <= 10000000.0, got '1e300'"),
    "thresholds swapped": (YAML.replace("0.65", "0.1"), "expected free_thresh <= occupied_thresh, got 0.196 and 0.1"),
    "another mode": (YAML.replace("trinary", "binary"), "mode: Invalid enum value 'binary' .trinary, scale or raw"),
    "negate neither": (YAML.replace("negate: 0", "negate: maybe"), "negate: expected bool, got 'maybe'"),
    "an image that is a list": (YAML.replace("map.pgm", "[a]"), r"image: expected str, got \['a'\]"),
    "a mapping inside": (YAML.replace("map.pgm", "{a: b}"), "image: expected str, got {'a': 'b'}"),
    "a list": ("- a\n- b", "expected object, got"),
    "broken": ("image: [", "line 2, column 1: expected YAML"),
    "empty": ("", "expected object, got None"),
}


@pytest.mark.parametrize(("text", "sentence"), BAD_YAML.values(), ids=BAD_YAML)
def test_what_is_wrong_with_a_description_is_said(text: str, sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        from_yaml(text.encode())


BAD_IMAGES = {
    "none at all": (b"GIF89a", "expected an image, PGM, PNG or BMP, got b'GIF89a'"),
    "empty": (b"", "expected an image"),
    "a bitmap": (b"P4 1 1 \0", "expected an image"),
    "no sizes": (b"P5\n# only a comment\n", "expected a whole image"),
    "truncated": (P5[:-2], "expected a whole image"),
    "a number missing": (P2.replace(b"205 ", b""), "expected a whole image"),
    "a word among numbers": (P2.replace(b"205", b"dark"), "expected a whole image"),
    "brighter than its brightest": (P2.replace(b"255\n0", b"100\n0"), "expected a whole image"),
    "huge": (b"P5 99999 99999 255\n", "expected 1 to|expected a smaller image"),
    "a truncated PNG": (png()[:-20], "expected a whole image"),
    "a PNG with a wrong checksum": (png().replace(b"IDAT", b"IDAX"), "expected a whole image"),
    "a bomb": (hand_made_png(60_000, 60_000, 8, 0, b""), "expected 1 to|expected a smaller image"),
}


@pytest.mark.parametrize(("content", "sentence"), BAD_IMAGES.values(), ids=BAD_IMAGES)
def test_what_is_wrong_with_an_image_is_said(content: bytes, sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        from_image(content, "map.pgm")


def test_a_map_lies_right_side_up_at_its_origin(tmp_path: Path) -> None:
    (tmp_path / "map.pgm").write_bytes(P5)
    (tmp_path / "map.yaml").write_text(YAML.replace("0.3]", "0]"))
    loaded = load_map(tmp_path / "map.yaml")
    assert loaded.cells.tolist() == [[FREE, FREE, WALL], [WALL, UNKNOWN, FREE]]
    assert loaded.at(-10.0 + 0.01, 2.5 + 0.06) == WALL  # the upper left pixel


def test_an_image_outside_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "map.pgm").write_bytes(P5)
    folder = tmp_path / "maps"
    (folder / "below").mkdir(parents=True)
    (folder / "below" / "map.pgm").write_bytes(P5)
    (folder / "link.pgm").symlink_to(tmp_path / "map.pgm")
    for name, sentence in (
        ("../map.pgm", "in the folder .* or below it"),
        (str(tmp_path / "map.pgm"), "in the folder .* or below it"),
        ("link.pgm", "in the folder .* or below it"),
        ("none.pgm", "found none"),
        ("below", "found none"),
        ('"a\\0b"', "expected the name of a file"),
    ):
        (folder / "map.yaml").write_text(YAML.replace("map.pgm", name))
        with pytest.raises(ConfigError, match=sentence):
            load_map(folder / "map.yaml")
    (folder / "map.yaml").write_text(YAML.replace("map.pgm", "below/map.pgm"))
    assert load_map(folder / "map.yaml").shape == (2, 3)


@needs_data
def test_public_maps() -> None:
    turtlebot = load_map(DATA / "rosmaps" / "turtlebot3_world" / "map.yaml")
    assert turtlebot.shape == (384, 384)
    assert turtlebot.at(-2.0, -0.5) == FREE  # where that world's robot starts
    assert turtlebot.at(0.0, 0.0) != FREE  # the pillar in its middle
    assert (turtlebot.cells == UNKNOWN).sum() > 100_000
    warehouse = load_map(DATA / "rosmaps" / "nav2_warehouse" / "warehouse.yaml")
    assert warehouse.shape == (1674, 1006)
    assert warehouse.origin == Pose(-15.1, -25.0, 0.0)
