"""The controller, compared with scikit-fuzzy, which clips, joins and takes centroids with its own code."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from skfuzzy import control, trapmf, trimf

from swarm.fuzzy import Controller, load_profile

from .oracle import transcription

PAPER = Controller(load_profile("paper"))
pytestmark = pytest.mark.filterwarnings("ignore")  # its own, of libraries newer than it


@cache
def simulations() -> dict[str, Any]:
    distance, heading = np.linspace(0, 1.6, 161), np.linspace(-180, 180, 361)
    variables = {name: control.Antecedent(distance, name) for name in ("left_obs", "right_obs", "front_obs")}
    for variable in variables.values():
        variable["near"] = trapmf(distance, [0, 0, 0.6, 1.0])
        variable["medium"] = trimf(distance, [0.6, 1.0, 1.4])
        variable["far"] = trapmf(distance, [1.0, 1.4, 1.6, 1.6])
    variables["head_ang"] = head = control.Antecedent(heading, "head_ang")
    head["negative"] = trapmf(heading, [-180, -180, -60, 0])
    head["zero"] = trimf(heading, [-30, 0, 30])
    head["positive"] = trapmf(heading, [0, 60, 180, 180])
    rules: dict[str, list[Any]] = {"obstacle_avoidance": [], "goal_seeking": []}
    speed = np.linspace(0, 4, 401)
    consequents = {}
    for behaviour in rules:
        for name in ("left_v", "right_v"):
            consequents[behaviour, name] = variable = control.Consequent(speed, name)
            variable["slow"], variable["medium"] = trimf(speed, [0, 1, 2]), trimf(speed, [1, 1.5, 2])
            variable["fast"] = trimf(speed, [2, 3, 4])
    for behaviour, _, left, right, front, heading_term, left_v, right_v in transcription():
        antecedent = variables["left_obs"][left] & variables["right_obs"][right] & variables["front_obs"][front]
        if heading_term != "any":
            antecedent &= head[heading_term]
        then = consequents[behaviour, "left_v"][left_v], consequents[behaviour, "right_v"][right_v]
        rules[behaviour].append(control.Rule(antecedent, then))
    return {name: control.ControlSystemSimulation(control.ControlSystem(rows)) for name, rows in rules.items()}


def wheel_speeds(left: float, front: float, right: float, heading: float) -> tuple[float, float]:
    w = min(float(np.clip((x - 0.6) / 0.4, 0, 1)) for x in (left, front, right))
    total = np.zeros(2)
    for name, weight in (("goal_seeking", w), ("obstacle_avoidance", 1 - w)):
        if weight > 0:
            simulation = simulations()[name]
            inputs = {"left_obs": left, "front_obs": front, "right_obs": right}
            simulation.inputs(inputs | ({"head_ang": heading} if name == "goal_seeking" else {}))
            simulation.compute()
            total += weight * np.array([simulation.output["left_v"], simulation.output["right_v"]])
    return float(total[0]), float(total[1])


def agree(rows: list[list[float]]) -> None:
    for row in rows:
        assert PAPER.wheel_speeds(*row) == pytest.approx(wheel_speeds(*row), abs=1e-3), row


def test_scikit_fuzzy_agrees_on_a_few_inputs() -> None:
    agree(np.random.default_rng(3).uniform([0, 0, 0, -180], [1.6, 1.6, 1.6, 180], (12, 4)).tolist())


@pytest.mark.long("scikit-fuzzy integrates 200 states numerically; make test compares 12")
def test_scikit_fuzzy_agrees_everywhere() -> None:
    corners = [[a, b, c, h] for a in (0.7, 1.0) for b in (0.6, 0.9, 1.6) for c in (0.8, 1.2) for h in (-60, -20, 0, 30)]
    random = np.random.default_rng(4).uniform([0.5, 0.5, 0.5, -70], [1.5, 1.5, 1.5, 70], (200, 4)).tolist()
    agree(corners + random)
