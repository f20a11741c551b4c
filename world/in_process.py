"""A world and its robots in one process: what a simulation with a drawn timetable and a replay of a tape share."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from swarm.geometry import Pose
from swarm.messages import Broadcast, Command, Event
from swarm.robot.brain import Robot
from swarm.scenario.load import Scenario
from swarm.scenario.starts import number_of
from world.host.last_messages import LastMessages, Sent
from world.views.progress import progress
from world.world import World


@dataclass(kw_only=True)
class InProcess:
    """The world, what it was told in this tick, and the broadcasts that its robots can have heard."""

    world: World
    scenario: Scenario  # with the floor that it began with
    last: LastMessages = field(default_factory=LastMessages)
    broadcasts: dict[Sent, Broadcast] = field(default_factory=dict)  # of this run, those that may still be heard

    def scenario_on_floor(self) -> Scenario:
        """Return the scenario with the floor as it is."""
        return replace(self.scenario, map=self.world.bodies.floor)

    def scenario_of(self, name: str) -> Scenario:
        """Return the scenario as it is for a robot, with the floor as it is."""
        return self.world.roster.scenario_on(self.world.bodies.floor, self.world.number(name))

    def new_robot(self, name: str) -> Robot:
        """Return a robot whose process begins on the floor as it is, without any memory."""
        world, number = self.world, self.world.number(name)
        return Robot(
            name, number_of(name), self.scenario_of(name), Pose(*world.starts[number]), None,
            world.roster.controller(number), edits=world.bodies.edits,
        )  # fmt: skip

    def welcome_robot(self, name: str) -> Robot:
        """Return a robot whose process joins the run now, with the world's record of its progress."""
        robot, world = self.new_robot(name), self.world
        if world.tick:
            robot.resume(progress(name, world), world.tasks.missions.orders.assigned_stops(world.number(name)))
        return robot

    def find_broadcasts(self, pairs: Iterable[Sent]) -> list[Broadcast]:
        """Return the broadcasts of pairs of a robot and a tick."""
        return [self.broadcasts[pair] for pair in pairs]

    def deliver(self, name: str, command: Command, broadcast: Broadcast | None) -> bool:
        """Bring an answer to the world; return False if that ignores it."""
        if broadcast is not None:
            self.broadcasts[name, command.tick] = broadcast
        return self.last.take(name, command, self.world.run, self.world.tick)

    def move(self) -> list[Event]:
        """Run a tick of the world by the answers that have come; return its events."""
        self.world.bodies.external.told = self.last.bodies
        events = self.world.step(self.last.commands, self.last.sent)
        self.last.forget_commands()
        return events

    def forget(self, before: int) -> None:
        """Drop the broadcasts from before a tick."""
        self.broadcasts = {pair: one for pair, one in self.broadcasts.items() if pair[1] >= before}
