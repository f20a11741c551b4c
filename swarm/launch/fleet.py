"""A fleet of processes on this machine, and its supervisor."""

import json
import multiprocessing
import os
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from multiprocessing import connection, forkserver
from multiprocessing.process import BaseProcess
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Final

from swarm.launch import child
from swarm.launch.table import RESTARTS, STOP_ORDER, EarlyEnd, Role
from swarm.scenario.source import Source

LAST_LINES: Final = 12
GRACE: Final = 5.0  # s between SIGTERM and SIGKILL
PRELOAD: Final = ("swarm.launch.preload",)
SOURCE: Final = "SWARM_SOURCE"  # the fork server's environment variable with the scenario that it rehearses
# Once a large block was freed, glibc keeps later ones up to that size. Blocks from 1 MB on shall go back to the system.
MALLOC: Final = {"MALLOC_MMAP_THRESHOLD_": "1000000", "MALLOC_TRIM_THRESHOLD_": "1000000"}


def warm_up(source: Source) -> None:
    """Start the fork server; it imports and computes what the processes need while the caller checks the scenario."""
    multiprocessing.set_forkserver_preload(list(PRELOAD))
    before = dict(os.environ)
    os.environ.update({SOURCE: json.dumps(source, default=str)} | MALLOC)
    try:
        forkserver.ensure_running()
    finally:
        os.environ.clear()
        os.environ.update(before)


@dataclass(frozen=True, slots=True)
class Ended:
    """A process that ended by itself."""

    name: str
    status: int  # exit status; negative: the signal that ended it
    last_lines: str
    then: EarlyEnd


class Fleet:
    """A supervisor of processes, forked from a server that has imported all code. Leaving the ``with`` ends them."""

    def __init__(self, folder: Path, log: Callable[[str], None]) -> None:
        self._folder = folder  # one .log file per process
        self._log = log
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(list(PRELOAD))
        self._running: dict[str, tuple[Role, BaseProcess]] = {}
        self._arguments: dict[str, dict[str, Any]] = {}
        self._restarts: Counter[str] = Counter()

    def __enter__(self) -> "Fleet":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def start(self, role: Role, name: str, arguments: Mapping[str, Any]) -> None:
        """Start a process; its ``name`` must be unique in the fleet."""
        self._arguments[name] = dict(arguments)
        process = self._context.Process(
            target=child.main, args=(role.load, self._arguments[name], self.log_of(name)), name=name, daemon=False
        )
        process.start()
        self._running[name] = (role, process)

    def log_of(self, name: str) -> Path:
        """Return the file with the output of a process."""
        return self._folder / f"{name}.log"

    def pid_of(self, name: str) -> int | None:
        """Return the id of a process, or None if it does not run."""
        return self._running[name][1].pid if name in self._running else None

    def watch(self, timeout: float) -> list[Ended]:
        """Wait up to ``timeout`` [s], restart what the process table says, and return the processes that ended."""
        sentinels = {process.sentinel: name for name, (_, process) in self._running.items()}
        ended = []
        for sentinel in connection.wait(list(sentinels), timeout):
            name = sentinels[sentinel]  # type: ignore[index]
            role, process = self._running.pop(name)
            process.join()
            status = process.exitcode or 0
            then = role.on_failure if status else role.on_success
            if then is EarlyEnd.RESTART:
                self._restarts[name] += 1
                if self._restarts[name] > RESTARTS:
                    then = EarlyEnd.FINISH
            ended.append(Ended(name, status, self.last_lines(name), then))
            if then is EarlyEnd.RESTART:
                self.start(role, name, self._arguments[name])
        return ended

    def last_lines(self, name: str) -> str:
        """Return the last lines that a process has printed."""
        try:
            text = self.log_of(name).read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""
        return "\n".join(text.splitlines()[-LAST_LINES:])

    def stop(self) -> None:
        """End every process with SIGTERM, and with SIGKILL after ``GRACE``; the router ends last, for last messages."""
        for role in STOP_ORDER:
            processes = [process for other, process in self._running.values() if other is role]
            for process in processes:
                process.terminate()
            deadline = monotonic() + GRACE
            for process in processes:
                process.join(max(0.0, deadline - monotonic()))
                if process.is_alive():
                    process.kill()
                    process.join()
        self._running.clear()
