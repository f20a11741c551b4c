"""The constants of driving, which are tuned together: a class for each concern, and its values.

A comment states the unit, what the value does, and its reason if one is recorded. Where it states no reason, the value
was chosen by trial, and no measurement of it is recorded.

The makers of the kernels in ``rollout`` and ``evasion`` get their values as arguments: then numba compiles the values
in and has them in the key of its cache. It would not notice that a global of another file has changed.
"""

from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray


class SafetyTuning(NamedTuple):
    """The safety filter: see docs/fuzzy.md."""

    gap: float = 0.03  # m, between the footprint and what it must not touch; equal to TrafficConstants.margin
    # s for which a command is simulated, before braking; longer than COMMAND.timeout (0.25 s), for which the wheels
    # obey the last command of a process that falls asleep
    look: float = 0.4
    front_gap: float = 0.1  # m, to everything that the front sector sees
    gentle: float = 0.6  # share of the braking power that is used to stop at a place and to end a turn
    nearing: float = 0.8  # 1/s, forward speed per distance to that place: the robot circles it in ever smaller arcs
    stands: float = 0.02  # m/s; a slower robot counts as standing
    creep: float = 0.05  # m/s; a slower speed does not count as driving
    straight: float = 0.3  # m/s; the way ahead is clear if the robot can drive straight on at this speed
    directions: int = 12  # tried to each side, to find the freer one
    turn_until: float = 0.07  # rad; a turn to face a point stops at an error of about half of this
    turn_rate: float = 2.5  # rad/s at most, in place
    # rad; at a larger error both directions of turn are equally good and the robot keeps the one it has: late commands
    # made it tremble near the half turn (decision 10)
    half_turn: float = 2.6
    # share of the forward speed, share of the yaw rate: the same arc slower, then the same turn with less forward speed
    # (decision 13: a quarter of the arc after the tightened turns made eight robots at the doorway 3 s slower)
    remedies: NDArray[np.float64] = np.array(
        ((1.0, 1.0), (0.6, 0.6), (0.3, 0.3), (0.6, 1.0), (0.3, 1.0), (0.1, 1.0), (0.0, 1.0))
    )
    turns: NDArray[np.float64] = np.array(((1.0, 1.0), (0.6, 1.0), (0.3, 1.0), (0.0, 1.0)))  # the same, on a way out


class AimTuning(NamedTuple):
    """The choice of an aim."""

    nearest: float = 0.05  # m; a nearer point is not used as an aim
    gap: float = 0.04  # m, to cells that are not held, on the straight line to an aim: 1 cm more than SAFETY.gap
    tight_gap: float = 0.01  # m, where ``gap`` leaves no aim: beside a wall the robot still reaches the next cell
    shares: tuple[float, ...] = (0.75, 0.5, 0.25)  # of the line from the robot's cell to the next waypoint


class ScaleTuning(NamedTuple):
    """The scale: the tables get the sensed distances divided by it (decision 13). The wire allows 0.01 to 1."""

    tight: float = 0.4  # the least where the room is small (docs/fuzzy.md)
    lane: float = 0.15  # in a lane between others
    roomy: float = 0.8  # m, from the robot's centre to the cells not granted; from here on the room does not count
    # share by which the scale shrinks if the aim is behind: then the tables turn at once (decision 13: without it the
    # tunnel took 90 s instead of 77 s)
    behind: float = 0.7
    turning: float = 0.15  # where the robot has to turn to its aim: obstacles count as far, and the tables turn to it
    detour: float = 0.02  # on a detour, or in a circle: nearly everything counts as far; the safety filter keeps clear


class PilotTuning(NamedTuple):
    """When a robot gets nowhere, when it rests, and what a rollout is asked."""

    in_view: int = 5  # cells of the way in which the rollout's aim may lie
    rolled_every: int = 4  # ticks between two rollouts
    nowhere_after: float = 5.0  # s without a shorter way, after which a robot gets nowhere (docs/fuzzy.md)
    longer: float = 7.2  # m; a way that grew by more than this is a different way
    passage: int = 2  # neighbours of a cell, at most, in a passage, where a robot turns while it waits (decision 13)
    # m from the point of its cell nearest to the next cell, where a robot that waits for that cell stops. At 0 and
    # 0.12 m the bearing of the point changes fast, and the safety filter instead of the tables turns the robot
    queued: float = 0.25
    # s in all for which a robot that is done tries to get back to its last stop, from which it made room for others;
    # then it stays where it is in nobody's way. Robots on a ring, in an order in which not all can be back, never ended
    settles_after: float = 60.0
    # rad; a robot that drives straight to its place turns on the spot if its heading is off by more
    docks_straight: float = 0.35
    docks_near: float = 0.025  # m, how near to its place it stands
    docks_turning: float = 2.0  # 1/s, its turn for an error of its heading where the tables would turn away
    pulls_in: float = 0.1  # m from the middle of its cell, in a lane, where a robot drives straight to it until inside
    circle: float = 0.75  # track widths, the least radius of a circle that the tables drive round a place
    # of the chosen speeds, while commands reach the wheels late: the first with which the robot stays in its cells
    shares: tuple[float, ...] = (1.0, 0.5, 0.25)
    well_within: float = 0.9  # share of ``reach`` within which a robot that is done need not come nearer to its stop


