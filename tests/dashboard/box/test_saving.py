"""What the box saves is a scenario file that drives the same."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from msgspec import to_builtins

from dashboard.box.scenario_file import scenario_file
from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.maps.text import floor_as_text, from_text
from swarm.messages import Map, Setup
from swarm.scenario.check import check
from swarm.scenario.load import Scenario, load
from swarm.scenario.shipped_scenarios import find_scenario
from swarm.scenario.starts import starts

DRAWN = ("paper", "box", "movers", "crossing", "wall_following", "unknown")  # all robots start at poses of their own
KEPT = ("name", "targets", "own_targets", "return_home", "reach", "robots", "robot", "sensors", "radio", "movers")


@pytest.mark.parametrize("name", DRAWN)
def test_a_saved_scenario_drives_the_same(name: str, tmp_path: Path) -> None:
    before = load(find_scenario(Path(name)))
    robots, seed = before.settings.count, before.settings.seed
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


@pytest.mark.parametrize("mix", [{"cart": 2, "scout": 6}, {"cart": 1, "scout": 3}, {"scout": 2}])
def test_a_saved_fleet_of_several_kinds_drives_the_same(mix: dict[str, int], tmp_path: Path) -> None:
    """A kind that has sensors and a controller of its own keeps them; no kind is told what is the scenario's."""
    loaded = load(find_scenario(Path("mixed")))
    own = {"cart": {"sensors": {"range": 3.0}, "controller": "careful"}}
    raw = to_builtins(loaded.settings)
    raw |= {"robots": mix, "kinds": {name: kind | own.get(name, {}) for name, kind in raw["kinds"].items()}}
    raw["kinds"]["cart"]["sensors"] = raw["sensors"] | own["cart"]["sensors"]
    ready = check(load_saved(tmp_path, yaml.safe_dump(raw, sort_keys=False)), sum(mix.values()), 1).scenario
    told, packed = ready.to_wire()
    poses = starts(ready, sum(mix.values()), 1)
    setup = Setup(
        scenario="mixed", robots=sum(mix.values()), mix=mix, starts=[(pose.x, pose.y, pose.yaw) for pose in poses]
    )
    text = scenario_file(Map(packed=packed, scenario=told), setup)
    file = yaml.safe_load(text)
    assert (file["robots"], list(file["robots"])) == (mix, list(mix))
    assert set(file["kinds"]["scout"]) <= {"radius", "targets"}
    assert file["kinds"]["cart"]["sensors"] == {"range": 3.0}
    after = load_saved(tmp_path, text)
    for part in (*KEPT, "patrol", "serve"):
        assert getattr(after.settings, part) == getattr(loaded.settings, part) or part == "robots", part
    for kind in raw["kinds"]:
        here, there = ready.of_kind(kind), after.of_kind(kind)
        assert (there.settings.robot, there.settings.sensors) == (here.settings.robot, here.settings.sensors)
        assert there.profile == here.profile
    driven = check(after, sum(mix.values()), 2).scenario
    assert starts(driven, sum(mix.values()), 2) == poses
    numbers = range(sum(mix.values()))
    assert [driven.stops(n, poses[n][:2]) for n in numbers] == [ready.stops(n, poses[n][:2]) for n in numbers]


def load_saved(folder: Path, text: str) -> Scenario:
    (file := folder / "saved.yaml").write_text(text)
    return load(file)


def test_a_floor_that_no_text_can_say_is_refused() -> None:
    moved = replace(from_text("...\n...\n", 0.5, "test"), origin=Pose(-1.0, 2.0, 0.0))
    with pytest.raises(ConfigError, match=r"expected a floor of walls, obstacles and free cells with its corner at"):
        floor_as_text(moved)


def test_a_drawing_is_read_back() -> None:
    text = "####\n#.o#\n#..#\n####\n"
    assert floor_as_text(from_text(text, 0.5, "test")) == text
