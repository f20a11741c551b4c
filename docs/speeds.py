"""Draws how fast the tables drive over the distance to what is near, for the paper's profile and for `careful`."""

from collections.abc import Callable
from typing import Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from swarm.fuzzy import Controller, load_profile
from swarm.fuzzy.vocabulary import Slowing

PROFILES: Final = {"paper": "#4a6fa5", "careful": "#c8662b"}  # and the colour each is drawn in
CAREFUL: Final = load_profile("careful")
SLOWING: Final = cast(Slowing, CAREFUL.slowing)
FAR: Final = 1.6  # m, the end of the universe
FASTEST: Final = 3.5  # m/s, of the axis
TOLD: Final = (0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6)  # m, the table's columns
WIDE, HIGH, LEFT, TOP, GAP, BOTTOM = 300, 210, 60, 84, 70, 50  # px: one panel, and what is around and between the two
STYLE: Final = (
    "text{font:12px sans-serif;fill:#222;text-anchor:middle}.title{font-weight:bold;font-size:13px}"
    ".left{text-anchor:start}.right{text-anchor:end}path{fill:none;stroke:#ddd}polyline{fill:none;stroke-width:2.5}"
    ".left_v{stroke-width:1.2;stroke-dasharray:6 4}.right_v{stroke-width:1.2;stroke-dasharray:1.5 3}"
)
LINES: Final = {"forward": "forward", "left_v": "left wheel", "right_v": "right wheel"}


class Case(NamedTuple):
    """A way to come near something, the target straight ahead and all other distances far."""

    title: str
    axis: str
    rows: Callable[[NDArray[np.float64]], NDArray[np.float64]]  # distances (n,) to the controller's inputs (n, 4)


def _rows(place: int) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    def rows(distances: NDArray[np.float64]) -> NDArray[np.float64]:
        inputs = np.tile([FAR, FAR, FAR, 0.0], (distances.size, 1))
        inputs[:, place] = distances
        return inputs

    return rows


CASES: Final = (
    Case("Head-on", "front_obs [m]", _rows(1)),
    Case("Beside a wall on the right", "right_obs [m]", _rows(2)),
)


def speeds(case: Case, profile: str, distances: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Ask a profile: the forward speed, which is the mean of the two wheels, and each wheel [m/s]."""
    wheels = Controller(load_profile(profile)).wheel_speeds_many(case.rows(distances))
    return {"forward": wheels.mean(axis=1), "left_v": wheels[:, 0], "right_v": wheels[:, 1]}


def svg() -> str:
    """Draw one panel for each case: forward speeds thick, wheels thin."""
    width, height = LEFT + 2 * WIDE + GAP + 20, TOP + HIGH + BOTTOM
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">',
        "<title>Speeds that the tables ask for over the distance to what is near</title>",
        f"<style>{STYLE}</style>",
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        *_legend(),
    ]
    for number, case in enumerate(CASES):
        parts += _panel(case, LEFT + number * (WIDE + GAP))
    return "\n".join([*parts, "</svg>", ""])


def _legend() -> list[str]:
    parts = []
    for row, (profile, colour) in enumerate(PROFILES.items()):
        y = 18 + 20 * row
        parts.append(f'<text class="left" x="{LEFT}" y="{y + 4}">{profile}</text>')
        for column, (line, words) in enumerate(LINES.items()):
            x = LEFT + 70 + 130 * column
            parts.append(f'<polyline class="{line}" stroke="{colour}" points="{x},{y} {x + 30},{y}"/>')
            parts.append(f'<text class="left" x="{x + 36}" y="{y + 4}">{words}</text>')
    return parts


def _panel(case: Case, left: float) -> list[str]:
    def at(distance: float, speed: float) -> str:
        return f"{left + WIDE * distance / FAR:.1f},{TOP + HIGH * (1 - speed / FASTEST):.1f}"

    parts = [f'<text class="title" x="{left + WIDE / 2:g}" y="{TOP - 12}">{case.title}</text>']
    for speed in np.arange(0.0, FASTEST + 0.1, 0.5):
        parts.append(f'<path d="M{at(0.0, speed)} L{at(FAR, speed)}"/>')
        if speed % 1 == 0:
            y = at(0.0, speed).split(",")[1]
            parts.append(f'<text class="right" x="{left - 8:g}" y="{float(y) + 4:.1f}">{speed:g}</text>')
    for distance in np.arange(0.0, FAR + 0.1, 0.4):
        parts.append(f'<path d="M{at(distance, 0.0)} L{at(distance, FASTEST)}"/>')
        x = at(distance, 0.0).split(",")[0]
        parts.append(f'<text x="{x}" y="{TOP + HIGH + 18}">{distance:.1f}</text>')
    parts += [
        f'<text x="{left + WIDE / 2:g}" y="{TOP + HIGH + 40}">{case.axis}</text>',
        f'<text class="right" x="{left - 8:g}" y="{TOP - 12}">m/s</text>',
    ]
    distances = np.linspace(0.0, FAR, 81)
    for name, colour in PROFILES.items():
        for line, values in reversed(speeds(case, name, distances).items()):
            points = " ".join(at(*point) for point in zip(distances.tolist(), values.tolist(), strict=True))
            parts.append(f'<polyline class="{line}" stroke="{colour}" points="{points}"/>')
    return parts


def numbers() -> str:
    """Say the same in numbers, as a paragraph and a Markdown table."""
    at = np.array(TOLD)
    near = TOLD.index(SLOWING.near)
    told = [
        f"`{CAREFUL.name}` multiplies speeds by {SLOWING.least:g} up to {SLOWING.near:g} m and by 1 from "
        f"{SLOWING.far:g} m on. In between the factor grows evenly."
    ]
    body = []
    for case in CASES:
        paper, careful = (speeds(case, name, at)["forward"] for name in PROFILES)
        told.append(
            f"{case.title}, the paper's tables drive forward at {paper[-1]:.2f} m/s while all is far, and at "
            f"{paper[near]:.2f} m/s at {SLOWING.near:g} m and less. "
            f"There `{CAREFUL.name}` drives at {careful[near]:.2f} m/s."
        )
        for name, values in zip(PROFILES, (paper, careful), strict=True):
            body.append([f"{case.title}, `{name}`", *(f"{speed:.2f}" for speed in values)])
    head = ["forward speed [m/s] at", *(f"{distance:g} m" for distance in TOLD)]
    lines = [head, ["---", *("--:" for _ in TOLD)], *body]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"{chr(10).join(told)}\n\n{table}"
