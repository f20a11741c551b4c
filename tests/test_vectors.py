"""The test vectors for robots of other makes: ``examples/foreign_robot.py``, which shares no code with ours, agrees.

That they are what our code computes is checked by ``test_docs``, as for every generated file.
"""

import copy
import json
import zlib
from collections.abc import Callable
from fractions import Fraction
from math import ceil, floor, radians
from types import ModuleType
from typing import Any, Final

import msgpack
import pytest

from tests.launch.foreign import module
from tests.shared import ROOT

FOLDER: Final = ROOT / "schemas" / "vectors"
LATTICES: Final = ("lattice-paper", "lattice-squares", "lattice-turned", "lattice-edited", "lattice-touching")
SQUARES: Final = "lattice-squares"

Json = Any


def read(name: str) -> Json:
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def foreign() -> ModuleType:
    return module()


def rounded(*values: float) -> list[float]:
    return [round(value, 9) + 0.0 for value in values]


# --- what the other make computes; the rest of the vector is what it is given ---


def packed(vector: Json) -> Json:
    """Return the map of a vector as it is on the wire, its edits carried out."""
    cells = [list(map(int, row)) for row in vector["map"]["cells"]]
    kinds = {"free": 0, "wall": 1, "obstacle": 2}
    for edit in vector.get("edits", []):
        for row in range(*edit["rows"]):
            for column in range(*edit["columns"]):
                cells[row][column] = kinds[edit["kind"]]
    return vector["map"] | {"cells": zlib.compress(bytes(cell for row in cells for cell in row))}


def lattice(foreign: ModuleType, vector: Json) -> Json:
    """Return the vector of a lattice, computed again."""
    found = foreign.Lattice(packed(vector), vector["settings"])
    count = found.rows * found.columns
    again = copy.deepcopy(vector)
    again["lattice"] = {
        "rows": found.rows,
        "columns": found.columns,
        "middles": [rounded(*found.middle(cell)) for cell in range(count)],
        "stands": [cell for cell in range(count) if found.stands[cell]],
        "joins": [[cell, other] for cell in range(count) for other in sorted(found.near[cell]) if cell < other],
    }
    for point in again["points"]:
        point["cell"] = found.cell_of(*point["at"])
    for disc in again["discs"]:
        disc["reaches_into"] = found.touched(*disc["at"], disc["radius"])
    return again


def radio(foreign: ModuleType, vector: Json) -> Json:
    """Return the vector of the radio, computed again; it counts no lost messages."""
    again, sent = copy.deepcopy(vector), []

    class Session:
        def put(self, key: str, payload: bytes, *, attachment: bytes, **kwargs: object) -> None:
            sent.append((key.removeprefix("swarm/v1/mine/"), attachment))

    for row in again["phases"]:
        every = 2 if row["somebody_listens"] else row["every"]
        row["sends_at"] = [tick for tick in range(100, 125) if foreign.due(tick, int(row["robot"][1:]) - 1, every)]
    for row in again["zones"]:
        row["key"] = f"radio/{foreign.zone_of(*row['at'], 8.0)}/r2"
        x, y = map(int, row["key"].split("/")[1:3])
        row["hears"] = [[zx, zy] for zx in range(x - 1, x + 2) for zy in range(y - 1, y + 2)]
    wire = None
    for row in again["attachments"]:
        if wire is None or wire.sender != row["array"][0]:
            wire = foreign.Wire(Session(), "mine")
            wire.sender = row["array"][0]
        wire.send(row["key"], "Command", {})
        key, attached = sent[-1]
        row |= {"key": key, "attachment": attached.hex(), "array": msgpack.unpackb(attached)}
    return again


def rays(foreign: ModuleType, vector: Json) -> Json:
    """Return the vector of the rays, computed again but for what the world measures."""
    again = copy.deepcopy(vector)
    for row in again["fans"]:
        given = row["sensors"]
        side, half = radians(given["side_deg"]), radians(given["side_half_width_deg"])
        sides = {"left": (side, half), "front": (0.0, radians(given["front_half_width_deg"])), "right": (-side, half)}
        row["angles"] = {name: rounded(*foreign.fan(*one, given["rays"])) for name, one in sides.items()}
    angles = [angle for sector in again["fans"][0]["angles"].values() for angle in sector]
    for scan in again["scans"]:
        (x, y, yaw), radius = scan["pose"], again["radius"]
        ends = [foreign.end_of((x, y), yaw, radius, *ray) for ray in zip(angles, scan["rays"], strict=True)]
        scan["ends"] = [[round(one, 6) for one in end] for end in ends]
    return again


