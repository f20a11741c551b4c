"""The laws of the shared floor: who touches what, and who holds which cell."""

from collections.abc import Collection, Mapping
from itertools import combinations
from math import hypot
from typing import Final

from swarm.geometry import distance
from swarm.messages import Broadcast
from swarm.traffic.cells import OUTSIDE
from world.faults import SILENT
from world.storm.history import History, Moment
from world.storm.seen import EXACT, Found, cells_at, pushes, was_pushed

NEAR: Final = 2.5  # cells; who is so near to a cell has to acknowledge a claim for it, if it was heard of late
LATELY: Final = 20  # ticks
GLANCE: Final = 0.2  # m, a radius; a body whose middle is beside a cell need not show to who looks into it
BACK: Final = 200  # ticks after a silence in which a robot and those who could not ask it sort their cells out
AWAY: Final = 20  # ticks without a step, after which a robot begins its holds again


def no_contact(history: History) -> Found:
    """Check that nobody touched anything that it could have kept clear of by stopping.

    A robot that stood is not to blame; nor is one that a moving obstacle overtook.
    """
    for tick, contact, struck in history.contacts:
        if struck:
            continue
        name = history.robots[contact.robot]
        if contact.kind == "obstacle" and _mover_came(history, tick, contact.robot):
            continue
        other = f" {history.robots[contact.other]}" if contact.other is not None else ""
        yield tick, (name,), f"{name} touched {contact.kind}{other}"


def _mover_came(history: History, tick: int, number: int) -> bool:
    """Return True if a moving obstacle closed the gap faster than the robot did."""
    now, before = history.moments[min(tick, len(history.moments) - 1)], history.moments[max(0, tick - 2)]
    pose, was = now.poses[number], before.poses[number]
    for mover, mover_was in zip(now.movers, before.movers, strict=True):
        apart = distance(pose, mover)
        if apart > 3 * history.settings.robot.radius:
            continue
        ux, uy = (mover.x - pose.x) / apart, (mover.y - pose.y) / apart
        mine = (pose.x - was.x) * ux + (pose.y - was.y) * uy
        its = -((mover.x - mover_was.x) * ux + (mover.y - mover_was.y) * uy)
        return its >= mine - EXACT
    return False


def no_overlap(history: History) -> Found:
    """Check that no two robots hold one cell.

    A silent robot keeps its cells, also against those who cannot ask it, until a look has shown them empty. So it is
    excused that somebody takes a silent robot's cell in which no body is, or of which nobody ever told it; and what a
    moving obstacle pushes a body into.
    """
    pushed = pushes(history)
    excused: set[tuple[str, str]] = set()
    blamed: set[tuple[str, str]] = set()
    held: dict[str, frozenset[int]] = {}
    silent: dict[str, int] = {}  # when each was silent last
    told = _Told(history)
    for moment in history.moments:
        silent |= {name: moment.tick for name, health in moment.health.items() if health in SILENT}
        told.hear(moment)
        held |= {name: frozenset(command.held) - {OUTSIDE} for name, command in moment.commands.items()}
        now = {(a, b): held[a] & held[b] for a, b in combinations(sorted(held), 2) if held[a] & held[b]}
        for (a, b), shared in now.items():
            if (a, b) in excused | blamed:
                continue
            asleep = [name for name in (a, b) if moment.tick - silent.get(name, -BACK - 1) <= BACK]
            if any(was_pushed(pushed, history.robots.index(name), moment.tick) for name in (a, b)) or any(
                not told.of(b if name == a else a, name) & shared or not _stands_in(history, moment, name, shared)
                for name in asleep
            ):
                excused.add((a, b))
                continue
            blamed.add((a, b))
            yield moment.tick, (a, b), f"{a} and {b} hold cell {', '.join(map(str, sorted(shared)))}"
        excused &= now.keys()
        blamed &= now.keys()


class _Told:
    """What each robot has been told of the cells of each other one, over the radio and by who passed it on."""

    def __init__(self, history: History) -> None:
        self._cells: dict[tuple[str, str], tuple[int, frozenset[int]]] = {}
        self._air: dict[str, Broadcast] = {}

    def hear(self, moment: Moment) -> None:
        """Take in what arrives at a tick."""
        for name, sense in moment.senses.items():
            for sender, _ in sense.hears:
                traffic = self._air[sender].traffic if sender in self._air else None
                for record in (traffic.own, *(relayed.record for relayed in traffic.others)) if traffic else ():
                    if record.stamp > self._cells.get((name, record.robot), (-1, frozenset()))[0]:
                        cells = frozenset((*record.held, *(claim.cell for claim in record.claims)))
                        self._cells[name, record.robot] = record.stamp, cells
        self._air |= moment.spoken

    def of(self, listener: str, robot: str) -> frozenset[int]:
        """Return the cells that a robot holds or claims, as far as ``listener`` was told."""
        return self._cells.get((listener, robot), (-1, frozenset()))[1]


