"""Draws the pictures of concepts.md from the project's own objects: two robots that meet at the door of one scenario.

The meeting is a ``Simulation`` of the floor of ``doorway.yaml``, one robot on either side of the door. Whatever a
picture shows of it was said or done by those robots: senses, commands, claims, acknowledgements, a joint plan.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Final, NamedTuple

from msgspec.structs import replace as changed

from docs.drawing import Sheet, colour, framed
from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages.traffic import JointPlan, Record
from swarm.planning.path import plan
from swarm.scenario.load import Scenario, load
from swarm.scenario.prepare import planning_grid, prepare, settle_lattice
from swarm.settings import RadioSettings, StartSettings
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of
from world.bodies.physics import Physics
from world.bodies.radio_model import RadioModel
from world.simulate import Simulation, Tick

SCENARIOS: Final = Path(__file__).parents[1] / "scenarios"
STARTS: Final = [(10.2, 7.8, 0.0), (16.2, 7.8, pi)]  # m, m, rad; r1 left of the door, r2 right of it
DOOR: Final = (13.2, 6.6)  # m
STOPS: Final = [[(18.6, 7.8)], [(7.8, 7.8)]]  # m; each is on the other side
SEED: Final = 1
LASTS: Final = 100  # ticks of the meeting; in them they agree on a joint plan, and hold the first cells of it
FIRST: Final = 43  # tick of the first picture: r2 speaks in it, r1 in the next
SHOWN: Final = 6  # ticks in it
AWAY: Final = (5.4, 7.9, 0.0)  # m, m, rad
CORNER: Final = (8.37, 7.17)  # m; a place near the corner of four cells
LISTENER: Final = 13  # of doorway.yaml's starts, the one whose hearing is drawn: r14


class Meeting(NamedTuple):
    """The run."""

    scenario: Scenario
    cells: CellMap
    ticks: list[Tick]
    poses: list[dict[str, Pose]]  # at each tick

    def records(self, tick: int) -> dict[str, Record]:
        """Return what each robot told last about its traffic, up to and with a tick."""
        told: dict[str, Record] = {}
        for moment in self.ticks[: tick + 1]:
            told |= {name: words.traffic.own for name, words in moment.spoken.items() if words.traffic is not None}
        return told

    def first(self, holds: Callable[[Mapping[str, Record]], bool], after: int = 0) -> int:
        """Return the first tick whose records are as asked."""
        return next(tick for tick in range(after, len(self.ticks)) if holds(self.records(tick)))


@cache
def meeting() -> Meeting:
    """Step the two robots until they are on their way by a joint plan."""
    scenario = load(SCENARIOS / "doorway.yaml")
    settings = changed(scenario.settings, start=StartSettings(poses=STARTS), own_targets=STOPS)
    run = Simulation.of(replace(scenario, settings=settings), len(STARTS), SEED)
    ticks: list[Tick] = []
    poses: list[dict[str, Pose]] = []
    while len(ticks) < LASTS:
        poses.append(dict(zip(run.world.robots, run.world.poses(), strict=True)))
        ticks.append(run.step())
    return Meeting(run.scenario, cells_of(run.scenario.map, run.scenario.settings), ticks, poses)


def tick() -> str:
    """Draw what goes between the world and two robots in some ticks: sense, command, broadcast."""
    met, wide, left, rows = meeting(), 104, 96, {"world": 40, "r1": 120, "r2": 190}
    parts = []
    for name, y in rows.items():
        parts.append(f'<text class="left bold" x="12" y="{y + 4}">{name}</text>')
        parts.append(f'<path class="faint" d="M{left - 16},{y} H{left + SHOWN * wide}" stroke-width="2"/>')
    for number in range(SHOWN):
        moment, x = met.ticks[FIRST + number], left + number * wide
        time = next(iter(moment.senses.values())).time
        parts.append(f'<text class="left" x="{x}" y="22">tick {FIRST + number}, {time:.2f} s</text>')
        for name in moment.commands:
            y, column = rows[name], x + 14 * (list(rows).index(name) - 1)
            parts.append(f'<path class="ink" d="M{column},40 V{y - 7}" marker-end="url(#tip)"/>')
            parts.append(f'<circle cx="{column}" cy="{y}" r="5" fill="{colour(name)}"/>')
            parts.append(
                f'<path class="ink dashed" d="M{column + 5},{y - 4} L{x + wide - 30},44" marker-end="url(#tip)"/>'
            )
        for name in moment.spoken:
            y = rows[name]
            parts.append(f'<circle class="ring" cx="{x + 14 * (list(rows).index(name) - 1)}" cy="{y}" r="10" '
                         f'stroke="{colour(name)}" stroke-width="3"/>')  # fmt: skip
        if number + 1 < SHOWN:
            parts += _heard(met.ticks[FIRST + number + 1], rows, x, wide)
    lines = (
        "solid: sense, the world to a robot; dashed: command, back within the tick",
        "ring: a broadcast; coloured arrow: whose next sense says that it has arrived",
    )
    return framed("Six ticks of the world and two robots", left + SHOWN * wide + 12, 216, parts, lines)


def _heard(moment: Tick, rows: Mapping[str, int], x: float, wide: float) -> list[str]:
    return [
        f'<path d="M{x + 14 * (list(rows).index(speaker) - 1) + 10},{rows[speaker]} '
        f'L{x + wide + 14 * (list(rows).index(listener) - 1) - 9},{rows[listener]}" '
        f'stroke="{colour(speaker)}" stroke-width="3" marker-end="url(#tip-{speaker})"/>'
        for listener, sense in moment.senses.items()
        for speaker, _ in sense.hears
    ]


def target() -> str:
    """Draw the targets of the paper's mission and the paths that A* finds between them."""
    scenario, starts = prepare(load(SCENARIOS / "paper.yaml"), 1, SEED)
    grid = planning_grid(scenario)
    settings, floor = scenario.settings, scenario.map
    here: Point = starts[0][:2]
    stops = scenario.stops(0, here)
    sheet = Sheet("One robot's targets on the paper's floor", (0.0, 0.0), _corner(floor.shape, floor.resolution), 20)
    sheet.floor(floor)
    for a, b in pairwise((here, *stops)):
        path = plan(grid, a, b)
        assert path is not None, "the paper's mission has a path to each target"
        sheet.line(path.points, f'stroke="{colour("r1")}" stroke-width="2.5" marker-end="url(#tip-r1)"')
    for number, at in enumerate(stops, start=1):
        home = number == len(stops)
        sheet.disc(at, settings.reach, 'class="ring ink" stroke-width="2"')
        sheet.text(at, "home" if home else f"target {number}", up=14, look="bold")
    return sheet.svg()


