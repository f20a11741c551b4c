"""Why robots wait: ``python -m benchmarks.why [--seconds 60] [--waits 30]``.

Every robot of six scenarios is asked in every second. A thin answer names no cause; a false one names a holder that
neither holds nor claims the cell, and does not say that it has left it. The bars are 1 % of the answers of robots that
wait, and none. Then waits are drawn, and what their answers name is changed: a root is stopped, a lost broadcast
delivered. The same is done with a robot that moves and that the answer does not name.
"""

import argparse
from dataclasses import replace
from functools import partial
from random import Random
from typing import Final, NamedTuple

from msgspec.structs import replace as changed

from benchmarks.measure import load, machine, printed
from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.moment import Instant, Simulated, run_moment_until
from swarm.blackbox.explain.prove import prove
from swarm.scenario.load import load as loaded
from swarm.scenario.shipped_scenarios import file_of
from world.simulate import Simulation

THIN: Final = 1.0  # % of the answers of robots that wait
APART: Final = 100  # ticks between two waits of one robot that are drawn
NEWS: Final = frozenset({Clause.LOST, Clause.FAR, Clause.COMING})


class Case(NamedTuple):
    """A run whose robots are asked."""

    scenario: str
    robots: int
    loss: float

    @property
    def name(self) -> str:
        """The run in words."""
        return f"{self.scenario}, {self.robots} robots, loss {self.loss:g}"

    def begun(self) -> Instant:
        """Return the run before its first tick."""
        scenario = loaded(file_of(self.scenario))
        radio = changed(scenario.settings.radio, loss=self.loss)
        scenario = replace(scenario, settings=changed(scenario.settings, radio=radio))
        return Simulated(Simulation.of(scenario, self.robots, 1))


class Wait(NamedTuple):
    """A robot that waits."""

    case: Case
    robot: str
    tick: int


CASES: Final = (
    Case("paper", 8, 0.2), Case("doorway", 12, 0.2), Case("crossing", 8, 0.0), Case("circle", 8, 0.3),
    Case("office", 8, 0.0), Case("corridor", 2, 0.2),
)  # fmt: skip


def asked(case: Case, seconds: float, waits: list[Wait]) -> list[str]:
    """Ask all robots of a run in every second; add those that wait to ``waits``, and return the cells of a row."""
    answers = thin = false = circles = 0
    last: dict[str, int] = {}

    def look(moment: Instant) -> None:
        nonlocal answers, thin, false, circles
        tick = moment.past.tick
        if tick % round(moment.past.rate):
            return
        for robot in moment.robots:
            causes = [cause for cause in moment.why(robot) if cause.clause is not Clause.ALSO]
            if causes[0].clause is Clause.DRIVES or len(causes) == 1:
                continue
            answers += 1
            thin += causes[-1].clause is Clause.UNKNOWN
            circles += causes[-1].clause is Clause.CIRCLE
            false += any(map(partial(is_false, moment), causes, [*causes[1:], None]))
            if tick - last.get(robot, -APART) >= APART:
                last[robot] = tick
                waits.append(Wait(case, robot, tick))

    moment = case.begun()
    run_moment_until(moment, round(seconds / moment.world.dt), look)
    return [str(answers), f"{thin} ({100 * thin / max(1, answers):.1f} %)", str(false), str(circles)]


def is_false(moment: Instant, cause: Cause, follows: Cause | None) -> bool:
    """Return True if the robot that is named has nothing to do with the cell, and the next line does not say so."""
    if cause.clause not in {Clause.HELD, Clause.CLAIMED} or cause.other is None:
        return False
    decided = moment.robots[cause.other].last_decision
    own = decided.progress.reservations if decided is not None else None
    has = own is not None and cause.cell in {*own.held, *(claim.cell for claim in own.all_claims)}
    return not has and (follows is None or follows.clause not in NEWS)


def proved(waits: list[Wait]) -> list[list[str]]:
    """Change what the answers of waits name, and then a robot that they do not name; return two rows of cells."""
    rows = [[0, 0, 0, 0], [0, 0, 0, 0]]
    for wait in waits:
        again = partial(as_it_was, wait)
        moment = again()
        causes = moment.why(wait.robot)
        named = {robot for cause in causes for robot in (cause.robot, cause.other)}
        others = [robot for robot in moment.robots if robot not in named and moves(moment, robot)]
        control = [causes[0], Cause(1, others[0], Clause.DRIVES, "")] if others else []
        for row, chain, one in ((rows[0], causes, moment), (rows[1], control, again())):
            proofs = prove(wait.robot, chain, one, again) if chain else []
            for proof in proofs:
                longer = proof.after is None or (proof.before is not None and proof.after > proof.before)
                row[0] += 1
                row[1] += proof.changes_wait and longer
                row[2] += proof.changes_wait and not longer
                row[3] += not proof.changes_wait
    return [list(map(str, row)) for row in rows]


def as_it_was(wait: Wait) -> Instant:
    """Return the moment of a wait."""
    return run_moment_until(wait.case.begun(), wait.tick)


def moves(moment: Instant, robot: str) -> bool:
    """Return True if a robot turns its wheels."""
    command = moment.past.commands[robot]
    return max(abs(command.left), abs(command.right)) > 0.1


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="of each run")
    parser.add_argument("--waits", type=int, default=30, help="whose answers are proved")
    options = parser.parse_args()
    print(machine(), "\n")
    waits: list[Wait] = []
    head = [
        "asked each second",
        "answers of robots that wait",
        f"thin, bar {THIN:g} %",
        "false holders, bar 0",
        "circles",
    ]
    printed(head, [(case.name, partial(asked, case, options.seconds, waits)) for case in CASES])
    Random(1).shuffle(waits)
    rows = proved(waits[: options.waits])
    head = [f"{min(options.waits, len(waits))} waits", "changes", "it waits longer", "shorter", "as long"]
    names = ("what the answer names", "a robot that it does not name, stopped")
    printed(head, [(name, lambda row=row: row) for name, row in zip(names, rows, strict=True)])
    print(f"Load {load()}.")


if __name__ == "__main__":
    main()
