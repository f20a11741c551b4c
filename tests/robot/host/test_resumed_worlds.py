"""A world in real time is killed again and again, and goes on from its snapshot: its robots answer late, and remember.

Answers that came late in the first life of a tick come at once in its second, so the bodies go other ways.
"""

import pickle
from collections import deque
from collections.abc import Mapping
from random import Random
from typing import Any, Final
from unittest.mock import Mock

import pytest

from swarm.messages import Broadcast, Sense
from swarm.robot.driving.lateness import LateLimiter
from swarm.robot.host.radio import Receiver
from swarm.robot.host.seat import GivenAnswer, Seat
from swarm.scenario.load import Scenario
from tests.launch.actors import SMALL
from tests.shared import mostly_long, scenario_of
from world.host.last_messages import LastMessages, Sent
from world.simulate import Simulation
from world.world import World, WorldState

ROBOTS: Final = 3
KEPT: Final = 100  # ticks
SAVED: Final = 20  # ticks between two snapshots
LIVES: Final = (40, 120)  # ticks, fewest and most, between two kills
LIMIT: Final = 120.0  # s
TOUCHED: Final = 1  # the seed in which a robot touches that does not look where it is before it repeats an answer


def small() -> Scenario:
    """Return the floor of the fleets under test."""
    text = SMALL.split("text: |\n")[1].split("start:")[0].replace("    ", "")
    poses = [[2.5, 2.0, 0.0], [2.5, 4.0, 0.0], [2.5, 6.0, 0.0]]
    return scenario_of(text, start={"poses": poses}, targets=[[9.5, 2.0], [9.5, 6.0]])


class Hall:
    """A world and the seats of its robots, without a bus."""

    def __init__(self, seed: int) -> None:
        self.chance = Random(f"resumed {seed}")
        self.run = Simulation.of(small(), ROBOTS, seed)
        self.world = self.run.world
        self.spoken: Mapping[Sent, Broadcast] = {}
        self.seats = {robot.name: Seat(robot, self.receiver(), KEPT, print) for robot in self.run.robots}
        self.saved = 0, pickle.dumps(self.world.save())
        self.killed_at = self.chance.randint(*LIVES)
        self.late = self.chance.choice((0.05, 0.15, 0.3)), self.chance.choice((6, 12, 20))  # share, ticks at most
        self.begin()

    def receiver(self) -> Receiver:
        """Return a receiver that hears what the world lists and was sent."""
        receiver = Mock(spec=Receiver)
        receiver.what_came.side_effect = lambda hears, tick: [self.spoken[one] for one in hears if one in self.spoken]
        receiver.tune.return_value = (0, 0)
        return receiver

    def begin(self) -> None:
        """Forget what was under way: it was sent to the world that was killed."""
        self.last = LastMessages()
        self.under_way: dict[str, deque[tuple[int, GivenAnswer]]] = {name: deque() for name in self.seats}
        self.spoken = {}

    def answer(self, name: str, sense: Sense) -> None:
        """Let a robot answer a sense: late the first time, at once if it has answered before."""
        seat, delay = self.seats[name], 0
        given = seat.repeat(sense)
        if given is None:
            seat.take(sense)
            if seat.sense is None:
                return
            given = seat.answer(list)
            often, most = self.late
            delay = self.chance.randint(3, most) if self.chance.random() < often else self.chance.randint(0, 2)
        queue = self.under_way[name]
        queue.append((max([self.world.tick + delay, *(due for due, _ in queue)]), given))

    def step(self) -> None:
        """Run one tick, or kill the world and go on from the last snapshot."""
        world = self.world
        if world.tick >= self.saved[0] + SAVED:
            self.saved = world.tick, pickle.dumps(world.save())
        for name, sense in world.senses(lockstep=False).items():
            self.answer(name, sense)
        self.spoken = {}
        for name, queue in self.under_way.items():
            while queue and queue[0][0] <= world.tick:
                outputs = queue.popleft()[1].outputs
                self.last.take(name, outputs.command, world.run, world.tick)
                if outputs.broadcast is not None:
                    self.spoken[name, outputs.command.tick] = outputs.broadcast
        world.step(self.last.commands, self.last.sent)
        self.last.forget_commands()
        if world.tick >= self.killed_at:
            self.killed_at = world.tick + self.chance.randint(*LIVES)
            state: WorldState = pickle.loads(self.saved[1])
            self.world = World(self.run.scenario, world.starts, self.run.seed)
            self.world.restore(state)
            self.begin()

    def contacts(self) -> Mapping[str, int]:
        """Run until all robots are home or the time is over; return the contacts by what was touched."""
        while not self.world.is_finished and self.world.time < LIMIT:
            self.step()
        self.run.world = self.world
        report: dict[str, Any] = self.run.report(0.0, LIMIT)
        contacts: Mapping[str, int] = report["contacts"]
        return contacts


NONE: Final = {"robot": 0, "wall": 0, "obstacle": 0}


@pytest.mark.parametrize("seed", mostly_long("a whole mission with thirty kills", range(3), 0))
def test_nobody_touches_when_a_world_in_real_time_goes_on_from_before(seed: int) -> None:
    assert Hall(seed).contacts() == NONE


@pytest.mark.long("a whole mission with thirty kills")
@pytest.mark.parametrize("looks", [True, False])
def test_whoever_gives_its_old_answers_somewhere_else_touches(looks: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The limits of late commands would hide it: they keep a robot in its cells whatever is under way."""
    monkeypatch.setattr(LateLimiter, "limit", lambda limiter, speeds, *state: speeds)
    if not looks:
        monkeypatch.setattr(GivenAnswer, "fits", lambda given, sense: True)
    assert (Hall(TOUCHED).contacts() == NONE) is looks
