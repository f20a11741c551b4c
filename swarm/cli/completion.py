"""The command `swarm completion`: a script with which a shell completes commands, their options and known words."""

import argparse
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any, Final

from swarm.cli.parsing import PACES, Commands, Parser

SHELLS: Final = ("bash", "zsh", "fish")


def _scenarios() -> Iterable[str]:
    from swarm.scenario.shipped import shipped

    return shipped()


def _dashboards() -> Iterable[str]:
    from dashboard.mode import ASKED

    return ASKED


def _messages() -> Iterable[str]:
    from swarm.messages.schema import kinds

    return kinds()


def _faults() -> Iterable[str]:
    from swarm.launch.drill.table import TABLE

    return [row.name for row in TABLE]


def _profiles() -> Iterable[str]:
    from world.storm.plans.profiles import PROFILES

    return PROFILES


def _controllers() -> Iterable[str]:
    from swarm.fuzzy import profiles

    return sorted(file.stem for file in Path(profiles.__path__[0]).glob("*.yaml"))


Known = dict[tuple[str, str], Callable[[], Iterable[str]]]  # by command and argument

WORDS: Final[Known] = {  # what it may be, or often is
    **{(command, "pace"): lambda: PACES for command in ("run", "box", "world")},
    **{(command, "dashboard"): _dashboards for command in ("run", "watch")},
    ("setup", "scenario"): _scenarios,
    ("schema", "message"): _messages,
    ("drill", "row"): _faults,
    ("storm", "profile"): _profiles,
}
WORDS_OR_FILES: Final[Known] = {  # the same, or a file
    **{(command, "scenario"): _scenarios for command in ("run", "box", "world")},
    ("plan", "map"): _scenarios,
    ("explain", "profile"): _controllers,
}


def completion(top: Parser, commands: "Commands[Parser]", options: argparse.Namespace) -> int:
    """Print the script for a shell; the parsers are spoilt for other uses."""
    import shtab

    for name, parser in commands.choices.items():
        for action in parser._actions:
            told: Any = action  # shtab reads its `choices` and an attribute of its own
            if (words := WORDS.get((name, action.dest))) is not None:
                action.choices = list(words())
            elif (words := WORDS_OR_FILES.get((name, action.dest))) is not None:
                told.complete = _or_a_file(f"_swarm_files_{name}_{action.dest}", words())
            elif name == "help" and action.dest == "about":
                action.choices = list(commands.choices)
            elif action.type is Path:
                told.complete = shtab.DIRECTORY if action.metavar == "DIR" else shtab.FILE
    print(shtab.complete(top, options.shell))
    return 0


def _or_a_file(function: str, words: Iterable[str]) -> dict[str, Any]:
    """Return how each shell completes one of some words, or a file."""
    known = " ".join(words)
    return {
        "bash": function,
        "zsh": function,
        "fish": f"({function})",
        "preamble": {
            "bash": f'{function}() {{ compgen -W "{known}" -- "$1"; compgen -f -- "$1"; }}',
            "zsh": f"{function}() {{ _alternative 'words:word:({known})' 'files:file:_files' }}",
            "fish": f"function {function}\n  printf '%s\\n' {known}\n  __fish_complete_path (commandline -ct)\nend",
        },
    }


def add(commands: "Commands[Parser]", top: Parser) -> None:
    """Add this command to the command line."""
    one = commands.add_parser("completion", help="print a script by which a shell completes commands and options")
    one.add_argument("shell", choices=SHELLS, help='bash and zsh: eval "$(swarm completion bash)"; fish: ... | source')
    one.set_defaults(command=partial(completion, top, commands))