def _corner(shape: tuple[int, int], resolution: float) -> Point:
    return shape[1] * resolution, shape[0] * resolution


def cell() -> str:
    """Draw the lattice of the paper's floor: cells a robot can stand in, and which are joined."""
    scenario, starts = prepare(load(SCENARIOS / "paper.yaml"), 1, SEED)
    settings, floor = scenario.settings, scenario.map
    cells = cells_of(floor, settings)
    sheet = Sheet("The cells of the paper's floor", (0.0, 0.0), _corner(floor.shape, floor.resolution), 20)
    for number in range(len(cells)):
        if cells.stands[number]:
            sheet.square(cells.centre(number), cells.side, 'class="ring faint"')
    sheet.floor(floor)
    for number in range(len(cells)):
        for near in cells.neighbours[number]:
            if near > number:
                joined = (cells.centre(number), cells.centre(near))
                sheet.line(joined, f'stroke="{colour("r2")}" stroke-width="2"')
        if cells.stands[number]:
            sheet.disc(cells.centre(number), 0.08, 'class="dot"')
    pose = starts[0]
    for number in cells.cells_under_disc(pose.x, pose.y, settings.robot.radius):
        sheet.square(cells.centre(number), cells.side, f'fill="{colour("r1")}" fill-opacity="0.4"')
    sheet.robot("r1", pose, settings.robot.radius)
    return sheet.svg()


