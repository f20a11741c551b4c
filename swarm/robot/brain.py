"""The robot's decisions. ``Robot.step`` uses nothing but the robot's state and its inputs."""

import dataclasses
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from msgspec.structs import replace

from swarm.fuzzy import Controller
from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages import RADIO, Activity, Assigned, Broadcast, Sense, State
from swarm.planning.grid import Grid
from swarm.robot.driving.cell_pilot import CellPilot
from swarm.robot.driving.pilot import Pilot, PilotInputs, PilotOutputs
from swarm.robot.ground import Ground
from swarm.robot.mission import Mission, MissionStage
from swarm.robot.navigator import Navigator
from swarm.robot.outputs import Outputs, OutputWriter
from swarm.robot.pose_estimate import Estimate, PoseEstimator
from swarm.robot.tuning import REPLAN
from swarm.scenario.load import Scenario
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import (
    cells_of,
    cells_of_learned_floor,
    standable_under,
    traffic_settings,
)
from swarm.traffic.outputs import StepResult
from swarm.traffic.progress_checker import ProgressChecker, make_movement_test
from swarm.traffic.step import Traffic


class Inputs(NamedTuple):
    """The inputs of one step."""

    sense: Sense
    heard: Sequence[Broadcast]


class Robot:
    """One robot of a fleet; ``number`` counts from 0 and determines the ticks at which the robot broadcasts."""

    def __init__(
        self,
        name: str,
        number: int,
        scenario: Scenario,
        start: Pose,
        grid: Grid | None = None,
        controller: Controller | None = None,
        edits: int = 0,
    ) -> None:
        self.name = name
        self._number = number
        self._scenario = scenario
        self._settings = scenario.settings
        self._start = start
        self._ground = Ground(scenario, grid, edits)
        self._controller = controller or Controller(scenario.profile)
        self._load: float | None = None  # m, its radius while it carries a load
        self._unloaded = scenario.settings
        self._begin(run=0)

    def _begin(self, run: int) -> None:
        settings = self._settings
        if run and not settings.map.known:
            self._ground = Ground(self._scenario)
        self.run = run
        self.mission = Mission(self._own_stops, returns=settings.return_home, patrols=settings.patrol)
        self._navigator = Navigator(self._ground.grid, settings.robot.radius, settings.reach)
        self._pilot = self._new_pilot()
        self._others: dict[str, Broadcast] = {}
        self._estimator = self._new_estimator(self._start)
        self._activity = Activity.READY
        self._planned_at = float("-inf")
        self._progress = ProgressChecker(make_movement_test(settings.robot.radius))
        self._progress.restart(self._start[:2], 0.0)
        self._forgot_for = -1  # the stop for which it last cleared its map
        self._finished = 0  # stops of earlier assignments that it had finished
        self._opened = False  # the map has changed: a way may lead to a stop that was given up
        self._retry_at = 0.0  # s
        self._retries: Counter[int] = Counter()  # of each stop
        self._writer = OutputWriter(self.name)

    def _cells(self) -> CellMap:
        """Return the cells of the floor that is known, as they are joined for this robot."""
        settings, floor = self._settings, self._ground.map
        return cells_of(floor, settings) if settings.map.known else cells_of_learned_floor(floor, settings)

    def _new_pilot(self) -> Pilot:
        settings, cells = self._settings, self._cells()
        constants = traffic_settings(settings)
        if self._load is not None:
            constants = dataclasses.replace(constants, tells_body=True)
        traffic = Traffic(self.name, cells, constants, slot=self._number)
        return CellPilot(traffic, cells, self._number, settings, self._controller)

    def _new_estimator(self, start: Pose | None) -> PoseEstimator:
        robot = self._settings.robot
        return PoseEstimator(1.0 / self._settings.rate, robot.wheel_acceleration, robot.track_width, start)

    @property
    def last_decision(self) -> StepResult | None:
        """The decisions of its last step of coordination; None: it has made none."""
        return self._pilot.last_decision

    def resume(self, state: State, assigned: Assigned | None = None) -> None:
        """Continue the mission where an earlier process of this robot left it; ``assigned`` are its stops now."""
        self._begin(state.run)
        self._estimator = self._new_estimator(None)
        if assigned is not None:
            self.mission.begin()
            self.mission.assign(assigned)
        if state.activity is not Activity.READY and state.assignment == self.mission.number:
            self.mission.resume(state.reached, state.unreachable, state.laps)

    def fault_of(self, sense: Sense) -> str | None:
        """Return a sentence that says what in a sense does not fit the scenario; None: everything fits."""
        rays, stops = 3 * self._settings.sensors.rays, len(self._stops_of(sense))
        for name, found, expected in (("rays", sense.rays, rays), ("bearings", sense.bearings, stops)):
            if len(found) != expected:
                return f"{name}: expected {expected}, got {len(found)}; do the robot and the world run one scenario?"
        return None

    def _stops_of(self, sense: Sense) -> Sequence[Point]:
        """Return the stops that a sense is about."""
        if sense.assigned is not None:
            return sense.assigned.stops
        return self.mission.stops if sense.run == self.run else self._own_stops

    @property
    def _own_stops(self) -> Sequence[Point]:
        return self._scenario.stops(self._number, self._start[:2])

    def has_missed_edits(self, sense: Sense) -> bool:
        """Return True if the robot has missed edits of the map for good: then it needs the whole map again."""
        return self._ground.has_missed_edits(sense.edits_before)

    def take_map(self, scenario: Scenario, edits: int) -> None:
        """Replace the map; ``edits`` is the number of edits that the new one includes."""
        self._ground = Ground(scenario, None, edits)
        self._navigator.take_ground(self._ground.grid)
        self._navigator.clear()
        self._pilot.take_floor(self._ground.map)
        self._opened = True

    def step(self, inputs: Inputs) -> Outputs:
        """Return what the robot does at one tick."""
        told = inputs.sense
        if told.run != self.run:
            self._begin(told.run)
        estimate = self._estimator.update(told)
        exact = estimate.pose == (told.x, told.y, told.yaw)
        sense = told if exact else replace(told, x=estimate.pose.x, y=estimate.pose.y, yaw=estimate.pose.yaw)
        if self.mission.stage is MissionStage.READY:
            self.mission.begin()
        said = self._take_load(told.radius, estimate.pose) if told.radius != self._load else []
        self._take_over(sense.assigned)
        self._hear(inputs)
        self._tick_off_stops(sense, estimate.pose)
        self._learn(sense, inputs.heard)
        self._take_up_stops((sense.x, sense.y), sense.time)
        self._find_path(sense, estimate.pose)
        move = self._drive(sense, estimate, inputs.heard)
        move = move._replace(notes=[*said, *move.notes]) if said else move
        self._activity = move.activity
        believed = None if exact else (*estimate.pose, estimate.error)
        replans = max(0, self._navigator.plans - self._finished - self.mission.target - 1)
        walls = self._ground.tell if self._settings.map.shared else list[int]
        return self._writer.write(self.run, sense, move, self.mission, self._navigator, replans, believed, walls)

    def _take_load(self, radius: float | None, pose: Pose) -> list[tuple[str, str]]:
        """Plan a new path with another radius [m], or without a load (None); return what there is to say about it.

        Traffic begins as in a robot that has just started: it holds what is under its body, and listens first.
        """
        self._load, own = radius, self._unloaded
        self._settings = own if radius is None else replace(own, robot=replace(own.robot, radius=radius))
        self._scenario = self._scenario.with_settings(self._settings)
        self._ground.take_radius(self._scenario)
        self._navigator = Navigator(self._ground.grid, self._settings.robot.radius, self._settings.reach)
        self._pilot = self._new_pilot()
        self._opened = True
        if standable_under(self._cells(), pose[:2], self._settings):
            return []
        wide = self._settings.robot.radius
        return [("load", f"does not fit where it stands: a radius of {wide:g} m finds no way from there")]

    # --- what it knows about others and about the floor ---

    def _hear(self, inputs: Inputs) -> None:
        for broadcast in inputs.heard:
            if broadcast.run == self.run and broadcast.robot != self.name:
                known = self._others.get(broadcast.robot)
                if known is None or broadcast.tick > known.tick:
                    self._others[broadcast.robot] = broadcast

    def _learn(self, sense: Sense, heard: Sequence[Broadcast]) -> None:
        ground = self._ground
        changed = ground.take_edits(sense.edits_before, sense.edits)
        if changed:
            self._navigator.clear()  # a removed wall may open a shorter way
            self._opened = True
            self._pilot.take_floor(ground.map)
        if not self._settings.map.known:
            changed |= ground.learn(sense, self._pilot.robot_at(sense.tick))
        if self._settings.map.shared:
            for broadcast in heard:
                changed |= ground.hear(broadcast.walls, sense.time)
        if changed:
            self._navigator.take_ground(ground.grid)
            self._learn_cells((sense.x, sense.y))

    def _learn_cells(self, here: Point) -> None:
        """Update the cells from the learned map; drop the path if the cells no longer lead to the goal."""
        changed = self._pilot.learn(self._ground.map, self._ground.take_news())
        self._opened |= changed
        if changed and self.mission.goal is not None and not self._pilot.can_reach(here, self.mission.goal):
            self._navigator.clear()

    def _near(self, now: int) -> list[Broadcast]:
        """Return the newest broadcast of each robot heard within the radio's timeout."""
        stale = RADIO.timeout * self._settings.rate
        return [other for other in self._others.values() if now - other.tick <= stale]

    # --- where it goes ---

    def _take_over(self, assigned: Assigned | None) -> None:
        """Take over the stops that the world has assigned, instead of those so far."""
        if assigned is not None and assigned.number > self.mission.number:
            self._finished += self.mission.target
            self.mission.assign(assigned)
            self._navigator.clear()
            self._forgot_for, self._opened, self._retries = -1, False, Counter()

    def _take_up_stops(self, here: Point, time: float) -> None:
        """Take up the stops that were given up and that a path leads to now.

        A robot that learns the floor and clears its map sees ways that are not there: it tries each stop a few times.
        """
        mission, settings = self.mission, self._settings
        if not (self._opened and mission.unreachable and settings.retry_stops and time >= self._retry_at):
            return
        self._opened, self._retry_at = False, time + REPLAN.again
        for stop in tuple(mission.unreachable):
            goal = mission.stops[stop]
            may = settings.map.known or self._retries[stop] < REPLAN.retries
            if may and self._pilot.can_reach(here, goal) and self._navigator.leads_to(here, goal):
                self._retries[stop] += 1
                mission.take_up(stop)
                self._navigator.clear()

    def _tick_off_stops(self, sense: Sense, pose: Pose) -> None:
        """Finish the stops that the robot is at by its pose if that is exact, else those that the world has counted."""
        mission, laps = self.mission, self.mission.laps
        while mission.has_done_stop(pose, self._settings.reach, sense.counted):
            if mission.laps > laps:
                break  # one lap a tick: stops that are left may be so near each other that both are reached at once
            mission.finish_stop(reached=True)
            self._navigator.clear()

    def _find_path(self, sense: Sense, pose: Pose) -> None:
        """Find a path to the goal if there is none; give up stops that no path reaches."""
        navigator = self._navigator
        here = (pose.x, pose.y)
        while (goal := self.mission.goal) is not None and navigator.path is None:
            if self._pilot.can_reach(here, goal) and navigator.head_for(here, goal):
                self._planned_at = sense.time
            elif not self._settings.map.known and self._forgot_for != self.mission.target:
                self._forgot_for = self.mission.target
                self._ground.forget(sense.time)
                navigator.take_ground(self._ground.grid)
                self._learn_cells(here)
            else:
                self.mission.finish_stop(reached=False)
        if (goal := self.mission.goal) is None:
            return
        on_path = navigator.advance(pose)
        if self._activity is Activity.GIVE_WAY or sense.stopped:
            self._progress.restart(here, sense.time)
        stuck = self._progress.check(here, sense.time) > REPLAN.stuck
        if (not on_path or stuck) and sense.time - self._planned_at > REPLAN.again:
            self._planned_at = sense.time
            bodies = [(other.x, other.y) for other in self._near(sense.tick)] if stuck else []
            if navigator.head_for(here, goal, bodies):
                self._progress.restart(here, sense.time)
                navigator.advance(pose)

    # --- how it drives ---

    def _drive(self, sense: Sense, estimate: Estimate, heard: Sequence[Broadcast]) -> PilotOutputs:
        mission, pose = self.mission, estimate.pose
        goal = mission.goal
        inputs = PilotInputs(
            sense=sense,
            pose=pose,
            estimate=estimate,
            goal=goal or (mission.stops[-1] if mission.stops else pose[:2]),
            then=mission.stop_after_next,
            heading=mission.heading,
            done=goal is None,
            anywhere=goal is None and (mission.number > 0 or self._settings.serve),
            target=min(mission.target, len(mission.stops) - 1),
            navigator=self._navigator,
            heard=heard,
        )
        return self._pilot.drive(inputs)
