"""Real fleets under test: started by the command, watched over the wire, ended by process id."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager, suppress
from math import inf
from pathlib import Path
from queue import Empty, Queue
from threading import Event as Flag
from threading import Thread
from time import monotonic
from typing import Any, Final, Self, TypeVar

import psutil

from swarm.blackbox.replay.judge import Watch
from swarm.blackbox.replay.replay import Replay
from swarm.bus import Arrival, Bus, Endpoint, Presence
from swarm.errors import ConfigError, SwarmError
from swarm.messages import CLOCK, EVENT, SENSE, STATUS, Clock, Event, Phase, Sense, Status
from swarm.scenario.load import Scenario
from swarm.tape.reader import TapeFile
from world.simulate import Simulation

T = TypeVar("T")

PATH: Final = os.pathsep.join(
    [str(Path(__file__).with_name("as_installed")), *filter(None, [os.environ.get("PYTHONPATH")])]
)
JUDGED: Final = 600  # ticks of a tape; to judge a run costs as much as to drive it
PATIENCE: Final = 150.0  # s; the longest silence before the test fails: a loaded machine compiles for a minute
LONGEST: Final = 600.0  # s; the longest wait for what fits: on a busy machine a mission takes ten times as long
SHOWN: Final = 12  # lines of each log, below a failed test
FAREWELL: Final = 150.0  # s; the longest wait for processes that were told to end

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
limit: 1500
"""


HOW_IT_RAN: Final = {"wall_time", "real_time_factor", "robots_per_process"}


def in_process(scenario: Scenario, robots: int, seed: int) -> dict[str, Any]:
    """Return the report of the same run without processes."""
    return Simulation.of(scenario, robots, seed).run()


def assert_the_same_run(report: dict[str, Any], expected: dict[str, Any]) -> None:
    """Check that two reports are of one run."""
    for name in expected.keys() - HOW_IT_RAN:
        assert report[name] == expected[name], name
    assert report.keys() == expected.keys()


def as_started() -> None:
    """Heed the signals that a shell lets a job in the background ignore: so does whoever runs these tests there."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def judge_tapes(runtime: Path, breaks: Collection[str] = ()) -> None:
    """Check that the runs whose tapes fleets have left in a folder broke no safety law, and are replayed: their begin.

    ``breaks`` are laws that the test has planted a fault against.
    """
    for path in sorted(runtime.glob("zenoh-swarm-*/*.swarm")):
        watch, replay = Watch(), Replay(TapeFile(path))
        while replay.done < JUDGED and (tick := replay.step()) is not None:
            watch.take(replay, tick)
        broken = [one for one in watch.judge_laws() if one.law not in breaks]
        found = [one for one in (replay.difference, *broken) if one is not None]
        assert not found, f"{path}: {found}"


class Command:
    """One running `swarm` command; its lines are read as they come."""

    def __init__(
        self,
        *arguments: str,
        runtime: Path,
        files: int = 0,
        file_size: int = 0,
        warnings: str = "error",
        breaks: Collection[str] = (),
    ) -> None:
        limits = [f"ulimit -n {files};"] * bool(files) + [f"ulimit -f {file_size // 512};"] * bool(file_size)
        self.process = subprocess.Popen(
            ["sh", "-c", " ".join([*limits, 'exec "$0" "$@"']), sys.executable, "-m", "swarm.cli", *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True, preexec_fn=as_started,
            env=os.environ | {"PYTHONPATH": PATH, "PYTHONWARNINGS": warnings}
            | {"XDG_RUNTIME_DIR": str(runtime), "COLUMNS": "400"},
        )  # fmt: skip
        self.runtime, self._breaks = runtime, breaks
        self.lines: list[str] = []
        self._deaf = Flag()
        self._queue: Queue[str | None] = Queue()
        self.reader = Thread(target=self._read, daemon=True)
        self.reader.start()
        self.family: list[psutil.Process] = []

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._queue.put(line.rstrip("\n"))
            if self._deaf.is_set():
                self.process.stdout.close()
                break
        self._queue.put(None)

    def read_no_more(self) -> None:
        """Close this end of its output after its next line."""
        self._deaf.set()
        self.reader.join(PATIENCE)

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

    def await_line(self, part: str, within: float = inf) -> str:
        """Read on until a line holds ``part``, as long as lines come, and at most so many seconds."""
        for line in self.lines:
            if part in line:
                return line
        ends = monotonic() + within
        while True:
            try:
                got = self._queue.get(timeout=max(0.0, min(PATIENCE, ends - monotonic())))
            except Empty:
                raise AssertionError(f"it does not say {part!r}:\n" + "\n".join(self.lines)) from None
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
            if self.is_log_of(process, name):
                return process
        raise AssertionError(f"no process of {name}")

    def await_member(self, name: str) -> psutil.Process:
        """Wait until a process of the fleet has begun to write its log."""
        for _ in range(round(PATIENCE / 0.05)):
            with suppress(AssertionError, psutil.NoSuchProcess):
                return self.member(name)
            self.process.poll()
            Flag().wait(0.05)
        raise AssertionError(f"no process of {name}")

    def is_log_of(self, process: psutil.Process, name: str) -> bool:
        """Return True if a process writes the log ``name``.log."""
        return any(file.path.endswith(f"/{name}.log") for file in process.open_files())

    def fork_server(self) -> psutil.Process:
        """Find the server that the fleet's processes are forked from."""
        for process in psutil.Process(self.process.pid).children():
            if any("forkserver" in word for word in process.cmdline()):
                return process
        raise AssertionError("no fork server")

    def end(self) -> int:
        """Wait for its end and give the exit status; a mission in real time takes longer than any step of it."""
        return self.process.wait(LONGEST)

    def show(self) -> None:
        """Print what it said and the end of each log: pytest shows that below a failed test."""
        print(f"-- said\n{self.text}")
        for log in sorted(self.runtime.glob("zenoh-swarm-*/*/*.log")):
            lines = log.read_text().splitlines()
            print("\n".join([f"-- {log.name}", *lines[-SHOWN:]]))

    def assert_nobody_is_left(self) -> None:
        """Every process noted by ``remember_family`` has to be gone."""
        assert len(self.family) > 2
        _, alive = psutil.wait_procs([p for p in self.family if p.pid != self.process.pid], FAREWELL)
        assert not alive

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *fault: object) -> None:
        """End what a failed test left over, after it has shown where each process stood."""
        if fault[0] is not None:
            self.show()
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
        self.reader.join(FAREWELL)
        assert not self.reader.is_alive(), f"a process that writes to this output is left\n{self.text}"
        assert self.process.stdout is not None
        self.process.stdout.close()
        if fault[0] is None:
            judge_tapes(self.runtime, self._breaks)


