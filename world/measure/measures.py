"""What the world measures in one run: the record, the checks of traffic and steering, progress, and the verdict."""

from collections.abc import Mapping, Sequence

from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.messages import Command, RobotAction
from swarm.scenario.load import Scenario
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of
from world.bodies.bodies import Moved
from world.bodies.event_line import EventLine
from world.bodies.roster import Roster
from world.measure.cell_watch import TrafficWatch
from world.measure.progress import ProgressWatch
from world.measure.recorder import WAITING, Recorder
from world.measure.state import MeasuresState
from world.measure.steering import SteeringWatch
from world.measure.verdict import Verdict


class Measures:
    """All measures, robots by their numbers; the ``roster`` says what they are, and others may be added to it."""

    def __init__(self, scenario: Scenario, starts: Sequence[Pose], roster: Roster) -> None:
        self._settings, self._roster, self._robots = scenario.settings, roster, roster.names
        dt = 1.0 / scenario.settings.rate
        self.recorder = Recorder(scenario, roster, starts, dt)
        self.reservations = TrafficWatch(cells_of(scenario.map, scenario.settings), roster, dt)
        self.progress = ProgressWatch(len(starts))
        self.steering = SteeringWatch(roster, starts, dt)
        self.verdict = Verdict()

    @property
    def state(self) -> MeasuresState:
        """The state, which shares its values with this object."""
        recorder, reservations = self.recorder.state, self.reservations.state
        return MeasuresState(recorder, reservations, self.progress.state, self.steering.state, self.verdict.state)

    def restore(self, state: MeasuresState) -> None:
        """Continue from a state."""
        self.recorder.restore(state.recorder)
        self.reservations.state, self.progress.state = state.reservations, state.progress
        self.steering.state, self.verdict.state = state.steering, state.verdict

    @property
    def cells(self) -> CellMap:
        """The cells of the floor as it is; for a robot of a kind, ``Roster.cells`` says how they are joined."""
        return self.reservations.cells

    def add_robot(self, start: Pose, time: float) -> None:
        """Measure one more robot from a time [s] on."""
        self.progress.add_robot(time)
        self.reservations.add_robot(start)
        self.steering.add_robot(start)
        self.recorder.add_robot(start)

    def set_floor(self, floor: OccupancyMap) -> None:
        """Measure on this floor from now on."""
        self.recorder.judge.set_floor(floor)
        self.reservations.cells = cells_of(floor, self._settings)

    def take_load(self, robot: int, request: RobotAction, time: float) -> None:
        """Record a robot's new load, by the roster, from a time [s] on."""
        self.recorder.judge.set_radii(self._roster.radii())
        self.recorder.request(robot, request)
        self.begin(robot, time)

    def begin(self, robot: int, time: float) -> None:
        """Judge a robot that was asked for something else from a time [s] on."""
        self.progress.begin(robot, time)
        self.verdict.clear()

    def check(
        self, tick: int, time: float, poses: Sequence[Pose], fresh: Mapping[str, Command], last: Sequence[Command]
    ) -> list[EventLine]:
        """Return what robots note with their ``fresh`` commands, and what the check of reservations finds."""
        said = []
        for name, command in sorted(fresh.items()):
            for kind, text in command.notes:
                if self.verdict.take(name, kind, text, time):
                    said.append(EventLine(kind, text, name))
        for fault in self.reservations.look(tick, poses, fresh, last):
            cells = ", ".join(map(str, fault.where))
            text = f"{fault.kind} of {' and '.join(fault.robots)} in cell {cells}"
            said.append(EventLine("traffic_fault", text, fault.robots[0]))
        return said

    def record(self, moved: Moved, in_force: Sequence[Command | None], last: Sequence[Command]) -> list[EventLine]:
        """Record a tick: how robots moved by the commands ``in_force``, and their ``last`` ones; return contacts."""
        said = []
        for contact in self.recorder.contacts(moved.contacts, moved.touching, moved.wheels, moved.poses):
            other = f" {self._robots[contact.other]}" if contact.other is not None else ""
            text = f"touches {contact.kind}{other}"
            said.append(EventLine("contact", text, self._robots[contact.robot], moved.where[contact]))
        self.steering.look(in_force, moved.poses)
        self.recorder.poses(moved.poses)
        self.recorder.record_activities(last)
        return said

    def record_stalls(self, time: float, moved: Moved, stops: Sequence[int | None]) -> list[int]:
        """Record who stands with a stop left; return the robots that begin to stall at a time [s]."""
        self.recorder.record_standing(stops, moved.wheels)
        return self.progress.look(time, moved.poses, stops)

    def is_jammed(self, time: float, commands: Sequence[Command]) -> bool:
        """Return True if the robots have proven that their jam has no solution, and the world believes it."""
        standing = dict(zip(self._robots, self.progress.standing(time), strict=True))
        waiting = [name for name, one in zip(self._robots, commands, strict=True) if one.activity in WAITING]
        return self.verdict.ends(time, standing, waiting)
