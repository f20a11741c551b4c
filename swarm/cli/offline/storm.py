"""The command `swarm storm`: it runs random worlds and checks them against laws."""

import argparse
import os
import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from swarm.cli.argument_parser import Commands, Parser
from swarm.errors import ConfigError
from swarm.settings import TAPE

if TYPE_CHECKING:
    from swarm.storm.plans.plan import StormPlan

DEFAULT: Final = 100  # seeds
LARGEST: Final = 2**53


def storm(options: argparse.Namespace) -> int:
    """Run the plans of seeds, or plan files, and print every broken law."""
    from swarm.kernels import announce_compilation

    announce_compilation()
    from swarm.launch.storm import perform_both
    from swarm.storm import command

    profiles = tuple(options.profile.split(","))
    if options.show is not None:
        print(command.show(_only(profiles), _seed("--show", options.show)), end="")
        return 0
    if options.tape is not None:
        return _plan_from_tape(options.tape, options.out)
    if options.shrink is not None:
        plan = _plan(options.shrink, profiles)
        out = options.out or Path("tests", "storm", f"{plan.profile}-{plan.seed}.yaml")
        return command.shrink_plan(plan, out, _jobs(options.jobs))
    if options.over == "processes" and options.twice:
        raise ConfigError("storm: expected either --twice or --over processes, got both; leave one out")
    if options.plan and (options.seeds or options.start is not None or options.profile != "all"):
        raise ConfigError("storm: expected either plan files or --seeds and --profile, got both; leave one out")
    return command.run(
        command.StormOptions(
            profiles=profiles,
            seeds=seeds(options.seeds, options.start),
            files=tuple(options.plan),
            jobs=_jobs(options.jobs),
            twice=options.twice,
            over=perform_both if options.over == "processes" else None,
            results=options.results,
            plans=options.plans,
            as_json=options.json,
        )
    )


def _plan_from_tape(path: Path, out: Path | None) -> int:
    """Make a plan of what happened in a run, and write it if it breaks a law, or if ``out`` names its file.

    Return 1 if the run or the plan has broken one, else 0.
    """
    from swarm.blackbox.replay.judge import Watch
    from swarm.blackbox.replay.storm_plan import as_plan
    from swarm.cli.offline.replay import open_replay, replay_tape
    from swarm.storm.output import write_plan
    from swarm.storm.results import Job, perform
    from swarm.tape.reader import TapeFile

    plan, left_out = as_plan(TapeFile(path))
    watch, replay = Watch(), open_replay(path)
    replay_tape(replay, partial(watch.take, replay))
    broken = {"the run": watch.judge_laws(), "its plan": perform(Job(plan.profile, plan.seed, plan)).violations}
    for what in left_out:
        print(f"{what}: no plan has that, so it is left out")
    for who, laws in broken.items():
        for law, tick, _, text in laws:
            print(f"{who} breaks {law}, tick {tick}: {text}")
        if not laws:
            print(f"{who} breaks no law")
    if broken["its plan"] or out is not None:
        file = out or Path("tests", "storm", f"{path.stem}.yaml")
        write_plan(plan, file)
        print(f"{file}: {plan.robots} robots, {len(plan.faults)} faults; swarm storm --shrink {file} makes it smaller")
    return int(any(broken.values()))


def seeds(text: str | None, start: int | None) -> range:
    """Read ``A:B`` (without B), or a number of seeds that begin at ``start``.

    Raises:
        ConfigError: the text has neither form, or a seed is too large.

    >>> seeds("3:5", None), seeds("2", 10)
    (range(3, 5), range(10, 12))
    """
    if text is not None and ":" in text:
        match = re.fullmatch(r"(\d{1,16}):(\d{1,16})", text)
        if match is None or not int(match[1]) < int(match[2]) <= LARGEST:
            raise ConfigError(f"--seeds: expected A:B with A below B, got {text!r}; 0:100 is the first hundred")
        if start is not None:
            raise ConfigError("--seeds: expected either A:B or a number with --start, got both; leave one out")
        return range(int(match[1]), int(match[2]))
    if text is not None and not (re.fullmatch(r"\d{1,16}", text) and int(text)):
        raise ConfigError(f"--seeds: expected a number from 1 on, or A:B, got {text!r}; 0:100 is the first hundred")
    first = 0 if start is None else start
    number = DEFAULT if text is None else int(text)
    if not 0 <= first <= LARGEST - number:
        raise ConfigError(f"--start: expected 0 to 2**53, got {first}")
    return range(first, first + number)


def _seed(flag: str, text: str) -> int:
    if not re.fullmatch(r"\d{1,16}", text) or int(text) > LARGEST:
        raise ConfigError(f"{flag}: expected a seed, 0 to 2**53, got {text!r}")
    return int(text)


def _plan(text: str, profiles: tuple[str, ...]) -> "StormPlan":
    """Draw a seed's plan, or read a plan file."""
    from swarm.storm.plans.draw import draw
    from swarm.storm.plans.plan import read

    return read(Path(text)) if text.endswith((".yaml", ".yml")) else draw(_only(profiles), _seed("--shrink", text))


def _only(profiles: tuple[str, ...]) -> str:
    if len(profiles) > 1:
        raise ConfigError(f"--profile: expected one name, got {', '.join(profiles)}; a seed has another plan in each")
    return profiles[0]


def _jobs(number: int | None) -> int:
    cores = len(os.sched_getaffinity(0))
    if number is None:
        return cores
    if not 1 <= number <= 256:
        raise ConfigError(f"--jobs: expected 1 to 256, got {number}; this machine has {cores} cores")
    return number


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("storm", help="run random worlds in one process and check them against laws")
    one.add_argument("plan", type=Path, nargs="*", metavar="PLAN.yaml", help="plan files to run, instead of seeds")
    one.add_argument("--seeds", metavar="N|A:B", help=f"how many seeds, or A to B - 1; by default {DEFAULT}")
    one.add_argument("--start", type=int, metavar="A", help="the first of N seeds, by default 0")
    one.add_argument("--profile", default="all", metavar="NAME,...", help="what the seeds draw; by default all")
    one.add_argument("--jobs", type=int, metavar="J", help="parallel runs; by default one per core")
    one.add_argument("--twice", action="store_true", help="run each plan twice: the digests must be equal")
    text = "processes: run each plan over real processes too; the digests must be equal"
    one.add_argument("--over", default="simulation", choices=("simulation", "processes"), help=text)
    one.add_argument("--results", type=Path, metavar="FILE.jsonl", help="append a JSON line per seed, at once")
    one.add_argument("--plans", type=Path, metavar="DIR", help="write the plans that failed into this folder")
    one.add_argument("--show", metavar="SEED", help="print the plan of a seed and end")
    one.add_argument("--shrink", metavar="SEED|PLAN.yaml", help="shrink a plan that fails, write it and end")
    text = "make a plan of what happened in a run, from its tape, and end; it is written if it breaks a law"
    one.add_argument("--from", dest="tape", type=Path, metavar=f"FILE{TAPE}", help=text)
    text = "file of --shrink and --from; by default in tests/storm"
    one.add_argument("--out", type=Path, metavar="FILE.yaml", help=text)
    one.add_argument("--json", action="store_true")
    one.set_defaults(command=storm)
