"""Which planted faults does a storm find? ``python -m benchmarks.mutants [NAME ...] [--seeds N] [--patience S]``.

Each fault changes one line of code in a copy of the tree. ``swarm storm`` then runs seeds of suitable profiles until
one breaks a law that it keeps without the fault. The table has the law and the seed.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Timer
from time import perf_counter
from typing import Final, NamedTuple

from benchmarks.measure import machine, table

ROOT: Final = Path(__file__).parents[1]
ROOMS: Final = ("swarm", "world", "dashboard")
SEEDS: Final = 100  # of each profile
PATIENCE: Final = 600.0  # s for one fault
BROKE: Final = re.compile(r"^(\S+) (\d+): ([^,]+), tick \d+: ")  # the line of swarm storm about a failed seed
TRAFFIC: Final = "swarm/traffic/"
ROBOT: Final = "swarm/robot/"
MOTION: Final = "swarm/motion/"


class Mutant(NamedTuple):
    """One planted fault: in ``file``, ``before``, which occurs exactly once, becomes ``after``."""

    name: str
    profiles: str  # profiles of storm that should find it
    file: str
    before: str
    after: str


# fmt: off
MUTANTS: Final = (
    Mutant("held cells let go early", "calm", TRAFFIC + "reservations/route.py",
           "((cell in touched or (cell in room", "((False or (cell in room"),
    Mutant("margin lost", "calm", TRAFFIC + "settings.py", "margin: float = 0.03", "margin: float = -0.02"),
    Mutant("plan order ignored", "shared", TRAFFIC + "joint/following.py",
           "return None if record.left > entry.place else entry.robot", "return None"),
    Mutant("dead taken for fresh", "dead", TRAFFIC + "peers/records.py",
           "if record.stamp >= tick - fresh}", "if True}"),
    Mutant("take although held", "claims", TRAFFIC + "reservations/rules.py",
           '_nobody_holds,\n    "I have acknowledged', '_is_ripe,\n    "I have acknowledged'),
    Mutant("no listening", "suspend", TRAFFIC + "settings.py", "listen: int = 30", "listen: int = 0"),
    Mutant("edit ignored", "edits", ROBOT + "brain.py",
           "self._pilot.take_floor(ground.map)\n        if not", "pass\n        if not"),
    Mutant("never looks", "dead", TRAFFIC + "obstacles/inspection.py",
           "wants = bool(waits) or self.leans_to == cell", "wants = False"),
    Mutant("GRANT without I hold it", "contest", TRAFFIC + "reservations/rules.py",
           '"I hold the cell":                      _i_do_not_hold,', ""),
    Mutant("GRANT without older claim", "contest", TRAFFIC + "reservations/rules.py",
           '"I have an older claim":                _i_have_no_older_claim,', ""),
    Mutant("take unacknowledged", "contest", TRAFFIC + "reservations/rules.py",
           '"not all have acknowledged":            _all_acknowledge,', ""),
    # There is no row for TAKE without its rule about older claims. All robots have one clock here, so a robot that has
    # acknowledged a claim never makes an older one. The rule matters only if a robot takes a cell and falls silent
    # before it says so; none of sixty seeds drew that. The next row is about the order of claims itself.
    Mutant("no order among claims of one tick", "contest", TRAFFIC + "reservations/rules.py",
           "return (one.stamp, who) < (other.stamp, whose)", "return one.stamp < other.stamp"),
    Mutant("unsolvable unproven", "asleep,unsolvable", TRAFFIC + "joint/leader.py",
           "proven, names = _is_proof(call, call.answer)", "proven, names = True"),
    Mutant("always exact", "asleep,unsolvable", TRAFFIC + "joint/problem.py", "exact = not blocked", "exact = True"),
    Mutant("who is done makes no room", "shared", ROBOT + "cell_pilot.py",
           "idle = inputs.done and (settles or inputs.anywhere or self._cells.cell_of(*inputs.goal) in self._wanted)",
           "idle = False"),
    Mutant("claim numbers used twice", "contest", TRAFFIC + "reservations/rules.py",
           "claims=(*self.claims, Claim(cell, self.number, tick)), number=self.number + 1)",
           "claims=(*self.claims, Claim(cell, self.number, tick)), number=self.number)"),
    Mutant("resume forgets", "away", ROBOT + "brain.py",
           "self.mission.resume(state.reached, state.unreachable, state.laps)", "pass"),
    Mutant("braking path too short", "meet", ROBOT + "safety.py",
           "most = self._acceleration * self._dt\n",
           "most = 4 * self._acceleration * self._dt\n"),
    Mutant("brake too strong in the look-ahead", "meet", ROBOT + "safety.py",
           "self._drive.track_width, self._acceleration * self._dt, self._dt, self._ticks",
           "self._drive.track_width, 2 * self._acceleration * self._dt, self._dt, self._ticks"),
    Mutant("looks no further than the command", "meet", MOTION + "sweep.py",
           "while step < ticks or left_now != 0.0 or right_now != 0.0:", "while step < ticks:"),
    Mutant("nothing is slowed", "meet", MOTION + "sweep.py", "        if clear:\n", "        if True:\n"),
    Mutant("spare lost", "calm", ROBOT + "safety.py",
           "self._radius + SAFETY.gap,", "self._radius - SAFETY.gap,"),
    Mutant("clearance lost look by look", "calm", MOTION + "sweep.py",
           "max(here - GRAZE, min(here, body_radius + TIGHT))", "here - GRAZE"),
    Mutant("front sensor ignored", "movers", ROBOT + "safety.py",
           "return min(self._stops_in(front), constraints.fastest) if constraints.may_drive else 0.0",
           "return 9.0 if constraints.may_drive else 0.0"),
    Mutant("detour to the wrong side", "calm,movers", ROBOT + "detour.py",
           "self._heading = DETOUR.aside *", "self._heading = -DETOUR.aside *"),
    Mutant("no detour", "calm", ROBOT + "detour.py",
           "if still > DETOUR.patience and", "if still > 1e9 and"),
    Mutant("room taken without acknowledgement", "contest,meet", TRAFFIC + "reservations/claims.py",
           "if obstacle(TAKE, self._case(claim, progress, situation, near)) is None:", "if True:"),
    Mutant("room never given back", "contest,meet", TRAFFIC + "reservations/route.py",
           "(cell in room and self.steps[index] == BESIDE)", "(self.steps[index] == BESIDE)"),
    Mutant("what moves is taken to stay", "movers", TRAFFIC + "obstacles/detector.py",
           "STILL: Final = 0.1", "STILL: Final = 9.0"),
    Mutant("staleness times 100", "dead", TRAFFIC + "settings.py", "fresh: int = 40", "fresh: int = 4000"),
    Mutant("command timeout ignored", "suspend", "world/tasks/tasks.py",
           "<= COMMAND.timeout for one in self.commands", "<= 1e9 for one in self.commands"),
    Mutant("stop distance 0", "movers", TRAFFIC + "settings.py",
           "stop_distance: float = 0.6", "stop_distance: float = 0.0"),
    Mutant("halting never", "movers", TRAFFIC + "obstacles/detector.py", "if place is None:", "if True:"),
    Mutant("claims kept while frozen", "crowd,claims", TRAFFIC + "step.py",
           "else Claimed(routed.without_claims(), (), took=False)", "else Claimed(routed, (), took=False)"),
    Mutant("ripe at once", "contest", TRAFFIC + "settings.py", "ripe: int = 8", "ripe: int = 0"),
    Mutant("asks half as far", "contest,calm", TRAFFIC + "settings.py",
           "return min(self.radio_range, 2 * min(self.claim_radius, (self.horizon + 1) * side) + 1.5)",
           "return min(self.claim_radius, (self.horizon + 1) * side)"),
    Mutant("who answers late is heard by nobody", "late", "world/world.py",
           "[(self.robots[sender], tick) for sender, tick in row]",
           "[(self.robots[sender], self.tick) for sender, tick in row]"),
    Mutant("of several late answers one is not heard", "slow", "world/host/last_messages.py",
           "self.sent.append((name, message.tick))", "self.sent[:] = [(name, message.tick)]"),
    Mutant("relayed records dropped", "strangers", TRAFFIC + "peers/records.py",
           "for hops, record in broadcast.others:", "for hops, record in ():"),
    Mutant("lateness taken for 0", "meet,late", ROBOT + "lateness.py",
           "return tuple(self._commands) if self._ticks else ()", "return ()"),
    Mutant("an edit makes forget the others", "edits", TRAFFIC + "step.py",
           "self._goal.forget()\n        return progress.over(",
           "self._peers = PeerRecords(self.me, self.settings)\n        return progress.over("),
    Mutant("a new process counts claims from 1", "away", TRAFFIC + "reservations/presence.py",
           "return begun(body.tick * 64 + 1, body", "return begun(1, body"),
)
# fmt: on


class Caught(NamedTuple):
    """The first seed that fails with the fault and not without it."""

    law: str
    profile: str
    seed: int


def missing(mutants: tuple[Mutant, ...] = MUTANTS) -> list[str]:
    """Return the faults whose text is not exactly once in its file: the code has changed, so the row must change."""
    found = []
    for mutant in mutants:
        path = ROOT / mutant.file
        count = path.read_text(encoding="utf-8").count(mutant.before) if path.exists() else 0
        if count != 1:
            found.append(f"{mutant.name}: {mutant.file}: expected {mutant.before!r} once, found it {count} times")
    return found


def copy_to(folder: Path) -> None:
    """Copy the tree with numba's cache and with the files' times, by which numba knows that the cache is valid."""
    for room in ROOMS:
        shutil.copytree(ROOT / room, folder / room)


def plant(mutant: Mutant, folder: Path) -> None:
    """Plant the fault in the copy."""
    path = folder / mutant.file
    path.write_text(path.read_text(encoding="utf-8").replace(mutant.before, mutant.after), encoding="utf-8")


def mend(mutant: Mutant, folder: Path) -> None:
    """Restore the file and its time."""
    shutil.copy2(ROOT / mutant.file, folder / mutant.file)


def broken(folder: Path, profiles: str, seeds: str, jobs: int, patience: float) -> Iterator[Caught]:
    """Run a storm in a tree and yield the failures as they come. Leaving the iteration ends the storm."""
    command = [sys.executable, "-m", "swarm.cli", "storm", "--profile", profiles, "--seeds", seeds, "--jobs", str(jobs)]
    process = subprocess.Popen(
        command, cwd=folder, env=os.environ | {"PYTHONPATH": str(folder)}, text=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip
    timer = Timer(patience, process.send_signal, [signal.SIGINT])
    timer.start()
    said = []
    try:
        assert process.stderr is not None
        for line in process.stderr:
            said.append(line)
            if match := BROKE.match(line):
                yield Caught(match[3], match[1], int(match[2]))
        if process.wait() == 2:
            raise SystemExit("".join(said))
    finally:
        timer.cancel()
        process.send_signal(signal.SIGINT)
        process.wait()


class Baseline:
    """The laws that seeds break without any fault; each seed runs once."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, int], set[str]] = {}

    def breaks(self, caught: Caught) -> bool:
        """Return True if the seed breaks the law without the fault, too."""
        key = caught.profile, caught.seed
        if key not in self._known:
            seeds = f"{caught.seed}:{caught.seed + 1}"
            self._known[key] = {one.law for one in broken(ROOT, caught.profile, seeds, 1, PATIENCE)}
        return caught.law in self._known[key]


