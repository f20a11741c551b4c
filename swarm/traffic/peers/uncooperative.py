"""Robots that are heard but say nothing of traffic: the cells that each covers, and moving aside for one.

Such a *mute* robot follows no rule of ours. It is never asked for anything and never waited for beyond the cells under
its body and its brake. They are computed from its last two broadcasts, and are not relayed: a robot claims cells up to
(range - 1 m)/2 away, so a mute robot that covers one of them is in range itself, unless walls stop the radio.

A mute robot does not say where it wants to be. It may want to be where this robot stands. So a robot that has stood
beside one for long drives away for a while, and then comes back.
"""

from collections.abc import Collection, Iterable, Mapping
from math import cos, hypot, sin
from typing import Final, NamedTuple

from msgspec.structs import replace

from swarm.geometry import Pose, Twist, distance, integrate, wrap
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.settings import TrafficConstants

STANDS: Final = 0.05  # m/s; a robot that was slower between its last two broadcasts stands
STEP: Final = 0.1  # m, between two points of a path
LONGEST: Final = 1.0  # s for which it is assumed to drive on unheard
STAYS: Final = 40  # ticks, 2 s at 20 Hz, after which a covered cell counts as occupied for good: ways lead round it
SAYS: Final = 200  # ticks, 10 s at 20 Hz, for which a robot has waited for mute robots only, after which it says so

# moving aside; these numbers are choices, not measurements; the seconds hold at 20 Hz only
NEAR: Final = 1.5  # cell sides; a mute robot so near may want this place: diagonal neighbours are 1.41 apart
CLEAR: Final = 2.0  # cell sides from a mute robot to a place aside: a cell between them stays free for it
FARTHEST: Final = 6  # cells, the longest way to a place aside: there and back stays short beside ``LASTS``
PLACES: Final = 4  # nearest places, tried in turn: the first may be where the mute robot wants to be next
LASTS: Final = 300  # ticks (15 s) aside, with the way there: a mute robot has time to notice and to drive on
MOVED: Final = 0.3  # m; a robot that has moved farther does not stand; less is a turn on the spot or a nudge


class MuteBroadcast(NamedTuple):
    """A broadcast that says nothing of traffic."""

    robot: str
    tick: int
    pose: Pose
    rests: bool = False  # it says that it wants to go nowhere


class Mutes:
    """The mute robots that one robot hears."""

    def __init__(self, settings: TrafficConstants) -> None:
        self._settings = settings
        self._last: dict[
            str, tuple[MuteBroadcast, MuteBroadcast]
        ] = {}  # by robot: the last broadcast but one, and the last
        self._since: dict[int, int] = {}  # covered cells, and since when without a break [tick]
        self._waits_since: int | None = None  # tick since which the robot has waited for mute robots only
        self.names: frozenset[str] = frozenset()  # of those heard lately

    def __bool__(self) -> bool:
        """Return True if any robot is or was mute when it was heard last."""
        return bool(self._last)

    def note_broadcasts(self, tick: int, spoken: Iterable[MuteBroadcast], spoke: Mapping[str, int]) -> None:
        """Take in broadcasts; ``spoke`` is the tick of the last record that each robot itself has sent."""
        for one in spoken:
            known = self._last.get(one.robot)
            before = one if known is None else known[1]
            if one.tick > before.tick or known is None:
                self._last[one.robot] = before, one
        if not self._last:
            return
        self._last = {robot: two for robot, two in self._last.items() if two[1].tick > spoke.get(robot, -1)}
        fresh = self._settings.fresh
        self.names = frozenset(
            [
                robot
                for robot, two in self._last.items()
                if tick - two[1].tick <= fresh < tick - spoke.get(robot, -fresh - 1)
            ]
        )

    def records(self, tick: int, known: Mapping[str, Record], cells: CellMap) -> dict[str, Record]:
        """Return the record that stands for each mute robot at a tick.

        What a robot said of its cells before it fell mute counts with those that it covers, as long as that is fresh.
        """
        found: dict[str, Record] = {}
        for robot, (before, last) in sorted(self._last.items()):
            age, said = tick - last.tick, known.get(robot)
            covers = tuple(sorted(cells_under_mute(before, last, age, cells, self._settings)))
            if said is not None and tick - said.stamp <= self._settings.fresh:
                held = (*[cell for cell in covers if cell not in said.held], *said.held)
                found[robot] = replace(said, held=held)
            else:
                x, y, _ = last.pose
                found[robot] = Record(robot=robot, stamp=last.tick, x=x, y=y, goal=OUTSIDE, held=covers)
        now = {cell for robot in self.names for cell in found[robot].held}
        self._since = {cell: self._since.get(cell, tick) for cell in now}
        return found

    @property
    def moving_robots(self) -> frozenset[str]:
        """Return the mute robots that moved between their last two broadcasts."""
        return frozenset(
            [robot for robot in self.names if abs(_estimate_twist(*self._last[robot], self._settings).linear) >= STANDS]
        )

    def waiting_poses(self, pose: Pose, reach: float) -> list[Pose]:
        """Return the poses of the mute robots within ``reach`` [m] that stand and want to go on."""
        still = [self._last[robot][1] for robot in sorted(self.names - self.moving_robots)]
        return [one.pose for one in still if not one.rests and distance(one.pose, pose) <= reach]

    def check_wait(self, tick: int, waits: Collection[str]) -> str | None:
        """Return a sentence once a robot has long waited for mute robots only; call it once a tick."""
        if not waits or not self.names.issuperset(waits):
            self._waits_since = None
            return None
        if self._waits_since is None:
            self._waits_since = tick
        if tick - self._waits_since != SAYS:
            return None
        return f"waits for {' and '.join(waits)}, which {'says' if len(waits) == 1 else 'say'} nothing of traffic"

    def long_covered_cells(self, tick: int) -> frozenset[int]:
        """Return the cells that mute robots have covered for long."""
        return frozenset([cell for cell, since in self._since.items() if tick - since >= STAYS])


