"""Makes the tape of a run in one process, in which robots are late, away or deaf as a test says."""

from collections.abc import Collection, Mapping
from pathlib import Path
from unittest.mock import Mock

from swarm.blackbox.replay.replay_radio import Ear
from swarm.bus import Bus
from swarm.fingerprint import OF_ROBOTS, fingerprint
from swarm.messages import ACTION, JOIN, Broadcast, Join, Phase, RobotAction, RobotDo
from swarm.robot.host.seat import GivenAnswer, Seat
from swarm.scenario.load import Scenario
from tests.world.shared import ask
from world.host.run import Run
from world.host.tape_feed import put_broadcast_on_tape, put_message_on_tape
from world.in_process import InProcess

NOTHING: Mapping[str, int] = {}


class Recorded:
    """A run in real time, without processes, and its tape."""

    def __init__(self, path: Path, scenario: Scenario, robots: int, *, seed: int = 1) -> None:
        self.path = path
        self._run = Run(
            Mock(spec=Bus), scenario, robots, seed, 1.0, 300.0, False, 0, None, lambda line: None, tape=path
        )
        self._maker = InProcess(world=self._run.world, scenario=self._run.scenario)
        self._seats: dict[str, Seat] = {}
        self._broadcasts: dict[tuple[str, int], Broadcast] = {}
        self._under_way: list[tuple[int, str, GivenAnswer]] = []  # with the tick in which it comes
        for name in self._run.world.robots:
            self.join(name)
        self._run.go_to(Phase.RUNNING)

    def join(self, name: str, *, ours: bool = True) -> None:
        """Put a process without memory in a robot's place."""
        code = fingerprint(libraries=OF_ROBOTS) if ours else "another"
        ask(self._run, JOIN, Join(robot=name, session=f"{name} {len(self._broadcasts)}", world=None, code=code))
        self._seats[name] = Seat(
            self._maker.welcome_robot(name), Ear(), 100, lambda line: None, self._run.world.identity
        )

    def stop(self, name: str) -> None:
        """Tell a robot to stop."""
        ask(self._run, ACTION, RobotAction(do=RobotDo.STOP), robot=name)

    def restart(self) -> None:
        """Begin a new run with the same processes."""
        self._run.restart()
        self._maker.world, self._broadcasts, self._under_way = self._run.world, {}, []

    def run(
        self,
        ticks: int,
        *,
        away: Collection[str] = (),
        late: Mapping[str, int] = NOTHING,
        unheard: Collection[tuple[str, str]] = (),
    ) -> "Recorded":
        """Run some ticks in which some do not answer, or late by ticks; ``unheard``: listeners and speakers."""
        for _ in range(ticks):
            now = self._run.world.tick
            for name, sense in self._run.senses().items():
                if name in away:
                    continue
                seat = self._seats[name]
                seat.take(sense)
                ear = seat.receiver
                assert isinstance(ear, Ear)
                ear.heard = [self._broadcasts[pair] for pair in sense.hears if (name, pair[0]) not in unheard]
                self._under_way.append((now + late.get(name, 0), name, seat.answer(list)))
            for due, name, given in self._under_way:
                if due <= now:
                    command, words = given.outputs.command, given.outputs.broadcast
                    if words is not None:
                        self._broadcasts[name, command.tick] = words
                        put_broadcast_on_tape(self._run, words)
                    put_message_on_tape(self._run, name, command)
            self._under_way = [one for one in self._under_way if one[0] > now]
            self._run.step()
        return self

    def done(self) -> Path:
        """End the tape; return its file."""
        self._run.tape.close()
        return self.path
