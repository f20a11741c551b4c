"""What the box saves is a scenario file that drives the same."""

from dataclasses import replace
from pathlib import Path

import pytest

from dashboard.box.scenario_file import scenario_file
from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.maps.text import floor_as_text, from_text
from swarm.messages import Map, Setup
from swarm.scenario.check import check
from swarm.scenario.load import load
from swarm.scenario.shipped_scenarios import find_scenario
from swarm.scenario.starts import starts

DRAWN = ("paper", "box", "movers", "crossing", "wall_following", "unknown")  # all robots start at poses of their own
KEPT = ("name", "targets", "own_targets", "return_home", "reach", "robots", "robot", "sensors", "radio", "movers")


@pytest.mark.parametrize("name", DRAWN)
def test_a_saved_scenario_drives_the_same(name: str, tmp_path: Path) -> None:
    before = load(find_scenario(Path(name)))
    robots, seed = before.settings.robots, before.settings.seed
    ready = check(before, robots, seed).scenario
    told, packed = ready.to_wire()
    poses = starts(ready, robots, seed)
    setup = Setup(scenario=name, robots=robots, starts=[(pose.x, pose.y, pose.yaw) for pose in poses])
    (file := tmp_path / "saved.yaml").write_text(scenario_file(Map(packed=packed, scenario=told), setup))
    after = load(file)
    assert after.map == before.map
    for part in KEPT:
        assert getattr(after.settings, part) == getattr(before.settings, part), part
    driven = check(after, robots, seed + 1).scenario
    assert starts(driven, robots, seed + 1) == poses
    assert driven.profile == before.profile


def test_a_floor_that_no_text_can_say_is_refused() -> None:
    moved = replace(from_text("...\n...\n", 0.5, "test"), origin=Pose(-1.0, 2.0, 0.0))
    with pytest.raises(ConfigError, match=r"expected a floor of walls, obstacles and free cells with its corner at"):
        floor_as_text(moved)


def test_a_drawing_is_read_back() -> None:
    text = "####\n#.o#\n#..#\n####\n"
    assert floor_as_text(from_text(text, 0.5, "test")) == text
