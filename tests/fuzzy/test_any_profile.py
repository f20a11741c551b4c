"""Profiles unlike the paper's, drawn at random, against the definition read straight from their plain builtins."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm.fuzzy import Controller, Profile, load_profile

COLUMNS = ("head_ang", "left_obs", "right_v", "front_obs", "left_v", "right_obs")  # an order unlike the paper's
Floats = NDArray[np.float64]
CELLS = 40_000
MIDPOINTS = (np.arange(CELLS) + 0.5) * 4 / CELLS  # m/s


@st.composite
def terms(draw: st.DrawFn, low: float, high: float, most: int) -> dict[str, list[Any]]:
    """Terms that overlap their neighbours, shoulders at both ends."""
    count = draw(st.integers(2, most))
    cuts = sorted(draw(st.lists(st.floats(low, high), min_size=2 * count - 2, max_size=2 * count - 2, unique=True)))
    edges: list[Any] = ["-inf", "-inf", *cuts, "inf", "inf"]
    return {f"t{k}": edges[2 * k : 2 * k + 4] for k in range(count)}


@st.composite
def speeds(draw: st.DrawFn) -> dict[str, list[float]]:
    corners = st.lists(st.integers(0, 40), min_size=4, max_size=4).map(sorted).filter(lambda x: x[0] < x[3])
    return {f"v{k}": [x / 10 for x in draw(corners)] for k in range(draw(st.integers(1, 4)))}


@st.composite
def documents(draw: st.DrawFn) -> dict[str, Any]:
    distance = {"unit": "m", "universe": [0, 1.6]}
    inputs: dict[str, Any] = {
        name: distance | {"terms": draw(terms(0.1, 1.5, 4))} for name in ("left_obs", "front_obs", "right_obs")
    }
    inputs["head_ang"] = {"unit": "degrees", "universe": [-180, 180], "terms": draw(terms(-170, 170, 4))}
    outputs: dict[str, Any] = {
        name: {"unit": "m/s", "universe": [0, 4], "terms": draw(speeds())} for name in ("left_v", "right_v")
    }
    behaviours = {}
    for name in ("one", "other"):
        split = draw(st.sets(st.sampled_from(sorted(inputs)), min_size=1, max_size=2))
        choices = [sorted(inputs[column]["terms"]) if column in split else ["any"] for column in sorted(inputs)]
        lines = [" ".join(("rule", *COLUMNS))]
        for number, antecedents in enumerate(product(*choices), 1):
            cells = dict(zip(sorted(inputs), antecedents, strict=True))
            cells |= {output: draw(st.sampled_from(sorted(outputs[output]["terms"]))) for output in outputs}
            lines.append(" ".join((str(number), *(cells[column] for column in COLUMNS))))
        behaviours[name] = "\n".join(lines)
    yields = draw(st.sets(st.sampled_from(sorted(inputs)), min_size=1))
    when = {name: draw(st.sampled_from(sorted(inputs[name]["terms"]))) for name in yields}
    weighing = {"behaviour": "other", "yields_to": "one", "when": when}
    slowing = {}
    if draw(st.booleans()):
        near, far = sorted(draw(st.lists(st.floats(0.0, 1.6), min_size=2, max_size=2, unique=True)))
        slowing = {"slowing": {"near": near, "far": far, "least": draw(st.floats(0.01, 0.99))}}
    return {
        "name": "random", "inputs": inputs, "outputs": outputs, "behaviours": behaviours, "weighing": weighing,
    } | slowing  # fmt: skip


def trapezoid(x: Floats, corners: list[Any]) -> Floats:
    a, b, c, d = (float(corner) for corner in corners)
    with np.errstate(invalid="ignore", divide="ignore"):
        rise = np.where(x >= b, 1.0, (x - a) / (b - a) if np.isfinite(a) and b > a else 0.0)
        fall = np.where(x <= c, 1.0, (d - x) / (d - c) if np.isfinite(d) and d > c else 0.0)
    return np.asarray(np.clip(np.minimum(rise, fall), 0, 1))


def by_definition(document: dict[str, Any], values: dict[str, float]) -> Floats:
    memberships = {
        name: {
            term: float(trapezoid(np.array(x), corners)) for term, corners in document["inputs"][name]["terms"].items()
        }
        | {"any": 1.0}
        for name, x in values.items()
    }
    w = min(1 - memberships[name][term] for name, term in document["weighing"]["when"].items())
    total = np.zeros(2)
    for behaviour, weight in (("other", w), ("one", 1 - w)):
        header, *rows = [line.split() for line in document["behaviours"][behaviour].splitlines()]
        for k, output in enumerate(("left_v", "right_v")):
            joined = np.zeros(CELLS)
            for row in rows:
                rule = dict(zip(header, row, strict=True))
                strength = min(memberships[name][rule[name]] for name in values)
                consequent = trapezoid(MIDPOINTS, document["outputs"][output]["terms"][rule[output]])
                joined = np.maximum(joined, np.minimum(strength, consequent))
            if weight > 0:
                total[k] += weight * float(joined @ MIDPOINTS / joined.sum())
    if slowing := document.get("slowing"):
        nearest = min(values["left_obs"], values["front_obs"], values["right_obs"])
        total *= np.interp(nearest, [slowing["near"], slowing["far"]], [slowing["least"], 1.0])
    return total


@given(documents(), st.lists(st.floats(0, 1.6), min_size=3, max_size=3), st.floats(-180, 180))
@settings(max_examples=40, deadline=None)
def test_any_profile_does_as_defined(document: dict[str, Any], distances: list[float], heading: float) -> None:
    controller = Controller(Profile.from_builtins(document))
    values = dict(zip(("left_obs", "front_obs", "right_obs", "head_ang"), (*distances, heading), strict=True))
    assert controller.wheel_speeds(*values.values()) == pytest.approx(by_definition(document, values), abs=2e-6)


def test_swapping_the_tables_for_constant_ones_changes_the_speeds_everywhere() -> None:
    document: dict[str, Any] = load_profile("paper").to_builtins()
    for name, table in document["behaviours"].items():
        header, *rows = table.splitlines()
        document["behaviours"][name] = "\n".join([header, *(f"{row.rsplit(' ', 2)[0]} slow fast" for row in rows)])
    constant = Controller(Profile.from_builtins(document))
    for values in product((0.2, 0.9, 1.6), (0.2, 0.9, 1.6), (0.2, 0.9, 1.6), (-90, 0, 90)):
        assert constant.wheel_speeds(*values) == pytest.approx((1.0, 3.0))