def hunt(mutant: Mutant, folder: Path, baseline: Baseline, options: argparse.Namespace) -> Caught | None:
    """Run seeds with the fault planted until one fails that does not fail without the fault."""
    plant(mutant, folder)
    storm = broken(folder, mutant.profiles, f"0:{options.seeds}", options.jobs, options.patience)
    try:
        return next((caught for caught in storm if not baseline.breaks(caught)), None)
    finally:
        storm.close()  # type: ignore[attr-defined]
        mend(mutant, folder)


def main() -> int:
    parser = argparse.ArgumentParser(description="Plant faults and let storms find them.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="faults whose name contains this; default: all")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--patience", type=float, default=PATIENCE, help="s of wall time for one fault")
    options = parser.parse_args()
    gone = missing()
    print("\n".join(gone), file=sys.stderr, end="\n" if gone else "")
    there = [mutant for mutant in MUTANTS if not any(line.startswith(f"{mutant.name}: ") for line in gone)]
    chosen = [one for one in there if not options.names or any(name in one.name for name in options.names)]
    rows, baseline = [("planted", "caught by", "profile", "at seed", "s")], Baseline()
    with TemporaryDirectory() as home:
        copy_to(Path(home))
        for mutant in chosen:
            began = perf_counter()
            caught = hunt(mutant, Path(home), baseline, options)
            found = (caught.law, caught.profile, str(caught.seed)) if caught else ("not caught", mutant.profiles, "-")
            rows.append((mutant.name, *found, f"{perf_counter() - began:.0f}"))
            print(f"{mutant.name}: {', '.join(found)}, {rows[-1][-1]} s", file=sys.stderr, flush=True)
    print(f"{machine()}\n")
    print(table(rows))
    print(f"\ncaught {sum(row[1] != 'not caught' for row in rows[1:])} of {len(chosen)}")
    return 1 if gone else 0


if __name__ == "__main__":
    sys.exit(main())
