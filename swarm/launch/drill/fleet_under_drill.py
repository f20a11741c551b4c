"""A fleet under drill: `swarm run` in a process of its own, watched over the wire and through /proc."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Event as Flag
from threading import Thread, current_thread, main_thread
from time import monotonic
from typing import Any, Final
from uuid import uuid4

from swarm.bus import Arrival, Bus, Endpoint
from swarm.bus.foreign import Stranger
from swarm.errors import SwarmError
from swarm.launch.drill.judge import Observed
from swarm.messages import CLOCK, EVENT, TRUTH, Truth

PATIENCE: Final = 180.0  # s, for the run and for each thing that is waited for; a busy machine takes five times as long
LEAVING: Final = 8.0  # s for the last processes to end after `swarm run` has
LOOK: Final = 0.02  # s
MARK: Final = "SWARM_DRILL"  # environment variable by which the processes of one fleet are found


class OverdueError(SwarmError):
    """What a drill waits for has not come."""


class LiveFleet:
    """A running fleet with a fault to come. Use it in a ``with``: leaving ends what is left of it."""

    def __init__(
        self, folder: Path, pace: str, options: tuple[str, ...], text: str, environ: Mapping[str, str]
    ) -> None:
        self.folder, self.scenario = folder, folder / "drill.yaml"
        self.scenario.write_text(text, encoding="utf-8")
        self.mark = uuid4().hex
        self._environ = {**os.environ, "XDG_RUNTIME_DIR": str(folder), MARK: self.mark, **environ}
        self._out, self._report = folder / "out.txt", folder / "report.json"
        report = () if "--report" in options else ("--report", str(self._report))
        self._own = self.command("run", str(self.scenario), "--dashboard", "off", "--pace", pace, *report, *options)
        self._beside: list[subprocess.Popen[bytes]] = []
        self._threads: list[Thread] = []
        self._told: list[tuple[str, str]] = []
        self._open = ExitStack()
        self.truth: Truth | None = None  # the newest one
        self.over = Flag()  # ends what goes on in the background

    def __enter__(self) -> "LiveFleet":
        try:
            words = self.await_that(lambda: next(iter(self._line("fleet ")), ""), "its first line").split()
            self.fleet, self.endpoint = words[1].rstrip(":"), Endpoint.parse(words[-1])
            self.home = self.folder / f"zenoh-swarm-{os.getuid()}" / self.fleet
            self.await_that(lambda: self.find("router"), "the router")
            self.bus = self._open.enter_context(Bus(self.endpoint, self.fleet, lambda line: None))
            for topic in (TRUTH, EVENT, CLOCK):
                self.bus.listen(topic)
            self.stranger = self._open.enter_context(Stranger(self.endpoint, self.fleet))
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *fault: object) -> None:
        self._end()

    def command(self, *arguments: str) -> subprocess.Popen[bytes]:
        """Start a `swarm` command as a part of this drill."""
        with self._out.open("ab") as out, _hangs_up():
            words = [sys.executable, "-m", "swarm.cli", *arguments]
            return subprocess.Popen(words, env=self._environ, stdout=out, stderr=out, start_new_session=True)

    def start_beside(self, *arguments: str) -> None:
        """Start a `swarm` command beside the fleet, on its router."""
        self._beside.append(self.command(*arguments, "--connect", str(self.endpoint), "--fleet", self.fleet))

    def run_in_background(self, work: Callable[[], None]) -> None:
        """Do some work in the background; it must end when ``over`` is set."""
        self._threads.append(Thread(target=work, daemon=True))
        self._threads[-1].start()

    # --- what happens ---

    def take(self, timeout: float = LOOK) -> None:
        """Take in what has arrived."""
        while (arrived := self.bus.receive(timeout)) is not None:
            timeout = 0.0
            if isinstance(arrived, Arrival) and arrived.topic is TRUTH:
                self.truth = arrived.message
            elif isinstance(arrived, Arrival) and arrived.topic is EVENT and arrived.message.kind == "reached":
                self._told.append((arrived.message.robot or "", arrived.message.text))

    def wait_for_truth(self, fits: Callable[[Truth], bool], what: str) -> Truth:
        """Wait for a truth that fits, and return it."""

        def fitting() -> bool:
            self.take()
            return self.truth is not None and fits(self.truth)

        self.await_that(fitting, what)
        assert self.truth is not None
        return self.truth

    def await_that(self, look: Callable[[], Any], what: str) -> Any:  # noqa: ANN401, what ``look`` returns
        """Wait until ``look`` returns something true, and return that.

        Raises:
            OverdueError: it does not within PATIENCE, or the fleet has ended before.
        """
        deadline = monotonic() + PATIENCE
        while not (found := look()):
            if self._own.poll() is not None:
                raise OverdueError(f"expected {what}, the fleet ended before: {self.text[-300:]}")
            if monotonic() > deadline:
                raise OverdueError(f"expected {what}, it did not come within {PATIENCE:g} s")
            self.over.wait(LOOK)
        return found

    @property
    def text(self) -> str:
        """What the fleet has printed so far."""
        return self._out.read_text(encoding="utf-8", errors="replace")

    def _line(self, begin: str) -> list[str]:
        return [line for line in self.text.splitlines() if line.startswith(begin) and " router " in line]

    # --- its processes ---

    @property
    def launcher(self) -> int:
        """The id of the launcher's process."""
        return self._own.pid

    def processes(self) -> Iterator[Path]:
        """Yield the folder in /proc of each process of this drill."""
        mark = f"{MARK}={self.mark}".encode()
        for place in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                if mark in (place / "environ").read_bytes().split(b"\0"):
                    yield place

    def find(self, name: str) -> int | None:
        """Return the id of the process of the fleet that has this name, or None."""
        for place in self.processes():
            with suppress(OSError):
                if name == "fork server" and b"forkserver" in (place / "cmdline").read_bytes():
                    if _parent(place) == self.launcher:
                        return int(place.name)
                elif (place / "fd" / "1").readlink() == self.home / f"{name}.log":
                    return int(place.name)
        return None

    def member(self, name: str) -> int:
        """Wait for a process of the fleet, and return its id."""
        found: int = self.await_that(lambda: self.find(name), f"a process of {name}")
        return found

    # --- the end ---

    def finish(self, digest: str, expected: tuple[str, ...]) -> Observed:
        """Wait for the end of the run and of all its processes, and return what was seen."""
        deadline = monotonic() + PATIENCE
        while self._own.poll() is None and monotonic() < deadline:
            self.take()
        status = self._own.poll()
        self.over.set()
        for thread in self._threads:
            thread.join(PATIENCE)
        for one in self._beside:
            if one.poll() is None:
                one.kill()
            one.wait()
        if status is None:
            self._own.send_signal(signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                self._own.wait(PATIENCE)
        left = monotonic() + LEAVING
        while (processes := [_find_process(place) for place in self.processes()]) and monotonic() < left:
            Flag().wait(LOOK * 5)
        files = [*self.folder.glob("zenoh-swarm-*/*/"), *self.folder.glob(".*.part")]
        report = {}
        with suppress(OSError, ValueError):
            report = json.loads(self._report.read_text(encoding="utf-8"))
        return Observed(
            status, self.text, report, tuple(self._told), tuple(processes), tuple(path.name for path in files), digest,
            expected,
        )  # fmt: skip

    def _end(self) -> None:
        self.over.set()
        for place in list(self.processes()):
            with suppress(ProcessLookupError):
                os.kill(int(place.name), signal.SIGKILL)
        self._own.wait()
        for one in self._beside:
            one.wait()
        self._open.close()


def _parent(place: Path) -> int:
    return int((place / "stat").read_text().rsplit(")", 1)[1].split()[1])


def _find_process(place: Path) -> str:
    with suppress(OSError):
        words = (place / "cmdline").read_bytes().split(b"\0")
        return f"process {place.name} ({b' '.join(words).decode(errors='replace')[:80]})"
    return f"process {place.name}"


@contextmanager
def _hangs_up() -> Iterator[None]:
    """Start processes that a hang-up ends, also where this one was told to ignore it, as under `nohup`."""
    ignored = current_thread() is main_thread() and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    if ignored:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        yield
    finally:
        if ignored:
            signal.signal(signal.SIGHUP, signal.SIG_IGN)
