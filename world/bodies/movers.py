"""Moving obstacles: the pose of each at a time. They sense nothing and stop for nobody."""

from itertools import accumulate, pairwise
from math import atan2

from swarm.geometry import Pose, distance
from swarm.settings import MoverSettings


class Patrol:
    """A path from waypoint to waypoint at constant speed, in a loop or back and forth."""

    def __init__(self, settings: MoverSettings) -> None:
        points = list(settings.waypoints)
        points += [points[0]] if settings.loop else points[-2::-1]
        self._points = points
        self._stations = list(accumulate((distance(a, b) for a, b in pairwise(points)), initial=0.0))
        self._speed = settings.speed

    @property
    def period(self) -> float:
        """Return how long [s] it takes to come round."""
        return self._stations[-1] / self._speed

    def pose_at(self, time: float) -> Pose:
        """Return the pose at a time [s] since the run began; the yaw is the direction of the path."""
        along = self._speed * time % self._stations[-1]
        leg = max(k for k in range(len(self._points) - 1) if self._stations[k] <= along)
        (ax, ay), (bx, by) = self._points[leg], self._points[leg + 1]
        share = (along - self._stations[leg]) / (self._stations[leg + 1] - self._stations[leg])
        return Pose(ax + share * (bx - ax), ay + share * (by - ay), atan2(by - ay, bx - ax))
