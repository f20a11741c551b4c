"""A tape that is made without processes: two robots answer every sense at once."""

from collections.abc import Container
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import msgspec

from swarm.blackbox.replay.replay_radio import Ear
from swarm.bus import Bus
from swarm.fingerprint import OF_ROBOTS, fingerprint
from swarm.fuzzy import Controller
from swarm.geometry import Pose
from swarm.messages import JOIN, Broadcast, Join, Phase
from swarm.robot.brain import Robot
from swarm.robot.host.seat import Seat
from swarm.scenario.starts import number_of
from swarm.tape.reader import TapeFile
from swarm.tape.rows import first_row
from tests.shared import scenario_of
from tests.world.shared import ask
from world.host.run import Run
from world.host.tape_feed import put_message_on_tape


def made(
    path: Path,
    *,
    ticks: int,
    lost: Container[tuple[str, int]] = (),
    told: bool = True,
    **head: Any,  # noqa: ANN401
) -> Path:
    """Write the tape of a run of some ticks; ``head`` replaces fields of its head.

    The answers ``lost``, of robots to ticks, do not reach the world; with ``told`` the robot says so in its next one.
    """
    one = Run(Mock(spec=Bus), scenario_of(), 2, 1, 1.0, 300.0, False, 0, None, lambda line: None, tape=path)
    world, controller = one.world, Controller(one.scenario.profile)
    seats, said = dict[str, Seat](), dict[tuple[str, int], Broadcast]()
    for name, start in zip(world.robots, world.starts, strict=True):
        ask(one, JOIN, Join(robot=name, session=name, world=None, code=fingerprint(libraries=OF_ROBOTS)))
        robot = Robot(name, number_of(name), one.scenario, Pose(*start), None, controller)
        seats[name] = Seat(robot, Ear(), 100, lambda line: None, world.identity)
    one.go_to(Phase.RUNNING)
    for _ in range(ticks):
        for name, sense in one.senses().items():
            seat = seats[name]
            assert isinstance(seat.receiver, Ear)
            seat.receiver.heard = [said[pair] for pair in sense.hears]
            seat.take(sense)
            outputs = seat.answer(list).outputs
            if (name, sense.tick) in lost:
                if told:
                    seat.doubt_last_answers()
                continue
            if outputs.broadcast is not None:
                said[name, sense.tick] = outputs.broadcast
            put_message_on_tape(one, name, outputs.command)
        one.step()
    one.tape.close()
    if head:
        whole = path.read_bytes()
        good = TapeFile(path)
        path.write_bytes(first_row(msgspec.structs.replace(good.head, **head)) + whole[good.size :])
    return path
