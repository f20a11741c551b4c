"""The entry point of every process of a fleet: its output, its signals and its exit status."""

import io
import os
import signal
import sys
import threading
import traceback
from contextlib import suppress
from multiprocessing import connection, parent_process
from pathlib import Path
from pkgutil import resolve_name
from time import sleep
from typing import Any, Final

from swarm.errors import SwarmError
from swarm.launch.process_name import name_process
from swarm.launch.supervise.table import CRASHED
from swarm.stop_signal import leave_terminal_to_parent

GRACE: Final = 20.0  # s from SIGTERM to SIGKILL without a launcher; a dashboard finishes its file within that


class Log(io.FileIO):
    """The output of a process. What a full disk does not take is dropped: it must not end the process."""

    def write(self, data: Any) -> int:  # noqa: ANN401, a buffer
        """Write to the file if that is possible."""
        try:
            return super().write(data) or 0
        except OSError:
            return len(data)


def main(run: str, arguments: dict[str, Any], log: Path) -> None:
    """Call the function of this process, ``module:function``, and end with the exit status that it returns."""
    leave_terminal_to_parent()
    name_process(log.stem)
    try:
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o600)
    except OSError:  # the folder is gone or full: the process does its work without a log
        output = os.open(os.devnull, os.O_WRONLY)
    for number in (1, 2):
        os.dup2(output, number)
    sys.stdout, sys.stderr = (
        io.TextIOWrapper(Log(number, "w", closefd=False), "utf-8", "replace", write_through=True) for number in (1, 2)
    )
    die_with_parent()
    status = CRASHED
    try:
        status = resolve_name(run)(**arguments)
    except SwarmError as fault:
        print(fault, file=sys.stderr)
        status = 2
    except Exception:  # a fault of ours: the launcher starts a process again that ended so
        traceback.print_exc()
    with suppress(OSError):
        status_file_of(log).write_text(str(status or 0), encoding="utf-8")
    os._exit(status or 0)  # without the exit handlers of the fork server


def status_file_of(log: Path) -> Path:
    """Return the file with the exit status of a process that ended by itself, for a launcher without a fork server."""
    return log.with_suffix(".status")


def die_with_parent() -> None:
    """End this process when the launcher ends, whatever ended it: by SIGTERM, and by SIGKILL if it does not end then.

    A session of Zenoh that is closed on a machine under load may never come back.
    """
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)
        sleep(GRACE)
        os.kill(os.getpid(), signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()
