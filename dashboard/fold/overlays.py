"""The overlays of the floor at a moment: fired rules of one robot, cells held, who waits for whom, joint plans."""

from collections.abc import Sequence
from math import degrees
from typing import Final, NamedTuple

from dashboard.fold.learning import Learned, Learning
from dashboard.fold.plans import Followed, followed
from dashboard.fold.scene import Scene
from swarm.errors import SwarmError
from swarm.fuzzy import Controller, Explanation, Profile
from swarm.messages import Body, Broadcast, Truth
from swarm.messages.traffic import Epoch, JointPlan, Record
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of, traffic_settings

SPREAD: Final = 0.7  # of a cell's side, over which the lines of one plan spread where they share cells
ORDERS: Final = 3  # most orders of one plan that are shown
DETAILED: Final = 8  # robots; of more, the details of one are shown: those of all cover the floor
NAMED: Final = 8  # most robots named in an order

Box = tuple[float, float, float, float]  # m: x and y of the lower corner, width, height
Spot = tuple[float, float]  # m
Arrow = tuple[Spot, Spot]


def detailed(robots: Sequence[str], selected: str | None) -> tuple[str, ...]:
    """Return the robots whose sensors, held cells and joint plans are drawn: all of a few, else the selected one.

    >>> detailed(("r1", "r2"), "r2")
    ('r1', 'r2')
    >>> detailed([f"r{n}" for n in range(1, 10)], "r3")
    ('r3',)
    """
    if len(robots) <= DETAILED:
        return tuple(robots)
    return (selected,) if selected in robots and selected is not None else tuple(robots[:1])


class Drawing(NamedTuple):
    """A joint plan as it is drawn."""

    leader: str
    leads: list[Spot]  # m, position of the leader; empty if unknown
    lines: dict[str, list[Spot]]  # m, robot -> remaining path, from its position
    orders: list[tuple[Spot, str]]  # m, a cell's centre, and the order in which robots enter it


class Overlay(NamedTuple):
    """The overlay of the floor at one moment."""

    time: float  # s, since the run began
    rules: str  # rules that fire in the selected robot, as markdown; empty if the profile is not known
    held: dict[str, list[Box]]  # the cells that each robot holds
    waits: list[Arrow]  # from each robot to each robot that it waits for
    plans: list[Drawing]  # the joint plans under way
    learned: Learned | None = None  # the floor as robots have learned it; None: they were given it


class Overlays:
    """The overlays of one scene; ``selected`` is the robot whose rules are shown, None for the first."""

    def __init__(self, scene: Scene, selected: str | None = None) -> None:
        self._scene = scene
        self._selected = selected
        self._controller = Controller(Profile.from_builtins(scene.profile)) if scene.profile is not None else None
        self._cells = cells_of(scene.map, scene.settings)
        self._absent = traffic_settings(scene.settings).absent
        self._learning = None if scene.settings.map.known else Learning(scene)
        self._run = -1
        self._records: dict[str, Record] = {}  # the newest of each robot
        self._plans: dict[Epoch, JointPlan] = {}

    def hear(self, message: Broadcast) -> None:
        """Take in what a robot's broadcast says of the floor, and its traffic record."""
        if message.run != self._run:
            self._run, self._records, self._plans = message.run, {}, {}
            self._learning = self._learning and Learning(self._scene)
        if self._learning is not None:
            self._learning.hear(message)
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

    def at(self, truth: Truth) -> Overlay:
        """Return the overlay at the moment of ``truth``."""
        bodies = {body.robot: body for body in truth.bodies}
        rules = ""
        if self._controller is not None and bodies:
            rules = self.rules(self._controller, bodies.get(self._selected or "", truth.bodies[0]))
        held = {name: self.boxes(body) for name, body in bodies.items()}
        plans = self.plans(self._cells, truth.tick, bodies) if truth.run == self._run else []
        return Overlay(truth.time, rules, held, waits(bodies), plans, self.learned(truth))

    def learned(self, truth: Truth) -> Learned | None:
        """Return the floor as robots have learned it by the moment of ``truth``; None: they were given it."""
        if self._learning is None:
            return None
        return (self._learning if truth.run == self._run else Learning(self._scene)).at(truth.tick)

    def rules(self, controller: Controller, body: Body) -> str:
        """Return the explanation of a robot's fuzzy output as markdown."""
        try:
            told = explained(controller, self._scene.settings, body)
        except SwarmError as fault:
            return f"{body.robot}: {fault}"
        steering = body.steering.value if body.steering is not None else "none"
        joint = f", in a joint plan with {', '.join(body.members)}" if body.members else ""
        return f"**{body.robot}** {body.activity.value}, steering: {steering}{joint}\n\n```\n{told.text()}\n```"

    def plans(self, cells: CellMap, tick: int, bodies: dict[str, Body]) -> list[Drawing]:
        """Return the joint plans under way; a robot that is silent for so long that it loses its turns is left out."""
        heard = {
            robot: record
            for robot, record in self._records.items()
            if robot in bodies and tick - record.stamp <= self._absent
        }
        return [drawn(plan, cells, bodies) for plan in followed(heard, self._plans)]

    def boxes(self, body: Body) -> list[Box]:
        """Return the cells that a robot holds."""
        side = self._cells.side
        middles = (self._cells.centre(cell) for cell in body.held if cell < len(self._cells))
        return [(x - side / 2, y - side / 2, side, side) for x, y in middles]


def explained(controller: Controller, settings: Settings, body: Body) -> Explanation:
    """Return why the fuzzy controller gives a robot its wheel speeds now.

    Raises:
        ControlInputError: one of the body's numbers is none that the controller takes.
    """
    scale = settings.robot.distance_scale * body.scale
    heading_deg = -degrees(body.heading)  # the paper's sign: positive is to the right
    return controller.explain(body.left / scale, body.front / scale, body.right / scale, heading_deg)


def waits(bodies: dict[str, Body]) -> list[Arrow]:
    """Return an arrow from each robot to each robot that it waits for."""
    return [
        ((body.x, body.y), (bodies[other].x, bodies[other].y))
        for body in bodies.values()
        for other in body.waits
        if other in bodies
    ]


def drawn(plan: Followed, cells: CellMap, bodies: dict[str, Body]) -> Drawing:
    """Return the drawing of a joint plan; its lines lie side by side, so that each is visible in shared cells."""
    lines = {}
    for number, (robot, way) in enumerate(plan.ways.items()):
        body = bodies[robot]
        here = cells.cell_of(body.x, body.y)
        passed = way.index(here) + 1 if here in way else 1
        aside = cells.side * SPREAD * ((number + 0.5) / len(plan.ways) - 0.5)
        middles = [cells.centre(cell) for cell in way[passed:] if 0 <= cell < len(cells)]
        if middles:
            lines[robot] = [(body.x, body.y), *((x + aside, y + aside) for x, y in middles)]
    orders = [(cells.centre(cell), in_words(order)) for cell, order in plan.turns.items() if 0 <= cell < len(cells)]
    leads = [(bodies[plan.leader].x, bodies[plan.leader].y)] if plan.leader in bodies else []
    return Drawing(plan.leader, leads, lines, orders[:ORDERS])


def in_words(order: tuple[str, ...]) -> str:
    """Return an order of robots as text, the first few by name.

    >>> in_words(("r3", "r1", "r2", "r3"))
    'r3 > r1 > r2 > r3'
    """
    more = [f"+{len(order) - NAMED}"] if len(order) > NAMED else []
    return " > ".join([*order[:NAMED], *more])
