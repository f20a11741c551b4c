"""The cuts that shrinking tries: each makes plans that are a little simpler than a plan."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from typing import Any, Final, TypeVar

import msgspec

from swarm.errors import ConfigError
from swarm.scenario.load import check_values
from swarm.storm.plans.draw import can_be_driven
from swarm.storm.plans.plan import StormPlan

T = TypeVar("T")
Raw = dict[str, Any]  # a plan as plain data
Cut = Callable[[Raw], Iterator[Raw]]

FAR_RADIO: Final = 50.0  # m
CELL: Final = 1.2  # m, side of a cell if the plan does not give it
SHORTEST: Final = 2  # ticks; a fault is not made shorter


def simpler(plan: StormPlan, cut: Cut) -> Iterator[StormPlan]:
    """Yield the simpler plans of one kind that robots can drive in, those with the largest cuts first."""
    raw = msgspec.to_builtins(plan)
    for candidate in cut(raw):
        try:
            check_values(candidate["scenario"], "shrink")
            smaller = msgspec.convert(candidate, StormPlan)
            if smaller != plan and can_be_driven(smaller):
                yield smaller
        except (ConfigError, msgspec.ValidationError):
            continue


def size(plan: StormPlan) -> tuple[int, int, int, int]:
    """Count robots, faults, stops, and characters of free floor."""
    scenario = plan.scenario
    wrong = len(plan.faults) + (plan.kill_leader_at is not None) + bool(plan.late) + bool(plan.slow) + len(plan.mute)
    wrong += len(scenario.edits) + len(scenario.movers) + len(scenario.orders) + len(scenario.pool)
    stops = sum(map(len, scenario.own_targets)) or len(scenario.targets)
    return plan.robots, wrong, stops, (scenario.map.text or "").count(".")


def _fewer(items: Sequence[T]) -> Iterator[list[T]]:
    """Yield the list without all items, without each half, each quarter, ... and each single item."""
    part = len(items)
    while part:
        for first in range(0, len(items), part):
            yield [*items[:first], *items[first + part :]]
        part = 0 if part == 1 else (part + 1) // 2


def _with_value(raw: Raw, path: str, value: object) -> Raw:
    """Return the plan with another value at a dotted path."""
    new = deepcopy(raw)
    *sections, name = path.split(".")
    section = new
    for each in sections:
        section = section[each]
    section[name] = value
    return new


# ---- the cuts


def robots(raw: Raw) -> Iterator[Raw]:
    """Leave robots out; those that stay are numbered again."""
    mix = raw["scenario"]["robots"]
    kinds = [kind for kind, count in mix.items() for _ in range(count)] if isinstance(mix, dict) else []
    for stay in _fewer(range(len(kinds) or mix)):
        if not stay:
            continue
        new = deepcopy(raw)
        scenario = new["scenario"]
        scenario["robots"] = Counter(kinds[number] for number in stay) if kinds else len(stay)
        scenario["start"]["poses"] = [scenario["start"]["poses"][number] for number in stay]
        if scenario["own_targets"]:
            scenario["own_targets"] = [scenario["own_targets"][number] for number in stay]
        names = {f"r{number + 1}": f"r{place}" for place, number in enumerate(stay, start=1)}
        scenario["orders"] = [
            one | {"robot": names[one["robot"]]} for one in scenario["orders"] if one["robot"] in names
        ]
        new["faults"] = [fault | {"robot": names[fault["robot"]]} for fault in new["faults"] if fault["robot"] in names]
        new["mute"] = [names[robot] for robot in new["mute"] if robot in names]
        yield new


def faults(raw: Raw) -> Iterator[Raw]:
    """Leave faults of single robots out."""
    for stay in _fewer(raw["faults"]):
        yield raw | {"faults": stay}


def conditions(raw: Raw) -> Iterator[Raw]:
    """Set one condition of the whole run, such as radio loss, back to a harmless value."""
    yield raw | {"late": 0}
    yield raw | {"slow": 0}
    yield raw | {"kill_leader_at": None}
    for stay in _fewer(raw["mute"]):
        yield raw | {"mute": stay}
    if raw["scenario"]["kinds"]:
        alike = _with_value(raw, "scenario.robots", sum(raw["scenario"]["robots"].values()))
        yield _with_value(alike, "scenario.kinds", {})
    for path, value in (
        ("radio.loss", 0.0), ("radio.line_of_sight", False), ("radio.range", FAR_RADIO), ("return_home", False),
        ("sensors.noise", 0.0), ("sensors.bearing_noise_deg", 0.0),
    ):  # fmt: skip
        yield _with_value(raw, f"scenario.{path}", value)


def drop_changes(raw: Raw) -> Iterator[Raw]:
    """Leave edits, movers, orders and errands out."""
    for name in ("movers", "edits", "orders", "pool"):
        for stay in _fewer(raw["scenario"][name]):
            yield _with_value(raw, f"scenario.{name}", stay)


def stops(raw: Raw) -> Iterator[Raw]:
    """Leave stops out, of all robots or of one; each keeps one."""
    shared, own = raw["scenario"]["targets"], raw["scenario"]["own_targets"]
    for stay in _fewer(shared):
        if stay:
            yield _with_value(raw, "scenario.targets", stay)
    for number, row in enumerate(own):
        for stay in _fewer(row):
            if stay:
                yield _with_value(raw, "scenario.own_targets", [*own[:number], stay, *own[number + 1 :]])


def halve_faults(raw: Raw) -> Iterator[Raw]:
    """Make faults last half as long."""
    for number, fault in enumerate(raw["faults"]):
        if fault["ticks"] >= 2 * SHORTEST:
            shorter = fault | {"ticks": fault["ticks"] // 2}
            yield raw | {"faults": [*raw["faults"][:number], shorter, *raw["faults"][number + 1 :]]}


def cut_lanes(raw: Raw) -> Iterator[Raw]:
    """Cut one row or column of cells out of the floor and close the gap."""
    drawn = raw["scenario"]["map"]
    lines, side = drawn["text"].splitlines(), _side(raw)
    width, height = len(lines[0]), len(lines)
    for first in range(0, width - side + 1, side):
        cut = [line[:first] + line[first + side :] for line in lines]
        new = _shift_places(raw, 0, first * drawn["cell"], side * drawn["cell"])
        if new is not None:
            yield _with_value(new, "scenario.map.text", "\n".join(cut) + "\n")
    for first in range(0, height - side + 1, side):
        cut = [*lines[:first], *lines[first + side :]]
        new = _shift_places(raw, 1, (height - first - side) * drawn["cell"], side * drawn["cell"])
        if new is not None:
            yield _with_value(new, "scenario.map.text", "\n".join(cut) + "\n")


def fill_squares(raw: Raw) -> Iterator[Raw]:
    """Fill cells with wall, one at a time."""
    drawn, side = raw["scenario"]["map"], _side(raw)
    lines = drawn["text"].splitlines()
    for y in range(0, len(lines), side):
        for x in range(0, len(lines[0]), side):
            rows = range(y, min(len(lines), y + side))
            if any("." in lines[row][x : x + side] for row in rows):
                filled = [
                    line[:x] + "#" * len(line[x : x + side]) + line[x + side :] if row in rows else line
                    for row, line in enumerate(lines)
                ]
                yield _with_value(raw, "scenario.map.text", "\n".join(filled) + "\n")


CUTS: Final[tuple[Cut, ...]] = (robots, faults, conditions, drop_changes, stops, cut_lanes, halve_faults, fill_squares)


def _side(raw: Raw) -> int:
    """Return how many characters of the drawing a cell is wide."""
    cell, drawn = raw["scenario"]["traffic"]["cell"] or CELL, raw["scenario"]["map"]["cell"]
    return max(1, round(float(cell / drawn)))


def _shift_places(raw: Raw, axis: int, low: float, wide: float) -> Raw | None:
    """Move every place beyond a lane back by the lane's width; return None if a start, stop or mover is in the lane."""
    new = deepcopy(raw)
    scenario = new["scenario"]
    start, own, movers = scenario["start"], scenario["own_targets"], scenario["movers"]
    standing = [*start["poses"], *scenario["targets"], *(at for row in own for at in row)]
    standing += [at for mover in movers for at in mover["waypoints"]]
    if any(low < place[axis] < low + wide for place in standing):
        return None

    def shift_place(place: Sequence[float]) -> list[float]:
        x = place[axis]
        to = x if x <= low else max(low, round(x - wide, 6))  # the corner of an edit may be in the lane
        return [to if k == axis else value for k, value in enumerate(place)]

    start["poses"] = [shift_place(at) for at in start["poses"]]
    scenario["targets"] = [shift_place(at) for at in scenario["targets"]]
    scenario["own_targets"] = [[shift_place(at) for at in row] for row in own]
    for mover in movers:
        mover["waypoints"] = [shift_place(at) for at in mover["waypoints"]]
    for edit in scenario["edits"]:
        edit["low"], edit["high"] = shift_place(edit["low"]), shift_place(edit["high"])
    return new