def reservation() -> str:
    """Draw the first reservation of the meeting: r1 claims cells, r2 acknowledges the claims, r1 holds them."""
    met = meeting()
    claimed = met.first(lambda told: bool(told["r1"].claims))
    claims = met.records(claimed)["r1"].claims
    wanted = {("r1", claim.number) for claim in claims}
    agreed = met.first(lambda told: wanted <= set(told["r2"].acks), claimed)
    holds = met.first(lambda told: {claim.cell for claim in claims} <= set(told["r1"].held), agreed)
    numbers = ", ".join(str(claim.number) for claim in claims)
    panels = (
        (claimed, f"r1 claims {len(claims)} cells under the numbers {numbers}"),
        (agreed, f"r2 acknowledges the claims {numbers} of r1; it claims cells too"),
        (holds, "the claims of r1 have become holds"),
    )
    low, high = _around_the_door(met, ahead=4, aside=1)
    scale, gap, parts, top = 40.0, 34, [], 0.0
    for when, words in panels:
        sheet = Sheet("", low, high, scale)
        _floor_with_holds(sheet, met, when)
        parts.append(f'<text class="left" x="8" y="{top + 22:g}">tick {when}: {words}</text>')
        parts += [f'<svg y="{top + gap:g}" width="{sheet.width:g}" height="{sheet.height:g}">', *sheet.parts, "</svg>"]
        top += sheet.height + gap
    return framed("How claimed cells become held ones", sheet.width, top, parts)


def _around_the_door(met: Meeting, *, ahead: int, aside: int) -> tuple[Point, Point]:
    """Return two corners [m] of the cells about the door."""
    (x, y), side = met.cells.centre(met.cells.cell_of(*DOOR)), met.cells.side
    along, across = (ahead + 0.5) * side, (aside + 0.5) * side
    return (x - along, y - across), (x + along, y + across)


def _floor_with_holds(sheet: Sheet, met: Meeting, when: int) -> None:
    """Draw the floor at a tick, cells held in the robots' colours, and claims with an edge and their number."""
    cells, records = met.cells, met.records(when)
    for number in range(len(cells)):
        if sheet.shows(cells.centre(number), cells.side / 2):
            sheet.square(cells.centre(number), cells.side, 'class="ring faint"')
    sheet.floor(cells.occupancy)
    for name, record in records.items():
        for held in record.held:
            sheet.square(cells.centre(held), cells.side - 0.06, f'fill="{colour(name)}" fill-opacity="0.4"')
        for claim in record.claims:
            agreed = all((name, claim.number) in other.acks for other in records.values() if other is not record)
            look = f'class="ring{"" if agreed else " dashed"}" stroke="{colour(name)}" stroke-width="3"'
            sheet.square(cells.centre(claim.cell), cells.side - 0.12, look)
            sheet.text(cells.centre(claim.cell), str(claim.number))
    for name, pose in met.poses[when].items():
        sheet.robot(name, pose, met.scenario.settings.robot.radius)


def place() -> str:
    """Draw how a robot comes to a place at the corner of four cells: along its way, then straight, over held cells."""
    scenario = settle_lattice(load(SCENARIOS / "doorway.yaml"))  # the place is sent to it later
    settings = changed(
        scenario.settings, start=StartSettings(poses=[AWAY]), own_targets=[[CORNER]], reach=0.05, robots=1
    )
    run = Simulation.of(replace(scenario, settings=settings), 1, SEED)
    cells, radius = cells_of(run.scenario.map, run.scenario.settings), settings.robot.radius
    x, y = CORNER
    low, high = (x - 3 * cells.side, y - 1.5 * cells.side), (x + 1.5 * cells.side, y + 1.5 * cells.side)
    sheet = Sheet(
        "A place at the corner of four cells", low, high, 60,
        ("filled: the cells that the robot holds there; line: what it has driven",),
    )  # fmt: skip
    for number in range(len(cells)):
        if sheet.shows(cells.centre(number), cells.side / 2):
            sheet.square(cells.centre(number), cells.side, 'class="ring faint"')
    sheet.floor(run.scenario.map)
    driven: list[Point] = []
    held: Sequence[int] = ()
    while not run.world.is_finished:
        driven.append(run.world.poses()[0][:2])
        held = run.step().commands["r1"].held
    for number in held:
        sheet.square(cells.centre(number), cells.side - 0.06, f'fill="{colour("r1")}" fill-opacity="0.4"')
    sheet.line(driven, f'stroke="{colour("r1")}" stroke-width="3"')
    sheet.disc(CORNER, 0.08, 'class="dot"')
    sheet.robot("r1", run.world.poses()[0], radius)
    return sheet.svg()


