"""The processes of robots: those that a fleet begins with, and one for each place that the world opens later.

The launcher learns of new places as everybody else does, from the robots that the world's clock names.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from swarm.errors import ConfigError
from swarm.launch.fleet import Fleet, check_open_files
from swarm.launch.table import ROBOT
from swarm.secure import Identity

NAME: Final = re.compile(r"r\d{1,6}\Z")  # the name of a robot becomes that of its log file


class Newcomers:
    """The robots of one run that have a process; ``common`` returns what each member's process gets as arguments."""

    def __init__(self, fleet: Fleet, size: int, common: Callable[[str], dict[str, Any]]) -> None:
        self._fleet, self._size, self._common = fleet, size, common  # size: robots that share a process
        self._known: set[str] = set()

    def start(self, robots: Sequence[str]) -> None:
        """Start the processes of robots.

        Raises:
            ConfigError: this machine has no room for them, or a robot has no keys.
        """
        self._known.update(robots)
        for first in range(0, len(robots), self._size):
            some = robots[first : first + self._size]
            arguments = self._common(some[0])
            identity: Identity | None = arguments["endpoint"].identity
            if identity is not None:
                identity.check()
            name = some[0] if len(some) == 1 else f"{some[0]}-{some[-1]}"
            self._fleet.start(ROBOT, name, arguments | {"robots": some})

    def look(self, robots: Iterable[str], say: Callable[[str], None]) -> None:
        """Start processes for those robots that the world names and that are new; say which could not be started."""
        fresh = [name for name in robots if name not in self._known and NAME.match(name)]
        for first in range(0, len(fresh), self._size):
            some = fresh[first : first + self._size]
            try:
                check_open_files(len(self._known) + len(fresh))
                self.start(some)
            except ConfigError as fault:
                self._known.update(some)
                say(f"{', '.join(some)}: not started, the place waits for another process: {fault}")
