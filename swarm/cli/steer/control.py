"""Commands to a running fleet: the paper's buttons, edits of the floor, its set-up, and more robots."""

import argparse
from pathlib import Path
from typing import Any, TypeVar
from uuid import uuid4

import msgspec

from swarm.cli.argument_parser import Commands, Parser, point, robots_of
from swarm.cli.fleet_lookup import add_client_options, fleet_bus, send_request
from swarm.errors import ConfigError
from swarm.secure.names import OPERATOR

M = TypeVar("M")
ANSWER = 30.0  # s; a large floor is checked before the answer
BUTTONS = {
    "go": "start the robots",
    "pause": "stop the clock",
    "resume": "start the clock again",
    "restart": "start the run again: robots back at their starts, no progress",
}


def button(options: argparse.Namespace) -> int:
    """Press one of the paper's buttons."""
    from swarm.messages import ACTION, Action, Do

    return send_request(options, ACTION, Action(do=Do(options.button)))


def edit(options: argparse.Namespace) -> int:
    """Add walls or obstacles to the floor of a running fleet, or remove them."""
    from swarm.messages import EDIT, Edit, Kind

    asked = Edit(kind=Kind(options.kind), low=options.low, high=options.high, dry_run=options.dry_run)
    return send_request(options, EDIT, asked)


def add_robots(options: argparse.Namespace) -> int:
    """Open places for more robots; the launcher of the fleet starts a process for each."""
    from swarm.messages import PLACES, Places

    if not len(options.at) <= options.count >= 1:
        many = f" with {len(options.at)} starts" if options.at else ""
        raise ConfigError(f"add-robots: expected 1 robot or more, and one for each --at, got {options.count}{many}")
    starts = [(x, y, 0.0) for x, y in options.at]
    asked = _parse_request(
        {"id": options.id or uuid4().hex, "count": options.count, "at": starts, "kind": options.kind or ""},
        Places,
        "add-robots",
    )
    return send_request(options, PLACES, asked)


def setup(options: argparse.Namespace) -> int:
    """Set up another run of a fleet that waits or is paused, or print its set-up if nothing is asked for."""
    from swarm.maps.files import read_text
    from swarm.messages import DRAWING_LIMIT, SETUP, Setup

    if options.secure is not None:
        raise ConfigError(
            "setup: expected a fleet without keys, got --secure: with keys a launcher may not answer, and there is no "
            "set-up; stop the fleet and start another one with `swarm run SCENARIO --secure DIR`"
        )
    parts = {
        "scenario": options.scenario,
        "robots": options.robots if isinstance(options.robots, int) else None,
        "mix": options.robots if isinstance(options.robots, dict) else None,
        "speed": options.speed,
        "starts": [(x, y, 0.0) for x, y in options.start] or None,
        "targets": options.target or None,
        "map": None if options.map is None else read_text(options.map, DRAWING_LIMIT),
        "cell": options.cell,
    }
    asked = _parse_request(parts, Setup, "setup")
    with fleet_bus(options, OPERATOR) as bus:
        if any(part is not None for part in parts.values()):
            print(bus.ask(SETUP, asked, ANSWER).text)
            return 0
        if not (found := bus.fetch(SETUP)):
            raise ConfigError("setup: expected a launcher in that fleet, found none; start one with `swarm run`")
        print(msgspec.json.encode(found[0]).decode())
    return 0


def _parse_request(parts: dict[str, Any], kind: type[M], command: str) -> M:
    """Return a request made of what the command line says.

    Raises:
        ConfigError: a part is not what the request may say.
    """
    from swarm.messages.faults import explain_fault

    try:
        return msgspec.convert(parts, kind)
    except msgspec.ValidationError as fault:
        raise ConfigError(f"{command}: {explain_fault(str(fault), parts)}; correct it") from None


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    for name, text in BUTTONS.items():
        one = commands.add_parser(name, help=text)
        add_client_options(one)
        one.set_defaults(command=button, button=name)
    one = commands.add_parser("edit", help="add walls to the floor of a running fleet, or remove them")
    one.add_argument("kind", choices=("wall", "obstacle", "free"), help="what all cells of the rectangle become")
    one.add_argument("low", type=point, metavar="X,Y", help="m, a corner")
    one.add_argument("high", type=point, metavar="X,Y", help="m, the opposite corner")
    text = "only say what it would do: which robots would have no way to their targets any more"
    one.add_argument("--dry-run", action="store_true", help=text)
    add_client_options(one)
    one.set_defaults(command=edit)
    one = commands.add_parser("setup", help="print what a running fleet drives, or give it another set-up")
    one.add_argument("--scenario", metavar="NAME", help="one that comes with the project")
    one.add_argument("--robots", type=robots_of, metavar="N", help="how many, or of each kind: scout=6,cart=2")
    one.add_argument("--speed", type=float, metavar="SHARE", help="of the paper's wheel speeds, up to 1")
    one.add_argument("--start", type=point, action="append", default=[], metavar="X,Y", help="m; once for each robot")
    one.add_argument("--target", type=point, action="append", default=[], metavar="X,Y", help="m; in order")
    one.add_argument("--map", type=Path, metavar="FILE.txt", help="a drawing: # wall, o obstacle, . free")
    one.add_argument("--cell", type=float, metavar="METRES", help="side of a character of the drawing")
    add_client_options(one)
    one.set_defaults(command=setup)
    one = commands.add_parser("add-robots", help="add robots to a running fleet that stays (--serve)")
    one.add_argument("count", type=int, metavar="N", help="how many")
    one.add_argument("--kind", metavar="NAME", help="what they are, in a fleet of several kinds")
    text = "m; start of the first, then of the next; the world finds a free place for each of the others"
    one.add_argument("--at", type=point, action="append", default=[], metavar="X,Y", help=text)
    text = "name of the request, a new one by default; the same request given again changes nothing"
    one.add_argument("--id", metavar="NAME", help=text)
    add_client_options(one)
    one.set_defaults(command=add_robots)
