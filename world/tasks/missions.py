"""The missions of all robots: the stops that each has now, which of them it has been at, and requests for others."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from swarm.geometry import Pose, distance, wrap
from swarm.maps.occupancy import Point
from swarm.messages import Activity, Assigned, Command, Counted, Order, RobotAction
from swarm.robot.mission import LEAST, heading_at, is_at
from swarm.settings import Settings
from world.bodies.event_line import EventLine
from world.measure.recorder import Recorder
from world.tasks.orders import OrderChange, Orders, OrdersState, PastStops, StopProgress
from world.tasks.reachable import Reachable


class MissionsState(NamedTuple):
    """The state of `Missions`."""

    orders: OrdersState
    left: list[int | None]
    reached_at: list[list[float | None]]
    laps: list[int]


class Missions:
    """The stops of one run, by the robots' numbers. What counts is where a robot is, not what it says."""

    def __init__(
        self,
        settings: Settings,
        starts: Sequence[Pose],
        stops: Sequence[Sequence[Point]],
        robots: Sequence[str],
        recorder: Recorder,
    ) -> None:
        self._robots, self._homes = robots, [(start.x, start.y) for start in starts]
        self._reach, self._patrols = settings.reach, settings.patrol
        self._recorder = recorder
        self.orders = Orders(robots, stops, returns=settings.return_home)
        self.left: list[int | None] = [
            0 if row else None for row in stops
        ]  # the first stop neither reached nor given up
        self.reached_at: list[list[float | None]] = [[None] * len(row) for row in stops]  # s, in the present lap
        self.laps = [0] * len(stops)  # of a patrol, complete
        self._places: list[tuple[int, NDArray[np.float64]] | None] = [None] * len(starts)

    def add_robot(self, start: Pose) -> None:
        """Add a robot with its home and without stops; its first sense says so."""
        self._homes.append((start.x, start.y))
        self.orders.add_robot()
        self.left.append(None)
        self.reached_at.append([])
        self.laps.append(0)
        self._places.append(None)

    @property
    def state(self) -> MissionsState:
        """The state, which shares its values with this object."""
        return MissionsState(self.orders.state, self.left, self.reached_at, self.laps)

    def restore(self, state: MissionsState) -> None:
        """Continue from a state."""
        orders, self.left, self.reached_at, self.laps = state
        self.orders.restore(orders)

    def stops(self, number: int) -> tuple[Point, ...]:
        """Return a robot's stops [m]."""
        return tuple(self.orders.rows[number].stops)

    def places(self, number: int) -> NDArray[np.float64]:
        """Return a robot's stops as an array (n, 2) [m]."""
        row, known = self.orders.rows[number], self._places[number]
        if known is None or known[0] != row.number:
            known = row.number, np.array(row.stops, np.float64).reshape(-1, 2)
            self._places[number] = known
        return known[1]

    def label(self, number: int, stop: int) -> str:
        """Return the name of a stop for people: ``target 1``, ..., ``home``."""
        row = self.orders.rows[number]
        if row.pooled:
            return row.what
        return "home" if row.home and stop == len(row.stops) - 1 else f"target {stop + 1}"

    def is_stopped(self, number: int) -> bool:
        """Return True if a robot was told to stop."""
        return self.orders.rows[number].stopped

    @property
    def any_stopped(self) -> bool:
        """True if a robot was told to stop."""
        return any(row.stopped for row in self.orders.rows)

    @property
    def complete(self) -> bool:
        """True if every robot has been at all its stops."""
        return all(laps or None not in row for laps, row in zip(self.laps, self.reached_at, strict=True))

    @property
    def dropped_targets(self) -> list[tuple[str, str]]:
        """The robots from which `cancel` took targets that they had not reached, and what those were of."""
        return [(name, row.dropped) for name, row in zip(self._robots, self.orders.rows, strict=True) if row.dropped]

    @property
    def under_way(self) -> list[int | None]:
        """The stop that each robot should make progress to; None also for one that was told to stop."""
        return [None if row.stopped else left for row, left in zip(self.orders.rows, self.left, strict=True)]

    def to_tell(self, number: int, command: Command) -> Assigned | None:
        """Return the stops that a robot has not taken over yet, by its last command; None: it has."""
        return None if command.assignment == self.orders.rows[number].number else self.orders.assigned_stops(number)

    def is_finished(self, number: int, command: Command) -> bool:
        """Return True if a robot says that it is done, and has no stop left but those it has given up."""
        done = command.activity is Activity.DONE and command.assignment == self.orders.rows[number].number
        return done and self.left[number] is None

    def progress(self, number: int) -> StopProgress:
        """Return how far a robot is with the stops that it has now."""
        return StopProgress(self.reached_at[number], self.laps[number])

    def counted_stops(self, number: int) -> Counted:
        """Return which of a robot's stops count so far."""
        reached = [time is not None for time in self.reached_at[number]]
        return Counted(assignment=self.orders.rows[number].number, laps=self.laps[number], reached=reached)

    def history(self, number: int) -> list[PastStops]:
        """Return all stops that a robot has had, the present ones last."""
        return self.orders.history(number, self.progress(number))

    # --- requests ---

    def take(self, number: int, request: Order | RobotAction, here: Point, reachable: Reachable) -> OrderChange:
        """Carry out a request to a robot that is at ``here`` [m].

        Raises:
            PeerError: the request is refused; nothing has changed.
        """
        check = partial(reachable.check, number, here)
        outcome = self.orders.take(number, request, self.progress(number), self._homes[number], check)
        if outcome.new_stops:
            self._begin(number)
        if outcome.changed:
            self._recorder.request(number, request)
        return outcome

    def hand(self, number: int, errand: str | None, *targets: Point) -> OrderChange:
        """Give a robot an errand of the pool, a name and its target [m], or take back the one that it has."""
        outcome = self.orders.hand(number, self.progress(number), errand, targets)
        self._begin(number)
        self._recorder.request(number, Order(id="pool", targets=list(targets)))
        return outcome

    def _begin(self, number: int) -> None:
        """Begin with new stops."""
        self.reached_at[number], self.laps[number] = [None] * len(self.orders.rows[number].stops), 0
        self.left[number] = self._next_stop(number, ())

    # --- what robots say, and where they are ---

    def of_these_stops(self, number: int, command: Command) -> Command:
        """Return a command without what it says about stops that the robot no longer has."""
        if command.assignment == self.orders.rows[number].number:
            return command
        return replace(command, reached=[], unreachable=[])

    def admit(self, number: int, before: Command, command: Command, pose: Pose) -> list[EventLine]:
        """Take in what a robot says about its stops; return what it gives up, takes up again, or says wrongly."""
        name = self._robots[number]
        said = [
            EventLine("unreachable", f"gives up {self.label(number, stop)}: no path leads there", name)
            for stop in command.unreachable
            if stop < len(self.orders.rows[number].stops) and stop not in before.unreachable
        ]
        if command.unreachable != before.unreachable:
            said += self._describe_taken_up(number, before, command)
            self._next(number, command.unreachable)
        row = self.orders.rows[number]
        for stop, claimed in enumerate(command.reached[: len(row.stops)]):
            if claimed and self.reached_at[number][stop] is None and before.reached[stop : stop + 1] != [True]:
                off = f"{distance(pose, row.stops[stop]):.2f} m away"
                if (heading := heading_at(row.headings, stop)) is not None:
                    off += f" and {abs(wrap(heading - pose.yaw)):.2f} rad off its heading"
                text = f"says it reached {self.label(number, stop)} but is {off}; not counted"
                said.append(EventLine("false_claim", text, name))
        ours = command.assignment == self.orders.rows[number].number
        done = ours and Activity.DONE is command.activity is not before.activity
        if done and (lacks := self.left[number]) is not None:
            text = f"says it is done but has not reached {self.label(number, lacks)}; not counted"
            said.append(EventLine("false_claim", text, name))
        return said

    def _describe_taken_up(self, number: int, before: Command, command: Command) -> list[EventLine]:
        """Name the stops that a robot takes up again; it drives home again after them."""
        row = self.orders.rows[number]
        stops = [stop for stop in before.unreachable if stop not in command.unreachable and stop < len(row.stops)]
        stops = [stop for stop in stops if self.reached_at[number][stop] is None]
        if stops and row.home:
            self.reached_at[number][-1] = None
        text = "takes up {} again: a path leads there now".format
        return [EventLine("taken_up", text(self.label(number, stop)), self._robots[number]) for stop in stops]

    def is_at_next_stop(self, number: int, pose: Pose) -> bool:
        """Return True if the next stop counts at the end of this tick."""
        stop = self.left[number]
        row = self.orders.rows[number]
        return stop is not None and is_at(pose, row.stops[stop], heading_at(row.headings, stop), self._reach)

    def tick_off(self, number: int, pose: Pose, given_up: Sequence[int], time: float) -> list[EventLine]:
        """Count the stops that a robot is at, at a time [s]."""
        said = []
        while self.is_at_next_stop(number, pose) and (stop := self.left[number]) is not None:
            self.reached_at[number][stop] = time
            said.append(EventLine("reached", f"is at {self.label(number, stop)}", self._robots[number]))
            if self._next(number, given_up):
                break
        return said

    def _next(self, number: int, given_up: Sequence[int]) -> bool:
        """Find a robot's next stop; return True if a lap of its patrol begins with it."""
        row = self.orders.rows[number]
        self.left[number] = self._next_stop(number, given_up)
        turns = self._patrols and not row.number and len(row.stops) - len(given_up) >= LEAST
        if self.left[number] is not None or not turns:
            return False
        self.laps[number] += 1
        self.reached_at[number] = [None] * len(row.stops)
        self.left[number] = self._next_stop(number, given_up)
        return True

    def _next_stop(self, number: int, given_up: Sequence[int]) -> int | None:
        """Return the first stop that a robot has neither reached nor given up."""
        row = enumerate(self.reached_at[number])
        return next((stop for stop, time in row if time is None and stop not in given_up), None)
