"""What a dashboard that was killed has recorded of the run that goes on."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from dashboard.fold.account import Saved, is_earlier
from dashboard.rerun.reader import read_account
from swarm.errors import ConfigError

LARGEST: Final = 256 * 2**20  # bytes; the server keeps no more either


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
