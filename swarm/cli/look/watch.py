"""The command `swarm watch`: the progress of a running fleet in the terminal, and in Rerun if that is wanted."""

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.fleet_lookup import add_client_options, find_fleet
from swarm.errors import ConfigError
from swarm.installation import hint_for_extra
from swarm.secure.names import WATCHER

if TYPE_CHECKING:
    from swarm.bus import Endpoint

LOOK: Final = 0.1  # s between two looks at what has come
FLAGS: Final = {"web": "--web", "viewer": "--viewer"}  # of `python -m dashboard`
GRACE: Final = 5.0  # s for the dashboard to end


def watch(options: argparse.Namespace) -> int:
    """Show a fleet until its run is over or we are told to stop."""
    from rich.console import Console

    from dashboard.terminal import FOLLOWED, Terminal
    from swarm.bus import Bus
    from swarm.messages import CLOCK, MAP, STATE, Phase
    from swarm.stop_signal import stop_flag

    endpoint, fleet = find_fleet(options, WATCHER)
    console, worlds = Console(), Worlds()
    with stop_flag() as stop, Bus(endpoint, fleet) as bus, rerun(options, endpoint, fleet):
        floors = bus.fetch(MAP)
        home = all(floor.scenario.settings.return_home for floor in floors)
        bus.watch_presence()
        for topic in FOLLOWED:
            bus.listen(topic)
        with Terminal(console, home=home) as terminal:
            for message in (*floors, *bus.fetch(CLOCK), *bus.fetch(STATE)):
                terminal.take(message)
            while not stop.is_set() and terminal.progress.phase is not Phase.OVER:
                arrived = bus.receive(LOOK)
                if arrived is None and worlds.have_gone():  # not while its last words may be on the way
                    console.print("the world has gone; Ctrl-C ends this")
                while arrived is not None:
                    terminal.take(arrived)
                    worlds.fold(arrived)
                    arrived = bus.receive(0.0)
                terminal.refresh()
    return 0


class Worlds:
    """The sessions in which a fleet's world is present: a new one may come before an old one has gone."""

    def __init__(self) -> None:
        self._present: set[str] = set()
        self._told = True  # that there is none

    def fold(self, arrived: object) -> None:
        """Take in what ``Bus.receive`` returned."""
        from swarm.bus import Presence

        if not isinstance(arrived, Presence) or arrived.role != "world":
            return
        if arrived.alive:
            self._present.add(arrived.session)
            self._told = False
        else:
            self._present.discard(arrived.session)

    def have_gone(self) -> bool:
        """Return True once, at the first call after the last one has gone."""
        told, self._told = self._told, self._told or not self._present
        return not told and self._told


@contextmanager
def rerun(options: argparse.Namespace, endpoint: "Endpoint", fleet: str) -> Iterator[None]:
    """Run the dashboard in a process beside this one, if it is wanted, until the block ends.

    Raises:
        ConfigError: it is wanted and not installed.
    """
    from dashboard.mode import choose

    mode = choose(options.dashboard, os.environ)
    if mode is None:
        yield
        return
    if (lacks := hint_for_extra("rerun")) is not None:
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
    add_client_options(one)
    one.set_defaults(command=watch)
