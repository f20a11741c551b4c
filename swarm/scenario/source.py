"""The files that a scenario is read from, as a command names them; nothing is imported before they are read."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from swarm.scenario.load import Scenario


class Source(NamedTuple):
    """A scenario file, or a MovingAI map with a ``.scen`` file."""

    file: Path
    scen: Path | None = None
    robots: int | None = None  # how many rows of the ``.scen`` file; None: all
    serve: bool = False  # the fleet stays, whatever the file says

    def read(self) -> "Scenario":
        """Return the scenario.

        Raises:
            ConfigError: a file is missing or wrong.
        """
        if self.scen is None:
            from swarm.scenario.load import load

            return load(self.file, serve=self.serve)
        from swarm.scenario.benchmark import from_benchmark

        return from_benchmark(self.file, self.scen, self.robots, serve=self.serve)
