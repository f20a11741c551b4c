"""The processes of one launcher's fleet: start them, more of them for robots that come later, and all of them again."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Event as Flag
from typing import Any, Final

from swarm.bus import Endpoint
from swarm.errors import ConfigError
from swarm.launch.options import Options
from swarm.launch.supervise.fleet import Fleet, check_open_files
from swarm.launch.supervise.table import BOX, BRIDGES, DASHBOARD, PROXY, RECORDER, ROBOT, ROUTER, WORLD
from swarm.scenario.starts import robot_names
from swarm.secure import names as members
from swarm.settings import MOST_ROBOTS

NAME: Final = re.compile(r"r\d{1,6}\Z")  # the name of a robot becomes that of its log file
FAREWELL: Final = 15.0  # s for each that writes a file, after the run is over


class Processes:
    """The processes of a fleet; the world writes its report to ``summary_file`` at the end."""

    def __init__(
        self,
        fleet: Fleet,
        options: Options,
        endpoint: Endpoint,
        name: str,
        shown: dict[str, Any] | None,
        summary_file: Path,
        box: dict[str, Any] | None = None,
        tape: Path | None = None,
    ) -> None:
        """Prepare them; ``shown`` are the dashboard's arguments, ``box`` the box's, None if there is none."""
        self._tape = tape
        self.options, self.endpoint, self.name, self.summary_file = options, endpoint, name, summary_file
        self.first_run = 0
        self._fleet, self._shown, self._box = fleet, shown, box
        self._sessions = options.sessions
        self._proxy = None if options.delay is None else replace(endpoint, port=0).claim()  # where the robots connect
        self._known: set[str] = set()  # robots that have a process, or will have none
        self.added = 0  # robots that came later; another set-up is without them

    def _common(self, member: str) -> dict[str, Any]:
        return {"endpoint": self.endpoint.endpoint_for_member(member), "fleet": self.name}

    def start(self) -> None:
        """Start all of them.

        Raises:
            ConfigError: this machine has no room for them.
        """
        self._set_lease(self.options.sessions)
        self._fleet.start(ROUTER, "router", {"endpoint": self.endpoint})
        if self._proxy is not None:
            way = {"endpoint": self._proxy, "router": self.endpoint, "delay": self.options.delay}
            self._fleet.start(PROXY, "proxy", way)
        if self._box is not None:
            self._fleet.start(BOX, "box", self._common(members.OPERATOR) | self._box)
        self._begin()

    def has_new_robots(self, robots: Iterable[str]) -> bool:
        """Return True if robots are new and may come: the fleet stays, and has room for them."""
        return self.options.scenario.settings.serve and bool(self._fresh(robots))

    def add(self, robots: Iterable[str], say: Callable[[str], None]) -> None:
        """Start processes for those robots that are new; say which could not be started."""
        fresh = self._fresh(robots)
        groups = self._in_processes(fresh)
        sessions = self._sessions + len(groups)
        try:
            check_open_files(sessions)
        except ConfigError as fault:
            self._give_up(fresh, fault, say)
            return
        self._set_lease(sessions)
        self.added += len(fresh)
        for some in groups:
            try:
                identity = self.endpoint.endpoint_for_member(some[0]).identity
                if identity is not None:
                    identity.check()
                self._start_robots(some)
            except ConfigError as fault:
                self._give_up(some, fault, say)

    def _fresh(self, robots: Iterable[str]) -> list[str]:
        """Return those robots that are new, as many as the fleet may still get."""
        new = [name for name in dict.fromkeys(robots) if name not in self._known and NAME.match(name)]
        return new[: MOST_ROBOTS - len(self._known)]

    def _give_up(self, robots: Sequence[str], fault: ConfigError, say: Callable[[str], None]) -> None:
        """Say why robots get no process, and try no more."""
        self._known.update(robots)
        say(f"{', '.join(robots)}: not started, the place waits for another process: {fault}")

    def _in_processes(self, robots: Sequence[str]) -> list[Sequence[str]]:
        """Return the robots of each process."""
        size = self.options.robots_per_process
        return [robots[first : first + size] for first in range(0, len(robots), size)]

    def _start_robots(self, robots: Sequence[str]) -> None:
        """Start the process of some robots.

        Raises:
            ConfigError: this machine has no room for it.
        """
        self._known.update(robots)
        name = robots[0] if len(robots) == 1 else f"{robots[0]}-{robots[-1]}"
        common = self._common(robots[0])
        if self._proxy is not None:
            common["endpoint"] = replace(common["endpoint"], port=self._proxy.port)
        self._fleet.start(ROBOT, name, common | {"robots": robots})

    def start_again(self, options: Options, first_run: int, stop: Flag) -> None:
        """End the world, the robots and who listens, and start them with other options, unless told to ``stop``.

        The box stays, and so does the router, unless its lease is too short for the sessions to come.

        Raises:
            ConfigError: this machine has no room for them.
        """
        self._fleet.stop((WORLD,))
        self.let_finish(stop)
        if stop.is_set():
            return
        self._fleet.stop((DASHBOARD, RECORDER, *BRIDGES, ROBOT))
        for file in (self.summary_file, self._snapshot, self.given_up_file):
            file.unlink(missing_ok=True)
        self._fleet.lost.clear()
        self.options, self.first_run = options, first_run
        lease = self.endpoint.lease
        self._set_lease(options.sessions)
        if self.endpoint.lease > lease:
            self._fleet.stop((ROUTER,))
            self._fleet.start(ROUTER, "router", {"endpoint": self.endpoint})
        self._known, self.added = set(), 0
        self._begin()

    def let_finish(self, stop: Flag) -> None:
        """Wait for those who write files to end, for a while, or until told to ``stop``; the run is over."""
        for role in (DASHBOARD, RECORDER):
            self._fleet.await_end(role, FAREWELL, stop)

    def _set_lease(self, sessions: int) -> None:
        """Set the lease of the sessions that are opened from now on, by how many there are."""
        self._sessions, self.endpoint = sessions, self.endpoint.endpoint_for_sessions(sessions)
        self._fleet.amend(lambda given: given | {"endpoint": given["endpoint"].endpoint_for_sessions(sessions)})

    @property
    def _snapshot(self) -> Path:
        return self.summary_file.with_name("world.snapshot")

    @property
    def given_up_file(self) -> Path:
        """The file with the names of robots that are not started again, for the world."""
        return self.summary_file.with_name("given_up")

    def _begin(self) -> None:
        options, shown = self.options, self._shown
        self._fleet.start(
            WORLD,
            "world",
            self._common(members.WORLD)
            | {
                "scenario": options.scenario,
                "robots": options.robots,
                "seed": options.seed,
                "pace": options.pace,
                "limit": options.limit,
                "wait": options.wait,
                "outside": options.outside,
                "watchers": (shown is not None) + (options.bag is not None),
                "report_to": self.summary_file,
                "snapshot": self._snapshot,
                "first_run": self.first_run,
                "given_up": self.given_up_file,
                "tape": self._tape,
            },
        )
        if shown is not None:
            self._fleet.start(DASHBOARD, "dashboard", self._common(members.WATCHER) | shown)
        for bridge in BRIDGES:
            if bridge.name in options.bridges:
                self._fleet.start(bridge, bridge.name, self._common(members.BRIDGE))
        if options.bag is not None:
            self._fleet.start(RECORDER, "recorder", self._common(members.WATCHER) | {"record": options.bag})
        for robots in self._in_processes(robot_names(options.robots)):
            self._start_robots(robots)
