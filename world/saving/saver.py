"""The file from which a world that was killed goes on."""

from collections.abc import Callable
from pathlib import Path

from swarm.maps.wire import pack
from swarm.messages import PackedMap
from swarm.scenario.load import Scenario
from world.saving.snapshot import HostState, Snapshot
from world.saving.snapshot_file import fingerprint, write
from world.world import World


class Saver:
    """Writes snapshots of one world's process; a file that cannot be written is logged once and costs no run."""

    def __init__(self, path: Path | None, scenario: Scenario, seed: int, log: Callable[[str], None]) -> None:
        self._path, self._log = path, log
        self._scenario = fingerprint(scenario) if path is not None else ""
        self._seed = seed
        self._floor: tuple[int, PackedMap] | None = None  # number of edits, map
        self._failed = False

    def save(self, world: World, host: Callable[[], HostState]) -> None:
        """Write a snapshot between two ticks."""
        if self._path is None:
            return
        if world.bodies.edits and (self._floor is None or self._floor[0] != world.bodies.edits):
            self._floor = world.bodies.edits, pack(world.bodies.floor)
        snapshot = Snapshot(
            scenario=self._scenario,
            robots=len(world.robots) - len(world.tasks.places.starts),
            places=world.tasks.places,
            seed=self._seed,
            identity=world.identity,
            run=world.run,
            floor=self._floor[1] if self._floor is not None else None,
            state=world.save(),
            host=host(),
        )
        try:
            write(snapshot, self._path)
        except OSError as fault:
            if not self._failed:
                self._failed = True
                self._log(f"snapshot {self._path}: cannot be written ({fault.strerror}); a killed world is lost")
        else:
            self._failed = False
