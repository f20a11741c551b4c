"""Draws the paper's figure 5, the flow of a robot's mission, from the table of transitions."""

from html import escape
from typing import Final

from swarm.robot.mission import TRANSITIONS, MissionStage, Occasion

WIDE, HIGH, GAP, LEFT, TOP = 150, 56, 120, 210, 30  # px: a stage's box, the gap between two, the first one's place
SAYS: Final = {
    MissionStage.READY: "told to go?",
    MissionStage.OUTBOUND: "drives to a target",
    MissionStage.RETURNING: "drives home",
    MissionStage.DONE: "stands",
}
STEP: Final = 90  # px; distance between two arcs on the same side
STYLE: Final = (
    "text{font:13px sans-serif;fill:#222;text-anchor:middle}.stage{font-weight:bold}.why{font-size:12px;fill:#555}"
    "rect{fill:#eef3fa;stroke:#4a6fa5}path{fill:none;stroke:#4a6fa5}.back{stroke-dasharray:4 3}"
)


def svg() -> str:
    """Return the figure, top to bottom: straight lines lead to the next stage, arcs skip (right) or return (left)."""
    stages = list(TRANSITIONS)
    top = {stage: TOP + number * (HIGH + GAP) for number, stage in enumerate(stages)}
    middle = LEFT + WIDE / 2
    parts, arcs = [], {"left": 0, "right": 0}
    for stage, row in TRANSITIONS.items():
        for occasion, after in row.items():
            parts += _arrow(occasion, top[stage], top[after], arcs)
    for stage in stages:
        y = top[stage]
        parts += [
            f'<rect x="{LEFT}" y="{y}" width="{WIDE}" height="{HIGH}" rx="8"/>',
            f'<text class="stage" x="{middle:g}" y="{y + 24}">{escape(stage.value)}</text>',
            f'<text x="{middle:g}" y="{y + 42}">{escape(SAYS[stage])}</text>',
        ]
    width = LEFT + WIDE + max(arcs["right"], 1) * STEP + 160
    height = TOP + len(stages) * (HIGH + GAP) - GAP + 30
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">\n'
        f"<title>One robot's mission: stages, and what leads from one to the next</title>\n<style>{STYLE}</style>\n"
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0,0 L8,4 L0,8" style="fill:#4a6fa5"/></marker></defs>\n'
        f'<rect x="0" y="0" width="{width}" height="{height}" style="fill:#fff;stroke:none"/>\n'
    )
    return head + "\n".join(parts) + "\n</svg>\n"


def _arrow(occasion: Occasion, start: int, end: int, arcs: dict[str, int]) -> list[str]:
    """Return the arrow of one transition, from the box at height ``start`` to the one at ``end`` [px]."""
    middle, right = LEFT + WIDE / 2, LEFT + WIDE
    words = escape(occasion.value)
    if end == start + HIGH + GAP:  # the next stage
        return [
            f'<path d="M{middle:g},{start + HIGH} V{end}" marker-end="url(#tip)"/>',
            _words(words, middle, (start + HIGH + end) / 2),
        ]
    if end > start:  # a later stage
        arcs["right"] += 1
        out = right + arcs["right"] * STEP
        return [
            f'<path d="M{right},{start + HIGH - 12} H{out - 10} Q{out},{start + HIGH - 12} {out},{start + HIGH} '
            f'V{end + 2} Q{out},{end + 12} {out - 10},{end + 12} H{right}" marker-end="url(#tip)"/>',
            _words(words, out, (start + HIGH + end) / 2),
        ]
    if end == start:  # the same stage
        side, turn, at = (LEFT, -36, LEFT - 75) if occasion is Occasion.RESTART else (right, 36, right + 90)
        return [
            f'<path d="M{side},{start + 14} C{side + turn},{start + 4} {side + turn},{start + 40} {side},{start + 30}" '
            f'class="{"back" if occasion is Occasion.RESTART else "on"}" marker-end="url(#tip)"/>',
            _words(words, at, start - 4),
        ]
    arcs["left"] += 1
    out = LEFT - arcs["left"] * STEP // 2 - 10
    return [
        f'<path class="back" d="M{LEFT},{start + 20} H{out + 10} Q{out},{start + 20} {out},{start + 10} '
        f'V{end + HIGH} Q{out},{end + HIGH - 10} {out + 10},{end + HIGH - 10} H{LEFT}" marker-end="url(#tip)"/>',
        _words(words, out, start + 36),
    ]


def _words(words: str, x: float, y: float) -> str:
    """Return text on a white background, so that it stays readable over a line."""
    wide = 6.2 * len(words) + 6
    ground = f'<rect x="{x - wide / 2:g}" y="{y - 8:g}" width="{wide:g}" height="17" style="fill:#fff;stroke:none"/>'
    return ground + f'<text class="why" x="{x:g}" y="{y + 4:g}">{words}</text>'
