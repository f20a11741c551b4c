"""A run that is run again up to a tick, with all inner state: what may be asked about that tick."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping

from swarm.blackbox.explain.clauses import Cause
from swarm.blackbox.explain.run_history import Next, RecentPast, TakenAnswer
from swarm.blackbox.explain.state import RobotState, state_of
from swarm.blackbox.explain.why import explain
from swarm.errors import ConfigError
from swarm.maps.occupancy import Point
from swarm.robot.brain import Robot
from swarm.scenario.load import Scenario
from swarm.traffic.lattice.placement import traffic_settings
from world.faults import SILENT
from world.simulate import Simulation
from world.world import World


class Instant(ABC):
    """The end of one tick: robots and world as they are then, and all that was said before."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self._traffic = traffic_settings(scenario.settings)
        self.past = self._no_past()

    def _no_past(self) -> RecentPast:
        """Return the past of a run that has not begun."""
        return RecentPast(self.scenario.settings.radio, self.scenario.settings.rate, self._sees)

    def _sees(self, here: Point, there: Point) -> bool:
        return self.world.bodies.physics.sees(here, there)

    @property
    @abstractmethod
    def world(self) -> World:
        """The world as it is then."""

    @property
    @abstractmethod
    def robots(self) -> Mapping[str, Robot]:
        """The robots by name whose inner state is known, in the order of their numbers."""

    @property
    def doubt(self) -> str | None:
        """What is wrong with this moment, in a sentence; None: it is as it was."""
        return None

    @property
    def outside(self) -> list[str]:
        """The robots whose body is outside the world."""
        return []

    @abstractmethod
    def step(self) -> bool:
        """Go on by one tick; return False if the run is over."""

    @abstractmethod
    def is_away(self, robot: str, tick: int) -> bool:
        """Return True if a robot that is asked at a tick to come does not answer, by what happened to it."""

    def next_of(self, robot: str) -> Next | None:
        """Return what is known of a robot's next answer; None: nothing."""
        return None

    def check(self, robot: str) -> None:
        """Check that there is such a robot.

        Raises:
            ConfigError: there is none.
        """
        if robot not in (names := self.world.robots):
            text = f"expected one of {', '.join(names)}, got {robot!r}; this run has no other then"
            raise ConfigError(f"robot: {text}")

    def why(self, robot: str) -> list[Cause]:
        """Return the chain of causes of what a robot does.

        Raises:
            KeyError: there is no such robot.
        """
        return explain(robot, self.robots, self.past, self._traffic, self.next_of)

    def state(self, robot: str) -> RobotState:
        """Return the whole state of a robot.

        Raises:
            KeyError: there is no such robot.
        """
        roster, number = self.world.roster, self.world.number(robot)
        return state_of(robot, self.robots.get(robot), self.past, roster.settings(number), roster.controller(number))


class Simulated(Instant):
    """A moment of a simulation."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        super().__init__(simulation.scenario)

    @property
    def world(self) -> World:
        """The world as it is then."""
        return self._simulation.world

    @property
    def robots(self) -> Mapping[str, Robot]:
        """The robots by name."""
        return {robot.name: robot for robot in self._simulation.robots}

    def is_away(self, robot: str, tick: int) -> bool:
        """Return True if a robot that is asked at a tick to come does not answer."""
        drill = self._simulation.drill
        return drill.health(robot, tick * self.world.dt, leads=False) in SILENT

    def step(self) -> bool:
        """Go on by one tick; return False if the run is over."""
        world = self.world
        if world.is_finished or world.time >= self.scenario.settings.limit:
            return False
        now, done = world.tick, self._simulation.step()
        answers = [
            TakenAnswer(name, command, done.senses[name].hears, done.spoken.get(name))
            for name, command in done.commands.items()
        ]
        self.past.take(now, done.senses, answers)
        return True


def run_moment_until(moment: Instant, tick: int, each: Callable[[Instant], None] = lambda moment: None) -> Instant:
    """Run a moment on through a tick, or to the end of the run; ``each`` is called after every tick. Return it."""
    while moment.past.tick < tick and moment.step():
        each(moment)
    return moment
