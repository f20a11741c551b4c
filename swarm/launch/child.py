"""The first lines that run in a process of the fleet: where its output goes, what ends it, how its end is told."""

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
    """Call what runs in this process and end with its exit status."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the launcher tells each one
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
    os._exit(status or 0)  # the fork server's own at-exit work is not ours


def _die_with_parent() -> None:
    """Stop in order when the launcher is gone, however it went."""
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()
