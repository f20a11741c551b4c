"""The command `swarm completion`: a script with which a shell completes commands, their options and known words."""

import argparse
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Final

from swarm.cli.argument_parser import Commands, Parser

SHELLS: Final = ("bash", "zsh", "fish")


SCENARIOS: Final = "swarm.scenario.shipped_scenarios:shipped_scenarios"
Known = dict[tuple[str, str], str]  # by command and argument: where the words are, or the function that returns them

WORDS: Final[Known] = {  # what it may be, or often is
    **{(command, "pace"): "swarm.cli.argument_parser:PACES" for command in ("run", "box", "world")},
    **{(command, "dashboard"): "dashboard.mode:ASKED" for command in ("run", "watch")},
    ("setup", "scenario"): SCENARIOS,
    ("schema", "message"): "swarm.messages.schema:kinds",
    ("drill", "row"): "swarm.launch.drill.table:ROWS",
    ("storm", "profile"): "swarm.storm.plans.profiles:PROFILES",
}
WORDS_OR_FILES: Final[Known] = {  # the same, or a file
    **{(command, "scenario"): SCENARIOS for command in ("run", "box", "world")},
    ("plan", "map"): SCENARIOS,
    ("explain", "profile"): "swarm.fuzzy:built_in_profiles",
}


def _words(where: str) -> list[str]:
    """Return the words that are at a place, which is imported only now."""
    found = resolve_name(where)
    return list(found() if callable(found) else found)


def completion(top: Parser, commands: "Commands[Parser]", options: argparse.Namespace) -> int:
    """Print the script for a shell; the parsers are spoilt for other uses."""
    import shtab

    for name, parser in commands.choices.items():
        for action in parser._actions:
            told: Any = action  # shtab reads its `choices` and an attribute of its own
            if (where := WORDS.get((name, action.dest))) is not None:
                action.choices = _words(where)
            elif (where := WORDS_OR_FILES.get((name, action.dest))) is not None:
                told.complete = _or_a_file(f"_swarm_files_{name}_{action.dest}", _words(where))
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
