"""The dispatch between two ticks: errands that are over leave the book, and free robots get those that wait.

Each free robot bids the length of its way. The pairs with the least sum win; an errand that waits becomes more urgent.
"""

from collections.abc import Sequence
from itertools import islice
from math import inf
from typing import Final

import numpy as np

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Activity, Command, PoolTargets
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.placement import comes_near
from world.bodies.event_line import EventLine
from world.bodies.roster import Roster
from world.tasks.assignment import cheapest_pairs
from world.tasks.missions import Missions
from world.tasks.orders import OrderChange
from world.tasks.reachable import Reachable
from world.tasks.task_pool import Errand, TaskChange, TaskPool

EVERY: Final = 0.25  # s between two looks for pairs
WINDOW: Final = 64  # errands that are matched at once, the oldest of those that a free robot can reach
FRESH: Final = 1.0  # s; a robot whose newest command is older does not bid
GONE: Final = 10.0  # s; the errand of a robot whose newest command is older goes back; less than a run waits for it
PATIENCE: Final = 0.1  # m/s: an errand that has waited for 10 s is as urgent as one that is 1 m nearer
STUCK: Final = 120.0  # s without progress after which an errand goes back if another one waits; twice that of a stall
LAST: Final = 1e6  # m, added to the bid for an errand that the robot was stuck with: it takes any other one first
NO_BID: Final = 1e9  # m


