"""Driving by the simple rule: along the own path, standing while somebody goes first."""

from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Activity
from swarm.robot.fuzzy import Controller
from swarm.robot.pilot import Move, Situation, fuzzy_speeds
from swarm.robot.supervisor import Supervisor
from swarm.robot.surprise import Surprise
from swarm.scenario.schema import Settings
from swarm.traffic import give_way


class GiveWayPilot:
    """Follows a waypoint ahead; gives way by ``swarm.traffic.give_way``."""

    def __init__(self, name: str, settings: Settings, controller: Controller) -> None:
        self._name = name
        self._settings = settings
        self._controller = controller
        self._supervisor = Supervisor(settings)
        self._surprise = Surprise(settings)
        self._gives_way = False

    def drive(self, situation: Situation) -> Move:
        """Decide for one tick."""
        sense, navigator = situation.sense, situation.navigator
        others = [(other.x, other.y) for other in situation.others.values()]
        halt = self._surprise.watch(sense, navigator.grid, others)
        if situation.done:
            return Move(self._supervisor.stop(), 0.0, Activity.DONE)
        ahead = navigator.ahead(give_way.HORIZON, give_way.STEP)
        verdict = give_way.decide(
            give_way.Rank(-situation.rank, navigator.remaining, self._name),
            ahead,
            situation.others.values(),
            self._settings.robot.radius,
            waiting=self._gives_way,
        )
        around = (*verdict.standing, *self._surprise.obstacles)
        heading = navigator.heading_error(situation.pose, sense.bearings[situation.target], situation.goal)
        self._gives_way = bool(verdict.yield_to)
        if self._gives_way:
            return Move(self._supervisor.stop(), heading, Activity.GIVE_WAY, around, ahead, waits=verdict.yield_to)
        left, right = fuzzy_speeds(self._controller, self._settings.robot, sense, heading)
        bodies = (*others, *self._surprise.obstacles)
        speeds = self._supervisor.check(sense, navigator.grid, bodies, halt, left, right)
        return Move(speeds, heading, Activity.DRIVE, around, ahead)

    def take_floor(self, floor: OccupancyMap) -> None:
        """Take another floor: this rule knows none."""

    def can_reach(self, here: Point, goal: Point) -> bool:
        """Tell whether a path that the map has can be driven: any can."""
        return True
