"""The compaction of a recording that is finished: Rerun writes many small chunks, and few large ones take less room."""

import os
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Final

from dashboard.frames import is_whole
from dashboard.mode import viewer_program

LARGEST: Final = 1_000_000_000  # bytes; Rerun's program holds the whole recording in memory


def compact(recording: Path, within: float) -> None:
    """Make a recording smaller. It stays as it is if that takes longer than ``within`` [s], or fails in any way."""
    program = viewer_program()
    if program is None or not is_whole(recording) or recording.stat().st_size > LARGEST:
        return
    part = recording.with_name(f".{recording.name}.part")
    quiet = subprocess.DEVNULL
    # "live": chunks of a size that the viewer shows well; those for servers are hardly smaller
    command = [str(program), "rrd", "optimize", "--profile", "live", str(recording), "-o", str(part)]
    try:
        done = subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, timeout=within, check=False)
        if done.returncode == 0 and is_whole(part) and part.stat().st_size < recording.stat().st_size:
            os.replace(part, recording)
    except (OSError, subprocess.TimeoutExpired):
        return
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
