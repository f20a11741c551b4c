"""A square that a robot drives before it joins a fleet, and what its user must measure. Pure: it knows no clock.

The robot drives four sides and turns left four times. Each of these eight moves begins and ends at rest, so what was
commanded in a move and what came of it can be compared however late the robot obeys and however slowly it gains speed.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import pi
from statistics import fmean, median, pstdev
from typing import Final, NamedTuple

import yaml

from swarm.bridge.body.body import STANDS
from swarm.bridge.body.readings import Odometry
from swarm.errors import PeerError
from swarm.geometry import Pose, Twist, distance, wrap
from swarm.settings import PAPER_TOP_SPEED

REST: Final = 1.0  # s that a robot stands before each move and after it
STILL: Final = 0.01  # m/s and rad/s; slower is standing
MOVES: Final = 8
BEGUN, DONE = 0.1, 0.9  # shares of the commanded speed between which acceleration is measured
PATIENCE: Final = 3.0  # times as long as a move should take, after which it is given up


class OdometrySample(NamedTuple):
    """An odometry and when it came."""

    at: float  # s, of this process's clock
    odometry: Odometry
    pose: Pose  # the best that is known: localised, if there is a localisation


class SquareMove(NamedTuple):
    """One of the eight moves."""

    twist: Twist  # that was commanded
    began: float  # s, when it was commanded first
    told: float  # s, for how long
    before: Pose
    after: Pose
    samples: Sequence[OdometrySample]

    @property
    def is_turn(self) -> bool:
        """True if it was a turn."""
        return self.twist.linear == 0.0


class SquareResult(NamedTuple):
    """What a square shows."""

    rate: float  # Hz, of odometry
    jitter: float  # s, standard deviation of the time between two
    longest: float  # s, between two
    latency: tuple[float, float, float]  # s, from the first command to odometry that shows motion: least, median, most
    acceleration: float | None  # m/s2, of a rim; None: it was gained within one period of odometry
    braking: float | None  # m/s2
    top_speed: float  # m/s
    driven: float  # m per commanded m
    turned: float  # rad per commanded rad
    closed: tuple[float, float]  # m and rad between begin and end


class SquareKind(NamedTuple):
    """The kind of a scenario that a robot is to be, by what a square shows."""

    name: str
    radius: float | None = None  # m, of the circle around all of it; None: nobody has said


class Square:
    """The moves of one square. ``step`` is told each odometry and returns the twist to command."""

    def __init__(self, side: float, linear: float, angular: float) -> None:
        self._side, self._linear, self._angular = side, linear, angular
        self.moves: list[SquareMove] = []
        self.samples: list[OdometrySample] = []
        self._rests_since: float | None = None  # s
        self._began: OdometrySample | None = None  # of the move under way
        self._ended: float | None = None  # s, when its command ended
        self._turned = 0.0  # rad, in this move
        self._first = 0  # sample of this move

    @property
    def is_done(self) -> bool:
        """True if the square is driven."""
        return len(self.moves) == MOVES

    def add_sample(self, sample: OdometrySample) -> Twist:
        """Return the twist to command after a sample.

        Raises:
            PeerError: the robot does not do what it is told.
        """
        last = self.samples[-1] if self.samples else sample
        self.samples.append(sample)
        moves = abs(sample.odometry.twist.linear) > STILL or abs(sample.odometry.twist.angular) > STILL
        if moves or self._rests_since is None:
            self._rests_since = sample.at
        rested = sample.at - self._rests_since >= REST
        if self.is_done:
            return STANDS
        twist = Twist(self._linear, 0.0) if len(self.moves) % 2 == 0 else Twist(0.0, self._angular)
        if self._began is None:
            if rested:
                self._began, self._ended, self._turned, self._first = sample, None, 0.0, len(self.samples) - 1
                return twist
            return STANDS
        self._turned += wrap(sample.odometry.pose.yaw - last.odometry.pose.yaw)
        should = self._side / self._linear if twist.linear else pi / 2 / self._angular
        if self._ended is None:
            driven = distance(self._began.odometry.pose, sample.odometry.pose)
            if (driven >= self._side) if twist.linear else (self._turned >= pi / 2):
                self._ended, self._rests_since = sample.at, sample.at
                return STANDS
            if sample.at - self._began.at > PATIENCE * should + 2 * REST:
                raise PeerError(
                    f"expected {'a side' if twist.linear else 'a turn'} in {should:.1f} s, got {driven:.2f} m and "
                    f"{self._turned:.2f} rad in {sample.at - self._began.at:.1f} s; does the robot obey this topic?"
                )
            return twist
        if rested and sample.at - self._ended >= REST:
            self.moves.append(
                SquareMove(twist, self._began.at, self._ended - self._began.at, self._began.pose, sample.pose,
                     self.samples[self._first :])
            )  # fmt: skip
            self._began = None
        return STANDS


def measure_square(square: Square, track_width: float) -> SquareResult:
    """Return what a square that was driven shows; ``track_width`` [m] is that of the robot's own driver."""
    gaps = [after.at - before.at for before, after in pairwise(square.samples)]
    stamps = [sample.odometry.stamp for sample in square.samples]
    stamped = [after - before for before, after in pairwise(stamps)]
    times = stamped if all(time > 0.0 for time in stamped) else gaps
    starts = [late for move in square.moves if (late := measure_latency(move)) is not None]
    straight, turns = ([move for move in square.moves if move.is_turn == wanted] for wanted in (False, True))
    gained = [
        gain for move in square.moves if (gain := measure_acceleration(move, track_width, braking=False)) is not None
    ]
    lost = [
        gain for move in square.moves if (gain := measure_acceleration(move, track_width, braking=True)) is not None
    ]
    first, last = square.moves[0].before, square.moves[-1].after
    return SquareResult(
        rate=1 / fmean(times),
        jitter=pstdev(times),
        longest=max(gaps),
        latency=(min(starts), median(starts), max(starts)),
        acceleration=min(gained, default=None),
        braking=min(lost, default=None),
        top_speed=max(abs(sample.odometry.twist.linear) for sample in square.samples),
        driven=sum(distance(move.before, move.after) for move in straight)
        / sum(move.twist.linear * move.told for move in straight),
        turned=sum(turned_angle(move) for move in turns) / sum(move.twist.angular * move.told for move in turns),
        closed=(distance(first, last), abs(wrap(first.yaw - last.yaw))),
    )


