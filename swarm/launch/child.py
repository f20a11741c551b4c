"""The entry point of every process of a fleet: its output, its signals and its exit status."""

import os
import signal
import sys
import threading
from collections.abc import Callable
from multiprocessing import connection, parent_process
from pathlib import Path
from typing import Any

from swarm.errors import SwarmError


def main(load: Callable[[], Callable[..., int]], arguments: dict[str, Any], log: Path) -> None:
    """Call the function of this process and end with the exit status that it returns."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the launcher stops them in order
    output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    os.dup2(output, 1)
    os.dup2(output, 2)
    sys.stdout = open(1, "w", buffering=1, closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, closefd=False)  # noqa: SIM115
    _die_with_parent()
    try:
        status = load()(**arguments)
    except SwarmError as fault:
        print(fault, file=sys.stderr)
        status = 2
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status or 0)  # without the exit handlers of the fork server


def _die_with_parent() -> None:
    """Send SIGTERM to this process when the launcher ends, whatever ended it."""
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()
