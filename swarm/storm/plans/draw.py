"""The drawing of a plan from a seed. A world that nobody can drive in is drawn again, with the seed's next attempt."""

from itertools import count
from math import pi
from random import Random
from typing import Any, Final

from swarm.errors import ConfigError, suggest
from swarm.maps.occupancy import FREE, OBSTACLE, WALL, Point
from swarm.maps.text import from_text
from swarm.scenario.load import check_values
from swarm.scenario.starts import robot_names
from swarm.settings import RobotSettings
from swarm.storm.plans.kinds import with_kinds
from swarm.storm.plans.localisation import draw_localisation
from swarm.storm.plans.plan import StormPlan
from swarm.storm.plans.planned_faults import draw_faults, draw_mute
from swarm.storm.plans.profiles import PROFILES, StormProfile
from swarm.storm.plans.rooms import FINE, draw_places, draw_rooms, is_in_one_piece
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.placement import cells_of, comes_near, distance_to_stop

SIDE: Final = 1.2  # m, side of a cell
THIRD: Final = 3  # thin walls are a third of a cell wide
RADIUS: Final = RobotSettings().radius  # m
REACHES: Final = (0.4, 0.25, 0.1)  # m, where places are drawn anywhere
EDIT_FROM: Final = 5.0  # s; no edit comes earlier
MOVER_ROOM: Final = 0.45  # m, radius of a moving obstacle and what robots keep clear of it
SLOWEST: Final = (1, 2, 4, 4, 8)  # ticks; the last is longer than a command is valid


def draw(profile: str, seed: int) -> StormPlan:
    """Return the plan of a seed in a profile; it is always the same.

    Raises:
        ConfigError: there is no such profile.
    """
    if profile not in PROFILES:
        raise ConfigError(f"--profile: expected the name of a profile, got {profile!r}; {suggest(profile, PROFILES)}")
    for attempt in count():
        chance = Random(f"storm 1 {profile} {seed} {attempt}")
        plan = _try(PROFILES[profile], profile, seed, chance)
        if plan is not None:
            return with_kinds(plan, PROFILES[profile], can_be_driven)
    raise AssertionError  # count() does not end


def _try(profile: StormProfile, name: str, seed: int, chance: Random) -> StormPlan | None:
    """Draw once; return None if nobody could drive in the world."""
    if profile.rooms:
        return _try_rooms(profile, name, seed, chance)
    columns, rows = (round(chance.uniform(*span)) for span in (profile.columns, profile.rows))
    text = _floor(profile, columns, rows, chance)
    robots = min(round(chance.uniform(*profile.robots)), int(profile.per_cell * text.count(".") / profile.raster**2))
    if robots < profile.robots[0]:
        return None
    raw = _conditions(profile, name, seed, text, round(SIDE / profile.raster, 6), robots, chance)
    cells = _cells_for(raw)
    if cells is None:
        return None
    piece = _largest_piece(cells)
    stops = round(chance.uniform(*profile.stops))
    if len(piece) < robots + 1:
        return None
    raw["traffic"] = {"cell": round(cells.side, 6), "offset": [round(x, 6) for x in cells.offset]}
    raw["start"] = {"poses": [_pose(cells, cell, chance) for cell in chance.sample(piece, robots)]}
    if chance.random() < profile.shared:
        raw["targets"] = [_point(cells, cell, chance) for cell in chance.sample(piece, min(stops, len(piece)))]
    else:
        raw["own_targets"] = _own_targets(cells, piece, robots, stops, chance)
    if chance.random() < profile.edits:
        raw["edits"] = _edits(columns, rows, chance)
    if chance.random() < profile.movers:
        raw["movers"] = [_mover(cells, piece, chance)]
        if _shuts_off(raw, cells, piece):
            return None
    if profile.orders and chance.random() < profile.orders:  # other profiles draw as before
        raw["orders"] = _with_headings(_orders(cells, robots, chance), Random(f"headings {seed}"))
    if profile.pool and chance.random() < profile.pool:
        some = chance.sample(piece, min(len(piece), robots * chance.randint(1, 4)))
        raw["pool"] = [_point(cells, cell, chance) for cell in some]
    try:
        plan = _plan_of(profile, name, seed, raw, chance)
        return plan if can_be_driven(plan) else None
    except ConfigError:
        return None


def _try_rooms(profile: StormProfile, name: str, seed: int, chance: Random) -> StormPlan | None:
    """Draw rooms and halls once; return None if they have no room. Whether cells lead anywhere is not asked."""
    text = draw_rooms(chance)
    if text is None:
        return None
    robots, stops = round(chance.uniform(*profile.robots)), round(chance.uniform(*profile.stops))
    raw = _conditions(profile, name, seed, text, FINE, robots, chance)
    floor = from_text(text, FINE)
    legs = [draw_places(floor, RADIUS, robots, chance) for _ in range(1 + stops)]
    starts, *rows = [leg for leg in legs if leg is not None]
    if len(rows) < stops or not is_in_one_piece(floor, RADIUS, [*starts, *(place for row in rows for place in row)]):
        return None
    raw["start"] = {"poses": [[*place, round(chance.uniform(-pi, pi), 3)] for place in starts]}
    raw["own_targets"] = [[list(place) for place in row] for row in zip(*rows, strict=True)]
    raw["reach"] = chance.choice(REACHES)
    return _plan_of(profile, name, seed, raw, chance)


