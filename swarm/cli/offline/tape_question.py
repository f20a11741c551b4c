"""The commands `swarm why` and `swarm open`: a run is run again up to a tick, and asked."""

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarm.cli.argument_parser import Commands, Parser, robots_of
from swarm.cli.offline.replay import ProgressLine
from swarm.errors import ConfigError
from swarm.settings import TAPE

if TYPE_CHECKING:
    from swarm.blackbox.explain.first_difference import Parting
    from swarm.blackbox.explain.moment import Instant


def why(options: argparse.Namespace) -> int:
    """Print the chain of causes of what a robot does at a time."""
    import msgspec

    from swarm.blackbox.explain.clauses import as_text
    from swarm.blackbox.explain.prove import prove

    moment = _moment(options)
    causes, at = moment.why(options.robot), moment.past.clock(moment.past.tick)
    proofs = prove(options.robot, causes, moment, lambda: _moment(options)) if options.prove else []
    status = _print_doubt(moment)
    if options.json:
        found = [msgspec.to_builtins(one._asdict()) for one in causes]
        proved = [one._asdict() for one in proofs]
        print(json.dumps({"causes": found, "proofs": proved} if options.prove else found, indent=1))
        return status
    print(f"{options.robot} at {at}:\n{as_text(causes)}")
    for proof in proofs:
        print(proof.text)
    if options.prove and not proofs:
        print("Nothing to prove: the robot does not wait, or for nothing that can be changed.")
    return status


def _print_doubt(moment: "Instant") -> int:
    """Print a doubt if a moment may not be what happened; return the exit status: 1, else 0."""
    if moment.doubt is not None:
        print(f"swarm: {moment.doubt}", file=sys.stderr)
    return int(moment.doubt is not None)


def print_state(options: argparse.Namespace) -> int:
    """Print the whole state of a robot at a time, or a line for each robot."""
    import msgspec
    import yaml

    moment = _moment(options)
    if options.shell:
        return _shell(moment, options)
    names = moment.world.robots if options.robot is None else [options.robot]
    states = [msgspec.to_builtins(moment.state(name)) for name in names]
    found = states if options.robot is None else states[0]
    if options.json:
        print(json.dumps(found, indent=1))
    elif options.robot is None:
        print(f"at {moment.past.clock(moment.past.tick)}:")
        print("\n".join(map(_line, states)))
    else:
        print(yaml.safe_dump(found, sort_keys=False, default_flow_style=None, width=120), end="")
    return _print_doubt(moment)


def _shell(moment: "Instant", options: argparse.Namespace) -> int:
    """Let the user ask a moment in Python, and go on from it."""
    import code

    from swarm.blackbox.explain.clauses import as_text
    from swarm.blackbox.explain.moment import run_moment_until

    def step(ticks: int = 1) -> str:
        run_moment_until(moment, moment.past.tick + ticks)
        return f"at {moment.past.clock(moment.past.tick)}"

    def why(name: str) -> None:
        print(as_text(moment.why(name)))

    names = {"moment": moment, "why": why, "state": moment.state, "step": step}
    at = f"{options.file} at {moment.past.clock(moment.past.tick)}"
    text = f"{at}: moment.robots, moment.world, why('r1'), state('r1'), step(20). Ctrl-D ends."
    code.interact(banner=text, local=names, exitmsg="")
    return _print_doubt(moment)


def _line(state: dict[str, Any]) -> str:
    """Return a robot's state in one line."""
    traffic, (x, y, _) = state["traffic"], state["pose"]
    words = [f"{state['robot']}: {state['activity'] if state['answered'] else 'has not answered'}"]
    words.append(f"at {x:.2f}, {y:.2f} m, {sum(state['wheels']) / 2:.2f} m/s")
    if traffic is not None:
        words.append(f"holds {', '.join(map(str, traffic['held']))}")
        words += [f"waits for {', '.join(traffic['waits'])}"] * bool(traffic["waits"])
    return "; ".join(words)


