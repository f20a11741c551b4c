"""The messages of a run are told again from its tape, as the processes have sent them."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from swarm.blackbox.replay.replay import Replay
from swarm.blackbox.replay.wire import Wire
from swarm.bus import Arrival
from swarm.cli import main
from swarm.messages import EVENT, PLAN, STATE, STATUS, TRUTH, Event, Message, Phase, Plan, State, Status, Truth
from swarm.tape.reader import TapeFile
from tests.blackbox.replay.test_processes import HARD
from tests.launch.actors import SMALL, Fleet

HOSTS = frozenset({"joined", "gone", "back", "lost", "stale", "phase", "rival"})  # events of processes, not of the run


def told(tape: Path) -> list[Message]:
    replay = Replay(TapeFile(tape))
    wire, found = Wire(replay), list[Message]()
    while (tick := replay.step()) is not None:
        found += wire.take(tick)
    return [*found, *wire.end(Phase.OVER)]


def told_by_tape(status: Status) -> Status:
    """Return a status without what a tape does not have: the events of processes, and when they spoke last."""
    rows = [replace(row, since=0.0, event=None, state=replace(row.state, tick=0)) for row in status.robots]
    return replace(status, events=[], robots=rows)


@pytest.mark.long("a fleet, its listeners and its replay")
@pytest.mark.processes
@pytest.mark.parametrize("scenario", [SMALL, HARD], ids=["plain", "noise and loss"])
def test_a_tape_tells_what_listeners_have_heard(scenario: str, tmp_runtime: Path) -> None:
    file, tape = tmp_runtime / "case.yaml", tmp_runtime / "run.swarm"
    file.write_text(scenario)
    heard: list[Message] = []
    options = ("--pace", "max", "--record", str(tape), "--dashboard", "off")
    with Fleet(file, "--wait", *options, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        for topic in (TRUTH, STATE, PLAN, EVENT, STATUS):
            bus.listen(topic)
        fleet.await_all(bus)
        assert main(["go"]) == 0
        while not (heard and isinstance(heard[-1], Status) and heard[-1].phase is Phase.OVER):
            if isinstance(arrived := bus.receive(1.0), Arrival):
                heard.append(arrived.message)
        fleet.end()
    again = told(tape)
    for kind, least in ((Truth, 50), (State, 20), (Plan, 3), (Event, 3)):
        ours = [one for one in again if isinstance(one, kind)]
        theirs = [one for one in heard if isinstance(one, kind) and not (isinstance(one, Event) and one.kind in HOSTS)]
        assert len(theirs) >= least
        assert [one for one in theirs if one not in ours] == []
    last = [[one for one in messages if isinstance(one, Status)][-1] for messages in (again, heard)]
    assert told_by_tape(last[0]) == told_by_tape(last[1])
