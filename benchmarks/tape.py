"""The tape of a run: ``python -m benchmarks.tape [--fleets 4 8 64@0.25] [--seconds 40] [--ticks 2000] [--long 600]``.

The first table is of real fleets that patrol a depot: the size of their tapes, with the bar of 5 kB for a robot-minute,
and how fast `swarm replay` runs them again, with the bar of 10 times real time for 8 robots. ``64@0.25`` are 64 robots
at a quarter of real time: where a machine does not keep up, answers are late, and each says what it had heard. The
second is the world's writing of the answers of 16 robots, which were made before: the bars are 0.2 % of a core, and
1 ms in the longest tick. Both count the processor's time, not the clock's.

The third is of opening any moment of a long run of 8 robots, in lockstep: the first pass, which leaves keyframes, with
the bar of 10 times real time. Then the file is opened at random ticks, with the bar of 1 s for the longest.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from random import Random
from statistics import fmean, median
from time import process_time, thread_time
from typing import Final

from benchmarks.measure import load, machine, printed
from benchmarks.wire import ROOT, patrol
from swarm.blackbox.explain.tape_moment import Taped
from swarm.blackbox.replay.replay import replay_tape
from swarm.scenario.load import load as loaded
from swarm.tape.reader import TapeFile
from swarm.tape.writer import Tape
from world.fleet.publisher import floor
from world.simulate import Simulation

SIZE: Final = 5.0  # kB for a robot-minute
SHARE: Final = 0.2  # % of a core
LONGEST: Final = 1.0  # ms
WRITING: Final = 16  # robots whose answers are written
SHARING: Final = 8  # robots of a process in fleets larger than `ALONE`
ALONE: Final = 16
OPENED: Final = 8  # robots of the run that is opened
FASTER: Final = 10.0  # times real time
ANY: Final = 1.0  # s
RANDOM: Final = 30  # ticks


def recorded(fleet: str, seconds: float) -> list[str]:
    """Run a fleet, and return the cells of its tape."""
    robots, pace = sized(fleet)
    with tempfile.TemporaryDirectory() as folder:
        tape = Path(folder) / "run.swarm"
        command = [
            sys.executable, "-m", "swarm.cli", "run", str(patrol(Path(folder), robots)), "--robots", str(robots),
            "--dashboard", "off", "--pace", str(pace), "--limit", str(seconds), "--record", str(tape),
            "--robots-per-process", str(1 if robots <= ALONE else SHARING),
        ]  # fmt: skip
        subprocess.run(
            command, cwd=ROOT, stdout=subprocess.DEVNULL, env=os.environ | {"XDG_RUNTIME_DIR": folder}, check=False
        )
        head, whole = TapeFile(tape).size, tape.stat().st_size
        began = process_time()
        replay = replay_tape(TapeFile(tape))
        speed = replay.world.time / (process_time() - began)
    size = (whole - head) / 1000 / (robots * replay.world.time / 60)
    same = "all" if replay.difference is None else f"to {replay.difference.time:.2f} s"
    return [f"{head / 1000:.1f}", f"{size:.2f}", f"{replay.answers}", same, f"{speed:.1f}"]


def opened(seconds: float) -> list[str]:
    """Record a long run, open it at random ticks, and return the cells of what that takes."""
    with tempfile.TemporaryDirectory() as folder:
        tape, room = Path(folder) / "run.swarm", Path(folder) / "keyframes"
        command = [
            sys.executable, "-m", "swarm.cli", "run", str(patrol(Path(folder), OPENED)), "--robots", str(OPENED),
            "--dashboard", "off", "--pace", "max", "--limit", str(seconds), "--record", str(tape),
        ]  # fmt: skip
        subprocess.run(
            command, cwd=ROOT, stdout=subprocess.DEVNULL, env=os.environ | {"XDG_RUNTIME_DIR": folder}, check=False
        )
        room.mkdir()
        began = process_time()
        first = Taped(TapeFile(tape), room)
        first.run_through(None, None)
        speed = first.world.time / (process_time() - began)
        size = sum(file.stat().st_size for file in room.rglob("*.keyframe"))
        took = []
        for tick in Random(1).sample(range(first.world.tick), RANDOM):
            began = process_time()
            Taped(TapeFile(tape), room).run_through(None, tick)
            took.append(process_time() - began)
    same = "all" if first.doubt is None else "not all"
    return [f"{speed:.1f}", same, f"{size / 1e6:.1f}", f"{median(took):.2f}", f"{max(took):.2f}"]


def sized(fleet: str) -> tuple[int, float]:
    """Return the robots and the pace of a fleet.

    >>> sized("64@0.25")
    (64, 0.25)
    """
    robots, _, pace = fleet.partition("@")
    return int(robots), float(pace or 1.0)


def written(ticks: int) -> list[str]:
    """Write the tape of a simulation, and return the cells of what it costs."""
    with tempfile.TemporaryDirectory() as folder:
        simulation = Simulation.of(loaded(patrol(Path(folder), WRITING)), WRITING, 1)
        world, path = simulation.world, Path(folder) / "run.swarm"
        tape, seconds = Tape(path, print), list[float]()
        tape.begin(
            seed=1, pace="1.0", limit=ticks * world.dt, identity=world.identity, run=0, outside=[],
            map=floor(simulation.scenario, world),
        )  # fmt: skip
        head = path.stat().st_size
        for _ in range(ticks):
            commands = simulation.step().commands
            began = thread_time()
            tape.note_senses()
            for name, command in commands.items():
                tape.note_answer(world.number(name), command, command.tick, world.number)
            tape.step()
            seconds.append(thread_time() - began)
        tape.close()
        size = (path.stat().st_size - head) / 1000 / (WRITING * ticks * world.dt / 60)
    mean = fmean(seconds)
    return [f"{1e6 * mean:.0f}", f"{100 * mean / world.dt:.2f}", f"{1000 * max(seconds):.2f}", f"{size:.2f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description="Size, cost and replay of tapes.")
    parser.add_argument("--fleets", nargs="*", default=["4", "8", "16", "64", "64@0.25"], metavar="ROBOTS[@PACE]")
    parser.add_argument("--seconds", type=float, default=40.0, help="length of each run")
    parser.add_argument("--ticks", type=int, default=2000, help="ticks that are written")
    parser.add_argument("--long", type=float, default=600.0, help="length of the run that is opened at any tick")
    options = parser.parse_args()
    print(machine(), "\n")
    head = [
        f"tape of {options.seconds:g} s", "head [kB]", f"robot-minute [kB], bar {SIZE:g}", "answers", "the same",
        "replayed, times real time",
    ]  # fmt: skip
    printed(head, [(f"{one} robots", lambda one=one: recorded(one, options.seconds)) for one in options.fleets])
    head = [
        f"writing, {WRITING} robots", "mean tick [us]", f"share of a core [%], bar {SHARE:g}",
        f"longest tick [ms], bar {LONGEST:g}", "robot-minute [kB]",
    ]  # fmt: skip
    printed(head, [(f"{options.ticks} ticks", lambda: written(options.ticks))])
    head = [
        f"opening, {OPENED} robots", f"first pass, times real time, bar {FASTER:g}", "answers the same",
        "keyframes [MB]", f"{RANDOM} random ticks: median [s]", f"longest [s], bar {ANY:g}",
    ]  # fmt: skip
    printed(head, [(f"{options.long:g} s", lambda: opened(options.long))])
    print(f"Load {load()}.")


if __name__ == "__main__":
    main()
