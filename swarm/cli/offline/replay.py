"""`swarm replay`: run a tape again, and compare every answer with what was said then."""

import argparse
import sys
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Final

from swarm.cli.parsing import Commands, Parser
from swarm.settings import TAPE

if TYPE_CHECKING:
    from collections.abc import Callable

    from world.replay.judge import Watch
    from world.replay.replay import Replay
    from world.replay.values import ReplayedTick

EVERY: Final = 2.0  # s between two lines on how far it is


class ProgressLine:
    """Prints how far a replay is, on a terminal only."""

    def __init__(self) -> None:
        self._told = monotonic()

    def __call__(self, replay: "Replay") -> None:
        """Print a line if the last one is some time ago."""
        if monotonic() - self._told >= EVERY and sys.stderr.isatty():
            self._told = monotonic()
            share = replay.done / max(1, replay.outline.ticks)
            print(f"replayed {replay.world.time:.0f} s, {share:.0%}", file=sys.stderr, flush=True)


def replay(options: argparse.Namespace) -> int:
    """Replay a tape; return 0 if every answer is the same and no law is broken, else 1."""
    watch: Watch | None = None  # made once the file is known to be a tape

    def each(one: "Replay", tick: "ReplayedTick") -> None:
        nonlocal watch
        from world.replay.judge import Watch

        if options.laws:
            watch = watch or Watch()
            watch.take(one, tick)

    found = opened(options.file, each)
    for line in told(found):
        print(line)
    broken = watch.judged() if watch is not None else []
    for one in broken:
        print(f"law broken: {one.law}: tick {one.tick}, {', '.join(one.robots)}: {one.text}")
    if watch is not None and not broken:
        print(f"{watch.laws} laws kept")
    return 1 if found.difference is not None or broken else 0


def opened(path: Path, each: "Callable[[Replay, ReplayedTick], None]" = lambda one, tick: None) -> "Replay":
    """Replay a whole tape, and tell how far it is; ``each`` is called after every tick.

    Raises:
        ConfigError: the file is no tape, or has what cannot have happened.
    """
    from swarm.compiled import announce
    from world.replay.outline import Outline
    from world.tape.reader import TapeFile

    file = TapeFile(path)
    outline = Outline.of(file)  # what is no tape is refused before much is loaded
    announce()
    from world.replay.replay import replayed

    progress = ProgressLine()

    def tell(one: "Replay", tick: "ReplayedTick") -> None:
        progress(one)
        each(one, tick)

    return replayed(file, tell, outline)


def told(replay: "Replay") -> list[str]:
    """Return what a replay was like, in lines."""
    from swarm.fingerprint import fingerprint

    head, world, file, found = replay.head, replay.world, replay.file, replay.difference
    other = f"made by other code: version {head.version}, fingerprint {head.code}; this is {fingerprint()}"
    made = [] if head.code == fingerprint() else [other]
    cut = [f"the file ends within a row: {file.left_out} bytes are left out"] if file.left_out else []
    robots = f"{len(world.robots)} robot{'s' * (len(world.robots) > 1)}"
    run = f"{head.map.scenario.settings.name}, {robots}, run {world.run}, {world.time:.2f} s"
    same = f"{replay.answers} answers, all as they were; digest {world.measures.recorder.digest}"
    if found is not None:
        same = f"first difference at tick {found.tick}, {found.time:.2f} s: {found.robot}: {found.text}"
    return [*made, *cut, f"{run}: {same}"]


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("replay", help="run a tape again bit for bit, and say what differs")
    one.add_argument("file", type=Path, metavar=f"FILE{TAPE}", help="what `swarm run` has written")
    one.add_argument("--laws", action="store_true", help="judge the run by the safety laws of `swarm storm`")
    one.set_defaults(command=replay)
