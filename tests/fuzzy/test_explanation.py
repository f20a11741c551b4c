import json

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.fuzzy import Controller, load_profile
from swarm.fuzzy.explain import explain

from .oracle import fuzzify_distance, fuzzify_heading, transcription

PAPER = Controller(load_profile("paper"))
distances = st.floats(0, 1.6)


def test_rule_7_in_words() -> None:
    explanation = PAPER.explain(0.3, 0.4, 1.6, 12.0)
    (fired,) = explanation.rules
    assert (fired.behaviour, fired.rule, fired.strength) == ("obstacle_avoidance", 7, 1.0)
    assert fired.text == (
        "IF left_obs is near AND right_obs is far AND front_obs is near THEN left_v is fast AND right_v is slow"
    )
    assert (explanation.left_v, explanation.right_v, explanation.weight) == (3.0, 1.0, 0.0)
    assert explanation.weights == {"goal_seeking": 0.0, "obstacle_avoidance": 1.0}


@given(distances, distances, distances, st.floats(-180, 180))
def test_what_fired_is_what_the_definition_says(left: float, front: float, right: float, heading: float) -> None:
    explanation = PAPER.explain(left, front, right, heading)
    lefts, fronts, rights = (fuzzify_distance(x) for x in (left, front, right))
    headings = fuzzify_heading(heading)
    weight = {"goal_seeking": min(1 - x["near"] for x in (lefts, fronts, rights))}
    weight["obstacle_avoidance"] = 1 - weight["goal_seeking"]
    expected = {}
    for name, rule, a, b, c, head, *_ in transcription():
        strength = min(lefts[a], rights[b], fronts[c], headings[head])
        if strength > 1e-12 and weight[name] > 1e-12:
            expected[name, rule] = strength
    fired = {(rule.behaviour, rule.rule): rule.strength for rule in explanation.rules if rule.strength > 1e-12}
    fired = {key: strength for key, strength in fired.items() if explanation.weights[key[0]] > 1e-12}
    assert fired == pytest.approx(expected, abs=1e-12)
    assert explanation.weights == pytest.approx(weight)
    assert (explanation.left_v, explanation.right_v) == PAPER.wheel_speeds(left, front, right, heading)
    for name in weight:
        strengths = [rule.strength for rule in explanation.rules if rule.behaviour == name]
        assert strengths == sorted(strengths, reverse=True), "the strongest first"


def test_json_has_what_other_tools_read() -> None:
    said = json.loads(explain(0.9, 1.2, 0.75, 15.0, as_json=True))
    assert said["left_v"] == pytest.approx(1.98, abs=5e-5)
    assert said["right_v"] == pytest.approx(1.8547, abs=5e-5)
    assert said["weight"] == pytest.approx(0.375)
    assert said["memberships"]["head_ang"] == {"negative": 0.0, "zero": 0.5, "positive": 0.25}
    assert set(said["rules"][0]) == {"behaviour", "rule", "strength", "text"}
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(said)) == said


def test_text_for_the_terminal() -> None:
    text = explain(1.6, 0.7, 1.6, -40.0)
    assert text.splitlines()[0] == "profile paper"
    assert "front_obs     0.70 m        near 0.75  medium 0.25" in text
    assert "obstacle_avoidance weighs 0.750" in text
    assert "  0.750  rule 25: IF left_obs is far AND right_obs is far AND front_obs is near THEN" in text
    assert text.endswith("left_v 2.6250 m/s, right_v 1.5108 m/s")


def test_inputs_are_shown_as_the_terms_met_them() -> None:
    assert PAPER.explain(7.0, 1.0, 1.0, 200.0).inputs == {
        "left_obs": 1.6, "front_obs": 1.0, "right_obs": 1.0, "head_ang": -160.0,
    }  # fmt: skip
