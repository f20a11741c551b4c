"""The run of a world without its process: its run, requests to it, and snapshots through a file."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final
from unittest.mock import Mock

import msgspec

from swarm.bus import Bus, Presence, Request
from swarm.messages import JOIN, Activity, Command, Event, Join, Liveness, Phase, Seen, Topic
from swarm.scenario.load import Scenario
from swarm.settings import Pace
from tests.shared import scenario_of
from world.host.request_answers import answer
from world.host.run import Run
from world.saving import snapshot_file
from world.saving.snapshot_file import HostState, Snapshot
from world.simulate import Simulation
from world.tasks.tasks import REST
from world.world import World

NOISE: Final[dict[str, Any]] = {"sensors": {"noise": 0.02, "bearing_noise_deg": 3.0}, "radio": {"loss": 0.3}}


def run_of(
    scenario: Scenario | None = None,
    *,
    bus: Bus | None = None,
    pace: Pace = "max",
    limit: float = 300.0,
    wait: bool = False,
    file: Path | None = None,
    log: Callable[[str], None] = lambda line: None,
    given_up: Path | None = None,
) -> Run:
    """Return the run of a world of two robots."""
    on, of = bus or Mock(spec=Bus), scenario or scenario_of()
    return Run(on, of, 2, 1, pace, limit, wait, 0, file, log, given_up=given_up)


def request_of(topic: Topic[Any], message: Any, **ids: str) -> Mock:  # noqa: ANN401
    """Return a request that notes its answer."""
    return Mock(spec=Request, topic=topic, message=message, ids=ids)


def ask(one: Run, topic: Topic[Any], message: Any, **ids: str) -> Any:  # noqa: ANN401
    """Let a run answer a request; return the answer, or the text of the refusal."""
    request = request_of(topic, message, **ids)
    answer(request, one, Mock(spec=Bus, id="the world", sender=7))
    return request.accept.call_args.args[0] if request.accept.called else request.refuse.call_args.args[0]


def come(one: Run, name: str, session: str, world: str | None = None) -> Any:  # noqa: ANN401
    """Let a robot join; return the answer."""
    reply = ask(one, JOIN, Join(robot=name, session=session, world=world))
    one.membership.take(Presence("robot", name, session, alive=True), 0.0)
    return reply


def absent(one: Run, seconds: float) -> None:
    """Let some time pass in which the robots that are absent are missed."""
    one.membership.look(0.0, running=False)
    one.membership.look(seconds, running=True)


def command(left: float = 0.0, right: float = 0.0, **fields: Any) -> Command:  # noqa: ANN401
    """Return the command of a robot with rim speeds [m/s]; it drives unless the fields say something else."""
    return msgspec.structs.replace(REST, **({"left": left, "right": right, "activity": Activity.DRIVE} | fields))


def step(one: Run, **fields: dict[str, Any]) -> None:
    """Run one tick; the fields are those of the commands of some robots."""
    for name, said in fields.items():
        command: Command = msgspec.structs.replace(REST, run=one.world.run, tick=one.world.tick, **said)
        one.last.take(name, command, one.world.run, one.world.tick)
    one.step()


def host_state(phase: Phase = Phase.RUNNING) -> HostState:
    """Return what a process would save beside the state of its world."""
    return HostState(
        phase=phase, held=False, reason="", lost=[], wall_time=1.5, present=["r1"], most_in_one=1, late=2, states={}, plans={},
        tick_bins=[0, 1], tick_longest=0.25, not_reproducible=["why"], pressed={"a": "b"},
        events=[Event(run=0, tick=1, time=0.05, robot=None, kind="edit", text="wall")],
        seen={"r1": Seen(Liveness.LOST, 0.05)}, left={"r1"}, tape=7,
    )  # fmt: skip


def snapshot_of(world: World, scenario: Scenario, seed: int) -> Snapshot:
    """Return a snapshot of a world."""
    return Snapshot(
        scenario=snapshot_file.fingerprint(scenario), robots=len(world.robots) - len(world.tasks.places.starts),
        places=world.tasks.places, seed=seed, identity="abc",
        run=world.run, floor=None, state=world.save(), host=host_state(),
    )  # fmt: skip


def through_file(world: World, scenario: Scenario, seed: int, file: Path) -> World:
    """Return a new world from a snapshot of this one, through a file."""
    snapshot_file.write(snapshot_of(world, scenario, seed), file)
    first = len(world.robots) - len(world.tasks.places.starts)
    found = snapshot_file.read(file, scenario, first, seed)
    floor, starts = replace(scenario, map=world.bodies.floor), world.starts[:first]
    new = World(floor, starts, seed, run=found.run, edits=world.bodies.edits, places=found.places)
    new.restore(found.state)
    return new


def reborn(simulation: Simulation, file: Path) -> World:
    """Return a new world from a snapshot of the simulation's, through a file."""
    return through_file(simulation.world, simulation.scenario, simulation.seed, file)
