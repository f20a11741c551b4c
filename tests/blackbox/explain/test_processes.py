"""`why` on the tape of a fleet of processes: what happened to them is what it says."""

import os
import re
import signal
from pathlib import Path

import pytest

from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.tape_moment import Taped
from swarm.cli import main
from swarm.tape.reader import TapeFile
from tests.blackbox.replay.test_processes import HARD
from tests.launch.actors import Fleet, await_clock, await_tick


@pytest.mark.long("a whole mission")
@pytest.mark.processes
def test_stopped_and_killed_processes_are_told_from_one_another(
    tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, tape = tmp_runtime / "case.yaml", tmp_runtime / "run.swarm"
    file.write_text(HARD)
    with Fleet(file, "--limit", "8", "--record", str(tape), robots=3, runtime=tmp_runtime) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
            await_clock(bus, lambda clock: clock.tick >= 20)
            stopped = fleet.member("r2").pid
            os.kill(stopped, signal.SIGSTOP)
            await_tick(bus, 60)
            os.kill(stopped, signal.SIGCONT)
            fleet.member("r1").kill()
            await_clock(bus, lambda clock: clock.tick >= 120)
            assert main(["why", "r3"]) == 0, "of the fleet that runs, as far as it has come"
            first, second, *_ = capsys.readouterr().out.splitlines()
            assert re.fullmatch(r"r3 at [67]\.\d\d s:", first)
            assert second.startswith("r3 ")
        fleet.end()
    found = answers(tape)
    sleeps = {cause.robot for _, cause in found if "its process sleeps, and answers again at" in cause.text}
    ended = {cause.robot for _, cause in found if "its process has ended, and a new one answers at" in cause.text}
    assert "r2" in sleeps, "on a busy machine others sleep too"
    assert ended <= {"r1"}, "the new one may be there in the next tick"
    listens = {cause.robot for tick, cause in found if cause.clause is Clause.LISTENS and tick > 40}
    assert {"r1", "r2"} <= listens, "the one is new, the other has woken"
    assert not [cause for _, cause in found if cause.clause is Clause.UNKNOWN]


def answers(tape: Path) -> list[tuple[int, Cause]]:
    """Return all causes of all robots in every second tick."""
    taped, found = Taped(TapeFile(tape)), list[tuple[int, Cause]]()
    while taped.step():
        if taped.past.tick % 2 == 0:
            found += [(taped.past.tick, cause) for robot in taped.world.robots for cause in taped.why(robot)]
    assert taped.replay.difference is None
    return found
