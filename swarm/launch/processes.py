"""The processes of one launcher's fleet: start them, and start them again with another set-up."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from threading import Event as Flag
from typing import Any, Final

from swarm.bus import Endpoint
from swarm.errors import ConfigError
from swarm.launch.newcomers import Newcomers
from swarm.launch.options import Options
from swarm.launch.supervise.fleet import Fleet, check_open_files
from swarm.launch.supervise.table import BOX, DASHBOARD, PROXY, ROBOT, ROUTER, WORLD
from swarm.scenario.starts import names
from swarm.secure import names as members

FAREWELL: Final = 15.0  # s for the dashboard to write its file after the run is over


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
    ) -> None:
        """Prepare them; ``shown`` are the dashboard's arguments, ``box`` the box's, None if there is none."""
        self.options, self.endpoint, self.name, self.summary_file = options, endpoint, name, summary_file
        self.first_run = 0
        self._fleet, self._shown, self._box = fleet, shown, box
        self._sessions = options.sessions
        self._proxy = None if options.delay is None else replace(endpoint, port=0).claim()  # where the robots connect
        self._robots = Newcomers(fleet, options.robots_per_process, self._common_of_robots)

    def _common_of_robots(self, member: str) -> dict[str, Any]:
        common = self._common(member)
        if self._proxy is not None:
            common["endpoint"] = replace(common["endpoint"], port=self._proxy.port)
        return common

    def _common(self, member: str) -> dict[str, Any]:
        return {"endpoint": self.endpoint.seen_by(member), "fleet": self.name}

    def start(self) -> None:
        """Start all of them.

        Raises:
            ConfigError: this machine has no room for them.
        """
        self._share(self.options.sessions)
        self._fleet.start(ROUTER, "router", {"endpoint": self.endpoint})
        if self._proxy is not None:
            way = {"endpoint": self._proxy, "router": self.endpoint, "delay": self.options.delay}
            self._fleet.start(PROXY, "proxy", way)
        if self._box is not None:
            self._fleet.start(BOX, "box", self._common(members.OPERATOR) | self._box)
        self._begin()

    def lacks(self, robots: Iterable[str]) -> bool:
        """Return True if robots are new and may come: the fleet stays, and has room for them."""
        return self.options.scenario.settings.serve and bool(self._robots.fresh(robots))

    def add(self, robots: Iterable[str], say: Callable[[str], None]) -> None:
        """Start processes for those robots that are new; say which could not be started."""
        fresh = self._robots.fresh(robots)
        sessions = self._sessions + self._robots.processes(len(fresh))
        try:
            check_open_files(sessions)
        except ConfigError as fault:
            self._robots.give_up(fresh, fault, say)
            return
        self._share(sessions)
        self._robots.add(fresh, say)

    @property
    def added(self) -> int:
        """How many robots came later; another set-up is without them."""
        return self._robots.added

    def start_again(self, options: Options, first_run: int, stop: Flag) -> None:
        """End the world, the robots and the dashboard, and start them with other options, unless told to ``stop``.

        The box stays, and so does the router, unless its lease is too short for the sessions to come.

        Raises:
            ConfigError: this machine has no room for them.
        """
        self._fleet.stop((WORLD,))
        self.let_finish(stop)
        if stop.is_set():
            return
        self._fleet.stop((DASHBOARD, ROBOT))
        for file in (self.summary_file, self._snapshot, self.given_up):
            file.unlink(missing_ok=True)
        self._fleet.lost.clear()
        self.options, self.first_run = options, first_run
        lease = self.endpoint.lease
        self._share(options.sessions)
        if self.endpoint.lease > lease:
            self._fleet.stop((ROUTER,))
            self._fleet.start(ROUTER, "router", {"endpoint": self.endpoint})
        self._robots = Newcomers(self._fleet, options.robots_per_process, self._common_of_robots)
        self._begin()

    def let_finish(self, stop: Flag) -> None:
        """Wait for the dashboard to write its file and end, for a while, or until told to ``stop``; the run is over."""
        self._fleet.await_end(DASHBOARD, FAREWELL, stop)

    def _share(self, sessions: int) -> None:
        """Set the lease of the sessions that are opened from now on, by how many there are."""
        self._sessions, self.endpoint = sessions, self.endpoint.shared_by(sessions)
        self._fleet.amend(lambda arguments: arguments | {"endpoint": arguments["endpoint"].shared_by(sessions)})

    @property
    def _snapshot(self) -> Path:
        return self.summary_file.with_name("world.snapshot")

    @property
    def given_up(self) -> Path:
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
                "watchers": 1 if shown is not None else 0,
                "report_to": self.summary_file,
                "snapshot": self._snapshot,
                "first_run": self.first_run,
                "given_up": self.given_up,
            },
        )
        if shown is not None:
            self._fleet.start(DASHBOARD, "dashboard", self._common(members.WATCHER) | shown)
        self._robots.start(names(options.robots))