def cells_under_mute(
    before: MuteBroadcast, last: MuteBroadcast, age: int, cells: CellMap, settings: TrafficConstants
) -> frozenset[int]:
    """Return the cells under a mute robot's body and its brake, ``age`` ticks after it spoke ``last``.

    While it stands, these are the cells under its body; one that wants to go on may stray a little. While it moves, it
    may drive on as it did or straight, or gain speed, until it is heard again; then it brakes.
    """
    room = settings.widest + settings.margin
    twist = _estimate_twist(before, last, settings)
    if abs(twist.linear) < STANDS:
        return cells.swept_cells(((last.pose.x, last.pose.y),), settings.widest if last.rests else room)
    most, time = settings.acceleration, min(age * settings.tick, LONGEST)
    speed = abs(twist.linear) + most * (last.tick - before.tick) * settings.tick / 2
    way, top = settings.reach_after(speed, time)
    length = way + top**2 / (2 * settings.braking)
    ahead = 1.0 if twist.linear > 0 else -1.0
    points: list[Point] = []
    for turning in {0.0, twist.angular / abs(twist.linear)}:
        pose, step = last.pose, Twist(ahead * STEP, turning * STEP)
        for _ in range(int(length / STEP) + 2):
            points.append((pose.x, pose.y))
            pose = integrate(pose, step, 1.0)
    return cells.swept_cells(points, room + STEP / 2)


def _estimate_twist(before: MuteBroadcast, last: MuteBroadcast, settings: TrafficConstants) -> Twist:
    """Return how a robot moved between two broadcasts; unknown at the first one, and at rest."""
    ticks = last.tick - before.tick
    if ticks <= 0:
        return Twist(0.0, 0.0)
    time = ticks * settings.tick
    dx, dy = last.pose.x - before.pose.x, last.pose.y - before.pose.y
    turned = wrap(last.pose.yaw - before.pose.yaw)
    arc = turned / 2 / sin(turned / 2) if abs(turned) > 1e-6 else 1.0
    along = dx * cos(last.pose.yaw - turned / 2) + dy * sin(last.pose.yaw - turned / 2)
    linear = min(settings.speed, arc * hypot(dx, dy) / time)
    return Twist(linear if along >= 0 else -linear, turned / time)


class StepAsideRecovery:
    """Decides when one robot moves aside, and where to."""

    def __init__(self) -> None:
        self._at: Pose | None = None  # where it stands
        self._since = 0  # tick since which it stands there, or moves aside
        self._to: Point | None = None  # m, the place aside; None: it does not move aside
        self._times = 0  # how often it has moved aside

    def decide(
        self, tick: int, pose: Pose, mutes: Mutes, head: int, taken: Collection[int], cells: CellMap, *, stands: bool
    ) -> Point | None:
        """Return the place aside [m] to drive to, or None: it does not move aside. Call it once a tick.

        The way to that place does not lead through cells that are ``taken``. ``head`` is the cell to start from. A
        robot that was told to stop ``stands``.
        """
        if self._to is not None and tick < self._since + LASTS and not stands:
            return self._to
        near = mutes.waiting_poses(pose, NEAR * cells.side)
        moved = self._at is None or distance(self._at, pose) > MOVED
        if not near or moved or self._to is not None or stands:
            self._at, self._since, self._to = pose, tick, None
        elif tick - self._since >= SAYS:
            self._since, self._to = tick, self._place(near, head, taken, cells)  # it drives there from the next tick on
        return None

    def _place(self, near: Collection[Pose], head: int, taken: Collection[int], cells: CellMap) -> Point | None:
        """Return the centre [m] of a cell clear of the mute robots ``near``: each time another one, if there is any."""
        steps = cells.distances(head, frozenset(taken) - {head})
        reached = [cell for cell, far in enumerate(steps) if far <= FARTHEST and cells.stands[cell]]
        places = {cell: cells.centre(cell) for cell in reached}
        clear = sorted(
            [cell for cell, at in places.items() if all(distance(at, one) >= CLEAR * cells.side for one in near)],
            key=lambda cell: (steps[cell], cell),
        )[:PLACES]
        self._times += bool(clear)
        return places[clear[self._times % len(clear)]] if clear else None