def brain(foreign: ModuleType, me: str, *held: int) -> Json:
    """Return the other make's robot on the floor of the vectors; it has listened."""
    floor_of = read(SQUARES)
    settings = floor_of["settings"] | {"own_targets": [], "targets": [[1.0, 1.0]], "return_home": False, "reach": 0.3}
    welcome = {"robot": me, "start": [0.6, 0.6, 0.0], "scenario": {"settings": settings}, "edits": 0}
    robot = foreign.Brain(welcome | {"packed": packed(floor_of)})
    robot.held = list(held)
    return robot


def records(foreign: ModuleType, vector: Json) -> Json:
    """Return the vector of records, computed again but for our words."""
    again = copy.deepcopy(vector)
    for case in again["cases"]:
        state, answer = case["state"], case["answer"]
        robot = brain(foreign, "r2", *state["held"])
        robot.tick, robot.claims, robot.route = 1000, copy.deepcopy(state["claims"]), [*state["way"]]
        robot.number = max((number for _, number, _ in robot.claims), default=8)
        before = robot.lattice.middle(state["held"][0])
        for one in case["heard"]:
            said = foreign.unpacked(bytes.fromhex(one["hex"]))
            one["traffic"] = said["traffic"]
            robot.hear([said])
        robot.claim(before)
        answer["newest"] = {name: one["stamp"] for name, one in sorted(robot.others.items())}
        answer["silent"] = sorted(robot.others.keys() - robot.fresh().keys())
        answer["takes"] = robot.held[len(state["held"]) :]
        answer["acks"] = sorted(robot.grant(before))
        if "may_claim" in answer:
            answer["may_claim"] = state["way"][-1] in [cell for cell, _, _ in robot.claims]
    again["ill_formed"] = [one for one in again["ill_formed"] if foreign.unpacked(bytes.fromhex(one["hex"])) is None]
    return again


def plan(foreign: ModuleType, vector: Json) -> Json:
    """Return the vector of the joint plan, computed again."""
    again = copy.deepcopy(vector)
    made = foreign.unpacked(bytes.fromhex(again["broadcast"]["hex"]))["traffic"]["own"]["plan"]

    def following(me: str, tick: int, said: Json, place: int) -> Json:
        robot = brain(foreign, me, made["ways"][me][place])
        robot.plan, robot.adopted, robot.tick = made, again["adopted"], tick
        robot.others = {one["robot"]: one for one in said if one["robot"] != me}
        return robot

    for moment in again["moments"]:
        for me, way in made["ways"].items():
            robot = following(me, moment["tick"], moment["records"], 0)
            moment["waits_for"][me] = {str(step): robot.turn_of(step) for step in range(1, len(way))}
    for end in again["ends"]:
        robot = following(end["me"], end["tick"], end["records"], -1)
        robot.goal = end["goal"]
        end["stays"] = robot.stays_in_plan()
        robot.plan = made | {"through": True}
        end["stays_if_through"] = robot.stays_in_plan()
    return again


def calls(foreign: ModuleType, vector: Json) -> Json:
    """Return the vector of calls, computed again."""
    again = copy.deepcopy(vector)
    for story in again["stories"]:
        robot = brain(foreign, "r3", 22)
        for event in story["events"]:
            robot.tick = event["tick"]
            robot.hear([foreign.unpacked(bytes.fromhex(event["heard"]["hex"]))] if event["heard"] else [])
            robot.join_in()
            epoch = robot.plan["epoch"] if robot.plan else None
            event["answer"] = {"frozen": robot.frozen, "epoch": epoch, "refusal": robot.refusal()}
    return again


