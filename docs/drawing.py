"""A sheet of floor in SVG: metres in, a picture out that can be read on light and dark pages."""

from collections.abc import Iterable
from html import escape
from math import cos, sin
from typing import Final

from dashboard.fold import palette
from swarm.geometry import Pose
from swarm.maps.occupancy import OBSTACLE, WALL, OccupancyMap, Point

LIGHT: Final = {"ground": "#ffffff", "ink": "#1f2328", "faint": "#d5dae0", "wall": "#8b949e", "block": "#b09a86"}
DARK: Final = {"ground": "#161b22", "ink": "#e6edf3", "faint": "#3b434d", "wall": "#6e7681", "block": "#85705f"}


TIPS: Final = ("r1", "r2")  # robots that have arrows in their colour


def _rules(colours: dict[str, str]) -> str:
    return (
        f".ground{{fill:{colours['ground']}}}.wall{{fill:{colours['wall']}}}.block{{fill:{colours['block']}}}"
        f"text{{fill:{colours['ink']}}}.ink{{stroke:{colours['ink']}}}.faint{{stroke:{colours['faint']}}}"
        f".dot{{fill:{colours['ink']}}}"
    )


STYLE: Final = (
    "text{font:12px sans-serif;text-anchor:middle}.left{text-anchor:start}.bold{font-weight:bold}"
    "path,.faint,.ring{fill:none}.dashed{stroke-dasharray:4 3}"
    f"{_rules(LIGHT)}@media(prefers-color-scheme:dark){{{_rules(DARK)}}}"
)


def colour(robot: str) -> str:
    """Return the colour that the dashboard gives a robot: r1 has the first one."""
    return palette.hexadecimal(palette.robot(int(robot[1:]) - 1))


class Sheet:
    """A rectangle of floor, from its corner ``low`` to ``high`` [m], at ``scale`` [px/m]; below it lines of text."""

    def __init__(self, title: str, low: Point, high: Point, scale: float, lines: Iterable[str] = ()) -> None:
        self._low, self._top, self._scale = low, high[1], scale
        self._high, self._title, self._lines = high, title, tuple(lines)
        self.width, self.height = (high[0] - low[0]) * scale, (high[1] - low[1]) * scale
        self.parts: list[str] = []

    def at(self, point: Point) -> tuple[float, float]:
        """Return where a point of the floor [m] is in the picture [px]."""
        return (point[0] - self._low[0]) * self._scale, (self._top - point[1]) * self._scale

    def shows(self, point: Point, spare: float) -> bool:
        """Return True if a point of the floor is on the sheet, or less than ``spare`` [m] beyond its edge."""
        return all(a - spare < at < b + spare for a, at, b in zip(self._low, point, self._high, strict=True))

    def add(self, part: str) -> None:
        """Add an element, in pixels."""
        self.parts.append(part)

    def floor(self, occupancy: OccupancyMap) -> None:
        """Draw walls and obstacles."""
        for kind, name in ((WALL, "wall"), (OBSTACLE, "block")):
            for low, high in occupancy.blocks(kind):
                corners = " ".join("{:.1f},{:.1f}".format(*self.at(c)) for c in occupancy.corners(low, high))
                self.add(f'<polygon class="{name}" points="{corners}"/>')

    def disc(self, middle: Point, radius: float, look: str) -> None:
        """Draw a disc of ``radius`` [m]."""
        x, y = self.at(middle)
        self.add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius * self._scale:.1f}" {look}/>')

    def square(self, middle: Point, side: float, look: str) -> None:
        """Draw a square of ``side`` [m]."""
        x, y = self.at(middle)
        wide = side * self._scale
        self.add(f'<rect x="{x - wide / 2:.1f}" y="{y - wide / 2:.1f}" width="{wide:.1f}" height="{wide:.1f}" {look}/>')

    def line(self, points: Iterable[Point], look: str) -> None:
        """Draw a line through points [m]."""
        self.add(f'<path d="M{" L".join("{:.1f},{:.1f}".format(*self.at(point)) for point in points)}" {look}/>')

    def robot(self, name: str, pose: Pose, radius: float) -> None:
        """Draw a robot in its colour with a line to where it looks, and its name."""
        self.disc(pose[:2], radius, f'fill="{colour(name)}" class="ink"')
        nose = (pose.x + radius * cos(pose.yaw), pose.y + radius * sin(pose.yaw))
        self.line((pose[:2], nose), 'class="ink" stroke-width="2"')
        self.text((pose.x, pose.y + radius), name, up=5, look="bold")

    def text(self, at: Point, words: str, *, up: float = -4, look: str = "") -> None:
        """Write at a point [m], ``up`` pixels higher."""
        x, y = self.at(at)
        self.add(f'<text class="{look}" x="{x:.1f}" y="{y - up:.1f}">{escape(words)}</text>')

    def svg(self) -> str:
        """Return the picture."""
        return framed(self._title, self.width, self.height, self.parts, self._lines)


def _tip(name: str, look: str) -> str:
    """Make an arrow's tip, 10 px long under a line of any width."""
    return (
        f'<marker id="{name}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="10" markerHeight="10" '
        f'markerUnits="userSpaceOnUse" orient="auto"><path {look} stroke-width="1.5" d="M1,1 L7,4 L1,7"/></marker>'
    )


def framed(title: str, width: float, height: float, parts: Iterable[str], lines: Iterable[str] = ()) -> str:
    """Return a picture of so many pixels, on a ground of its own, with lines of text below."""
    lines = tuple(lines)
    below = [
        f'<text class="left" x="8" y="{height + 20 + 18 * row:g}">{escape(line)}</text>'
        for row, line in enumerate(lines)
    ]
    ground = height + (18 * len(lines) + 12 if lines else 0)
    box = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {ground:g}" '
        f'width="{width:g}" height="{ground:g}">',
        f"<title>{escape(title)}</title>",
        f"<style>{STYLE}</style>",
        "<defs>",
        _tip("tip", 'class="ink"'),
        *(_tip(f"tip-{name}", f'stroke="{colour(name)}"') for name in TIPS),
        "</defs>",
        f'<rect class="ground" width="{width:g}" height="{ground:g}"/>',
    ]
    if lines:  # what is drawn beyond the sheet's lower edge must not lie under the text
        parts = [f'<svg width="{width:g}" height="{height:g}">', *parts, "</svg>"]
    return "\n".join([*box, *parts, *below, "</svg>", ""])
