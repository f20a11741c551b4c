"""`swarm diff`: the first tick, robot and field at which two runs part, and what is behind it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

from swarm.blackbox.explain.first_difference import Parting, differences_of_starts, find_parting, find_parting_by_rules
from swarm.cli import main
from swarm.errors import ConfigError
from swarm.fuzzy import Profile
from swarm.scenario.load import Scenario
from swarm.tape.reader import TapeFile
from swarm.traffic.settings import TrafficConstants
from tests.blackbox.explain.recorded import Recorded
from tests.storm.shared import plan_of

TICKS = 160
Make = Callable[..., Path]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Return a function that records two robots that change sides; each tape has another name."""

    def record(scenario: Scenario | None = None, **run: Any) -> Path:  # noqa: ANN401
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.swarm"
        recorded = Recorded(path, scenario or plan_of().to_scenario(), 2)
        return recorded.run(40).run(10, **run).run(TICKS - 50).done()

    return record


def changed_rules() -> tuple[str, Scenario]:
    """Return a behaviour, and the scenario with another speed in all of its rules."""
    scenario = plan_of().to_scenario()
    raw = msgspec.to_builtins(scenario.profile.to_builtins())
    (name, table), *_ = raw["behaviours"].items()
    rows = table.splitlines()
    changed = {name: "\n".join([rows[0], *(row.replace("fast", "slow") for row in rows[1:])]) + "\n"}
    return name, replace(scenario, profile=Profile.from_builtins(raw | {"behaviours": raw["behaviours"] | changed}))


def parted(one: Path, other: Path) -> Parting:
    found = find_parting(TapeFile(one), TapeFile(other))
    assert found is not None
    turned = find_parting(TapeFile(other), TapeFile(one))
    assert turned is not None
    assert (turned.tick, turned.robot, turned.values.field) == (found.tick, found.robot, found.values.field)
    assert (turned.values.one, turned.values.other) == (found.values.other, found.values.one)
    return found


def test_two_runs_that_were_the_same_do_not_part(make: Make) -> None:
    one, other = make(), make()
    assert differences_of_starts(TapeFile(one), TapeFile(other)) == []
    assert find_parting(TapeFile(one), TapeFile(other)) is None


def test_a_changed_rule_is_named_with_its_strength_at_the_first_answer_that_it_changes(make: Make) -> None:
    name, other = changed_rules()
    found = parted(make(), make(other))
    assert found.values.field in {"command.left", "command.right"}
    assert f"because of {name} rule" in found.cause
    assert "(strength " in found.cause


def test_a_changed_setting_is_named(make: Make) -> None:
    found = parted(make(), make(plan_of(radio={"range": 5.0}).to_scenario()))
    assert "radio.range 8.0 | 5.0" in found.cause


def test_another_seed_is_named_where_it_is_first_seen(make: Make, tmp_path: Path) -> None:
    tapes = []
    for seed in (1, 2):
        path = tmp_path / f"seed {seed}.swarm"
        tapes.append(Recorded(path, plan_of(radio={"loss": 0.5}).to_scenario(), 2, seed=seed).run(60).done())
    found = parted(*tapes)
    assert "sense.hears" in found.values.field
    assert "seed 1 | 2" in found.cause


def test_a_changed_constant_of_the_code_is_the_first_answer_that_this_code_does_not_give(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = make()
    with monkeypatch.context() as patch:
        patch.setattr("swarm.traffic.lattice.placement.TrafficConstants", changed_constants)
        other = make()
    found = parted(one, other)
    assert found.values.text == "answer as this code gives it | another one"
    assert "was made by other code" in found.cause


def changed_constants(*args: Any, **fields: Any) -> TrafficConstants:  # noqa: ANN401
    return TrafficConstants(*args, **(fields | {"ripe": 20}))


def test_an_answer_that_came_later_is_named(make: Make) -> None:
    found = parted(make(), make(late={"r2": 2}))
    assert (found.tick, found.robot, found.values.text) == (40, "r2", "answers [40] | []")


def test_a_broadcast_that_one_had_not_heard_is_named(make: Make) -> None:
    found = parted(make(), make(unheard=[("r1", "r2")]))
    assert (found.robot, found.values.field) == ("r1", "heard")


def test_runs_of_other_robots_cannot_be_compared(make: Make, tmp_path: Path) -> None:
    other = Recorded(tmp_path / "three.swarm", plan_of(robots=1, start={"poses": [[1.8, 1.8, 0.0]]}, own_targets=[[[9.0, 1.8]]]).to_scenario(), 1)  # fmt: skip
    with pytest.raises(ConfigError, match="expected two runs of the same robots, got r1, r2 and r1"):
        differences_of_starts(TapeFile(make()), TapeFile(other.run(1).done()))


def test_the_command_says_it_in_lines(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    one, late = make(), make(late={"r2": 2})
    assert main(["diff", str(one), str(late)]) == 1
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "first difference at 2.00 s (tick 40): r2: answers [40] | []"
    assert main(["diff", str(one), str(make())]) == 0
    assert capsys.readouterr().out == f"no difference in {TICKS} ticks\n"
    short = Recorded(one.parent / "short.swarm", plan_of().to_scenario(), 2).run(30).done()
    assert main(["diff", str(one), str(short)]) == 0
    assert capsys.readouterr().out == f"no difference in 30 ticks; {one} goes on\n"
    assert main(["diff", str(one), "no.swarm"]) == 2
    assert "no.swarm: expected a tape" in capsys.readouterr().err


def test_two_runs_of_other_code_are_to_be_compared_with_that(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("swarm.traffic.lattice.placement.TrafficConstants", changed_constants)
        one = make()
    found = parted(one, one)
    assert found.values.text == "answer another one | another one"
    assert found.cause.startswith("both runs were made by other code")
    assert found.cause.endswith("compare them with that code")


def test_runs_that_part_by_their_timing_are_compared_by_their_rules_too(
    make: Make, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, other = changed_rules()
    late = Recorded(tmp_path / "late.swarm", other, 2).run(10, late={"r2": 1}).run(TICKS).done()
    one = make()
    assert parted(one, late).timing
    found = find_parting_by_rules(TapeFile(one), TapeFile(late))
    assert found is not None
    assert f"because of {name} rule" in found.cause
    assert find_parting_by_rules(TapeFile(one), TapeFile(make(late={"r2": 2}))) is None
    assert main(["diff", str(one), str(late)]) == 1
    said = capsys.readouterr().out
    assert "with the second run's rules and settings in the first run: first difference at" in said
