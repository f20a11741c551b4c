"""The state of robots as bytes, without what never changes and all of them share."""

import io
import pickle
from collections.abc import Iterable
from types import MappingProxyType
from typing import Any

from swarm.fuzzy import Controller
from swarm.maps.occupancy import OccupancyMap
from swarm.planning.grid import Grid
from swarm.scenario.load import Scenario
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import CellMap

SHARED = (Scenario, Controller, CellMap, Grid, OccupancyMap, Settings)


def read_only(inside: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    """Return a mapping that cannot be changed: the type itself has no name that a pickle could use."""
    return MappingProxyType(inside)


class Frozen:
    """Packs and unpacks; what is shared stays in the memory of this process, so the bytes are of no use to another."""

    def __init__(self, shared: Iterable[object] = ()) -> None:
        self._shared: dict[int, object] = {id(one): one for one in shared}

    def packed(self, thing: object) -> bytes:
        """Return a value as bytes."""
        file, shared = io.BytesIO(), self._shared

        class Packer(pickle.Pickler):
            def persistent_id(self, one: object) -> int | None:
                if isinstance(one, SHARED):
                    shared[id(one)] = one
                    return id(one)
                return None

            def reducer_override(self, one: object) -> Any:  # noqa: ANN401
                return (read_only, (dict(one),)) if isinstance(one, MappingProxyType) else NotImplemented

        Packer(file, protocol=5).dump(thing)
        return file.getvalue()

    def unpacked(self, data: bytes) -> Any:  # noqa: ANN401
        """Return the value of bytes that this object has packed."""
        shared = self._shared

        class Opener(pickle.Unpickler):
            def persistent_load(self, name: int) -> object:
                return shared[name]

        return Opener(io.BytesIO(data)).load()
