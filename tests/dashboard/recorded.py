"""Reads a recording back without the code that wrote it."""

import warnings
from pathlib import Path
from typing import Any

import rerun.chunk


class Recording:
    """The chunks of an ``.rrd`` file."""

    def __init__(self, path: Path) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it has no index
            self._chunks = [chunk for chunk in rerun.chunk.RrdReader(str(path)).stream() if chunk.num_rows]

    @property
    def entities(self) -> set[str]:
        """Names of everything drawn."""
        return {chunk.entity_path for chunk in self._chunks if not chunk.entity_path.startswith("/__")}

    @property
    def components(self) -> set[tuple[str, str, bool]]:
        """Everything drawn: its entity, its component, and whether it stands still."""
        names = [(chunk, name) for chunk in self._chunks for name in chunk.to_record_batch().schema.names]
        return {(chunk.entity_path, name, chunk.is_static) for chunk, name in names if ":" in name}

    @property
    def timelines(self) -> set[str]:
        """Names of all timelines."""
        return {name for chunk in self._chunks for name in chunk.timeline_names}

    def rows(self, entity: str, component: str) -> list[tuple[float, list[Any]]]:
        """Return all values of a component, by time [s]; what stands still has time -1."""
        found = []
        for chunk in self._chunks:
            batch = chunk.to_record_batch()
            if chunk.entity_path != entity or component not in batch.schema.names:
                continue
            values = batch.column(component).to_pylist()
            if chunk.is_static:
                times = [-1.0] * len(values)
            else:
                times = [nanos / 1e9 for nanos in batch.column("sim_time").cast("int64").to_pylist()]
            found += [(time, value) for time, value in zip(times, values, strict=True) if value is not None]
        return sorted(found, key=lambda row: row[0])