class Fleet(Command):
    """`swarm run`, with a bus on its wire."""

    def __init__(
        self,
        scenario: Path,
        *arguments: str,
        runtime: Path,
        robots: int = 2,
        report: str = "r.json",
        file_size: int = 0,
        keys: Path | None = None,
        breaks: Collection[str] = (),
    ) -> None:
        self.report_file = runtime / report
        secure = () if keys is None else ("--secure", str(keys))
        super().__init__(
            "run", str(scenario), "--robots", str(robots), "--dashboard", "off", "--report", str(self.report_file),
            *secure, *arguments, runtime=runtime, file_size=file_size, breaks=breaks,
        )  # fmt: skip
        self.robots = robots
        words = self.await_line("fleet ").split()
        self.name, self.endpoint = words[1].rstrip(":"), Endpoint.parse(words[-1], keys, "watcher")

    @contextmanager
    def bus(self) -> Iterator[Bus]:
        """Open the fleet's wire, as soon as its router listens."""
        with ExitStack() as stack:
            since = monotonic()
            while True:
                try:
                    bus = stack.enter_context(Bus(self.endpoint, self.name, lambda line: None))
                    break
                except ConfigError:
                    if monotonic() - since > PATIENCE:
                        raise
            yield bus

    def await_all(self, bus: Bus, *besides: str) -> None:
        """Wait until the world and every robot are present, and whoever ``besides``, and note the family."""
        bus.watch_presence()
        missing = {"world", *besides} | {f"r{number}" for number in range(1, self.robots + 1)}
        try:
            while missing:
                missing.remove(await_message(bus, Presence, lambda one: one.alive and one.id in missing, "absent").id)
        except AssertionError:
            raise AssertionError(f"not there: {missing}\n{self.text}") from None
        self.remember_family()

    def show(self) -> None:
        """Print what the fleet said, its status and the end of each log: pytest shows that below a failed test."""
        super().show()
        with suppress(SwarmError), Bus(self.endpoint, self.name, print) as bus:
            print(f"-- status\n{bus.fetch(STATUS)}")

    def report(self) -> dict[str, Any]:
        """Read what it reported."""
        report: dict[str, Any] = json.loads(self.report_file.read_text())
        return report


def await_message(bus: Bus, kind: type[T], fits: Callable[[T], bool], lacks: str) -> T:
    """Wait for a message of a kind that fits, or for a presence; what it comes on is listened to already."""
    until = monotonic() + LONGEST
    while (left := until - monotonic()) > 0.0 and (arrived := bus.receive(min(left, PATIENCE))) is not None:
        found = arrived.message if isinstance(arrived, Arrival) else arrived
        if isinstance(found, kind) and fits(found):
            return found
    raise AssertionError(lacks)


def await_clock(bus: Bus, fits: Callable[[Clock], bool]) -> Clock:
    """Wait for the world to tell a clock that fits."""
    bus.listen(CLOCK)
    return await_message(bus, Clock, fits, "the world tells no clock that fits")


def await_tick(bus: Bus, tick: int) -> int:
    """Wait until the world tells r1 what it senses at a tick or a later one; return that tick."""
    bus.listen(SENSE, robot="r1")
    return await_message(bus, Sense, lambda sense: sense.tick >= tick, f"r1 senses nothing at tick {tick}").tick


def await_phase(bus: Bus, phase: Phase) -> Clock:
    """Wait until the run is in a phase."""
    return await_clock(bus, lambda clock: clock.phase is phase)


def await_event(bus: Bus, fits: Callable[[Event], bool]) -> Event:
    """Wait for an event that fits; listen to events before what causes it."""
    bus.listen(EVENT)
    return await_message(bus, Event, fits, "the world tells no event that fits")


def await_presence(bus: Bus, name: str, alive: bool) -> Presence:
    """Wait until somebody comes or goes; the presence has to be watched already."""
    lacks = f"nobody called {name} {'comes' if alive else 'goes'}"
    return await_message(bus, Presence, lambda one: (one.id, one.alive) == (name, alive), lacks)


def await_status(bus: Bus, fits: Callable[[Status], bool]) -> Status:
    """Ask for the status each time that something arrives, at least the clock, until it fits."""
    bus.listen(CLOCK)
    last, until = None, monotonic() + LONGEST
    while monotonic() < until:
        for last in bus.fetch(STATUS):
            if fits(last):
                return last
        if bus.receive(PATIENCE) is None:
            break
    raise AssertionError(f"no status fits; the last one: {last}")
