"""Plans: a seed gives one plan, a plan equals its file, and a bad file gets an error of one sentence."""

import pickle
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm.errors import ConfigError
from swarm.scenario.starts import robot_names
from swarm.storm.plans.draw import draw
from swarm.storm.plans.plan import StormPlan, read
from swarm.storm.plans.profiles import PROFILES
from swarm.storm.results import NOBODY_DEAD, Job, perform
from tests.storm.shared import plan_of

seeds = st.integers(0, 2**53)
profiles = st.sampled_from(sorted(PROFILES))


@settings(max_examples=10)
@given(profiles, seeds)
def test_a_seed_means_one_plan_which_its_file_gives_back(
    tmp_path_factory: pytest.TempPathFactory, profile: str, seed: int
) -> None:
    plan = draw(profile, seed)
    assert draw(profile, seed) == plan
    assert (plan.profile, plan.seed) == (profile, seed)
    path = tmp_path_factory.mktemp("plans") / "plan.yaml"
    path.write_text(plan.to_yaml())
    assert read(path) == plan
    assert pickle.loads(pickle.dumps(plan)) == plan


@settings(max_examples=10)
@given(profiles, seeds)
def test_every_drawn_plan_is_a_world_within_its_profile(profile: str, seed: int) -> None:
    plan = draw(profile, seed)
    ranges = PROFILES[profile]
    assert ranges.robots[0] <= plan.robots <= ranges.robots[1]
    assert plan.scenario.map.known == ranges.known
    scenario, faults = plan.to_scenario(), plan.to_faults()
    assert {spell.robot for spell in faults.spells} | set(faults.killed or ()) <= {*robot_names(plan.robots)}
    assert all(scenario.stops(number, pose[:2]) for number, pose in enumerate(scenario.settings.start.poses or ()))


def test_other_seeds_and_profiles_mean_other_plans() -> None:
    scenarios = [draw(profile, seed).scenario for profile in ("all", "calm") for seed in range(3)]
    assert all(a != b for number, a in enumerate(scenarios) for b in scenarios[:number])


# fmt: off
FEATURES: dict[str, tuple[dict[str, Any], str]] = {  # fields of a plan, the feature they make
    "late":          ({"late": 3}, "late"),
    "slow":          ({"slow": 3}, "slow"),
    "loss":          ({"radio": {"loss": 0.1}}, "loss"),
    "short radio":   ({"radio": {"range": 5.0}}, "short radio"),
    "sight":         ({"radio": {"line_of_sight": True}}, "line of sight"),
    "edits":         ({"edits": [{"at": 9.0, "kind": "free", "low": [2.0, 2.0], "high": [3.0, 3.0]}]}, "edits"),
    "movers":        ({"movers": [{"waypoints": [[2.0, 2.0], [3.0, 3.0]], "speed": 0.2, "radius": 0.2}]}, "movers"),
    "leader killed": ({"kill_leader_at": 20}, "leader killed"),
    "dead":          ({"faults": [{"robot": "r1", "kind": "dead", "tick": 5}]}, "dead"),
    "held up":       ({"faults": [{"robot": "r1", "kind": "held_up", "tick": 5, "ticks": 9}]}, "held up"),
}
# fmt: on


@pytest.mark.parametrize("name", FEATURES)
def test_a_plan_names_what_it_has(name: str) -> None:
    fields, feature = FEATURES[name]
    calm = plan_of(radio={"range": 50.0})
    assert calm.features() == frozenset()
    all_fields: dict[str, object] = {"radio": {"range": 50.0}} | fields
    assert plan_of(**all_fields).features() == {feature}


GOOD = yaml.safe_load(plan_of(faults=[{"robot": "r1", "kind": "dead", "tick": 5}]).to_yaml())


def changed(**fields: object) -> str:
    return str(yaml.safe_dump(GOOD | fields))


def scenario(**fields: object) -> str:
    return changed(scenario=GOOD["scenario"] | fields)


# fmt: off
GARBAGE: dict[str, tuple[str | bytes, str]] = {  # the file, part of the sentence
    "nothing":            ("", "expected a storm plan"),
    "a list":             ("[1, 2]", "expected a storm plan"),
    "a scenario":         (yaml.safe_dump(GOOD["scenario"]), "expected a storm plan"),
    "no YAML":            ("storm: [1", "expected YAML"),
    "nested":             ("[" * 5000, "expected YAML"),
    "bytes":              (b"\xff\xfe\x00storm", "expected text"),
    "huge":               ("#" * 1_000_001, "expected at most 1000000 bytes"),
    "version":            (changed(storm=2), "storm"),
    "no scenario":        (yaml.safe_dump({"storm": 1, "profile": "all", "seed": 1}), "missing required field `scenario`"),
    "another field":      (changed(weather="fair"), "weather"),
    "seed":               (changed(seed=-1), "seed"),
    "late":               (changed(late=101), "late"),
    "slow":               (changed(slow=101), "slow"),
    "fault kind":         (changed(faults=[{"robot": "r1", "kind": "sick", "tick": 1}]), "sick"),
    "fault tick":         (changed(faults=[{"robot": "r1", "kind": "dead", "tick": -1}]), "tick"),
    "unknown robot":      (changed(faults=[{"robot": "r9", "kind": "dead", "tick": 1}]), "expected robots r1 to r2, got r9"),
    "robots":             (scenario(robots=0), "robots"),
    "more robots":        (scenario(robots=5), "expected a list for each of 5 robots"),
    "no map":             (scenario(map={"file": "floor.map"}), "draw the map in the plan"),
    "a torn map":         (scenario(map={"text": "###\n#.\n###\n", "cell": 0.4}), "map"),
    "an odd map":         (scenario(map={"text": "###\n#?#\n###\n", "cell": 0.4}), "?"),
    "start in a wall":    (scenario(start={"poses": [[0.4, 0.4, 0.0], [6.6, 3.0, 3.0]]}), "start of r1"),
    "not a number":       (scenario(start={"poses": [[1.8, float("nan"), 0.0], [6.6, 3.0, 3.0]]}), "poses"),
}
# fmt: on


@pytest.mark.parametrize("name", GARBAGE)
def test_a_file_that_is_no_plan_gets_one_sentence(name: str, tmp_path: Path) -> None:
    text, part = GARBAGE[name]
    path = tmp_path / "plan.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ConfigError) as said:
        read(path)
    assert part in str(said.value)
    assert "\n" not in str(said.value)
    assert str(said.value).startswith(str(path)), "it says which file"


def test_a_file_that_is_not_there_is_said(tmp_path: Path) -> None:
    for path in (tmp_path / "none.yaml", tmp_path):
        with pytest.raises(ConfigError, match="expected a file, found none"):
            read(path)


def test_what_a_run_was_is_told() -> None:
    plan: StormPlan = plan_of()
    result = perform(Job("test", 1, plan, twice=True))
    assert (result.category, result.complete, result.violations) == (NOBODY_DEAD, True, ())
    assert result.robots == 2
    assert len(result.digest) == 32
