"""Real fleets under test: started by the command, watched over the wire, ended by process id."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from types import TracebackType
from typing import Any, Final, Self

import psutil

from swarm.bus import Arrival, Bus, Endpoint, Presence
from swarm.messages import CLOCK, EVENT, Clock, Event, Phase

PATIENCE: Final = 40.0  # s; the longest that anything here is waited for before the test fails
FAREWELL: Final = 20.0  # s; the same for processes that were told to end

SMALL: Final = """\
name: small
map:
  cell: 1.0
  text: |
    ############
    #..........#
    #..........#
    #....##....#
    #....##....#
    #..........#
    #..........#
    ############
start:
  poses: [[2.5, 2.0, 0.0], [2.5, 4.0, 0.0], [2.5, 6.0, 0.0]]
targets: [[9.5, 2.0], [9.5, 6.0]]
limit: 300
"""


class Command:
    """One running `swarm` command; its lines are read as they come."""

    def __init__(self, *arguments: str, runtime: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "swarm.cli", *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
            env=os.environ | {"XDG_RUNTIME_DIR": str(runtime), "PYTHONWARNINGS": "error", "COLUMNS": "400"},
        )  # fmt: skip
        self.lines: list[str] = []
        self._queue: Queue[str | None] = Queue()
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()
        self.family: list[psutil.Process] = []

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._queue.put(line.rstrip("\n"))
        self._queue.put(None)

    @property
    def text(self) -> str:
        """Everything it has said so far."""
        while True:
            try:
                line = self._queue.get_nowait()
            except Empty:
                return "\n".join(self.lines)
            if line is not None:
                self.lines.append(line)

    def await_line(self, part: str) -> str:
        """Read on until a line holds ``part``."""
        for line in self.lines:
            if part in line:
                return line
        while True:
            got = self._queue.get(timeout=PATIENCE)
            assert got is not None, f"it ended without saying {part!r}:\n" + "\n".join(self.lines)
            self.lines.append(got)
            if part in got:
                return got

    def remember_family(self) -> None:
        """Note every process that belongs to it now."""
        self.family = [psutil.Process(self.process.pid), *psutil.Process(self.process.pid).children(recursive=True)]

    def member(self, name: str) -> psutil.Process:
        """Find the process of the fleet that writes the log ``name``.log."""
        for process in psutil.Process(self.process.pid).children(recursive=True):
            if any(file.path.endswith(f"/{name}.log") for file in process.open_files()):
                return process
        raise AssertionError(f"no process of {name}")

    def end(self) -> int:
        """Wait for its end and give the exit status; a mission in real time takes longer than any step of it."""
        return self.process.wait(3 * PATIENCE)

    def assert_nobody_is_left(self) -> None:
        """Every process noted by ``remember_family`` has to be gone."""
        assert len(self.family) > 2
        _, alive = psutil.wait_procs([p for p in self.family if p.pid != self.process.pid], FAREWELL)
        assert not alive

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End what a failed test left over."""
        if self.process.poll() is None:
            family = psutil.Process(self.process.pid).children(recursive=True)
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(FAREWELL)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
            for process in family:
                if process.is_running():
                    process.kill()
        self._reader.join(FAREWELL)
        assert self.process.stdout is not None
        self.process.stdout.close()


class Fleet(Command):
    """`swarm run`, with a bus on its wire."""

    def __init__(self, scenario: Path, *arguments: str, runtime: Path, robots: int = 2, report: str = "r.json") -> None:
        self.report_file = runtime / report
        super().__init__(
            "run", str(scenario), "--robots", str(robots), "--dashboard", "off", "--report", str(self.report_file),
            *arguments, runtime=runtime,
        )  # fmt: skip
        self.robots = robots
        words = self.await_line("fleet ").split()
        self.name, self.endpoint = words[1].rstrip(":"), Endpoint.parse(words[-1])

    @contextmanager
    def bus(self) -> Iterator[Bus]:
        """Open the fleet's wire."""
        with Bus(self.endpoint, self.name, lambda line: None) as bus:
            yield bus

    def await_all(self, bus: Bus) -> None:
        """Wait until the world and every robot are present, and note the family."""
        bus.watch_presence()
        missing = {"world"} | {f"r{number}" for number in range(1, self.robots + 1)}
        while missing:
            arrived = bus.receive(PATIENCE)
            assert arrived is not None, f"not there: {missing}\n{self.text}"
            if isinstance(arrived, Presence) and arrived.alive:
                missing.discard(arrived.id)
        self.remember_family()

    def report(self) -> dict[str, Any]:
        """Read what it reported."""
        report: dict[str, Any] = json.loads(self.report_file.read_text())
        return report


def await_clock(bus: Bus, fits: Callable[[Clock], bool]) -> Clock:
    """Wait for the world to tell a clock that fits."""
    bus.listen(CLOCK)
    while True:
        arrived = bus.receive(PATIENCE)
        assert arrived is not None, "the world tells no clock that fits"
        if isinstance(arrived, Arrival) and isinstance(arrived.message, Clock) and fits(arrived.message):
            return arrived.message


def await_phase(bus: Bus, phase: Phase) -> Clock:
    """Wait until the run is in a phase."""
    return await_clock(bus, lambda clock: clock.phase is phase)


def await_event(bus: Bus, fits: Callable[[Event], bool]) -> Event:
    """Wait for an event that fits; listen to events before what causes it."""
    bus.listen(EVENT)
    while True:
        arrived = bus.receive(PATIENCE)
        assert arrived is not None, "the world tells no event that fits"
        if isinstance(arrived, Arrival) and isinstance(arrived.message, Event) and fits(arrived.message):
            return arrived.message


def await_presence(bus: Bus, name: str, alive: bool) -> Presence:
    """Wait until somebody comes or goes; the presence has to be watched already."""
    while True:
        arrived = bus.receive(PATIENCE)
        assert arrived is not None, f"nobody called {name} {'comes' if alive else 'goes'}"
        if isinstance(arrived, Presence) and arrived.id == name and arrived.alive is alive:
            return arrived
