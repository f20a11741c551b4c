"""The option `--clock` of bridges whose messages have stamps."""

from typing import Final

from swarm.cli.argument_parser import Parser

CLOCKS: Final = ("run", "wall")


def add(parser: Parser) -> None:
    """Add the option."""
    text = "whose time stamps have: the run's, by default, which /clock tells; or this machine's, without /clock"
    parser.add_argument("--clock", choices=CLOCKS, default=CLOCKS[0], help=text)
