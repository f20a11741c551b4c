"""The reader of recordings: what is in a file, which may be anything, and which file a dashboard goes on from."""

import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import rerun
import rerun.chunk

from dashboard.fold.account import Saved, is_earlier, read
from dashboard.frames import is_whole, readable, written_by
from dashboard.rerun.layout import ACCOUNT, APPLICATION, TIMELINE
from swarm.errors import ConfigError

TEXT: Final = "TextDocument:text"
LARGEST: Final = 256 * 2**20  # bytes of a file to go on from; the server keeps no more either
ASK: Final = "give the FILE of `swarm run --record FILE`"


def read_account(path: Path) -> tuple[Saved, bool]:
    """Return the last account of a recording, and whether it has its end; of one that is cut, the last before the cut.

    Raises:
        ConfigError: the file is no recording of a dashboard that can be read, or has no account.
    """
    try:
        _check(path)
        with readable(path) as file:
            texts, whole = _accounts(file, path), is_whole(path)
    except OSError as fault:
        why = fault.strerror or _short(fault)
        raise ConfigError(f"{path}: expected a recording that can be read, got: {why}; {ASK}") from None
    except (ValueError, RuntimeError) as fault:
        raise ConfigError(f"{path}: expected a recording, got one that is spoilt: {_short(fault)}; {ASK}") from None
    if not texts:
        why = "its dashboard ended before the world had told it any" if whole else "it is cut before the first"
        raise ConfigError(f"{path}: expected an account of the run, found none: {why}, or it is of an older version")
    try:
        return read(texts[-1]), whole
    except ConfigError as fault:
        raise ConfigError(f"{path}: {fault}") from None


def earlier(files: Sequence[Path], account: Saved) -> Path | None:
    """Return the newest recording of the same run among those of earlier dashboards, the newest first; None: none.

    A fleet that was restarted has several recordings of each dashboard.
    """
    for first in files:
        for path in (*sorted(first.parent.glob(f"{first.stem}-run*{first.suffix}"), reverse=True), first):
            try:
                if path.stat().st_size <= LARGEST and is_earlier(read_account(path)[0], account):
                    return path
            except (OSError, ConfigError):
                continue
    return None


def moving(path: Path) -> Iterator[rerun.chunk.Chunk]:
    """Yield the chunks of a recording that are on the timeline.

    Raises:
        OSError, ValueError, RuntimeError: the file cannot be read.
    """
    with readable(path) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore", rerun.error_utils.RerunWarning)  # that a file has no footer
        for chunk in rerun.chunk.RrdReader(file).stream():
            if not chunk.is_static and TIMELINE in chunk.timeline_names:
                yield chunk


def _check(path: Path) -> None:
    """Check that a file is a recording that this version of Rerun reads."""
    version, ours = written_by(path), _ours()
    if version is None:
        what = "another file, or one that is cut at its begin" if path.stat().st_size else "an empty file"
        raise ConfigError(f"{path}: expected a recording (.rrd), got {what}; {ASK}")
    if version > ours:
        theirs, known = (f"{major}.{minor}" for major, minor in (version, ours))
        raise ConfigError(
            f"{path}: expected a recording of Rerun {known} or older, got one of {theirs}; "
            "analyze it with the version of this project that has recorded it"
        )


def _ours() -> tuple[int, int]:
    major, minor, *_ = rerun.__version__.split(".")
    return int(major), int(minor)


def _accounts(file: Path, named: Path) -> list[str]:
    """Return the texts of all accounts in a file, in the order of time."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rerun.error_utils.RerunWarning)  # that a file has no footer
        reader = rerun.chunk.RrdReader(file)
        known = {one.application_id for one in reader.recordings()}
    if known and APPLICATION not in known:
        found = ", ".join(sorted(known))
        raise ConfigError(f"{named}: expected a recording of a fleet, got one of {found}; {ASK}")
    chunks = [chunk for chunk in reader.stream().filter(content=f"/{ACCOUNT}") if chunk.num_rows] if known else []
    rows = [row for chunk in chunks for row in _rows(chunk)]
    return [text for _, text in sorted(rows, key=lambda row: row[0])]


def _rows(chunk: rerun.chunk.Chunk) -> list[tuple[int, str]]:
    """Return time [ns] and text of each row of a chunk."""
    batch: Any = chunk.to_record_batch()
    if chunk.is_static or not {TIMELINE, TEXT} <= set(batch.schema.names):
        return []
    times, values = batch.column(TIMELINE).cast("int64").to_pylist(), batch.column(TEXT).to_pylist()
    return [(time, value[0]) for time, value in zip(times, values, strict=True) if time is not None and value]


def _short(fault: Exception) -> str:
    return (str(fault).splitlines() or [type(fault).__name__])[0][:200]