def turned_angle(move: SquareMove) -> float:
    """Return by how much a robot has turned [rad], a quarter or so."""
    return wrap(move.after.yaw - move.before.yaw - pi / 2) + pi / 2


def speed_shares(move: SquareMove) -> list[tuple[float, float]]:
    """Return times [s] and the speed that was commanded, as a share of it."""
    wanted = move.twist.angular if move.is_turn else move.twist.linear
    return [
        (at, (odometry.twist.angular if move.is_turn else odometry.twist.linear) / wanted)
        for at, odometry, _ in move.samples
    ]


def measure_latency(move: SquareMove) -> float | None:
    """Return the time [s] from the first command to the first odometry that shows motion; None: it shows none."""
    return next((at - move.began for at, share in speed_shares(move) if share > BEGUN), None)


def measure_acceleration(move: SquareMove, track_width: float, *, braking: bool) -> float | None:
    """Return the acceleration of the rims [m/s2] in a move; None if it was too quick for this odometry."""
    shares = speed_shares(move)
    if braking:
        shares = [(-at, share) for at, share in reversed(shares)]
    begun = next(((at, share) for at, share in shares if share > BEGUN), None)
    done = next(((at, share) for at, share in shares if share > DONE), None)
    if begun is None or done is None or done[0] <= begun[0]:
        return None
    rim = move.twist.angular * track_width / 2 if move.is_turn else move.twist.linear
    return rim * (done[1] - begun[1]) / (done[0] - begun[0])