def _conditions(
    profile: StormProfile, name: str, seed: int, text: str, side: float, robots: int, chance: Random
) -> dict[str, Any]:
    """Draw what a scenario has besides starts and targets: its map is ``text`` in squares of ``side`` [m]."""
    raw: dict[str, Any] = {
        "name": f"storm.{name}.{seed}",
        "map": {"text": text, "cell": side, "known": profile.known},
        "robots": robots,
        "seed": seed,
        "limit": 3600.0,
        "return_home": chance.random() < profile.home,
        "radio": {
            "range": chance.choice(profile.radio_range),
            "loss": chance.choice(profile.loss),
            "line_of_sight": chance.random() < profile.sight,
        },
    }
    if chance.random() < profile.noise:
        raw["sensors"] = {"noise": 0.02, "bearing_noise_deg": 2.0}
    return raw | draw_localisation(profile, robots, Random(f"pose {seed}"))  # a chance of its own: others stay


def _plan_of(profile: StormProfile, name: str, seed: int, raw: dict[str, Any], chance: Random) -> StormPlan:
    """Draw what goes wrong in a scenario; return the plan of both."""
    robots = raw["robots"]
    return StormPlan(
        profile=name,
        seed=seed,
        scenario=check_values(raw, "storm"),
        faults=draw_faults(profile, robots, chance),
        kill_leader_at=chance.randrange(20, 400) if chance.random() < profile.leader_killed else None,
        late=chance.randint(1, 4) if chance.random() < profile.late else 0,
        mute=draw_mute(profile, robots, chance),
        slow=chance.choice(SLOWEST) if profile.slow and chance.random() < profile.slow else 0,
    )


# ---- the floor


def _floor(profile: StormProfile, columns: int, rows: int, chance: Random) -> str:
    """Draw a walled floor: blocks on the lattice, or blocks and thin walls anywhere."""
    side, third = profile.raster, profile.raster // THIRD  # characters
    width, height = columns * side, rows * side
    grid = [["." for _ in range(width)] for _ in range(height)]
    anywhere = chance.random() < profile.off_lattice
    blocks = round(chance.uniform(*profile.walls) * columns * rows)
    for _ in range(blocks):
        if anywhere:
            w, h = (third * n for n in chance.choice(((1, 3), (3, 1), (1, 6), (6, 1), (2, 2), (3, 3))))
            x, y = chance.randrange(width), chance.randrange(height)
        else:
            w, h = side, side
            x, y = side * chance.randrange(columns), side * chance.randrange(rows)
        kind = chance.choice("##o")
        for row in range(y, min(height, y + h)):
            for column in range(x, min(width, x + w)):
                grid[row][column] = kind
    beside, edge = "#" * side, ["#" * (width + 2 * side)] * side
    return "\n".join([*edge, *(beside + "".join(line) + beside for line in grid), *edge]) + "\n"


def _cells_for(raw: dict[str, Any]) -> CellMap | None:
    """Return the cells of a floor whose starts and stops are not drawn yet."""
    blank = raw | {"start": {"area": [0.0, 0.0, 1e3, 1e3]}, "targets": [[1.0, 1.0]], "robots": 1, "return_home": False}
    blank["map"] = blank["map"] | {"known": True}
    plan = StormPlan(profile="draw", seed=0, scenario=check_values(blank, "storm"))
    scenario = plan.to_scenario()
    return cells_of(scenario.map, scenario.settings)


def _largest_piece(cells: CellMap) -> list[int]:
    pieces: list[list[int]] = []
    seen: set[int] = set()
    for cell, stands in enumerate(cells.stands):
        if stands and cell not in seen:
            piece = [other for other, steps in enumerate(cells.distances(cell)) if steps < FAR]
            seen.update(piece)
            pieces.append(piece)
    return max(pieces, key=len, default=[])


def _pose(cells: CellMap, cell: int, chance: Random) -> list[float]:
    x, y = _point(cells, cell, chance)
    return [x, y, round(chance.uniform(-pi, pi), 3)]


def _point(cells: CellMap, cell: int, chance: Random) -> list[float]:
    """Draw a place near the middle of a cell where a robot can stand [m]."""
    x, y = cells.centre(cell)
    spread = chance.choice((0.0, 0.15))
    at = (x + chance.uniform(-spread, spread), y + chance.uniform(-spread, spread))
    return [round(value, 3) for value in cells.move_inside(cell, at, 0.3)]


def _own_targets(cells: CellMap, piece: list[int], robots: int, stops: int, chance: Random) -> list[list[list[float]]]:
    """Draw each robot its own stops; no two robots have the same last stop."""
    last = chance.sample(piece, robots)
    rows = []
    for robot in range(robots):
        row = [chance.choice(piece) for _ in range(stops - 1)] + [last[robot]]
        rows.append([_point(cells, cell, chance) for cell in row])
    return rows


