"""The overlays of the floor at a moment: fired rules of one robot, cells held, who waits for whom, joint plans.

Where robots are not given the floor, also the floor as they learn it: what they have told each other to be solid.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import ceil
from typing import Annotated, Final, NamedTuple

from msgspec import Struct

from dashboard.fold.plans import Followed, plans_under_way, sort_by_turn
from dashboard.fold.scene import Scene
from swarm.errors import SwarmError
from swarm.messages import Body, Broadcast, Truth
from swarm.messages.fields import doc
from swarm.messages.traffic import Epoch, JointPlan, Record
from swarm.scenario.prepare import RESOLUTION
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of, traffic_settings

SPREAD: Final = 0.7  # of a cell's side, over which the lines of one plan spread where they share cells
ORDERS: Final = 3  # most orders of one plan that are shown
DETAILED: Final = 8  # robots; of more, the details of one are shown: those of all cover the floor
NAMED: Final = 8  # most robots named in an order
KEPT: Final = 30.0  # s of the run for which a cell stays that nobody tells again; each robot tells all of its in turn

Box = tuple[float, float, float, float]  # m: x and y of the lower corner, width, height
Spot = tuple[float, float]  # m
Arrow = tuple[Spot, Spot]


def robots_in_detail(robots: Sequence[str], selected: str | None) -> tuple[str, ...]:
    """Return the robots whose sensors, held cells and joint plans are drawn: all of a few, else the selected one.

    >>> robots_in_detail(("r1", "r2"), "r2")
    ('r1', 'r2')
    >>> robots_in_detail([f"r{n}" for n in range(1, 10)], "r3")
    ('r3',)
    """
    if len(robots) <= DETAILED:
        return tuple(robots)
    return (selected,) if selected in robots and selected is not None else tuple(robots[:1])


class TurnOrder(Struct, frozen=True, kw_only=True):
    """The order in which robots enter a cell."""

    at: Annotated[Spot, doc("m; the cell's middle")]
    robots: Annotated[str, doc("such as `r3 > r1`")]


class Joint(Struct, frozen=True, kw_only=True):
    """A joint plan under way."""

    leader: Annotated[str, doc("the robot that made it")]
    ways: Annotated[dict[str, list[Spot]], doc("m; of each member, from where it is")]
    turns: Annotated[list[TurnOrder], doc("the longest orders")]


class Learned(Struct, frozen=True, kw_only=True):
    """The floor as the robots have learned and told it, where they were not given it."""

    rows: Annotated[int, doc("of the learned grid, which has the floor's extent and origin")]
    columns: Annotated[int, doc("of the learned grid")]
    resolution: Annotated[float, doc("m; side of a cell")]
    cells: Annotated[list[int], doc("solid ones: row * columns + column")]


class Overlay(NamedTuple):
    """The overlay of the floor at one moment."""

    time: float  # s, since the run began
    spots: Mapping[str, Spot]  # m, where each robot is
    rules: str  # rules that fire in the selected robot, as markdown; empty if there is no robot
    held: Mapping[str, list[Box]]  # the cells that each robot holds
    waits: Sequence[Arrow]  # from each robot to each robot that it waits for
    joint: Sequence[Joint]  # the joint plans under way
    learned: Learned | None = None  # the floor as robots have learned it; None: they were given it


class Overlays:
    """The overlays of one scene, from the broadcasts of one run after the other."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._run = -1
        self._records: dict[str, Record] = {}  # the newest of each robot
        self._plans: dict[Epoch, JointPlan] = {}
        self._walls: dict[int, int] = {}  # cell that is learned to be solid -> tick at which it was told last

    def hear(self, message: Broadcast) -> None:
        """Take in what a robot's broadcast says of the floor, and its traffic record."""
        if message.run != self._run:
            self._run, self._records, self._plans, self._walls = message.run, {}, {}, {}
        if not self._scene.settings.map.known:
            self._walls.update(dict.fromkeys(message.walls, message.tick))
        if message.traffic is None:
            return
        own = message.traffic.own
        known = self._records.get(message.robot)
        if known is not None and known.stamp >= own.stamp:
            return
        self._records[message.robot] = own
        if own.plan is not None and own.plan.epoch not in self._plans:
            in_use = {record.epoch for record in self._records.values()}
            self._plans = {epoch: plan for epoch, plan in self._plans.items() if epoch in in_use}
            self._plans[own.plan.epoch] = own.plan

    def overlay_at(self, truth: Truth, selected: str | None = None) -> Overlay:
        """Return the overlay at the moment of ``truth``; ``selected`` is whose rules are shown, None: the first."""
        bodies = {body.robot: body for body in truth.bodies}
        return Overlay(
            time=truth.time,
            spots={name: (body.x, body.y) for name, body in bodies.items()},
            rules=self._rules(bodies.get(selected or "", truth.bodies[0])) if bodies else "",
            held={name: self._held_cells(body) for name, body in bodies.items()},
            waits=wait_arrows(bodies),
            joint=self.joint(truth),
            learned=self.learned_floor(truth),
        )

    def joint(self, truth: Truth) -> list[Joint]:
        """Return the joint plans under way; a robot that is silent for so long that it loses its turns is left out."""
        bodies = {body.robot: body for body in truth.bodies}
        return [
            joint_plan_lines(plan, self._cells, bodies)
            for plan in plans_under_way(self._newest_records(truth), self._plans)
        ]

    def sort_by_turn(self, robots: Sequence[str], truth: Truth) -> list[str]:
        """Return robots that drive to one target in the order of their turns there, as given where no plan says it."""
        return sort_by_turn(robots, self._newest_records(truth), self._plans)

    def _newest_records(self, truth: Truth) -> dict[str, Record]:
        """Return the newest record of each robot of the run that has not been silent for long."""
        if truth.run != self._run:
            return {}
        absent = traffic_settings(self._scene.settings).absent
        there = {body.robot for body in truth.bodies}
        return {
            robot: record
            for robot, record in self._records.items()
            if robot in there and truth.tick - record.stamp <= absent
        }

    def learned_floor(self, truth: Truth) -> Learned | None:
        """Return the floor as robots have learned it by the moment of ``truth``; None: they were given it."""
        settings, floor = self._scene.settings, self._scene.map
        if settings.map.known:
            return None
        oldest = truth.tick - KEPT * settings.rate
        told = self._walls if truth.run == self._run else {}
        factor = ceil(floor.resolution / RESOLUTION - 1e-9)
        return Learned(
            rows=floor.shape[0] * factor,
            columns=floor.shape[1] * factor,
            resolution=floor.resolution / factor,
            cells=sorted(cell for cell, tick in told.items() if tick >= oldest),
        )

    @cached_property
    def _cells(self) -> CellMap:
        """The cells of traffic: on a large floor they take a while to find."""
        return cells_of(self._scene.map, self._scene.settings)

    def _rules(self, body: Body) -> str:
        """Return the explanation of a robot's fuzzy output as markdown."""
        try:
            told = self._scene.explain_wheels(body)
        except SwarmError as fault:
            return f"{body.robot}: {fault}"
        steering = body.steering.value if body.steering is not None else "none"
        joint = f", in a joint plan with {', '.join(body.members)}" if body.members else ""
        kind = self._scene.kind_of(body.robot)
        who = f"**{body.robot}** ({kind})" if kind else f"**{body.robot}**"
        return f"{who} {body.activity.value}, steering: {steering}{joint}\n\n```\n{told.text()}\n```"

    def _held_cells(self, body: Body) -> list[Box]:
        """Return the cells that a robot holds."""
        side = self._cells.side
        middles = (self._cells.centre(cell) for cell in body.held if cell < len(self._cells))
        return [(x - side / 2, y - side / 2, side, side) for x, y in middles]


