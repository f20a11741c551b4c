"""A fleet of processes on this machine, and its supervisor."""

import json
import multiprocessing
import os
import resource
import signal
from collections import defaultdict, deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection, forkserver
from multiprocessing.process import BaseProcess
from pathlib import Path
from threading import Event as Flag
from time import monotonic
from typing import Any, Final

from swarm.errors import ConfigError
from swarm.launch.supervise import child
from swarm.launch.supervise.table import CRASHED, RESTARTS, ROBOT, STOP_ORDER, WITHIN, EarlyEnd, Role
from swarm.scenario.source import Source

LOOK: Final = 0.1  # s between two looks at the processes
LAST_LINES: Final = 12
REAP: Final = 1.0  # s that the fork server has to tell the exit status of a process that has ended
FORK_SERVER_DIED: Final = 255  # the exit status that multiprocessing makes up then
PRELOAD: Final = ("swarm.launch.supervise.preload",)
SECURE: Final = ("swarm.secure.certificates",)  # 9 MB that processes with keys share
SOURCE: Final = "SWARM_SOURCE"  # the fork server's environment variable with the scenario that it rehearses
# Once a large block was freed, glibc keeps later ones up to that size. Blocks from 1 MB on shall go back to the system.
MALLOC: Final = {"MALLOC_MMAP_THRESHOLD_": "1000000", "MALLOC_TRIM_THRESHOLD_": "1000000"}
FILES: Final = (96, 4)  # open files that a launcher needs, and more of them for each process of the fleet
MOST_FILES: Final = 65_536


def warm_up(source: Source, secure: bool = False) -> None:
    """Start the fork server; it imports and computes what the processes need while the caller checks the scenario."""
    allow_open_files()
    multiprocessing.set_forkserver_preload([*PRELOAD, *(SECURE if secure else ())])
    os.environ.update(MALLOC)  # also for a fork server that is started again
    os.environ[SOURCE] = json.dumps(source, default=str)
    try:
        forkserver.ensure_running()
    finally:
        del os.environ[SOURCE]


def call_off() -> None:
    """End the fork server before any process was forked: it would import for seconds, and hold the output open."""
    server: Any = forkserver._forkserver  # multiprocessing has no public way to end it
    if server._forkserver_pid is not None:
        with suppress(ProcessLookupError):
            os.kill(server._forkserver_pid, signal.SIGKILL)
        server._stop()


def allow_open_files() -> int:
    """Raise this process's limit of open files, and that of its children, as far as the system lets it; return it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = MOST_FILES if hard == resource.RLIM_INFINITY else min(hard, MOST_FILES)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    return most


def check_open_files(processes: int) -> None:
    """Check the limit of open files.

    Raises:
        ConfigError: it is too low for a fleet of so many processes.
    """
    needed = FILES[0] + FILES[1] * processes
    if (most := allow_open_files()) < needed:
        raise ConfigError(
            f"open files: expected a limit of at least {needed} for {processes} processes, got {most}; "
            f"raise it with `ulimit -n {needed}`, or run fewer robots"
        )


@dataclass(frozen=True, slots=True)
class Ended:
    """A process that ended by itself."""

    name: str
    status: int  # exit status; negative: the signal that ended it
    last_lines: str
    then: EarlyEnd
    robots: tuple[str, ...]  # that it drove


class Running:
    """A process of the fleet. It is watched by the kernel's descriptor of it, which outlives the fork server."""

    def __init__(self, role: Role, process: BaseProcess, log: Path) -> None:
        self.role = role
        self._process = process
        self._status = child.status_file_of(log)
        try:
            self.descriptor: int | None = os.pidfd_open(process.pid or 0)
        except ProcessLookupError:  # it has ended already
            self.descriptor = None

    @property
    def ends(self) -> int:
        """What becomes readable when the process ends."""
        return self._process.sentinel if self.descriptor is None else self.descriptor

    def send(self, number: signal.Signals) -> None:
        """Send a signal if the process is alive."""
        if self.descriptor is not None:
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self.descriptor, number)

    def wait(self, timeout: float | None) -> bool:
        """Return True as soon as the process has ended, False after ``timeout`` [s]."""
        return bool(connection.wait([self.ends], timeout))

    def close(self) -> int:
        """Return the exit status of the process, which has ended."""
        if self.descriptor is not None:
            os.close(self.descriptor)
            self.descriptor = None
        self._process.join(REAP)
        status = self._process.exitcode
        if status in {None, FORK_SERVER_DIED}:
            with suppress(OSError, ValueError):
                return int(self._status.read_text(encoding="utf-8"))
            return -signal.SIGKILL
        return status or 0


