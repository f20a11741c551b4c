"""Every way in which a profile can be wrong, and its error text."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarm.errors import ConfigError
from swarm.fuzzy import Controller, Profile, load_profile
from swarm.fuzzy.load import LARGEST_FILE, PROFILES

PAPER_TEXT = (PROFILES / "paper.yaml").read_text(encoding="utf-8")


def replace(old: str, new: str) -> Callable[[str], str]:
    def edit(text: str) -> str:
        assert old in text, old
        return text.replace(old, new, 1)

    return edit


def slowing(section: str) -> Callable[[str], str]:
    return lambda text: f"{text}slowing: {section}\n"


RULE_5 = "    5     near      medium     medium     any         medium  slow\n"
NEAR = "near:   [-inf, -inf, 0.6, 1.0]"
SLOW = "slow:   [0, 1, 1, 2]"

# What is done to the paper's file -> the sentence that says so
BAD: list[tuple[Callable[[str], str], str]] = [
    (lambda text: "", "mine.yaml: the file is empty; copy profiles/paper.yaml and edit it"),
    (lambda text: "# nothing but words\n", "mine.yaml: the file is empty"),
    (lambda text: "hello", "mine.yaml: expected a mapping of name, inputs, outputs, behaviours, weighing, got"),
    (lambda text: "a: [1, 2", "mine.yaml: expected YAML as in profiles/paper.yaml: while parsing a flow sequence"),
    (lambda text: "[" * 1500, "mine.yaml: expected YAML as in profiles/paper.yaml: "),
    (lambda text: "a: !!python/object/apply:os.system [ls]", "could not determine a constructor for the tag"),
    (lambda text: "a: 2001-99-99", "mine.yaml: expected YAML as in profiles/paper.yaml: month must be in 1..12"),
    (lambda text: "? [1, 2]\n: 3", "mine.yaml: expected YAML as in profiles/paper.yaml: "),
    (lambda text: "1: 2", "mine.yaml: expected text as a key, got 1; put it in quotes"),
    (lambda text: text + " " * LARGEST_FILE, f"mine.yaml: expected at most {LARGEST_FILE} bytes, got "),
    (lambda text: text + "name: again\n", "the key 'name' appears twice"),
    (lambda text: text + "rules: []\n", "mine.yaml: unknown key 'rules'; known: behaviours, description, inputs"),
    (replace("weighing:", "weighting:"), "mine.yaml: unknown key 'weighting'; did you mean 'weighing'?"),
    (replace("name: paper", "name: "), "mine.yaml: name: expected text, got nothing"),
    (lambda text: text[: text.index("outputs:")], "mine.yaml: outputs is missing; is the file whole?"),
    (lambda text: text[: text.index("  goal_seeking")], "mine.yaml: weighing is missing; is the file whole?"),
    (lambda text: text[: text.index(RULE_5) + 30], "mine.yaml: weighing is missing; is the file whole?"),
    # weighing
    (lambda text: text[: text.index("weighing:")], "mine.yaml: weighing is missing; is the file whole?"),
    (replace("behaviour: goal_seeking", "behaviour: goal"), "weighing.behaviour: unknown behaviour 'goal'; known"),
    (
        replace("yields_to: obstacle_avoidance", "yields_to: goal_seeking"),
        "expected two behaviours, got 'goal_seeking'",
    ),
    (replace("{left_obs: near, f", "{left: near, f"), "weighing.when: unknown input 'left'; did you mean 'left_obs'?"),
    (
        replace("{left_obs: near, f", "{left_obs: nea, f"),
        "weighing.when: 'nea' is not a term of left_obs; did you mean 'near'",
    ),
    (
        replace("when: {left_obs: near, front_obs: near, right_obs: near}", "when: {}"),
        "weighing.when: expected a mapping",
    ),
    # variables
    (replace("  front_obs: *distance\n", ""), "mine.yaml: inputs: front_obs is missing"),
    (replace("head_ang:", "heading:"), "mine.yaml: inputs: unknown key 'heading'; did you mean 'head_ang'?"),
    (
        replace("  right_v: *speed", "  right_v: 4"),
        "outputs.right_v: expected a mapping of unit, universe, terms, got 4",
    ),
    (replace("unit: m\n", "unit: 1\n"), "inputs.left_obs.unit: expected 'm', got 1; units are not converted"),
    (
        replace("[0, 1.6]", "[1.6, 0]"),
        "inputs.left_obs.universe: expected [low, high] with 0 <= low < high <= 1000, got [1.6, 0]",
    ),
    (
        replace("[0, 1.6]", "[0, inf]"),
        "inputs.left_obs.universe: expected [low, high] with 0 <= low < high <= 1000, got [0, inf]",
    ),
    (replace("[0, 1.6]", "1.6"), "inputs.left_obs.universe: expected [low, high], got 1.6"),
    (replace("[-180, 180]", "[0, 360]"), "head_ang.universe: expected [low, high] with -180 <= low < high <= 180, got"),
    (replace("[0, 4]", "[0, 400]"), "left_v.universe: expected [low, high] with -20 <= low < high <= 20, got [0, 400]"),
    (
        replace("unit: degrees", "unit: rad"),
        "inputs.head_ang.unit: expected 'degrees', got 'rad'; units are",
    ),
    # terms
    (replace("near: ", "no: "), "inputs.left_obs.terms: expected text as a key, got False; put it in quotes"),
    (replace("near: ", "very near: "), "terms: expected a word of letters, digits and _ as a name, got 'very near'"),
    (replace(SLOW, "slow: [1, 1, 1, 1.0000001]"), "left_v.terms.slow: expected a trapezoid with some width, a < d"),
    (
        replace(NEAR, "near: [-inf, -inf, 1.0, 0.6]"),
        "near: expected a trapezoid in order, a <= b <= c <= d, got [-inf, -",
    ),
    (replace(NEAR, "near: [0, 0.6, 1.0]"), "terms.near: expected a trapezoid [a, b, c, d], got [0, 0.6, 1.0]"),
    (replace(NEAR, "near: [0, 0, x, 1]"), "expected a trapezoid [a, b, c, d], each a number, got 'x' among them"),
    (replace(NEAR, "near: [0, 0, .nan, 1]"), "expected a trapezoid [a, b, c, d], each a number, got nan among them"),
    (replace(NEAR, "near: [0, 0, true, 1]"), "expected a trapezoid [a, b, c, d], each a number, got True among them"),
    (replace(NEAR, "near: [0, 0, 1, 1.0e+300]"), "each a number, got 1e+300 among them"),
    (replace(NEAR, f"near: [0, 0, 1, 1{'0' * 400}]"), "each a number, got 1000000000000000"),
    (
        replace(NEAR, "near: [-inf, 0, 0.6, 1]"),
        "expected both -inf on a left shoulder, both inf on a right one, got [-inf",
    ),
    (replace(NEAR, "near: [inf, inf, inf, inf]"), "near: expected a trapezoid with some width, a < d, got [inf"),
    (replace(NEAR, "near: [0.5, 0.5, 0.5, 0.5]"), "near: expected a trapezoid with some width, a < d, got [0.5"),
    (replace(NEAR, "near: [6, 6, 7, 8]"), "near: expected a term that is reached within the universe 0..1.6, got [6"),
    (
        replace(NEAR, "any: [-inf, -inf, 0.6, 1]"),
        "terms.any: in a rule 'any' matches every input; give the term",
    ),
    (
        replace(SLOW, "slow: [-1, 0, 0, 1]"),
        "left_v.terms.slow: expected a support within the universe 0..4, got [-1, 0, 0",
    ),
    (
        replace(SLOW, "slow: [0, 1, inf, inf]"),
        "left_v.terms.slow: expected a support within the universe 0..4, got [0, 1",
    ),
    (replace(SLOW, "slow: [1, 1, 1, 1]"), "left_v.terms.slow: expected a trapezoid with some width, a < d, got [1, 1"),
    (replace(SLOW, "\n      ".join(f"t{k}: [0, 1, 2, 3]" for k in range(10))), "expected at most 9 terms, got 12"),
    (replace(SLOW, "slwo: [0, 1, 1, 2]"), "rule 1: 'slow' is not a term of left_v; did you mean 'slwo'?"),
    # rules
    (
        replace(RULE_5, RULE_5.replace("medium  slow", "medum  slow")),
        "rule 5: 'medum' is not a term of left_v; did you mean 'me",
    ),
    (
        replace(RULE_5, RULE_5.replace("near  ", "nera  ")),
        "avoidance: rule 5: 'nera' is not a term of left_obs; did you mean 'n",
    ),
    (
        replace(RULE_5, RULE_5.replace("medium  slow", "any slow")),
        "rule 5: 'any' is not a term of left_v; known: fast, medium",
    ),
    (
        replace(RULE_5, RULE_5.replace("slow", "")),
        "rule 5: expected 7 columns (rule left_obs right_obs front_obs head_ang",
    ),
    (replace(RULE_5, RULE_5.replace("slow", "slow slow")), "rule 5: expected 7 columns"),
    (
        replace(RULE_5, RULE_5.replace("5", " ")),
        "expected a rule's number first, got 'near medium medium any medium slow'",
    ),
    (replace(RULE_5, RULE_5.replace("5", "-5")), "expected a rule's number first, got '-5 near medium medium any"),
    (
        replace(RULE_5, RULE_5.replace("5", "4")),
        "obstacle_avoidance: rule 4 appears twice; give each rule its own number",
    ),
    (
        replace(RULE_5, RULE_5.replace("medium     medium", "near medium")),
        "rule 5 has the antecedents of rule 2 (near, ne",
    ),
    (
        replace("rule  left_obs", "left_obs"),
        "expected a header line of 'rule' and each of left_obs, front_obs, right_obs",
    ),
    (replace("front_obs  head_ang    left_v", "head_ang left_v"), "left_v right_v'; add front_obs"),
    (
        replace("front_obs  head_ang", "front_obs front_obs head_ang"),
        "each of left_obs, front_obs, right_obs, head_ang",
    ),
    (replace("front_obs  head_ang", "front head_ang"), "unknown column 'front'; did you mean 'front_obs'?"),
    (
        replace("  goal_seeking: |", "  wander: |\n    rule left_obs\n  goal_seeking: |"),
        "behaviours.wander: expected a header",
    ),
    (
        replace("  goal_seeking: |\n", "  goal_seeking: |\n  wander: |\n"),
        "behaviours.goal_seeking: expected text, got ''",
    ),
    # slowing
    (
        slowing("{near: 0.6, far: 1.4}"),
        "slowing: least is missing; is the file whole? profiles/careful.yaml shows every",
    ),
    (slowing("{near: 0.6, far: 1.4, lest: 0.3}"), "slowing: unknown key 'lest'; did you mean 'least'?"),
    (slowing("none"), "slowing: expected a mapping of near, far, least, got 'none'"),
    (slowing(""), "slowing: expected a mapping of near, far, least, got nothing"),
    (slowing("{near: close, far: 1.4, least: 0.3}"), "slowing.near: expected a number, got 'close'"),
    (slowing("{near: 0.6, far: .nan, least: 0.3}"), "slowing.far: expected a number, got nan"),
    (slowing("{near: 0.6, far: 1.4, least: true}"), "slowing.least: expected a number, got True"),
    (
        slowing("{near: 0.6, far: 0.6, least: 0.3}"),
        "slowing: expected 0 <= near < far <= 1.6 m, got near 0.6, far 0.6; below",
    ),
    (
        slowing("{near: -0.1, far: 0.6, least: 0.3}"),
        "slowing: expected 0 <= near < far <= 1.6 m, got near -0.1, far 0.6",
    ),
    (slowing("{near: 0.6, far: 1.7, least: 0.3}"), "slowing: expected 0 <= near < far <= 1.6 m, got near 0.6, far 1.7"),
    (
        slowing("{near: 0.6, far: .inf, least: 0.3}"),
        "slowing: expected 0 <= near < far <= 1.6 m, got near 0.6, far inf",
    ),
    (
        slowing("{near: 0.6, far: 1.4, least: 0}"),
        "slowing.least: expected a share of the tables' speeds, 0 < least < 1, got 0; ",
    ),
    (
        slowing("{near: 0.6, far: 1.4, least: 1}"),
        "slowing.least: expected a share of the tables' speeds, 0 < least < 1, got 1; ",
    ),
    # gaps
    (
        replace(RULE_5, ""),
        "obstacle_avoidance: no rule fires at left_obs 0 (near), front_obs 1 (medium), right_obs 1 (medium)",
    ),
    (replace("zero:     [-30, 0, 0, 30]", "zero: [-30, -20, -20, -1]"), "goal_seeking: no rule fires at left_obs "),
    (replace("medium: [0.6, 1.0, 1.0, 1.4]", "medium: [0.8, 1.0, 1.0, 1.4]"), "goal_seeking: no rule fires at"),
    (
        replace(NEAR, "near: [-inf, -inf, 0.5, 0.6]"),
        "goal_seeking: no rule fires at left_obs 0.55 (near), front_obs 0.55 (near), right_obs 0.55 (near), ",
    ),
]


@pytest.mark.parametrize(("edit", "sentence"), BAD, ids=range(len(BAD)))
def test_a_bad_file_is_refused_in_a_sentence(edit: Callable[[str], str], sentence: str, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(edit(PAPER_TEXT), encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        load_profile("mine.yaml", tmp_path)
    assert str(refused.value).startswith("mine.yaml: ")
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_truncated_file_is_refused_wherever_it_ends() -> None:
    for length in range(0, len(PAPER_TEXT.rstrip()), 61):
        with pytest.raises((ConfigError, yaml.YAMLError)):
            Profile.from_builtins(yaml.safe_load(PAPER_TEXT[:length]))


def test_a_third_behaviour_is_one_too_many(tmp_path: Path) -> None:
    table = PAPER_TEXT.partition("goal_seeking: |\n")[2].partition("\n\n")[0]
    text = replace("  goal_seeking: |\n", f"  wander: |\n{table}\n  goal_seeking: |\n")(PAPER_TEXT)
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(ConfigError, match="expected one or two, got 3: obstacle_avoidance, wander, goal_seeking"):
        load_profile("mine.yaml", tmp_path)


@given(st.integers(0, len(PAPER_TEXT) - 1), st.integers(0, 12), st.text("0159 .,:|[]{}#-\n\tnearmdiuf", max_size=6))
def test_a_damaged_file_is_refused_or_still_a_whole_profile(place: int, cut: int, put: str) -> None:
    text = PAPER_TEXT[:place] + put + PAPER_TEXT[place + cut :]
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError:
        return
    try:
        profile = Profile.from_builtins(document)
    except ConfigError:
        return
    controller = Controller(profile)
    for speed in controller.wheel_speeds(0.9, 1.2, 0.75, 15.0):
        assert -20 <= speed <= 20


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=8) | st.integers(), inner, max_size=4),
    max_leaves=8,
)
PLACES = [
    ("name",), ("inputs",), ("inputs", "left_obs"), ("inputs", "left_obs", "universe"), ("inputs", "left_obs", "terms"),
    ("inputs", "left_obs", "terms", "near"), ("outputs", "left_v", "terms", "slow"), ("outputs",), ("behaviours",),
    ("behaviours", "goal_seeking"), ("weighing",), ("weighing", "when"), ("weighing", "behaviour"), ("slowing",), ("slowing", "near"), ("slowing", "least"),
]  # fmt: skip


@given(st.sampled_from(PLACES), plain)
def test_whatever_comes_over_the_wire_is_a_profile_or_refused(place: tuple[str, ...], value: object) -> None:
    document = load_profile("careful").to_builtins()
    inner: dict[str, object] = document
    for key in place[:-1]:
        step = inner[key]
        assert isinstance(step, dict)
        inner = step
    inner[place[-1]] = value
    with suppress(ConfigError):
        Controller(Profile.from_builtins(document))