def _edits(columns: int, rows: int, chance: Random) -> list[dict[str, Any]]:
    """Draw edits: walls that come and go, some of which change nothing."""
    edits: list[dict[str, Any]] = []
    time = EDIT_FROM
    for _ in range(chance.randint(1, 4)):
        time += chance.uniform(1.0, 20.0)
        w, h = chance.choice(((0.3, 0.3), (1.0, 0.3), (0.3, 1.0), (1.1, 1.1)))
        x = SIDE + chance.uniform(0.0, columns * SIDE - w)
        y = SIDE + chance.uniform(0.0, rows * SIDE - h)
        low, high = [round(x, 2), round(y, 2)], [round(x + w, 2), round(y + h, 2)]
        kind = chance.choice(("wall", "obstacle", "free"))
        edits.append({"at": round(time, 2), "kind": kind, "low": low, "high": high})
        if kind != "free" and chance.random() < 0.5:
            edits.append({"at": round(time + chance.uniform(5.0, 30.0), 2), "kind": "free", "low": low, "high": high})
    return sorted(edits, key=lambda edit: edit["at"])


def _with_headings(orders: list[dict[str, Any]], chance: Random) -> list[dict[str, Any]]:
    """Add to some of the targets a heading to turn to there."""
    for one in orders:
        if "targets" in one and chance.random() < 0.4:
            one["headings"] = [
                round(chance.uniform(-3.14, 3.14), 2) if chance.random() < 0.7 else None for _ in one["targets"]
            ]
    return orders


def _orders(cells: CellMap, robots: int, chance: Random) -> list[dict[str, Any]]:
    """Draw requests to robots; whoever is stopped goes on later. Some are refused: no way leads there, or too old."""
    orders: list[dict[str, Any]] = []
    stand = [cell for cell in range(len(cells)) if cells.stands[cell]]
    for robot in robot_names(robots):
        for time in sorted(chance.uniform(1.0, 60.0) for _ in range(chance.randint(0, 4))):
            asked: dict[str, Any] = {"at": round(time, 2), "robot": robot}
            what = chance.choice(("order", "order", "order", "stop", "home", "cancel"))
            if what == "order":
                stops = [_point(cells, chance.choice(stand), chance) for _ in range(chance.randint(1, 3))]
                more = {"id": chance.choice("ab"), "update": chance.randrange(4), "home": chance.random() < 0.3}
                orders.append(asked | {"targets": stops} | more)
                continue
            orders.append(asked | {"do": what})
            if what == "stop":
                orders.append({"at": round(time + chance.uniform(1.0, 40.0), 2), "robot": robot, "do": "go_on"})
    return sorted(orders, key=lambda asked: asked["at"])


def _mover(cells: CellMap, piece: list[int], chance: Random) -> dict[str, Any]:
    a, b = (cells.centre(cell) for cell in chance.sample(piece, 2))
    return {
        "waypoints": [[round(x, 3) for x in point] for point in (a, b)],
        "speed": round(chance.uniform(0.1, 0.4), 2),
        "radius": 0.2,
    }


def _shuts_off(raw: dict[str, Any], cells: CellMap, piece: list[int]) -> bool:
    """Return True if a moving obstacle cuts cells off from each other, or passes over a start or a stop."""
    a, b = raw["movers"][0]["waypoints"]
    along = [(a[0] + share / 20 * (b[0] - a[0]), a[1] + share / 20 * (b[1] - a[1])) for share in range(21)]
    swept = cells.swept_cells(along, MOVER_ROOM)
    left = [cell for cell in piece if cell not in swept]
    places = [*raw["start"]["poses"], *raw.get("targets", []), *(p for row in raw.get("own_targets", []) for p in row)]
    if not left or any(cells.cell_of(place[0], place[1]) in swept for place in places):
        return True
    table = cells.distances(left[0], swept)
    return any(table[cell] >= FAR for cell in left)


# ---- can it be driven


def can_be_driven(plan: StormPlan) -> bool:
    """Check that each robot alone can reach each stop over its cells, on every floor that the edits make."""
    scenario = plan.to_scenario()
    settings = scenario.settings
    floor = scenario.map
    starts: list[Point] = [pose[:2] for pose in settings.start.poses or ()]
    floors = [floor]
    for edit in settings.edits:
        kind = {"wall": WALL, "obstacle": OBSTACLE, "free": FREE}[edit.kind]
        floor = floor.edit_rectangle(kind, edit.low, edit.high)[0]
        floors.append(floor)
    for number, start in enumerate(starts):
        own = scenario.of_robot(number).settings
        cells = cells_of(floors[0], own)
        if cells.cell_of(*start) < 0 or not cells.stands[cells.cell_of(*start)]:
            return False
        stops = [*scenario.stops(number, start), *settings.pool]
        for changed in floors:
            cells = cells_of(changed, own)
            if any(
                distance_to_stop(cells, stop, own) > own.reach or not comes_near(cells, start, stop, own)
                for stop in stops
            ):
                return False
    return True