class Fleet:
    """A supervisor of processes, forked from a server that has imported all code. Leaving the ``with`` ends them."""

    def __init__(self, folder: Path, log: Callable[[str], None]) -> None:
        self._folder = folder  # one .log file per process
        self._log = log
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(list(PRELOAD))
        self._running: dict[str, Running] = {}
        self._arguments: dict[str, dict[str, Any]] = {}  # of each process, as it was asked for
        self._ends: defaultdict[str, deque[float]] = defaultdict(deque)  # [s] of a process, within WITHIN
        self.starts: defaultdict[str, int] = defaultdict(int)  # how often each process was started
        self.lost: list[str] = []  # robots whose processes were not started again

    def __enter__(self) -> "Fleet":
        return self

    def __exit__(self, *fault: object) -> None:
        self.stop()

    def start(self, role: Role, name: str, arguments: Mapping[str, Any]) -> None:
        """Start a process; its ``name`` must be unique in the fleet.

        Raises:
            ConfigError: this machine has no room for another process.
        """
        self._arguments[name] = dict(arguments)
        self._launch(role, name)

    def amend(self, change: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
        """Change the arguments with which processes are started again."""
        self._arguments = {name: change(arguments) for name, arguments in self._arguments.items()}

    def _launch(self, role: Role, name: str) -> None:
        arguments = role.again(self._arguments[name], self.starts[name] + 1)
        child.status_file_of(self.log_of(name)).unlink(missing_ok=True)
        process = self._context.Process(
            target=child.main, args=(role.run, dict(arguments), self.log_of(name)), name=name, daemon=False
        )
        for left in (1, 0):  # a fork server that was killed just now is started again at the second attempt
            try:
                process.start()
                break
            except (OSError, EOFError) as fault:
                if left == 0:
                    reason = getattr(fault, "strerror", None) or "no answer from the fork server"
                    raise ConfigError(
                        f"{name}: expected to start a process, got: {reason}; free memory, or run fewer robots"
                    ) from None
        self._running[name] = Running(role, process, self.log_of(name))
        self.starts[name] += 1

    def log_of(self, name: str) -> Path:
        """Return the file with the output of a process."""
        return self._folder / f"{name}.log"

    def watch(self, timeout: float = LOOK) -> list[Ended]:
        """Wait up to ``timeout`` [s], restart what the process table says, and return the processes that ended."""
        ends = {running.ends: name for name, running in self._running.items()}
        ended = []
        for end in connection.wait(list(ends), timeout):
            name = ends[end]  # type: ignore[index]
            running = self._running.pop(name)
            status, role = running.close(), running.role
            killed = status < 0 or status == CRASHED
            then = role.on_kill if killed else role.on_failure if status else role.on_success
            if then is EarlyEnd.RESTART and self.note_end(name):
                then = role.too_often
            robots = tuple(self._arguments[name]["robots"]) if role is ROBOT else ()
            if then is EarlyEnd.LOSE:
                self.lost += robots
            ended.append(Ended(name, status, self.last_lines(name), then, robots))
            if then is EarlyEnd.RESTART:
                self._launch(role, name)
        return ended

    def await_end(self, role: Role, timeout: float, stop: Flag) -> None:
        """Wait until the processes of a role have ended, for ``timeout`` [s] at most, or until told to ``stop``."""
        deadline = monotonic() + timeout
        for running in [running for running in self._running.values() if running.role is role]:
            while not (running.wait(LOOK) or stop.is_set() or monotonic() > deadline):
                pass

    def note_end(self, name: str) -> bool:
        """Note that a process has ended; return True if it has done so more than RESTARTS times within WITHIN."""
        ends, now = self._ends[name], monotonic()
        ends.append(now)
        while now - ends[0] > WITHIN:
            ends.popleft()
        return len(ends) > RESTARTS

    def last_lines(self, name: str) -> str:
        """Return the last lines that a process has printed."""
        try:
            text = self.log_of(name).read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""
        return "\n".join(text.splitlines()[-LAST_LINES:])

    def tell_lost(self, file: Path) -> None:
        """Write the names of the robots whose processes are not started again."""
        with suppress(OSError):  # then the world waits for them a while
            file.write_text(" ".join(self.lost))

    def stop(self, roles: Sequence[Role] = STOP_ORDER) -> None:
        """End every process with SIGTERM, and with SIGKILL after a while; the router ends last, for last messages."""
        for role in roles:
            processes = [running for running in self._running.values() if running.role is role]
            for running in processes:
                running.send(signal.SIGTERM)
            deadline = monotonic() + role.grace
            for running in processes:
                if not running.wait(max(0.0, deadline - monotonic())):
                    running.send(signal.SIGKILL)
                    running.wait(None)
                running.close()
        self._running = {name: running for name, running in self._running.items() if running.role not in roles}