AGAIN: Final[dict[str, Callable[[ModuleType, Json], Json]]] = {
    **dict.fromkeys(LATTICES, lattice),
    "radio": radio,
    "rays": rays,
    "records": records,
    "plan": plan,
    "calls": calls,
}


@pytest.mark.parametrize("name", AGAIN)
def test_a_robot_of_another_make_computes_the_same(name: str, foreign: ModuleType) -> None:
    vector = read(name)
    assert AGAIN[name](foreign, vector) == vector


def agrees(name: str, vector: Json, foreign: ModuleType) -> bool:
    """Return True if the other make computes what the vector says, and can read it."""
    try:
        return bool(AGAIN[name](foreign, vector) == vector)
    except TypeError:  # no broadcast
        return False


def test_every_vector_is_checked_and_says_what_it_is() -> None:
    files = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in FOLDER.glob("*.json")}
    assert set(files) == set(AGAIN)
    assert all(one["description"] for one in files.values())
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert [name for name in files if f"{name}.json" not in readme] == []


# --- a vector with a fault is found out ---

# fmt: off
FAULTS: Final[tuple[tuple[str, tuple[str | int, ...], Json], ...]] = (  # where in which vector, and what is put there
    *((name, ("lattice", "joins", 3), [0, 99]) for name in LATTICES),
    ("lattice-paper",    ("lattice", "middles", 7),                 [8.4, 0.001]),
    ("lattice-touching", ("lattice", "stands"),                     [0, 1, 2, 3, 4, 5, 6]),
    ("lattice-touching", ("lattice", "joins"),                      [[0, 1], [1, 2], [1, 5], [2, 3], [2, 6], [5, 6]]),
    ("lattice-edited",   ("points", 0, "cell"),                     0),
    ("lattice-edited",   ("discs", 0, "reaches_into"),              [0, 1]),
    ("radio",            ("phases", 1, "sends_at", 0),              100),
    ("radio",            ("zones", 3, "key"),                       "radio/0/0/r2"),
    ("radio",            ("attachments", 5, "attachment"),          "92cebb40e64d03"),
    ("rays",             ("fans", 0, "angles", "left", 0),          1.483529864),
    ("records",          ("cases", 1, "answer", "acks"),            [["r1", 5]]),
    ("records",          ("cases", 3, "answer", "takes"),           []),
    ("records",          ("cases", 3, "heard", 0, "hex"),           "80"),
    ("records",          ("cases", 3, "state", "claims", 0, 2),     992),
    ("plan",             ("moments", 0, "waits_for", "r1", "2"),    None),
    ("plan",             ("ends", 0, "stays"),                      False),
    ("plan",             ("ends", 0, "stays_if_through"),           True),
    ("calls",            ("stories", 0, "events", 1, "answer", "frozen"), None),
)
# fmt: on


@pytest.mark.parametrize(("name", "where", "wrong"), FAULTS, ids=[f"{row[0]}: {row[1]}" for row in FAULTS])
def test_a_planted_fault_is_found(name: str, where: tuple[str | int, ...], wrong: Json, foreign: ModuleType) -> None:
    vector = read(name)
    inner = vector
    for step in where[:-1]:
        inner = inner[step]
    assert inner[where[-1]] != wrong
    inner[where[-1]] = wrong
    assert not agrees(name, vector, foreign)


# --- edits: by exact fractions, which nobody's rounding can spoil ---


def span(low: str, high: str, side: str, count: int) -> list[int]:
    """Return the first and the last row or column that an edit touches, the last one excluded."""
    ends = sorted(Fraction(one) / Fraction(side) for one in (low, high))
    first = floor(ends[0])
    return [max(0, first), min(count, max(first + 1, ceil(ends[1])))]


def test_an_edit_touches_the_cells_that_exact_arithmetic_says() -> None:
    vector = json.loads((FOLDER / "lattice-edited.json").read_text(encoding="utf-8"), parse_float=str)
    on, side = vector["map"], vector["map"]["resolution"]
    for edit in vector["edits"]:
        columns, rows = (
            span(str(edit["low"][axis]), str(edit["high"][axis]), side, on[count])
            for axis, count in enumerate(("columns", "rows"))
        )
        assert (edit["rows"], edit["columns"]) == (rows, columns), edit
