"""The command `swarm watch`: the progress of a running fleet in the terminal, and in Rerun if that is wanted."""

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from swarm.cli.finding import of_a_client, place
from swarm.cli.parsing import Commands, Parser
from swarm.errors import ConfigError
from swarm.secure.identity import WATCHER

if TYPE_CHECKING:
    from swarm.bus import Endpoint

LOOK: Final = 0.1  # s between two looks at what has come
FLAGS: Final = {"web": "--web", "viewer": "--viewer"}  # of `python -m dashboard`
GRACE: Final = 5.0  # s for the dashboard to end


def watch(options: argparse.Namespace) -> int:
    """Show a fleet until its run is over or we are told to stop."""
    from rich.console import Console

    from dashboard.terminal import Terminal
    from swarm.bus import Bus
    from swarm.messages import CLOCK, EVENT, RADIO, STATE, Phase
    from swarm.stopping import told_to_stop

    endpoint, fleet = place(options, WATCHER)
    with (
        told_to_stop() as stop,
        Bus(endpoint, fleet) as bus,
        rerun(options, endpoint, fleet),
        Terminal(Console()) as terminal,
    ):
        bus.watch_presence("robot")
        for topic in (CLOCK, STATE, EVENT, RADIO):
            bus.listen(topic)
        for message in (*bus.fetch(CLOCK), *bus.fetch(STATE)):
            terminal.take(message)
        while not stop.is_set() and terminal.progress.phase is not Phase.OVER:
            arrived = bus.receive(LOOK)
            while arrived is not None:
                terminal.fold(arrived)
                arrived = bus.receive(0.0)
            terminal.refresh()
    return 0


@contextmanager
def rerun(options: argparse.Namespace, endpoint: "Endpoint", fleet: str) -> Iterator[None]:
    """Run the dashboard in a process beside this one, if it is wanted, until the block ends.

    Raises:
        ConfigError: it is wanted and not installed.
    """
    from dashboard.mode import choose, missing

    mode = choose(options.dashboard, os.environ)
    if mode is None:
        yield
        return
    if (lacks := missing()) is not None:
        raise ConfigError(f"--dashboard {options.dashboard}: {lacks}")
    keys = [] if options.secure is None else ["--secure", str(options.secure)]
    command = [sys.executable, "-m", "dashboard", "--connect", str(endpoint), "--fleet", fleet, FLAGS[mode], *keys]
    with subprocess.Popen(command) as process:
        try:
            yield
        finally:
            process.terminate()
            try:
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                process.kill()


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("watch", help="show the progress of a running fleet")
    text = "off by default: only the terminal; web, viewer or auto show Rerun too"
    one.add_argument("--dashboard", default="off", metavar="MODE", help=text)
    of_a_client(one)
    one.set_defaults(command=watch)
