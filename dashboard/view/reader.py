"""The reader of recordings: it returns the texts of an entity, of a file that may be anything."""

from pathlib import Path
from typing import Any, Final, NamedTuple

import rerun.chunk

from dashboard.mode import is_whole
from dashboard.view.layout import TIMELINE
from dashboard.view.recorder import APPLICATION
from swarm.errors import ConfigError

MAGIC: Final = b"RRF"  # the first bytes of each recording
TEXT: Final = "TextDocument:text"


class Recorded(NamedTuple):
    """The texts of one entity."""

    texts: list[str]  # in the order of time
    whole: bool  # the file has the footer that is written at its end


def read_texts(path: Path, entity: str) -> Recorded:
    """Return the texts of an entity.

    Raises:
        ConfigError: there is no such file, or it is no recording of a dashboard.
    """
    try:
        with path.open("rb") as file:
            begin = file.read(len(MAGIC))
    except OSError as fault:
        raise ConfigError(f"{path}: expected a recording, got: {fault.strerror}; give the FILE of --record") from None
    if begin != MAGIC:
        what = "an empty file" if not begin else "another kind of file"
        raise ConfigError(
            f"{path}: expected a recording (.rrd), got {what}; give the FILE of `swarm run --record FILE`"
        )
    try:
        reader = rerun.chunk.RrdReader(path)
        known = {one.application_id for one in reader.recordings()}
        if known and APPLICATION not in known:
            raise ConfigError(
                f"{path}: expected a recording of a fleet, got one of {', '.join(sorted(known))}; "
                "give the FILE of `swarm run --record FILE`"
            )
        chunks = [chunk for chunk in reader.stream().filter(content=entity) if chunk.num_rows] if known else []
        rows = [row for chunk in chunks for row in _rows(chunk)]
    except (OSError, ValueError, RuntimeError) as fault:
        raise ConfigError(f"{path}: expected a recording that can be read, got: {_short(fault)}") from None
    return Recorded([text for _, text in sorted(rows, key=lambda row: row[0])], is_whole(path))


def _rows(chunk: rerun.chunk.Chunk) -> list[tuple[int, str]]:
    """Return time [ns] and text of each row of a chunk."""
    batch: Any = chunk.to_record_batch()
    if chunk.is_static or not {TIMELINE, TEXT} <= set(batch.schema.names):
        return []
    times, values = batch.column(TIMELINE).cast("int64").to_pylist(), batch.column(TEXT).to_pylist()
    return [(time, value[0]) for time, value in zip(times, values, strict=True) if time is not None and value]


def _short(fault: Exception) -> str:
    return (str(fault).splitlines() or [type(fault).__name__])[0][:200]
