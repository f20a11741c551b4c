"""The command `swarm logs`: what happened in a fleet, an event in a line."""

import argparse
from typing import TYPE_CHECKING, Final

import msgspec

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.fleet_lookup import add_client_options, fleet_bus
from swarm.errors import ConfigError, suggest
from swarm.secure.names import WATCHER

if TYPE_CHECKING:
    from swarm.messages import Event

LOOK: Final = 0.2  # s between two looks whether we are told to stop


def logs(options: argparse.Namespace) -> int:
    """Print the last 100 events of a fleet; with --follow those that come too, until the run is over or Ctrl-C.

    Return 1 if there was none.
    """
    from swarm.bus import Arrival
    from swarm.messages import CLOCK, EVENT, EVENTS, Clock, Event, Phase
    from swarm.stop_signal import stop_flag

    with stop_flag() as stop, fleet_bus(options, WATCHER) as bus:
        if options.follow:  # before the kept ones are asked for: none is missed, and some come twice
            bus.listen(EVENT)
            bus.listen(CLOCK)
        if not (clocks := bus.fetch(CLOCK)):
            raise ConfigError("logs: expected a world in that fleet, found none; start one with `swarm world`")
        if options.robot is not None and options.robot not in (robots := clocks[0].robots):
            raise ConfigError(
                f"logs: expected a robot of the fleet, got {options.robot!r}; {suggest(options.robot, robots)}"
            )
        kept = [event for answer in bus.fetch(EVENTS) for event in answer.events]
        printed = sum(show(event, options) for event in kept)
        while options.follow and not stop.is_set():
            match bus.receive(LOOK):
                case Arrival(message=Event() as event) if event not in kept:
                    printed += show(event, options)
                case Arrival(message=Clock(phase=Phase.OVER)):  # the last message of a run
                    break
    return 0 if printed else 1


def show(event: "Event", options: argparse.Namespace) -> bool:
    """Print an event if it is about the robot that is asked for, or if all are; return True if it was printed."""
    if wanted := options.robot in {None, event.robot}:
        print(msgspec.json.encode(event).decode() if options.json else format_event(event), flush=True)
    return wanted


def format_event(event: "Event") -> str:
    """Return an event as a line for people: the run, its time in it, whom it is about, and what happened."""
    return f"run {event.run} {event.time:9.2f} s  {event.robot or '-':<4} {event.text}"


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("logs", help="print what happened in a running fleet: the last 100 events")
    one.add_argument("robot", nargs="?", metavar="ROBOT", help="only what is about this one")
    one.add_argument("--follow", action="store_true", help="then go on with those that come, until the run is over")
    one.add_argument("--json", action="store_true", help="an object per line")
    add_client_options(one)
    one.set_defaults(command=logs)
