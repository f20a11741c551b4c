"""What the sensors show that neither the map nor the radio explains: stop for it; if it stays, go around it."""

from collections.abc import Sequence
from typing import Final

from swarm.geometry import Pose, bearing, distance, from_frame, wrap
from swarm.maps.occupancy import Point
from swarm.messages import Sense
from swarm.planning.grid import Grid
from swarm.planning.rays import nearest_on_map
from swarm.robot.sectors import Angles, half_width, sectors
from swarm.scenario.schema import Settings

NEAR: Final = 0.8  # m, from the edge: nearer than that an unexplained thing ahead stops the robot,
BESIDE: Final = 0.3  # m, and one at a side
UNEXPLAINED: Final = 0.15  # m, so much nearer than the map alone would read
BODY: Final = 0.35  # m and rad: so far off may a robot known by radio be, and still be what is seen
LASTING: Final = 0.1  # s that it has to be there: a single reading is no thing
CLOSE: Final = 0.12  # m, from the edge: what came so near is still near when the sensors have turned away from it,
LINGERS: Final = 0.5  # s for which that is believed
STAYS: Final = 2.0  # s, then it is taken for an obstacle
REMEMBERED: Final = 20.0  # s for which that obstacle is believed in


class Surprise:
    """Watches for unexpected obstacles, for one robot."""

    def __init__(self, settings: Settings) -> None:
        self._sectors = sectors(settings.sensors)
        self._range, self._radius = settings.sensors.range, settings.robot.radius
        self._since: list[float | None] = [None, None, None]
        self._obstacles: list[tuple[Point, float]] = []
        self._close_until = float("-inf")

    @property
    def obstacles(self) -> list[Point]:
        """Centres [m] of things that stayed, taken for as large as a robot."""
        return [place for place, _ in self._obstacles]

    def watch(self, sense: Sense, grid: Grid, others: Sequence[Point]) -> bool:
        """Take this tick's readings; True: something unexplained is near, do not drive on."""
        now = sense.time
        self._obstacles = [(place, until) for place, until in self._obstacles if until > now]
        pose = Pose(sense.x, sense.y, sense.yaw)
        halt = now < self._close_until
        for number, (angles, read) in enumerate(
            zip(self._sectors, (sense.left, sense.front, sense.right), strict=True)
        ):
            if read >= (NEAR if number == 1 else BESIDE) or self._explained(pose, angles, read, grid, others):
                self._since[number] = None
                continue
            began = self._since[number]
            since = now if began is None else began
            self._since[number] = since
            if now - since >= STAYS:
                self._since[number] = None
                middle = wrap(pose.yaw + angles[len(angles) // 2])
                place = from_frame(Pose(pose.x, pose.y, middle), read + 2 * self._radius, 0.0)
                self._obstacles.append((place, now + REMEMBERED))
            elif now - since >= LASTING:
                halt = True
                if read < CLOSE:
                    self._close_until = now + LINGERS
        return halt

    def _explained(self, pose: Pose, angles: Angles, read: float, grid: Grid, others: Sequence[Point]) -> bool:
        half = half_width(angles)
        middle = angles[len(angles) // 2]
        for body in (*others, *self.obstacles):
            if distance(pose, body) - 2 * self._radius <= read + BODY:
                off = abs(wrap(bearing(pose, body) - middle))
                if off <= half + BODY:
                    return True
        by_map = nearest_on_map(grid, pose, angles, self._radius + self._range) - self._radius
        return by_map - read <= UNEXPLAINED