def _moment(options: argparse.Namespace) -> "Instant":
    from swarm.blackbox.explain.source import open_moment_at

    if options.at is not None and not 0.0 <= options.at <= 1e6:
        raise ConfigError(f"--at: expected 0 to 1e6 s, got {options.at:g}")
    if options.seed is not None and not 0 <= options.seed <= 2**53:
        raise ConfigError(f"--seed: expected 0 to 2**53, got {options.seed}")
    parts = {"run": options.run, "robots": options.robots, "seed": options.seed}
    moment = open_moment_at(options.file or _running(options), options.at, **parts, each=ProgressLine())
    if options.robot is not None:
        moment.check(options.robot)
    return moment


def _running(options: argparse.Namespace) -> Path:
    """Return the tape of a fleet that runs on this machine."""
    from swarm.launch.fleet_registry import find

    card = find(options.fleet)
    if card.tape is None:
        raise ConfigError(f"fleet {card.fleet}: expected a tape, got none; name a FILE")
    return Path(card.tape)


def diff(options: argparse.Namespace) -> int:
    """Print where two runs part; return 0 if they do not, else 1."""
    from swarm.blackbox.explain.first_difference import (
        MOST_NAMED,
        differences_of_starts,
        find_parting,
        find_parting_by_rules,
    )
    from swarm.tape.reader import TapeFile

    files = TapeFile(options.one), TapeFile(options.other)
    known = differences_of_starts(*files)
    for values in known[:MOST_NAMED]:
        print(f"before they began: {values.text}")
    if len(known) > MOST_NAMED:
        print(f"and {len(known) - MOST_NAMED} more")
    found = find_parting(*files)
    if found is None:
        ticks = [file.ticks for file in files]
        longer = options.one if ticks[0] > ticks[1] else options.other
        more = f"; {longer} goes on" if ticks[0] != ticks[1] else ""
        print(f"no difference in {min(ticks)} ticks{more}")
        return 0
    print(_first(found))
    if found.timing and (ruled := find_parting_by_rules(*files)) is not None:
        print(f"with the second run's rules and settings in the first run: {_first(ruled)}")
    return 1


def _first(found: "Parting") -> str:
    where = f"first difference at {found.time:.2f} s (tick {found.tick})"
    return f"{where}: {found.robot}: {found.values.text}\n{found.cause}"


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    one = commands.add_parser("why", help="say why a robot of a run does what it does at a time")
    one.add_argument("robot", metavar="ROBOT", help="such as r3")
    _of_a_moment(one, nargs="?")  # without a file: a fleet that runs
    text = "of a fleet that runs on this machine, without FILE; by default the only one there is"
    one.add_argument("--fleet", metavar="NAME", help=text)
    text = "change what the answer names, run on in memory, and say what would have been"
    one.add_argument("--prove", action="store_true", help=text)
    one.mixed = True
    one.set_defaults(command=why)

    one = commands.add_parser("open", help="print what the robots of a run know and have decided at a time")
    _of_a_moment(one)
    one.add_argument("robot", nargs="?", metavar="ROBOT", help="all of its state; without it, a line for each robot")
    text = "a Python prompt on that moment, which `step()` goes on from"
    one.add_argument("--shell", action="store_true", help=text)
    one.mixed = True
    one.set_defaults(command=print_state)

    one = commands.add_parser("diff", help="say where two runs part, by their tapes, and what is behind it")
    one.add_argument("one", type=Path, metavar=f"A{TAPE}")
    one.add_argument("other", type=Path, metavar=f"B{TAPE}")
    one.set_defaults(command=diff)


def _of_a_moment(parser: Parser, nargs: str | None = None) -> None:
    text = (
        f"what is run again: FILE{TAPE}, the tape of a run; a scenario, as `swarm run --pace max` runs it; "
        "or a plan of `swarm storm`"
    )
    parser.add_argument("file", type=Path, nargs=nargs, metavar="FILE", help=text)
    parser.add_argument("--at", type=float, metavar="SECONDS", help="time of the run; by default where the tape ends")
    parser.add_argument("--run", type=int, metavar="N", help="of a tape that has several; by default the last")
    parser.add_argument("--robots", type=robots_of, metavar="N", help="of a scenario; by default as it says")
    parser.add_argument("--seed", type=int, metavar="S", help="of a scenario; by default as it says")
    parser.add_argument("--json", action="store_true")
