"""The paper's mission (section 4, figure 5): the targets in order, then home. The table below is all of it.

A patrol visits the targets again and again: after the last one that it can reach, it begins the next lap.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import Final

from swarm.geometry import Pose, distance, wrap
from swarm.maps.occupancy import Point
from swarm.messages import Assigned, Counted
from swarm.settings import Settings

TURNED: Final = 0.1  # rad; a robot is turned to a heading within this; Nav2's goal checker wants 0.25
LEAST: Final = 2  # stops of a patrol that were not given up; with fewer it ends


class MissionStage(StrEnum):
    """Where in its mission a robot is."""

    READY = "ready"  # waits for the action go
    OUTBOUND = "outbound"  # drives to a target
    RETURNING = "returning"  # drives home
    DONE = "done"


class Occasion(StrEnum):
    """An event that changes the stage of a mission."""

    GO = "go"
    TARGET_LEFT = "target done, another one left"  # the target was reached, or no path leads there
    TARGETS_DONE = "target done, home is next"
    ALL_DONE = "target done, none left"
    TAKEN_UP = "a way opens to a target that was given up"
    ASSIGNED = "other targets are assigned"
    SENT_HOME = "only home is assigned or taken up"
    NO_STOPS = "no targets are assigned"
    RESTART = "restart"


# fmt: off
TRANSITIONS: Final[dict[MissionStage, dict[Occasion, MissionStage]]] = {
    MissionStage.READY:     {Occasion.GO: MissionStage.OUTBOUND, Occasion.RESTART: MissionStage.READY},
    MissionStage.OUTBOUND:  {Occasion.TARGET_LEFT: MissionStage.OUTBOUND, Occasion.TARGETS_DONE: MissionStage.RETURNING,
                             Occasion.ALL_DONE: MissionStage.DONE, Occasion.RESTART: MissionStage.READY,
                             Occasion.TAKEN_UP: MissionStage.OUTBOUND, Occasion.ASSIGNED: MissionStage.OUTBOUND,
                             Occasion.SENT_HOME: MissionStage.RETURNING, Occasion.NO_STOPS: MissionStage.DONE},
    MissionStage.RETURNING: {Occasion.ALL_DONE: MissionStage.DONE, Occasion.RESTART: MissionStage.READY,
                             Occasion.TAKEN_UP: MissionStage.OUTBOUND, Occasion.ASSIGNED: MissionStage.OUTBOUND,
                             Occasion.SENT_HOME: MissionStage.RETURNING, Occasion.NO_STOPS: MissionStage.DONE},
    MissionStage.DONE:      {Occasion.RESTART: MissionStage.READY, Occasion.TAKEN_UP: MissionStage.OUTBOUND,
                             Occasion.ASSIGNED: MissionStage.OUTBOUND, Occasion.SENT_HOME: MissionStage.RETURNING,
                             Occasion.NO_STOPS: MissionStage.DONE},
}
# fmt: on


def is_at(pose: Pose, stop: Point, heading: float | None, reach: float) -> bool:
    """Return True if a robot counts as being at a stop: within ``reach`` [m], and turned to its heading [rad]."""
    return distance(pose, stop) <= reach and (heading is None or abs(wrap(heading - pose.yaw)) <= TURNED)


def heading_at(headings: Sequence[float | None], stop: int) -> float | None:
    """Return the heading [rad] that is asked for at a stop, None if any will do."""
    return headings[stop] if stop < len(headings) else None


def targets_of_others(settings: Settings, number: int) -> list[Point]:
    """Return the targets of the other robots [m], without homes: a robot that is done must not stay on one."""
    if not settings.own_targets:
        return settings.targets
    return [stop for other, stops in enumerate(settings.own_targets) if other != number for stop in stops]


class Mission:
    """One robot's stage, and which stops it has reached or given up."""

    def __init__(self, stops: Sequence[Point], *, returns: bool, patrols: bool = False) -> None:
        self.stops = tuple(stops)
        self._headings: Sequence[float | None] = ()
        self._returns = returns
        self._patrols = patrols
        self.stage = MissionStage.READY
        self.reached = [False] * len(self.stops)
        self.unreachable: list[int] = []
        self.target = 0  # index of the stop under way; the number of stops when none is left
        self.laps = 0  # of a patrol, complete
        self.number = 0  # of the stops, as the world has numbered them; 0: those of the scenario

    @property
    def goal(self) -> Point | None:
        """The stop that the robot drives to [m], or None."""
        under_way = self.stage is MissionStage.OUTBOUND or self.stage is MissionStage.RETURNING
        return self.stops[self.target] if under_way else None

    @property
    def heading(self) -> float | None:
        """The heading [rad] to turn to at that stop; None: any."""
        return None if self.goal is None else heading_at(self._headings, self.target)

    @property
    def stop_after_next(self) -> Point | None:
        """The stop after that one [m], to which the robot drives on at once, or None."""
        if self.goal is None or self.heading is not None:
            return None
        following = self._next_from(self.target + 1)
        if following < len(self.stops):
            return self.stops[following]
        lap = [stop for stop in range(self.target) if stop not in self.unreachable] if self._patrols else []
        return self.stops[lap[0]] if lap else None

    def take(self, occasion: Occasion) -> None:
        """Change the stage as the table says.

        Raises:
            ValueError: the table has no such row; the mission is unchanged.
        """
        row = TRANSITIONS[self.stage]
        if occasion not in row:
            allowed = ", ".join(row)
            raise ValueError(f"mission: expected one of ({allowed}) in stage {self.stage}, got {occasion}")
        self.stage = row[occasion]

    def begin(self) -> None:
        """Begin to drive; without stops the mission is done."""
        self.take(Occasion.GO)
        if not self.stops:
            self.take(Occasion.NO_STOPS)

    def assign(self, assigned: Assigned) -> None:
        """Take over other stops; nothing of those before counts any more."""
        targets = len(assigned.stops) - assigned.home
        home = Occasion.SENT_HOME if assigned.stops else Occasion.NO_STOPS
        self.take(Occasion.ASSIGNED if targets else home)
        self.stops, self.number, self._headings = tuple(assigned.stops), assigned.number, assigned.headings
        self._returns, self._patrols = assigned.home, False
        self.reached, self.unreachable, self.target, self.laps = [False] * len(self.stops), [], 0, 0

    def take_up(self, stop: int) -> None:
        """Take up a stop that was given up. If the mission returns, the robot drives home once more."""
        self.unreachable.remove(stop)
        if self._returns:
            self.reached[-1] = False
        self.target = self._next_from(0)
        home = self._returns and self.target == len(self.stops) - 1
        self.take(Occasion.SENT_HOME if home else Occasion.TAKEN_UP)

    def has_done_stop(self, pose: Pose, reach: float, counted: Counted | None) -> bool:
        """Return True if the robot is done with the current stop: it is there, within ``reach`` [m].

        A robot that does not know its pose exactly is done when the world has ``counted`` the stop.
        """
        if self.goal is None:
            return False
        if counted is None:
            return is_at(pose, self.goal, self.heading, reach)
        if counted.assignment != self.number or counted.laps < self.laps:
            return False
        return counted.laps > self.laps or counted.reached[self.target : self.target + 1] == [True]

    def finish_stop(self, reached: bool) -> None:
        """Finish the current stop: it was reached, or it is given up because no path leads there."""
        if reached:
            self.reached[self.target] = True
        else:
            self.unreachable.append(self.target)
        self.target = self._next_from(self.target + 1)
        if self._patrols:
            self._turn()
        self._move_on()

    def resume(self, reached: Sequence[bool], unreachable: Sequence[int], laps: int = 0) -> None:
        """Continue the mission where an earlier process left it."""
        if self.stage is MissionStage.READY:
            self.begin()
        self.laps = laps
        self.reached = [*reached[: len(self.stops)], *[False] * (len(self.stops) - len(reached))]
        stops = enumerate(self.reached)
        self.unreachable = [stop for stop, was_there in stops if stop in unreachable and not was_there]
        if any(self.reached) or self.unreachable:
            self.target = self._next_from(0)
            if self._patrols:
                self._turn()
            self._move_on()

    def _next_from(self, first: int) -> int:
        """Return the first stop from ``first`` on that is neither reached nor given up; the number of stops if none."""
        stops = range(first, len(self.stops))
        return next(
            (stop for stop in stops if not self.reached[stop] and stop not in self.unreachable), len(self.stops)
        )

    def _turn(self) -> None:
        """Go past stops that were given up; begin the next lap if none is left in this one, and it has enough."""
        stops = range(len(self.stops))
        left = [stop for stop in stops[self.target :] if stop not in self.unreachable]
        if not left and len(self.stops) - len(self.unreachable) >= LEAST:
            self.laps, self.reached = self.laps + 1, [False] * len(self.stops)
            left = [stop for stop in stops if stop not in self.unreachable]
        self.target = left[0] if left else len(self.stops)

    def _move_on(self) -> None:
        left = len(self.stops) - self.target
        if left == 0:
            self.take(Occasion.ALL_DONE)
        elif left == 1 and self._returns:
            self.take(Occasion.TARGETS_DONE)
        else:
            self.take(Occasion.TARGET_LEFT)
