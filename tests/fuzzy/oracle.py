"""The paper's controller from its definition, in plain numpy, without the code under test."""

import numpy as np
from numpy.typing import NDArray

# The paper's tables, transcribed apart from the data file. n near, m medium, f far; s slow, m medium, f fast.
# Obstacle avoidance: rules 1 to 27 over left_obs, then right_obs, then front_obs, near to far: left_v and right_v.
AVOIDANCE = "sf ss mm ms ms fm fs ms fm " + "sf sm mf fs ss mm fs ms fm " + "sf sm mf sf sm mf fs fm ff"
# Goal seeking: 1 to 8 positive, 9 to 16 negative, 17 to 24 zero, over left_obs, right_obs, front_obs, medium to far.
SEEKING = "fm " * 8 + "mf " * 8 + "mm " * 8
DISTANCES = {"n": "near", "m": "medium", "f": "far"}
SPEEDS = {"s": "slow", "m": "medium", "f": "fast"}

Row = tuple[str, int, str, str, str, str, str, str]


def transcription() -> list[Row]:
    """The 51 rules as (behaviour, rule, left_obs, right_obs, front_obs, head_ang, left_v, right_v)."""
    rows: list[Row] = []
    avoidance = [(a, b, c, "any") for a in "nmf" for b in "nmf" for c in "nmf"]
    seeking = [(a, b, c, h) for h in ("positive", "negative", "zero") for a in "mf" for b in "mf" for c in "mf"]
    for name, antecedents, consequents in (
        ("obstacle_avoidance", avoidance, AVOIDANCE.split()),
        ("goal_seeking", seeking, SEEKING.split()),
    ):
        for number, ((a, b, c, head), speeds) in enumerate(zip(antecedents, consequents, strict=True), 1):
            distances = DISTANCES[a], DISTANCES[b], DISTANCES[c]
            rows.append((name, number, *distances, head, SPEEDS[speeds[0]], SPEEDS[speeds[1]]))
    return rows


def ramp_up(x: float, a: float, b: float) -> float:
    return float(np.clip((x - a) / (b - a), 0, 1))


def fuzzify_distance(x: float) -> dict[str, float]:
    near, far = 1 - ramp_up(x, 0.6, 1.0), ramp_up(x, 1.0, 1.4)
    return {"near": near, "medium": min(ramp_up(x, 0.6, 1.0), 1 - ramp_up(x, 1.0, 1.4)), "far": far}


def fuzzify_heading(x: float) -> dict[str, float]:
    zero = float(np.clip(1 - abs(x) / 30, 0, 1))
    return {"negative": ramp_up(-x, 0, 60), "zero": zero, "positive": ramp_up(x, 0, 60), "any": 1.0}


CELLS = 200_000
SPEED: NDArray[np.float64] = (np.arange(CELLS) + 0.5) * 4 / CELLS  # m/s, midpoints
CONSEQUENTS = {
    "slow": np.clip(1 - abs(SPEED - 1), 0, 1),
    "medium": np.clip(1 - abs(SPEED - 1.5) / 0.5, 0, 1),
    "fast": np.clip(1 - abs(SPEED - 3), 0, 1),
}


def wheel_speeds(left: float, front: float, right: float, heading: float) -> tuple[float, float]:
    """Mamdani min-max, the centroid by dense numerical integration, both behaviours weighed."""
    lefts, fronts, rights = (fuzzify_distance(min(x, 1.6)) for x in (left, front, right))
    headings = fuzzify_heading(heading)
    w = min(1 - lefts["near"], 1 - fronts["near"], 1 - rights["near"])
    total = np.zeros(2)
    for behaviour, weight in (("goal_seeking", w), ("obstacle_avoidance", 1 - w)):
        joined = np.zeros((2, CELLS))
        for name, _, a, b, c, head, *consequents in transcription():
            strength = min(lefts[a], rights[b], fronts[c], headings[head])
            if name == behaviour and strength > 0 and weight > 0:
                for k, consequent in enumerate(consequents):
                    joined[k] = np.maximum(joined[k], np.minimum(strength, CONSEQUENTS[consequent]))
        if weight > 0:
            total += weight * (joined @ SPEED) / joined.sum(axis=1)
    return float(total[0]), float(total[1])
