"""The processes of robots: those that a fleet begins with, and one for each place that the world opens later."""

import re
from collections.abc import Callable, Iterable, Sequence
from math import ceil
from typing import Any, Final

from swarm.errors import ConfigError
from swarm.launch.supervise.fleet import Fleet
from swarm.launch.supervise.table import ROBOT
from swarm.secure import Identity
from swarm.settings import MOST_ROBOTS

NAME: Final = re.compile(r"r\d{1,6}\Z")  # the name of a robot becomes that of its log file


class Newcomers:
    """The robots of one run that have a process; ``common`` returns what each member's process gets as arguments."""

    def __init__(self, fleet: Fleet, size: int, common: Callable[[str], dict[str, Any]]) -> None:
        self._fleet, self._size, self._common = fleet, size, common  # size: robots that share a process
        self._known: set[str] = set()
        self.added = 0  # robots that came later

    def fresh(self, robots: Iterable[str]) -> list[str]:
        """Return those robots that are new, as many as the fleet may still get."""
        new = [name for name in dict.fromkeys(robots) if name not in self._known and NAME.match(name)]
        return new[: MOST_ROBOTS - len(self._known)]

    def processes(self, robots: int) -> int:
        """Return how many processes so many robots need."""
        return ceil(robots / self._size)

    def start(self, robots: Sequence[str]) -> None:
        """Start the processes of robots.

        Raises:
            ConfigError: this machine has no room for them.
        """
        self._known.update(robots)
        for some in self._in_processes(robots):
            name = some[0] if len(some) == 1 else f"{some[0]}-{some[-1]}"
            self._fleet.start(ROBOT, name, self._common(some[0]) | {"robots": some})

    def add(self, robots: Sequence[str], say: Callable[[str], None]) -> None:
        """Start the processes of robots that came later; say which could not be started."""
        self.added += len(robots)
        for some in self._in_processes(robots):
            try:
                identity: Identity | None = self._common(some[0])["endpoint"].identity
                if identity is not None:
                    identity.check()
                self.start(some)
            except ConfigError as fault:
                self.give_up(some, fault, say)

    def give_up(self, robots: Sequence[str], fault: ConfigError, say: Callable[[str], None]) -> None:
        """Say why robots get no process, and try no more."""
        self._known.update(robots)
        say(f"{', '.join(robots)}: not started, the place waits for another process: {fault}")

    def _in_processes(self, robots: Sequence[str]) -> Iterable[Sequence[str]]:
        return (robots[first : first + self._size] for first in range(0, len(robots), self._size))
