"""A moment that goes on in memory, as nobody recorded it: with one thing changed, or with nothing."""

from collections.abc import Collection, Mapping

from msgspec.structs import replace

from swarm.blackbox.explain.moment import Instant
from swarm.messages import RobotAction, RobotDo
from swarm.robot.brain import Inputs
from world.in_process import InProcess


class Onward(InProcess):
    """Goes on from a moment, which changes with it. All that are there answer in time; nobody asks for anything.

    Who is away at the moment stays away until it came back on the tape.
    """

    def __init__(
        self,
        moment: Instant,
        *,
        stopped: Collection[str] = (),
        awake: Collection[str] = (),
        told: Mapping[str, str] | None = None,
        goes_on: Collection[str] = (),
    ) -> None:
        """Begin; ``stopped`` turn no wheel, ``awake`` are there, ``told`` have heard a robot's last broadcast.

        Those of ``goes_on`` are told to go on.
        """
        super().__init__(
            world=moment.world, scenario=moment.scenario, broadcasts=dict(moment.past.words),
        )  # fmt: skip
        self.robots = dict(moment.robots)
        self._moment, self._stopped, self._awake, self._told = moment, stopped, awake, dict(told or {})
        for name in goes_on:
            self.world.request(name, RobotAction(do=RobotDo.GO_ON))

    def step(self) -> None:
        """Run a tick."""
        world, past = self.world, self._moment.past
        for name, sense in world.senses(lockstep=True).items():
            if name not in self.robots or (name not in self._awake and self._moment.is_away(name, world.tick)):
                continue
            coming = self._moment.next_of(name)
            if coming is not None and coming.new and coming.came == world.tick and name not in self._awake:
                self.robots[name] = self.welcome_robot(name)
            robot = self.robots[name]
            if robot.has_missed_edits(sense):
                robot.take_map(self.scenario_of(name), world.bodies.edits)
            heard = self.find_broadcasts(pair for pair in sense.hears if pair in self.broadcasts)
            if (speaker := self._told.pop(name, None)) is not None:
                heard.append(past.said[speaker][-1])
            outputs = robot.step(Inputs(sense, heard))
            still = {"left": 0.0, "right": 0.0}
            command = replace(outputs.command, **still) if name in self._stopped else outputs.command
            self.deliver(name, command, outputs.broadcast)
        self.move()