def _stands_in(history: History, moment: Moment, name: str, shared: Collection[int]) -> bool:
    pose = moment.poses[history.robots.index(name)]
    cells = cells_at(history, moment.tick)
    return any(cell in shared for cell in cells.touched(pose.x, pose.y, history.settings.robot.radius - GLANCE))


def no_hold_without_claim(history: History) -> Found:
    """Check that a robot's hold grows only by cells it has claimed aloud, and that all who are near have agreed.

    Whatever the event: an edit, a new map, a stop, a new goal. Excepted is a robot that just began or was away, one
    that drives unconstrained because nobody is in range, and one that was pushed.
    """
    pushed = pushes(history)
    before: dict[str, tuple[int, frozenset[int], bool]] = {}  # tick, held, unconstrained
    claims: dict[str, dict[int, int]] = {}  # of the newest record: cell -> number
    acks: dict[str, set[tuple[str, int]]] = {}
    heard: dict[str, dict[str, int]] = {}
    for moment in history.moments:
        for name, sense in moment.senses.items():
            heard.setdefault(name, {}).update({sender: moment.tick for sender, _ in sense.hears})
        for name, command in moment.commands.items():
            held = frozenset(command.held) - {OUTSIDE}
            was = before.get(name)
            before[name] = moment.tick, held, command.unconstrained
            number = history.robots.index(name)
            if was is None or moment.tick - was[0] > AWAY or _is_back(history, moment, name):
                continue
            new = held - was[1]
            if not new or command.unconstrained or was[2] or was_pushed(pushed, number, moment.tick):
                continue
            unclaimed = sorted(new - claims.get(name, {}).keys())
            if unclaimed:
                yield moment.tick, (name,), f"{name} holds cell {unclaimed[0]} that it has not claimed"
                continue
            for cell in sorted(new):
                for other in _must_agree(history, moment, name, cell, heard.get(name, {})):
                    if (name, claims[name][cell]) not in acks.get(other, ()):
                        yield moment.tick, (name, other), f"{name} took cell {cell}, {other} has not agreed"
        for name, broadcast in moment.spoken.items():
            if broadcast.traffic is not None:
                own = broadcast.traffic.own
                claims[name] = {claim.cell: claim.number for claim in own.claims}
                acks.setdefault(name, set()).update(own.acks)


def _is_back(history: History, moment: Moment, name: str) -> bool:
    """Return True in the first tick of a robot's new process."""
    index = moment.tick - history.moments[0].tick
    return index > 0 and history.moments[index - 1].health.get(name) in SILENT


def _must_agree(history: History, moment: Moment, me: str, cell: int, heard: Mapping[str, int]) -> list[str]:
    """List who is so near to a cell, and was heard by ``me`` itself so lately, that it has to agree."""
    cells = cells_at(history, moment.tick)
    x, y = cells.centre(cell)
    late = LATELY - history.late
    return [
        name
        for name, pose in zip(history.robots, moment.poses, strict=True)
        if name != me
        and moment.tick - heard.get(name, -(10**9)) <= late
        and hypot(pose.x - x, pose.y - y) <= NEAR * cells.side
    ]


def no_body_outside(history: History) -> Found:
    """Check that each body is inside the cells that its robot holds."""
    pushed = pushes(history)
    radius = history.settings.robot.radius
    held: dict[str, frozenset[int]] = {}
    outside: set[str] = set()
    for moment in history.moments[:-1]:
        held |= {name: frozenset(command.held) for name, command in moment.commands.items()}
        cells = cells_at(history, moment.tick)
        for number, (name, pose) in enumerate(zip(history.robots, moment.poses, strict=True)):
            if name not in held:
                continue
            out = [cell for cell in cells.touched(pose.x, pose.y, radius - EXACT) if cell not in held[name]]
            if out and name not in outside and not was_pushed(pushed, number, moment.tick):
                yield moment.tick, (name,), f"{name} is in cell {out[0]} that it does not hold"
            outside = outside | {name} if out else outside - {name}