class PoseTuning(NamedTuple):
    """How a robot drives whose pose is not exact: shares of the room that its body leaves free around it in a cell."""

    slows: float = 0.5  # of the room; with a larger error the robot slows down
    stands: float = 0.8  # of the room; with a larger error it stands, and says so
    goes_on: float = 0.7  # of the room; from here on it drives again


class RolloutTuning(NamedTuple):
    """The simulation of where the tables would drive."""

    ahead: float = 2.5  # s of simulated motion (decision 13)
    there: float = 0.1  # m from the aim, where it counts as reached
    round: float = 1.3  # m; the tables turn in arcs of up to this and may circle around a nearer aim (decision 13)
    nearer: float = 0.7  # share of the first distance; a robot near its aim that stays farther away than this circles


class DetourTuning(NamedTuple):
    """A detour: see docs/fuzzy.md."""

    patience: float = 3.0  # s without progress: enough time for the tables to turn away by themselves
    progress: float = 0.1  # m; a robot that moved this far made progress
    aside: float = pi / 2  # rad, the heading that the tables get until the way straight ahead is clear
    done: float = 0.4  # m from its beginning, where a detour ends


class EvasionTuning(NamedTuple):
    """Getting out of a threat's way: see docs/ground.md."""

    speed: float = 0.6  # m/s at most: the cruising speed of the scenarios
    turn_rate: float = 4.0  # rad/s at most
    gain: float = 5.0  # 1/s, yaw rate per angle between robot and way out
    headings: int = 24  # ways out that are tried, evenly all around
    times: tuple[float, ...] = (1.8, 1.2, 0.8, 0.4)  # s to drive before braking, longest first
    ahead: float = 2.5  # s of simulated motion, braking included
    enough: float = 0.3  # m of gap; a larger gap counts no more than this
    differs: float = 0.02  # m; smallest difference of gaps between driving and standing that counts
    keep: float = 0.1  # m by which another way out must be better than the one under way
    tables_for: float = 0.4  # s for which the wheels get the tables' speeds before braking; equal to SAFETY.look
    turns_back: float = 2.0  # s of that simulation: a threat that drives away may turn back
    commit: float = 0.3  # s for which a way out is driven at least
    # s, braking included, for which no course may bring the threat nearer than standing would: 0.6 s more than
    # ``commit``, in which the wheels stop from 1.2 m/s at the usual 2 m/s2
    stopped: float = 0.9
    stopped_gap: float = 0.1  # m; a gap in that time that is enough, even where standing keeps more
    # courses of a threat: its turn [rad], and the share of its speed that it keeps
    courses: NDArray[np.float64] = np.array(
        ((0.0, 1.0), (0.4, 1.0), (-0.4, 1.0), (1.6, 1.0), (-1.6, 1.0), (pi, 1.0), (0.0, 0.0))
    )
    # weight of each course: straight on and a little to a side, because the measured velocity is inexact
    likely: NDArray[np.float64] = np.array((0.5, 0.25, 0.25, 0.0, 0.0, 0.0, 0.0))


class ReplanTuning(NamedTuple):
    """When a robot plans its path again, and around what."""

    again: float = 1.0  # s; shortest time between two plans for the same reason
    stuck: float = 4.0  # s without progress before the robot plans again: 1 s more than DETOUR.patience
    retries: int = 3  # times that a robot that learns the floor takes up a stop that it gave up
    strayed: float = 0.8  # m from the path; a robot farther away plans again
    jump: float = 2.0  # m; most progress along the path between two ticks
    body_gap: float = 0.15  # m, that a path keeps to robots that stand in the way


SAFETY: Final = SafetyTuning()
AIM: Final = AimTuning()
SCALE: Final = ScaleTuning()
PILOT: Final = PilotTuning()
POSE: Final = PoseTuning()
ROLLOUT: Final = RolloutTuning()
DETOUR: Final = DetourTuning()
EVASION: Final = EvasionTuning()
REPLAN: Final = ReplanTuning()
