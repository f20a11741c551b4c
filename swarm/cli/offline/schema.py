"""`swarm schema`: the JSON Schema of each message of the wire."""

import argparse

from swarm.cli.parsing import Commands, Parser
from swarm.errors import ConfigError, nearest


def schema(options: argparse.Namespace) -> int:
    """Print the JSON Schema of a message, or the names of all messages with their first lines."""
    from swarm.messages.schema import kinds, schema_of

    known = kinds()
    if options.message is None:
        widest = max(map(len, known))
        for name, kind in known.items():
            print(f"{name:<{widest}}  {(kind.__doc__ or '').splitlines()[0]}")
        return 0
    if options.message not in known:
        raise ConfigError(
            f"schema: expected the name of a message, got {options.message!r}; {nearest(options.message, known)}"
        )
    print(schema_of(known[options.message]), end="")
    return 0


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("schema", help="print the JSON Schema of a message of the wire, or list them")
    one.add_argument("message", nargs="?", metavar="MESSAGE", help="such as Sense; by default all names are listed")
    one.set_defaults(command=schema)
