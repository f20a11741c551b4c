"""The command line as a whole: all commands under their headings, and the two that are about the others."""

import argparse
from collections.abc import Sequence
from typing import Final

from swarm.cli import completion
from swarm.cli.argument_parser import Commands, Parser, Version, join_points
from swarm.cli.bridge import commands as bridge
from swarm.cli.look import echo, hz, logs, ls, status, topics, watch
from swarm.cli.offline import analyze, drill, replay, storm, tape_question, tools
from swarm.cli.start import fleet, keys
from swarm.cli.steer import control, orders
from swarm.errors import ConfigError, suggest_similar

ROOMS: Final = (
    fleet, keys, control, orders, bridge, status, ls, logs, topics, echo, hz, watch, replay, tape_question, analyze,
    drill, storm, tools,
)  # fmt: skip
GROUPS: Final[dict[str, tuple[str, ...]]] = {  # heading: the commands under it in `swarm --help`; each has one place
    "launch a fleet": ("run", "box", "keys", "router", "world", "robot"),
    "steer it": ("go", "pause", "resume", "restart", "stop", "setup", "edit", "add-robots"),
    "give its robots orders": ("order", "pool", "go-on", "home", "cancel", "load"),
    "look at it": ("status", "watch", "logs", "ls", "topics", "echo", "hz"),
    "connect it to others": ("bridge",),
    "paths, rules and recorded runs": ("replay", "why", "open", "diff", "plan", "explain", "analyze"),
    "test it and work on it": ("storm", "drill", "bench", "schema"),
    "help": ("help", "completion"),
}


class Top(Parser):
    """The parser of `swarm` itself."""

    def __init__(self) -> None:
        super().__init__(prog="swarm", description="N robots, each its own process, drive in one shared world.")
        text = "print the version, and whether the package is compiled"
        self.add_argument("--version", action=Version, nargs=0, help=text)
        self.commands: Commands[Parser] = self.add_subparsers(
            required=True, dest="called", metavar="COMMAND", parser_class=Parser
        )
        for room in ROOMS:
            room.add(self.commands)
        one = self.commands.add_parser("help", help="print this, or what a command takes")
        one.add_argument("about", nargs="?", metavar="COMMAND")
        one.set_defaults(command=self.help)
        completion.add(self.commands, self)
        self.about = {str(one.dest): one.help or "" for one in self.commands._get_subactions()}
        for name, said in self.about.items():
            self.commands.choices[name].description = f"{said[:1].upper()}{said[1:]}."

    def format_help(self) -> str:
        """Return the commands under their headings."""
        lines = [self.format_usage(), f"\n{self.description}\n\n"]
        for heading, names in GROUPS.items():
            lines += [f"{heading}:\n", *(f"  {name:<12}{self.about[name]}\n" for name in names), "\n"]
        lines += ["`swarm help COMMAND` says what a command takes; `swarm run` lists the scenarios.\n"]
        return "".join(lines)

    def help(self, options: argparse.Namespace) -> int:
        """Print the help of a command, or of all."""
        if options.about is not None:
            self.check(options.about)
        print((self if options.about is None else self.commands.choices[options.about]).format_help(), end="")
        return 0

    def check(self, word: str) -> None:
        """Check that a word is a command.

        Raises:
            ConfigError: it is none; a similar one is named.
        """
        if word not in self.commands.choices:
            meant = suggest_similar(word, self.commands.choices)
            raise ConfigError(f"expected a command, got {word!r}; {meant or 'see swarm --help'}")


def read(arguments: Sequence[str]) -> argparse.Namespace:
    """Return what a command line says; ``command`` is the function that carries it out.

    Raises:
        ConfigError: a word of it is wrong.
    """
    top, words = Top(), join_points(arguments)
    if words and not words[0].startswith("-"):
        top.check(words[0])
    return top.parse_args(words)
