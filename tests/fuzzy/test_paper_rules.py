"""The paper's rules are the data file's, and what their asymmetries do."""

import csv
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.fuzzy import Controller, load_profile

from .oracle import Row, transcription

PAPER = load_profile("paper")
CONTROLLER = Controller(PAPER)
RULES_CSV = Path(__file__).parents[3] / "shared" / "paper" / "rules.csv"
COLUMNS = ("left_obs", "right_obs", "front_obs", "head_ang", "left_v", "right_v")
WITHOUT_TWIN = {("obstacle_avoidance", number) for number in (1, 4, 10, 13, 25, 26)}


def rules_of_the_profile() -> list[Row]:
    return [
        (behaviour.name, rule.number, *(behaviour.cell(rule, column) for column in COLUMNS))  # type: ignore[misc]
        for behaviour in PAPER.behaviours.values()
        for rule in behaviour.rules
    ]


def test_the_profile_has_the_papers_51_rules_in_its_order() -> None:
    assert rules_of_the_profile() == transcription()
    assert [len(behaviour.rules) for behaviour in PAPER.behaviours.values()] == [27, 24]


def test_the_profile_has_the_rules_of_the_csv() -> None:
    if not RULES_CSV.exists():
        pytest.skip(f"{RULES_CSV} is not here; the transcription in oracle.py pins the rules")
    with RULES_CSV.open(newline="") as file:
        rows = [tuple(row.values()) for row in csv.DictReader(file)]
    assert rows == [tuple(map(str, row)) for row in rules_of_the_profile()]


def test_these_rules_have_no_mirror_twin() -> None:
    mirrored_head = {"any": "any", "zero": "zero", "positive": "negative", "negative": "positive"}
    consequents = {(name, *antecedents): (lv, rv) for name, _, *antecedents, lv, rv in transcription()}
    without = {
        (name, number)
        for name, number, left, right, front, head, left_v, right_v in transcription()
        if consequents[name, right, left, front, mirrored_head[head]] != (right_v, left_v)
    }
    assert without == WITHOUT_TWIN


distances = st.floats(0, 1.6)


@given(distances, distances, distances, st.floats(-180, 180))
def test_mirrored_inputs_give_mirrored_speeds_unless_such_a_rule_fires(
    left: float, front: float, right: float, heading: float
) -> None:
    fired = {(rule.behaviour, rule.rule) for rule in CONTROLLER.explain(left, front, right, heading).rules}
    left_v, right_v = CONTROLLER.wheel_speeds(left, front, right, heading)
    mirrored = CONTROLLER.wheel_speeds(right, front, left, -heading)
    if not fired & WITHOUT_TWIN:
        assert mirrored == pytest.approx((right_v, left_v), abs=1e-12)


@pytest.mark.parametrize(
    ("inputs", "rule"),
    [
        ((0.3, 0.3, 0.3, 0.0), 1),
        ((0.3, 0.3, 1.0, 0.0), 4),
        ((1.0, 0.3, 0.3, 0.0), 10),
        ((1.0, 0.3, 1.0, 0.0), 13),
        ((1.6, 0.3, 1.6, 0.0), 25),
    ],
)
def test_such_a_rule_alone_turns_the_same_way_when_mirrored(inputs: tuple[float, ...], rule: int) -> None:
    left, front, right, heading = inputs
    assert [fired.rule for fired in CONTROLLER.explain(left, front, right, heading).rules] == [rule]
    left_v, right_v = CONTROLLER.wheel_speeds(left, front, right, heading)
    assert CONTROLLER.wheel_speeds(right, front, left, -heading) != pytest.approx((right_v, left_v), abs=0.1)
