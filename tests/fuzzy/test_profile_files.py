"""Profiles as files and on the wire: what is read, and what comes back."""

import json
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
import yaml

from swarm.errors import ConfigError
from swarm.fuzzy import Controller, Profile, built_in_profiles, load_profile
from swarm.fuzzy.load import PROFILES

PAPER_TEXT = (PROFILES / "paper.yaml").read_text(encoding="utf-8")


def test_the_built_in_profiles() -> None:
    assert built_in_profiles() == ("careful", "paper", "wall_following")
    for name in built_in_profiles():
        assert load_profile(name).name == name


@pytest.mark.parametrize("name", built_in_profiles())
@pytest.mark.parametrize(
    "carry",
    [
        lambda profile: pickle.loads(pickle.dumps(profile)),
        lambda profile: Profile.from_builtins(profile.to_builtins()),
        lambda profile: Profile.from_builtins(json.loads(json.dumps(profile.to_builtins(), allow_nan=False))),
        lambda profile: Profile.from_builtins(msgspec.msgpack.decode(msgspec.msgpack.encode(profile.to_builtins()))),
        lambda profile: Profile.from_builtins(yaml.safe_load(yaml.safe_dump(profile.to_builtins(), sort_keys=False))),
    ],
    ids=["pickle", "builtins", "json", "msgpack", "yaml"],
)
def test_a_profile_arrives_as_it_left(name: str, carry: Callable[[Profile], Profile]) -> None:
    profile = load_profile(name)
    arrived = carry(profile)
    assert arrived == profile
    assert Controller(arrived).wheel_speeds(1.1, 0.9, 0.7, 20.0) == Controller(profile).wheel_speeds(
        1.1, 0.9, 0.7, 20.0
    )


def test_a_controller_is_picklable() -> None:
    controller = pickle.loads(pickle.dumps(Controller(load_profile("paper"))))
    assert controller.wheel_speeds(1.6, 1.6, 1.6, 0.0) == (1.5, 1.5)


def test_commas_bars_comments_and_the_columns_order_do_not_matter(tmp_path: Path) -> None:
    head, _, rest = PAPER_TEXT.partition("  obstacle_avoidance: |\n")
    table, _, rest = rest.partition("  goal_seeking: |\n")
    rows = [line.split() for line in table.splitlines()]
    turned = "".join(f"    | {' , '.join([row[0], *row[:0:-1]])} |  # turned\n\n" for row in rows)
    (tmp_path / "mine.yaml").write_text(f"{head}  obstacle_avoidance: |\n{turned}  goal_seeking: |\n{rest}")
    mine, paper = Controller(load_profile("mine.yaml", tmp_path)), Controller(load_profile("paper"))
    assert mine.wheel_speeds(0.9, 1.2, 0.75, 15.0) == paper.wheel_speeds(0.9, 1.2, 0.75, 15.0)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("papr", "controller 'papr': expected a profile's name or a file ending in .yaml; did you mean 'paper'?"),
        ("", "controller '': expected a profile's name"),
        (
            "rules.txt",
            "controller 'rules.txt': expected a profile's name or a file ending in .yaml; known: careful, paper, wall",
        ),
        ("absent.yaml", "absent.yaml: no such file"),
        ("folder.yaml", "folder.yaml: no such file"),
        ("../outside.yaml", "controller '../outside.yaml': expected a file within "),
        ("/outside.yaml", "controller '/outside.yaml': expected a file within "),
        ("link.yaml", "controller 'link.yaml': expected a file within "),
        ("nul\0.yaml", "expected a file's path, got one with a NUL in it"),
        ("latin.yaml", "latin.yaml: expected UTF-8 text, got the byte 0xe9"),
        (f"{'long' * 200}.yaml", "long.yaml: "),
    ],
)
def test_a_file_that_is_not_to_be_read(name: str, sentence: str, tmp_path: Path) -> None:
    base = tmp_path / "scenario"
    (base / "folder.yaml").mkdir(parents=True)
    (tmp_path / "outside.yaml").write_text(PAPER_TEXT)
    (base / "link.yaml").symlink_to(tmp_path / "outside.yaml")
    (base / "latin.yaml").write_bytes("name: café".encode("latin-1"))
    with pytest.raises(ConfigError) as refused:
        load_profile(name, base)
    assert sentence in str(refused.value)


def test_a_file_below_the_base_and_one_anywhere_without_a_base(tmp_path: Path) -> None:
    (tmp_path / "rules").mkdir()
    (tmp_path / "rules" / "mine.yml").write_text(PAPER_TEXT)
    assert load_profile("rules/../rules/mine.yml", tmp_path) == load_profile("paper")
    assert load_profile(tmp_path / "rules" / "mine.yml") == load_profile("paper")
    assert load_profile(tmp_path / "rules" / "mine.yml", tmp_path) == load_profile("paper")


def test_one_behaviour_has_nothing_to_weigh() -> None:
    document = load_profile("paper").to_builtins()
    with pytest.raises(ConfigError, match=r"weighing: expected 'none' with one behaviour, got {'behaviour'"):
        Profile.from_builtins(load_profile("wall_following").to_builtins() | {"weighing": document["weighing"]})


def test_a_crisp_edge_leaves_no_gap_and_an_open_one_does() -> None:
    def profile(medium: list[float]) -> Profile:
        terms = {"near": ["-inf", "-inf", 0.6, 0.6], "medium": medium, "far": [1.0, 1.4, "inf", "inf"]}
        variable = {"unit": "m", "universe": [0, 1.6], "terms": terms}
        document: dict[str, Any] = load_profile("wall_following").to_builtins()
        inputs = dict.fromkeys(("left_obs", "front_obs", "right_obs"), variable)
        return Profile.from_builtins(document | {"inputs": inputs | {"head_ang": document["inputs"]["head_ang"]}})

    crisp = Controller(profile([0.6, 0.6, 1.0, 1.4]))
    assert crisp.wheel_speeds(1.0, 0.6, 1.0, 0.0) != crisp.wheel_speeds(1.0, math.nextafter(0.6, 1), 1.0, 0.0)
    with pytest.raises(ConfigError, match=r"no rule fires at .*\(no term\)"):
        profile([math.nextafter(0.6, 1), 0.7, 1.0, 1.4])