class Dispatcher:
    """The pool of one run and the robots that serve it, by their numbers."""

    def __init__(self, settings: Settings, missions: Missions, roster: Roster) -> None:
        self.pool = TaskPool.pool_of(settings.pool)
        self._settings, self._missions, self._roster, self._robots = settings, missions, roster, roster.names
        self._every = max(1, round(EVERY * settings.rate))

    def add(self, request: PoolTargets, poses: Sequence[Pose], reachable: Reachable, time: float) -> OrderChange:
        """Put targets into the pool at a time [s].

        Raises:
            PeerError: the request is refused, nothing has changed; also if no robot can reach a target.
        """

        def check(targets: Sequence[Point]) -> None:
            for number, target in enumerate(targets, start=1):
                if all(reachable.wrong(robot, pose[:2], target) for robot, pose in enumerate(poses)):
                    reachable.check(0, poses[0][:2], [target], number)

        return self.pool.add(request, time, check)

    def has_waiting_errand(
        self, poses: Sequence[Pose], floor: OccupancyMap, commands: Sequence[Command], tick: int
    ) -> bool:
        """Return True if an errand waits that some robot could take, now or when it is free."""
        if not (waiting := self.pool.waiting):
            return False
        robots = [robot for robot in range(len(self._robots)) if self._serves(robot, commands[robot], tick, GONE)]
        return any(self._bid(robot, poses[robot], errand, floor) < NO_BID for errand in waiting for robot in robots)

    def step(
        self,
        poses: Sequence[Pose],
        floor: OccupancyMap,
        commands: Sequence[Command],
        standing: Sequence[float],
        tick: int,
    ) -> list[EventLine]:
        """Settle the errands that robots have, and hand out those that wait; return what has changed.

        ``standing`` is how long [s] each robot has made no progress, infinite if it has no stop left.
        """
        if not self.pool.open:
            return []
        said = self._settle(poses, floor, commands, standing, tick)
        if tick % self._every == 0:
            said += self._hand_out(poses, floor, commands, tick)
        return said

    # --- errands that robots have ---

    def _settle(
        self,
        poses: Sequence[Pose],
        floor: OccupancyMap,
        commands: Sequence[Command],
        standing: Sequence[float],
        tick: int,
    ) -> list[EventLine]:
        said: list[EventLine] = []
        for errand in self.pool.taken_errands:
            robot = errand.robot
            assert robot is not None
            why = self._why_errand_ended(errand, robot, commands[robot], tick)
            if why is None and STUCK < standing[robot] < inf and self._could_take_another(robot, poses[robot], floor):
                why = TaskChange.STUCK
            if why is TaskChange.REACHED:
                self.pool.close(errand, tick / self._settings.rate)
            elif why is not None:
                self.pool.put_back(errand, why)
                if why is not TaskChange.REPLACED:
                    self._missions.hand(robot, None)
                text = f"pool target {errand.name} goes back to the pool: {self._robots[robot]} had it, and {why.value}"
                said.append(EventLine("errand_back", text, self._robots[robot]))
        return said

    def _why_errand_ended(self, errand: Errand, robot: int, command: Command, tick: int) -> TaskChange | None:
        """Return why a robot no longer has an errand; None: it has it."""
        missions = self._missions
        if missions.orders.rows[robot].number != errand.assignment:
            return TaskChange.REPLACED
        if missions.progress(robot).done:
            return TaskChange.REACHED
        if command.unreachable:
            return TaskChange.GIVEN_UP
        return TaskChange.LOST if self._silent(command, tick) > GONE else None

    def _could_take_another(self, robot: int, pose: Pose, floor: OccupancyMap) -> bool:
        """Return True if an errand waits that the robot can reach and has not been stuck with."""
        others = (errand for errand in self.pool.waiting if robot not in errand.last)
        return any(self._bid(robot, pose, errand, floor) < NO_BID for errand in others)

    # --- errands that wait ---

    def _hand_out(
        self, poses: Sequence[Pose], floor: OccupancyMap, commands: Sequence[Command], tick: int
    ) -> list[EventLine]:
        queue = self.pool.waiting
        free = [robot for robot, command in enumerate(commands) if queue and self._free(robot, command, tick)]
        if not free:
            return []
        cells = self._roster.cells(floor, 0)  # whoever drives there: two errands in one cell are in each other's way
        driven_to = {cells.nearest_standable(*errand.at) for errand in self.pool.taken_errands}
        apart = (errand for errand in queue if cells.nearest_standable(*errand.at) not in driven_to)
        bid_for = ((one, [self._bid(robot, poses[robot], one, floor) for robot in free]) for one in apart)
        offers = list(islice((offer for offer in bid_for if min(offer[1]) < NO_BID), WINDOW))
        if not offers:
            return []
        waiting, bids = [errand for errand, _ in offers], np.array([row for _, row in offers]).T
        now = tick / self._settings.rate
        urgent = np.array([PATIENCE * (now - errand.given) for errand in waiting])
        later = np.array([[LAST * (robot in errand.last) for errand in waiting] for robot in free])
        said: list[EventLine] = []
        for row, column in cheapest_pairs(bids + later - urgent):
            robot, errand, bid = free[row], waiting[column], float(bids[row, column])
            if bid < NO_BID and (cell := cells.nearest_standable(*errand.at)) not in driven_to:
                driven_to.add(cell)
                outcome = self._missions.hand(robot, errand.name, errand.at)
                self.pool.hand_to(errand, robot, self._missions.orders.rows[robot].number)
                said += [EventLine(kind, text, self._robots[robot]) for kind, text in outcome.events]
                text = f"takes pool target {errand.name} at ({errand.at[0]:g}, {errand.at[1]:g}), {bid:.1f} m away"
                said.append(EventLine("errand", text, self._robots[robot]))
        return said

    def _bid(self, robot: int, pose: Pose, errand: Errand, floor: OccupancyMap) -> float:
        """Return the length [m] of a robot's way to an errand over its cells."""
        cells = self._roster.cells(floor, robot)
        start, goal = cells.nearest_standable(*pose[:2]), cells.nearest_standable(*errand.at)
        if robot in errand.refused or OUTSIDE in {start, goal}:
            return NO_BID
        if (steps := cells.distances(goal)[start]) < FAR:
            return steps * cells.side
        near = comes_near(cells, pose[:2], errand.at, self._roster.settings(robot))
        return distance(pose, errand.at) if near else NO_BID

    def _free(self, robot: int, command: Command, tick: int) -> bool:
        """Return True if a robot has nothing to do and may take an errand."""
        missions = self._missions
        done = command.activity is Activity.DONE and missions.is_finished(robot, command)
        return done and not missions.is_stopped(robot) and self._serves(robot, command, tick, FRESH)

    def _serves(self, robot: int, command: Command, tick: int, within: float) -> bool:
        """Return True if a robot was heard within a time [s], and was not sent home or cancelled by request."""
        return self._silent(command, tick) <= within and not self._missions.orders.is_withdrawn(robot)

    def _silent(self, command: Command, tick: int) -> float:
        """Return how old [s] a robot's newest command is."""
        return (tick - command.tick) / self._settings.rate
