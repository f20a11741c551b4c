"""A tape that is made without processes: two robots answer every sense at once."""

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import msgspec

from swarm.bus import Bus
from swarm.fingerprint import fingerprint
from swarm.messages import JOIN, Join, Phase
from tests.shared import scenario_of
from tests.world.shared import ask
from world.host.run import Run
from world.host.taping import take
from world.simulate import Simulation
from world.tape.reader import TapeFile
from world.tape.rows import sealed


def made(path: Path, *, ticks: int, **head: Any) -> Path:  # noqa: ANN401
    """Write the tape of a run of some ticks; ``head`` replaces fields of its head."""
    simulation = Simulation.of(scenario_of(), 2, 1)
    one = Run(Mock(spec=Bus), scenario_of(), 2, 1, 1.0, 300.0, False, 0, None, lambda line: None, tape=path)
    for name in one.world.robots:
        ask(one, JOIN, Join(robot=name, session=name, world=None, code=fingerprint()))
    one.go_to(Phase.RUNNING)
    for _ in range(ticks):
        one.senses()
        for name, command in simulation.step().commands.items():
            take(one, name, command)
        one.step()
    one.tape.close()
    if head:
        whole = path.read_bytes()
        good = TapeFile(path)
        path.write_bytes(sealed(msgspec.structs.replace(good.head, **head)) + whole[good.size :])
    return path
