"""The robot of ``examples/foreign_robot.py`` in place of one of a simulation's own; all it says and hears is packed."""

import importlib.util
from types import ModuleType
from typing import Any, Final

import msgpack

from swarm.bus.codec import decode, encode
from swarm.messages import Broadcast, Command, Message, Sense, State, Welcome
from swarm.robot.brain import Inputs
from swarm.robot.outputs import Outputs
from swarm.scenario.load import Scenario
from tests.shared import ROOT
from world.simulate import Simulation

FILE: Final = ROOT / "examples" / "foreign_robot.py"
LARGE: Final = 10_000_000  # bytes


def module() -> ModuleType:
    """Return the example as a module."""
    spec = importlib.util.spec_from_file_location("foreign_robot", FILE)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def plain(message: Message) -> Any:  # noqa: ANN401
    """Return a message as it is unpacked from the wire."""
    return msgpack.unpackb(encode(message))


class ForeignRobot:
    """The example's brain, with the ``step`` of a robot of this project."""

    def __init__(self, welcome: Welcome) -> None:
        self.brain = module().Brain(plain(welcome))

    def has_missed_edits(self, sense: Sense) -> bool:
        """Return False: the scenarios have no edits."""
        return False

    def step(self, inputs: Inputs) -> Outputs:
        """Return its answer, checked as the bus does."""
        command, broadcast, state = self.brain.step(plain(inputs.sense), [plain(one) for one in inputs.heard])
        return Outputs(
            decode(msgpack.packb(command), Command, LARGE),
            None if broadcast is None else decode(msgpack.packb(broadcast), Broadcast, LARGE),
            decode(msgpack.packb(state), State, LARGE),
            None,
        )


def with_foreign(scenario: Scenario, robots: int, seed: int, number: int) -> Simulation:
    """Return a simulation in which robot ``number`` is the foreign one."""
    run = Simulation.of(scenario, robots, seed)
    settings, packed = run.scenario.to_wire()
    run.robots[number] = ForeignRobot(  # type: ignore[call-overload]
        Welcome(
            robot=run.world.robots[number],
            world="local",
            session="local",
            scenario=settings,
            packed=packed,
            edits=0,
            start=run.world.starts[number],
            state=None,
        )
    )
    return run
