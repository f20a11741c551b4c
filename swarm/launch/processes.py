"""The processes of one launcher's fleet: start them, and start them again with another set-up."""

from collections.abc import Callable, Iterable
from pathlib import Path
from threading import Event as Flag
from time import monotonic
from typing import Any, Final

from swarm.bus import Endpoint
from swarm.launch.fleet import Fleet
from swarm.launch.newcomers import Newcomers
from swarm.launch.options import Options
from swarm.launch.table import BOX, DASHBOARD, ROBOT, ROUTER, WORLD
from swarm.scenario.starts import names
from swarm.secure import identity

LOOK: Final = 0.1  # s between two looks at the processes
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
        self._robots = Newcomers(fleet, options.robots_per_process, self._common)

    def _common(self, member: str) -> dict[str, Any]:
        return {"endpoint": self.endpoint.seen_by(member), "fleet": self.name}

    def start(self) -> None:
        """Start all of them.

        Raises:
            ConfigError: this machine has no room for them.
        """
        self._fleet.start(ROUTER, "router", {"endpoint": self.endpoint})
        if self._box is not None:
            self._fleet.start(BOX, "box", self._common(identity.OPERATOR) | self._box)
        self._begin()

    def look(self, robots: Iterable[str], say: Callable[[str], None]) -> None:
        """Start processes for robots that the world names and that are new."""
        self._robots.look(robots, say)

    def start_again(self, options: Options, first_run: int, stop: Flag) -> None:
        """End the world, the robots and the dashboard, and start them with other options; router and box stay.

        Raises:
            ConfigError: this machine has no room for them.
        """
        self._fleet.stop((WORLD,))
        let_finish(self._fleet, stop)
        self._fleet.stop((DASHBOARD, ROBOT))
        for file in (self.summary_file, self._snapshot, self.given_up):
            file.unlink(missing_ok=True)
        self._fleet.lost.clear()
        self.options, self.first_run = options, first_run
        self.endpoint = self.endpoint.shared_by(options.sessions)
        self._robots = Newcomers(self._fleet, options.robots_per_process, self._common)
        self._begin()

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
            self._common(identity.WORLD)
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
            self._fleet.start(DASHBOARD, "dashboard", self._common(identity.WATCHER) | shown)
        self._robots.start(names(options.robots))


def let_finish(fleet: Fleet, stop: Flag) -> None:
    """Wait for the dashboard to write its file and end; the run is over."""
    deadline = monotonic() + FAREWELL
    while fleet.pid_of("dashboard") is not None and monotonic() < deadline and not stop.is_set():
        fleet.watch(LOOK, again=False)
