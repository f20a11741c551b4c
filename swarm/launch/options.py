"""The options of `swarm run`, and their check before anything is started."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

from swarm.errors import ConfigError
from swarm.launch.proxy import Delay
from swarm.launch.supervise.fleet import check_open_files
from swarm.scenario.check import check
from swarm.scenario.load import Scenario
from swarm.settings import Pace
from world.bodies.external import check_external


@dataclass(frozen=True, kw_only=True)
class Options:
    """The options of `swarm run`."""

    scenario: Scenario
    robots: int
    robots_per_process: int = 1
    asked_seed: int | None = None  # None: the scenario's
    pace: Pace
    asked_limit: float | None = None  # s, simulated; None: the scenario's
    wait: bool = False
    dashboard: str = "off"  # auto, viewer, web, box, off
    rules: str | None = None  # the robot whose fired rules the dashboard shows
    record: Path | None = None  # what the dashboard draws
    tape: Path | None = None  # None: beside the folder of the fleet
    bag: Path | None = None  # of ROS 2
    report: Path | None = None
    port: int = 0  # 0: a free one
    fleet: str | None = None
    secure: Path | None = None  # the folder with the keys; None: the fleet is open to all on this machine
    outside: Sequence[str] = ()  # robots whose body reports from outside the world
    bridges: Sequence[str] = ()  # names of processes that show the fleet to other software
    quiet: bool = False  # only trouble and the summary
    delay: Delay | None = None  # of the network between robots and router; None: there is no proxy
    loaded: Scenario | None = None  # the scenario before it was checked, which a set-up changes

    @property
    def seed(self) -> int:
        """The seed of the run."""
        return self.scenario.settings.seed if self.asked_seed is None else self.asked_seed

    @property
    def limit(self) -> float:
        """The simulated time [s] after which the run ends."""
        return self.scenario.limit(self.asked_limit)

    @property
    def sessions(self) -> int:
        """How many processes the fleet has: robots, world, router, dashboard, box; those that were asked for."""
        more = (self.delay is not None) + (self.bag is not None) + len(self.bridges)
        return 4 + more + ceil(self.robots / self.robots_per_process)


def ready(options: Options) -> Options:
    """Return the options with the scenario prepared for its run.

    Raises:
        ConfigError: the scenario cannot be driven by so many robots, or this machine has no room for them.
    """
    check_open_files(options.sessions)
    mission = check(options.scenario, options.robots, options.seed)
    check_external(options.outside, options.robots)
    return replace(options, scenario=mission.scenario, loaded=options.scenario)


def check_output(flag: str, path: Path) -> None:
    """Check that a file which ``flag`` names can be written, as far as its folder tells.

    Raises:
        ConfigError: it is a folder, or its folder cannot be written.
    """
    if path.is_dir():
        raise ConfigError(f"{flag} {path}: expected a file's name, got a folder; add one")
    if not os.access(path.parent, os.W_OK):
        raise ConfigError(f"{flag} {path}: expected a folder that can be written, {path.parent} is not; choose another")
