"""`swarm replay`: run a tape again, compare every answer with what was said then, and write recordings of the run."""

import argparse
import sys
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Final

from swarm.cli.argument_parser import Commands, Parser
from swarm.errors import ConfigError
from swarm.installation import hint_for_extra
from swarm.settings import TAPE

if TYPE_CHECKING:
    from collections.abc import Callable

    from swarm.blackbox.replay.answer_values import ReplayedTick
    from swarm.blackbox.replay.replay import Replay

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
    _check(options)
    one = open_replay(options.file)
    takers: list[Callable[[ReplayedTick], None]] = []
    watch = None
    if options.laws:
        from swarm.blackbox.replay.judge import Watch

        watch = Watch()
        takers.append(partial(watch.take, one))
    files = _Files(one, options) if options.rrd is not None or options.mcap is not None else None
    if files is not None:
        takers.append(files.take)
    for line in replay_tape(one, *takers):
        print(line)
    broken = watch.judge_laws() if watch is not None else []
    for law in broken:
        print(f"law broken: {law.law}: tick {law.tick}, {', '.join(law.robots)}: {law.text}")
    if watch is not None and not broken:
        print(f"{watch.laws} laws kept")
    if files is not None:
        print("\n".join(files.close() or [f"not recorded: {options.file} has no whole tick"]))
    return 1 if one.difference is not None or broken else 0


class _Files:
    """The recordings of a run that are made of its tape."""

    def __init__(self, replay: "Replay", options: argparse.Namespace) -> None:
        from swarm.blackbox.replay.wire import Wire

        self._replay, self._wire = replay, Wire(replay)
        self._show = self._mcap = None
        if options.rrd is not None:
            from dashboard.tape_recording import TapedShow

            self._show = TapedShow(replay, self._wire, options.rrd, options.rules)
        if options.mcap is not None:
            from dashboard.mcap_file import McapFile

            self._mcap = McapFile(options.mcap)

    def take(self, tick: "ReplayedTick") -> None:
        """Take in a tick that was replayed just now."""
        messages, world = list(self._wire.take(tick)), self._replay.world
        if self._show is not None:
            self._show.take(messages)
        if self._mcap is not None:
            self._mcap.take(world.run, (world.tick - 1) * world.dt, messages)

    def close(self) -> list[str]:
        """Finish the files, and return a line for each; there is none if there was no tick."""
        from swarm.messages import Phase

        messages, world = list(self._wire.end(Phase.OVER)), self._replay.world
        told: list[str] = []
        if self._show is not None:
            told += [f"recorded: {file}  (open it with: rerun {file})" for file in self._show.close(messages)]
        if self._mcap is not None and world.tick:
            self._mcap.take(world.run, world.time, messages)
            told += [f"recorded: {file}" for file in self._mcap.close()]
        return told


def _check(options: argparse.Namespace) -> None:
    """Check that the recordings that are asked for can be written."""
    if options.rrd is None and options.rules is not None:
        raise ConfigError("--rules: expected --rrd OUT.rrd too, where they are drawn; give both or none")
    for flag, file, extra in (("--rrd", options.rrd, "rerun"), ("--mcap", options.mcap, "mcap")):
        if file is None:
            continue
        from swarm.launch.options import check_output

        if lacking := hint_for_extra(extra):
            raise ConfigError(f"{flag} {file}: {lacking}")
        check_output(flag, file)
        both = file.exists() and options.file.exists()
        if file.suffix == TAPE or (both and file.samefile(options.file)):
            raise ConfigError(f"{flag} {file}: expected another file than a tape; name one that ends in .{flag[2:]}")


def open_replay(path: Path) -> "Replay":
    """Return the replay of a tape, at its begin.

    Raises:
        ConfigError: the file is no tape, or has what cannot have happened.
    """
    from swarm.blackbox.replay.outline import Outline
    from swarm.kernels import announce_compilation
    from swarm.tape.reader import TapeFile

    file = TapeFile(path)
    outline = Outline.read_outline(file)  # what is no tape is refused before much is loaded
    announce_compilation()
    from swarm.blackbox.replay.replay import Replay

    return Replay(file, outline)


def replay_tape(replay: "Replay", *takers: "Callable[[ReplayedTick], None]") -> list[str]:
    """Replay a whole tape, tell how far it is, hand each tick to ``takers``, and return in lines what it was like."""
    from swarm.fingerprint import fingerprint

    progress = ProgressLine()
    while (tick := replay.step()) is not None:
        progress(replay)
        for take in takers:
            take(tick)
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
    text = "write what a dashboard would have drawn of the run, for Rerun; a run after a restart is in OUT-run2.rrd"
    one.add_argument("--rrd", type=Path, metavar="OUT.rrd", help=text)
    text = "write the run's messages as JSON with their schemas, for Foxglove and other readers of MCAP"
    one.add_argument("--mcap", type=Path, metavar="OUT.mcap", help=text)
    one.add_argument("--rules", metavar="ROBOT", help="robot whose fired rules are drawn; by default the first")
    one.set_defaults(command=replay)