def joint_plan() -> str:
    """Draw the joint plan of the meeting as it is told: each robot's way, and who enters a cell after whom."""
    met = meeting()
    when = met.first(lambda told: any(record.plan is not None for record in told.values()))
    agreed = next(record.plan for record in met.records(when).values() if record.plan is not None)
    low, high = _around_the_door(met, ahead=5, aside=1)
    sheet = Sheet("A joint plan at a door", low, high, 44, _turns(met.cells, agreed))
    _floor_with_holds(sheet, met, when)
    for passed in sorted({cell for way in agreed.ways.values() for cell in way}):
        x, y = met.cells.centre(passed)
        sheet.text((x + met.cells.side / 4, y - met.cells.side / 2), str(passed), up=4)
    for number, (name, way) in enumerate(agreed.ways.items()):
        aside = 0.14 * (number - (len(agreed.ways) - 1) / 2)  # m, so that ways over the same cells stay apart
        points = [(x + aside, y + aside) for x, y in map(met.cells.centre, way)]
        sheet.line(points, f'stroke="{colour(name)}" stroke-width="4" marker-end="url(#tip-{name})"')
    return sheet.svg()


def _turns(cells: CellMap, agreed: JointPlan) -> list[str]:
    """Return each turn of a plan in words."""
    return [
        f"{name} enters cell {agreed.ways[name][turn.step]} after {turn.robot} has left it"
        for name, turns in agreed.after.items()
        for turn in turns
    ]


def radio() -> str:
    """Draw whom one robot of ``doorway.yaml`` hears when all speak at once, and why it misses the others."""
    scenario = load(SCENARIOS / "doorway.yaml")
    settings = scenario.settings
    model = RadioSettings(range=settings.radio.range, loss=0.3, line_of_sight=True)
    poses = [Pose(*pose) for pose in settings.start.poses or ()]
    poses += [Pose(*stops[0], 0.0) for stops in settings.own_targets]
    physics = Physics(scenario.map, [settings.robot.radius] * len(poses), poses, [1.0] * len(poses), 0.05)
    spoken = [(number, 0) for number in range(len(poses))]
    hears = {sender for sender, _ in RadioModel(model, SEED, physics.sees).hears(poses, spoken)[LISTENER]}
    here = poses[LISTENER]
    sheet = Sheet(
        "Whom one robot hears", (0.0, 0.0), _corner(scenario.map.shape, scenario.map.resolution), 22,
        (
            f"orange: who listens; circle: the radio's range, {model.range:g} m; blue: heard",
            f"hollow: lost by chance ({model.loss:.0%} are); grey: behind the wall, or too far",
        ),
    )  # fmt: skip
    sheet.floor(scenario.map)
    sheet.disc(here[:2], model.range, 'class="ring ink dashed"')
    within = RadioModel(changed(model, loss=0.0), SEED, physics.sees).hears(poses, spoken)[LISTENER]
    in_range = {sender for sender, _ in within}
    for number, pose in enumerate(poses):
        if number in hears:
            sheet.line((pose[:2], here[:2]), f'stroke="{colour("r2")}" stroke-width="2"')
    for number, pose in enumerate(poses):
        missed = 'class="ground"' if number in in_range else 'class="wall"'
        look = f'fill="{colour("r2")}"' if number in hears else missed
        sheet.disc(pose[:2], settings.robot.radius, f'{look} stroke="#6e7681"')
    sheet.disc(here[:2], settings.robot.radius, f'fill="{colour("r1")}" stroke="#6e7681"')
    return sheet.svg()


PICTURES: Final[dict[str, Callable[[], str]]] = {
    "pictures/tick.svg": tick,
    "pictures/target.svg": target,
    "pictures/cell.svg": cell,
    "pictures/reservation.svg": reservation,
    "pictures/place.svg": place,
    "pictures/joint-plan.svg": joint_plan,
    "pictures/radio.svg": radio,
}
