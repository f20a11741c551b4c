"""The laws of the shared floor: who touches what, and who holds which cell."""

from collections.abc import Collection, Mapping
from itertools import combinations
from math import hypot
from typing import Final

from swarm.storm.history.heard_records import Told
from swarm.storm.history.history import History, Moment
from swarm.storm.history.run_facts import Found, cells_at, claims_of, find_pushes, iterate_new_cells, was_pushed
from swarm.traffic.lattice.cell_map import OUTSIDE
from world.faults import SILENT, Health

NEAR: Final = 2.5  # cells; a robot this near to a cell must acknowledge a claim for it, if the claimant heard it lately
LATELY: Final = 20  # ticks for which a broadcast counts as heard lately
GLANCE: Final = 0.2  # m, less of a body's radius: a look into a cell may miss a body that only reaches into it
BACK: Final = 200  # ticks after a silence in which a robot and those that could not ask it settle who holds which cell


def no_contact(history: History) -> Found:
    """Check that no robot touched anything that it could have avoided by stopping."""
    for tick, contact, avoidable in history.contacts:
        name = history.robots[contact.robot]
        if avoidable and name not in history.mute:
            other = f" {history.robots[contact.other]}" if contact.other is not None else ""
            yield tick, (name,), f"{name} touched {contact.kind}{other}"


def no_overlap(history: History) -> Found:
    """Check that no two robots hold one cell.

    A silent robot keeps its cells until a look has shown them empty, also if other robots cannot ask it. An overlap
    is excused if the silent robot's body is not in the cell, if the other robot never heard that the silent one keeps
    the cell, or if something pushed one of the two.
    """
    pushed = find_pushes(history)
    excused: set[tuple[str, str]] = set()
    blamed: set[tuple[str, str]] = set()
    held: dict[str, frozenset[int]] = {}
    silent: dict[str, int] = {}  # when each was silent last
    told = Told(history)
    for moment in history.moments:
        for name, health in moment.health.items():
            if health is not Health.WELL and health in SILENT:
                silent[name] = moment.tick
        held |= {name: frozenset(command.held) - {OUTSIDE} for name, command in moment.commands.items()}
        if len(frozenset().union(*held.values())) == sum(map(len, held.values())):
            excused.clear()
            blamed.clear()
            continue
        now = {(a, b): held[a] & held[b] for a, b in combinations(sorted(held), 2) if held[a] & held[b]}
        for (a, b), shared in now.items():
            if (a, b) in excused | blamed:
                continue
            told.hear_until(moment.tick)
            asleep = [name for name in (a, b) if moment.tick - silent.get(name, -BACK - 1) <= BACK]
            if any(was_pushed(pushed, history.robots.index(name), moment.tick) for name in (a, b)) or any(
                not told.cells(b if name == a else a, name) & shared or not _stands_in(history, moment, name, shared)
                for name in asleep
            ):
                excused.add((a, b))
                continue
            blamed.add((a, b))
            yield moment.tick, (a, b), f"{a} and {b} hold cell {', '.join(map(str, sorted(shared)))}"
        excused &= now.keys()
        blamed &= now.keys()


def _stands_in(history: History, moment: Moment, name: str, shared: Collection[int]) -> bool:
    number = history.robots.index(name)
    x, y, _ = moment.poses[number]
    surely = max(0.0, history.body(number).radius - GLANCE)
    return any(cell in shared for cell in cells_at(history, moment.tick).cells_under_disc(x, y, surely))


def no_hold_without_claim(history: History) -> Found:
    """Check that a robot takes only cells that it claimed by radio and that all robots nearby have acknowledged.

    This holds after every event: an edit, a new map, a stop, a new goal. A robot is excepted if it just began or was
    away, drives unconstrained because nobody is in range, or was pushed.
    """
    claims: dict[str, dict[int, int]] = {}  # from the newest record: cell -> claim number
    acks: dict[str, set[tuple[str, int]]] = {}
    heard: dict[str, dict[str, int]] = {}
    for moment, grown in iterate_new_cells(history):
        for name, sense in moment.senses.items():
            if sense.hears:
                heard.setdefault(name, {}).update({sender: moment.tick for sender, _ in sense.hears})
        for name, new in grown.items():
            unclaimed = sorted(new.difference(claims.get(name, {})))
            if unclaimed:
                yield moment.tick, (name,), f"{name} took cell {unclaimed[0]}, which it has not claimed"
                continue
            for cell in sorted(new):
                for other in _must_agree(history, moment, name, cell, heard.get(name, {})):
                    if (name, claims[name][cell]) not in acks.get(other, ()):
                        yield moment.tick, (name, other), f"{name} took cell {cell}, not acknowledged by {other}"
        for name, broadcast in moment.spoken.items():
            if broadcast.traffic is not None:
                own = broadcast.traffic.own
                claims[name] = {cell: claim.number for cell, claim in claims_of(own).items()}
                acks.setdefault(name, set()).update(own.acks)


def _must_agree(history: History, moment: Moment, me: str, cell: int, heard: Mapping[str, int]) -> list[str]:
    """Return the robots that must acknowledge a claim: they are near the cell, and ``me`` heard them itself lately."""
    cells = cells_at(history, moment.tick)
    x, y = cells.centre(cell)
    late = LATELY - history.late
    return [
        name
        for name, pose in zip(history.robots, moment.poses, strict=True)
        if name != me
        and name not in history.mute
        and moment.tick - heard.get(name, -(10**9)) <= late
        and hypot(pose.x - x, pose.y - y) <= NEAR * cells.side
    ]