def wait_arrows(bodies: dict[str, Body]) -> list[Arrow]:
    """Return an arrow from each robot to each robot that it waits for."""
    return [
        ((body.x, body.y), (bodies[other].x, bodies[other].y))
        for body in bodies.values()
        for other in body.waits
        if other in bodies
    ]


def joint_plan_lines(plan: Followed, cells: CellMap, bodies: dict[str, Body]) -> Joint:
    """Return a joint plan as it is drawn; its lines lie side by side, so that each is visible in shared cells."""
    lines = {}
    for number, (robot, way) in enumerate(plan.ways.items()):
        body = bodies[robot]
        here = cells.cell_of(body.x, body.y)
        passed = way.index(here) + 1 if here in way else 1
        aside = cells.side * SPREAD * ((number + 0.5) / len(plan.ways) - 0.5)
        middles = [cells.centre(cell) for cell in way[passed:] if 0 <= cell < len(cells)]
        if middles:
            lines[robot] = [(body.x, body.y), *((x + aside, y + aside) for x, y in middles)]
    turns = [
        TurnOrder(at=cells.centre(cell), robots=in_words(order))
        for cell, order in plan.turns.items()
        if 0 <= cell < len(cells)
    ]
    return Joint(leader=plan.leader, ways=lines, turns=turns[:ORDERS])


def in_words(order: tuple[str, ...]) -> str:
    """Return an order of robots as text, the first few by name.

    >>> in_words(("r3", "r1", "r2", "r3"))
    'r3 > r1 > r2 > r3'
    """
    more = [f"+{len(order) - NAMED}"] if len(order) > NAMED else []
    return " > ".join([*order[:NAMED], *more])
