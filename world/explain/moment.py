"""A run that is run again up to a tick, with all inner state: what may be asked about that tick."""

from collections.abc import Callable, Mapping

from swarm.robot.brain import Robot
from swarm.traffic.lattice.placement import traffic_settings
from world.explain.clauses import Cause
from world.explain.past import Past
from world.explain.state import RobotState, state_of
from world.explain.why import explain
from world.simulate import Simulation


class Moment:
    """The end of one tick: robots and world as they are then, and all that was said before."""

    def __init__(self, simulation: Simulation, past: Past) -> None:
        self.past = past
        self._simulation = simulation
        self._settings = traffic_settings(simulation.scenario.settings)

    @property
    def robots(self) -> Mapping[str, Robot]:
        """The robots by name, in the order of their numbers."""
        return {robot.name: robot for robot in self._simulation.robots}

    def why(self, robot: str) -> list[Cause]:
        """Return the chain of causes of what a robot does.

        Raises:
            KeyError: there is no such robot.
        """
        return explain(robot, self.robots, self.past, self._settings)

    def state(self, robot: str) -> RobotState:
        """Return the whole state of a robot.

        Raises:
            KeyError: there is no such robot.
        """
        scenario, controller = self._simulation.scenario, self._simulation.controller
        return state_of(robot, self.robots[robot], self.past, scenario.settings, controller)


def run_until(simulation: Simulation, tick: int, each: Callable[[Moment], None] = lambda moment: None) -> Moment:
    """Run a simulation that has not begun through a tick, or to its end; ``each`` is called after every tick."""
    world, settings = simulation.world, simulation.scenario.settings
    past = Past(settings.radio, settings.rate)
    moment = Moment(simulation, past)
    while past.tick < tick and not world.finished and world.time < settings.limit:
        now, done = world.tick, simulation.step()
        heard = {name: done.senses[name].hears for name in done.commands}
        past.take(now, done.senses, done.commands, done.spoken, heard)
        each(moment)
    return moment