def format_square_result(found: SquareResult, track_width: float, speed: float, by: str) -> Iterator[str]:
    """Yield the lines that tell what was measured; ``by`` is what told the robot's turns."""
    least, usual, most = found.latency
    effective = track_width / found.turned
    pauses = f"jitter {found.jitter * 1e3:.1f} ms, longest gap {found.longest:.3f} s"
    yield f"odometry            {found.rate:.1f} Hz, {pauses}"
    yield f"latency             {usual:.3f} s from a command to odometry that shows it ({least:.3f} to {most:.3f} s)"
    gained, lost = map(_format_acceleration, (found.acceleration, found.braking))
    yield f"acceleration        {gained}, braking {lost}, of a wheel's rim"
    yield f"top speed           {found.top_speed:.2f} m/s; {speed:.2f} m/s were commanded"
    yield f"distance            {found.driven:.3f} of what was commanded, by {by}"
    yield f"turning             {found.turned:.3f} of what was commanded, by {by}"
    yield f"track width         {effective:.3f} m in effect; {track_width:.3f} m in the robot's driver"
    yield f"the square ends     {found.closed[0]:.2f} m and {found.closed[1]:.2f} rad from its begin, by {by}"


def format_robot_section(found: SquareResult, track_width: float) -> Iterator[str]:
    """Yield the lines that tell what to set for a fleet all of whose robots are like the one that was measured."""
    yield f"give the bridge --track-width {track_width:g}, and the scenario these lines:"
    yield "robot:"
    for line in _format_body(found, track_width):
        yield f"  {line}"


def format_kind_entry(kind: SquareKind, found: SquareResult, track_width: float) -> Iterator[str]:
    """Yield the lines of an entry of a scenario's ``kinds``: the robot that was measured is a kind of its own."""
    yield "kinds:"
    yield f"  {_quote_name(kind.name)}:"
    around = "of the circle around all of it, from the point between its wheels"
    if kind.radius is None:
        yield f"    # radius: ?  # m, {around}; without this line robot.radius of the scenario counts"
    else:
        yield f"    radius: {kind.radius:g}  # m, {around}"
    for line in _format_body(found, track_width):
        yield f"    {line}"
    if found.acceleration is found.braking is None:
        yield "    # wheel_acceleration: too quick to measure; without this line that of the scenario's robot counts"


def format_kind_use(kind: SquareKind, robot: str, track_width: float, place: str) -> Iterator[str]:
    """Yield the lines that tell what to do with an entry of ``kinds`` that is at a place, such as a file."""
    name = _quote_name(kind.name)
    yield f"put {place} into the scenario, below its `kinds` if it has some, and {kind.name} into its `robots`, as in"
    yield f"robots: {{{name}: 1, other: 3}}: robots have their numbers in that order, and {robot} is to be a {name};"
    yield f"start the world with --body {robot}, and give the bridge --track-width {track_width:g}"


def _quote_name(name: str) -> str:
    """Return a name as YAML has it: one that is a number or a truth value there has quotes."""
    is_plain = re.fullmatch(r"[A-Za-z_][A-Za-z0-9_-]*", name) and yaml.safe_load(name) == name
    return name if is_plain else f'"{name}"'


def _format_body(found: SquareResult, track_width: float) -> Iterator[str]:
    """Yield the fields of a body that a square shows."""
    yield f"track_width: {track_width / found.turned:.3f}"
    if rates := [rate for rate in (found.acceleration, found.braking) if rate is not None]:
        yield f"wheel_acceleration: {max(0.01, min(rates)):.2f}"
    scale = min(1.0, found.top_speed / PAPER_TOP_SPEED)
    yield f"speed_scale: {scale:.3f}  # wheels of at most {found.top_speed:.2f} m/s"


def _format_acceleration(rate: float | None) -> str:
    return "too quick to measure" if rate is None else f"{rate:.2f} m/s2"
