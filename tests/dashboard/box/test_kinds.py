"""Robots of several kinds on the page, as Node computes it: what belongs to which kind, and how a mix is changed."""

import json
import re
import subprocess
from shutil import which
from typing import Any, Final

import msgspec
import pytest

from dashboard.box.server import assets
from tests.dashboard.drawn import floor as plain_floor
from tests.dashboard.mixed import NAMES, STARTS, floor
from tests.dashboard.rehearsal import Rehearsal

NODE: Final = which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="no Node on this machine: apt-get install nodejs")

SAYS: Final = """
import * as kinds from "./kinds.mjs";
import { ofKind } from "./words.mjs";
const floors = JSON.parse(process.argv[2]).map(({ scenario }) => ({ settings: scenario.settings, starts: scenario.starts ?? {}, kinds: scenario.kinds ?? {} }));
const tried = (what) => { try { return what(); } catch (fault) { return fault.message; } };
const look = (floor) => ({
  names: kinds.kindNames(floor),
  radii: ["r1", "r8"].map((robot) => kinds.radiusNow(floor, { robot, radius: 0 })),
  loaded: kinds.radiusNow(floor, { robot: "r1", radius: 0.5 }),
  ranges: ["r1", "r8"].map((robot) => kinds.sensorsOf(floor, robot).range),
  shapes: ["r1", "r8"].map((robot) => kinds.shapeOf(floor, kinds.kindOf(floor, robot))),
  targets: ["r1", "r8"].map((robot) => kinds.targetsOfKind(floor, robot)),
  mix: kinds.mixOf(floor), starts: kinds.startsIn(floor),
});
const [mixed] = floors, mix = { cart: 2, scout: 6 };
const changes = [["cart", 3], ["cart", 0], ["van", 1], ["scout", -1], ["scout", 999], ["cart", 1.5]];
console.log(JSON.stringify({
  floors: floors.map(look),
  changes: changes.map(([kind, count]) => tried(() => kinds.changed(mix, kind, count))),
  last: tried(() => kinds.changed({ cart: 2 }, "cart", 0)),
  kinds: kinds.kindsIn({ cart: 2, scout: 3 }),
  corners: ["disc", "hexagon", "diamond", "square", "triangle"].map((shape) => kinds.cornersOf(shape)),
  sentences: [0, 0.45].map((loaded) => ofKind({ kind: "cart", radius: 0.35, loaded, top: kinds.topSpeedOfKind(mixed, "cart") })),
}));
"""
# fmt: off
CHANGED: Final = [
    {"cart": 3, "scout": 6},
    {"scout": 6},
    {"cart": 2, "scout": 6, "van": 1},
    "scout: expected a number of robots, 0 or more, got -1",
    "scout: expected at most 1000 robots of all kinds together, got 1001; ask for fewer than 7",
    "cart: expected a number of robots, 0 or more, got 1.5",
]
# fmt: on


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return what the page's modules say of a fleet of two kinds and of one without."""
    folder = tmp_path_factory.mktemp("page")
    for name in ("kinds", "words"):
        (folder / f"{name}.mjs").write_bytes(assets()[f"{name}.js"][0])
    (folder / "says.mjs").write_text(SAYS)
    floors = msgspec.json.encode([floor(), plain_floor(Rehearsal(2))]).decode()
    command = [str(NODE), str(folder / "says.mjs"), floors]
    said: dict[str, Any] = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return said


def test_a_robot_has_what_belongs_to_its_kind(told: dict[str, Any]) -> None:
    mixed = told["floors"][0]
    assert (mixed["names"], mixed["mix"]) == (["cart", "scout"], {"cart": 2, "scout": 6})
    assert (mixed["radii"], mixed["loaded"], mixed["ranges"]) == ([0.35, 0.2], 0.5, [1.6, 1.6])
    assert mixed["shapes"] == ["disc", "hexagon"]
    assert [len(targets) for targets in mixed["targets"]] == [2, 3]
    assert mixed["starts"] == [list(STARTS[name]) for name in NAMES]


def test_a_fleet_without_kinds_has_one_radius_and_one_shape(told: dict[str, Any]) -> None:
    plain = told["floors"][1]
    assert plain == {
        "names": [], "radii": [0.2, 0.2], "loaded": 0.5, "ranges": [1.6, 1.6], "shapes": ["disc", "disc"],
        "targets": [None, None], "mix": None, "starts": [],
    }  # fmt: skip


def test_a_mix_is_changed_or_the_sentence_says_why_not(told: dict[str, Any]) -> None:
    assert told["changes"] == CHANGED
    assert [list(mix) for mix in told["changes"][:1]] == [["cart", "scout"]], "the robots keep their order"
    assert told["last"] == "a run needs a robot; ask for more of another kind first"
    assert told["kinds"] == ["cart", "cart", "scout", "scout", "scout"]


def test_each_shape_has_its_corners_on_the_disc(told: dict[str, Any]) -> None:
    assert [len(corners) for corners in told["corners"]] == [0, 6, 4, 4, 3]
    for corners in told["corners"]:
        assert [x**2 + y**2 for x, y in corners] == pytest.approx([1.0] * len(corners))


def test_the_panel_says_what_a_robot_is(told: dict[str, Any]) -> None:
    assert told["sentences"] == [
        "is of the kind cart: 0.35 m in radius; it drives at most 0.60 m/s",
        "is of the kind cart: 0.35 m in radius, with its load 0.45 m; it drives at most 0.60 m/s",
    ]


def test_every_shape_has_its_sign_in_the_style_sheet() -> None:
    text, style = assets()["kinds.js"][0].decode(), assets()["box.css"][0].decode()
    (listed,) = re.findall(r"SHAPES = \[(.*?)\]", text)
    shapes = re.findall(r'"(\w+)"', listed)
    assert re.findall(r'\[data-shape="(\w+)"\] { --corners', style) == shapes[1:]
