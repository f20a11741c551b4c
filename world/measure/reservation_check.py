"""The world's own check of traffic: reservations must not overlap, and bodies must stay inside their own."""

from collections.abc import Mapping, Sequence

from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.messages import Activity, Command
from swarm.settings import Settings
from swarm.traffic.lattice.placement import cells_of
from swarm.traffic.peers.records import TrafficNote
from world.measure.cell_watch import Watch, Watched
from world.measure.state import Fault, TrafficState
from world.measure.steering import IDLE


class TrafficWatch:
    """The input of `Watch`, which uses no planner: true poses and the cells that robots declare."""

    def __init__(self, floor: OccupancyMap, settings: Settings, robots: Sequence[str]) -> None:
        self._robots = robots
        self._poses: Sequence[Pose] = ()
        self.watch = Watch(cells_of(floor, settings), settings.robot.radius, 1.0 / settings.rate)

    def add_robot(self, start: Pose) -> None:
        """Judge one more robot from now on; its name is in the list of robots already."""
        self._poses = [*self._poses, start] if self._poses else ()

    @property
    def state(self) -> TrafficState:
        """The state, which shares its values with this object."""
        return TrafficState(poses=self._poses, watch=self.watch.state)

    def restore(self, state: TrafficState) -> None:
        """Continue from a state."""
        self._poses, self.watch.state = state.poses, state.watch

    def set_floor(self, floor: OccupancyMap, settings: Settings) -> None:
        """Judge against the cells of this floor from now on."""
        self.watch.cells = cells_of(floor, settings)

    def look(
        self, tick: int, poses: Sequence[Pose], fresh: Mapping[str, Command], last: Sequence[Command]
    ) -> list[Fault]:
        """Return the faults of a tick, judged from all poses, the ``fresh`` commands and each robot's last command."""
        before = self._poses or poses
        self._poses = poses
        robots, events = {}, []
        for number, name in enumerate(self._robots):
            command = last[number]
            if not command.held and command.activity is Activity.READY:
                continue  # the robot has not sent a command yet
            wants = command.activity not in IDLE
            moved = poses[number] != before[number]
            robots[name] = Watched(poses[number], command.held, wants, moved, command.waits, not command.held)
            if name in fresh:
                events += [TrafficNote(kind, (name,), text) for kind, text in command.notes]
        return self.watch.look(tick, robots, events)
