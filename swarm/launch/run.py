"""`swarm run`: a whole fleet on this machine, from the command to the exit status."""

import os
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from pathlib import Path
from threading import Event as Flag
from time import monotonic
from typing import IO, Any, Final, TextIO, cast

from rich.console import Console

from dashboard.mode import choose, missing, page_address
from dashboard.terminal import FOLLOWED, Terminal
from swarm.bus import Bus, Endpoint
from swarm.errors import ConfigError, SwarmError
from swarm.launch.fleet import Ended, Fleet, check_open_files
from swarm.launch.running import CARD, named, registered
from swarm.launch.summary import closing_lines, summary_of, told_of_recordings, write_report
from swarm.launch.table import DASHBOARD, RESTARTS, ROBOT, ROUTER, WITHIN, WORLD, EarlyEnd
from swarm.scenario.check import check
from swarm.scenario.load import Scenario
from swarm.scenario.starts import names
from swarm.secure import Identity, identity
from swarm.settings import Pace
from swarm.stopping import told_to_stop

LOOK: Final = 0.1  # s between two looks at the processes
FAREWELL: Final = 15.0  # s for the dashboard to write its file after the run is over


@dataclass(frozen=True, kw_only=True)
class Options:
    """The options of `swarm run`."""

    scenario: Scenario
    robots: int
    robots_per_process: int
    seed: int
    pace: Pace
    limit: float  # s, simulated
    wait: bool
    dashboard: str  # auto, viewer, web, off
    rules: str | None  # the robot whose fired rules the dashboard shows
    record: Path | None
    report: Path | None
    port: int
    fleet: str | None
    secure: Path | None = None  # the folder with the keys; None: the fleet is open to all on this machine


def run(options: Options) -> int:
    """Launch a fleet, show it until its run is over, and return the exit status: 0 complete, 1 not complete.

    Raises:
        ConfigError: the scenario cannot be driven, the port is in use, or a file cannot be written.
    """
    processes = 3 + ceil(options.robots / options.robots_per_process)
    check_open_files(processes)
    options = replace(options, scenario=check(options.scenario, options.robots, options.seed).scenario)
    for flag, path in (("--report", options.report), ("--record", options.record)):
        if path is not None and path.is_dir():
            raise ConfigError(f"{flag} {path}: expected a file's name, got a folder; add one")
        if path is not None and not os.access(path.parent, os.W_OK):
            raise ConfigError(
                f"{flag} {path}: expected a folder that can be written, {path.parent} is not; choose another"
            )
    mode = choose(options.dashboard, os.environ, record=options.record is not None)
    if mode is not None and (lacks := missing()) is not None:
        if options.dashboard != "auto" or options.record is not None:
            raise ConfigError(f"--dashboard {options.dashboard}: {lacks}; or use --dashboard off")
        mode = None
    endpoint = Endpoint("127.0.0.1", options.port, _router_of(options)).claim().shared_by(processes)
    with (
        told_to_stop() as stop,
        registered(options.fleet or named(options.scenario.settings.name), endpoint) as (
            name,
            home,
        ),
    ):
        output = cast("IO[str]", Output(sys.stdout, stop))
        console = Console(file=output)
        say = console.print if console.is_terminal else partial(print, file=output, flush=True)
        say(f"fleet {name}: {options.robots} robots, router {endpoint}")
        shown: dict[str, Any] = {"mode": mode, "record": options.record, "rules": options.rules}
        if mode == "web":
            ports = {"grpc_port": _free_port(), "web_port": _free_port()}
            say(f"watch it: {page_address(ports['web_port'], ports['grpc_port'])}")
            shown |= ports
        report_of_world = home / "report.json"
        with Fleet(home, say) as fleet:
            try:
                start(fleet, options, endpoint, name, shown if mode is not None else None, report_of_world)
                trouble = _watch(fleet, endpoint, name, stop, console, report_of_world, options.scenario)
                if stop.is_set() and not report_of_world.exists():
                    fleet.stop()
                elif mode is not None and not stop.is_set():
                    _let_finish(fleet, stop)
            except SwarmError as fault:
                trouble = str(fault)
        known = {"scenario": options.scenario.settings.name, "seed": options.seed, "robots": options.robots}
        summary = summary_of(report_of_world, known, trouble, fleet.lost)
        record = options.record if mode is not None else None
        for line in closing_lines(summary, told_of_recordings(record, fleet.starts["dashboard"], home / CARD)):
            say(line)
        if options.report is not None:
            write_report(options.report, summary)
    return 0 if summary["complete"] else 1


class Output:
    """The standard output of a launcher. When its reader or its terminal is gone, the run is told to stop."""

    def __init__(self, inner: TextIO, stop: Flag) -> None:
        self._inner, self._stop = inner, stop

    @property
    def encoding(self) -> str:
        """That of the standard output."""
        return self._inner.encoding

    def isatty(self) -> bool:
        """Return True if people read it on a terminal."""
        return self._inner.isatty()

    def fileno(self) -> int:
        """Return the descriptor of the standard output."""
        return self._inner.fileno()

    def write(self, text: str) -> int:
        """Write a text if that is still possible."""
        try:
            return self._inner.write(text)
        except OSError:
            self._stop.set()
            return len(text)

    def flush(self) -> None:
        """Pass on what was written if that is still possible."""
        try:
            self._inner.flush()
        except OSError:
            self._stop.set()


def _router_of(options: Options) -> Identity | None:
    """Check the keys of all processes that will run, and return the router's, or None for an open fleet."""
    if options.secure is None:
        return None
    if options.robots_per_process > 1:
        raise ConfigError(
            f"--robots-per-process: expected 1 with --secure, got {options.robots_per_process}: a robot's keys are for "
            "its name only, so it needs a process of its own; leave out one of the two"
        )
    for member in (identity.ROUTER, identity.WORLD, identity.WATCHER, *names(options.robots)):
        Identity(options.secure, member).check()
    return Identity(options.secure, identity.ROUTER)


def _free_port() -> int:
    return Endpoint("127.0.0.1", 0).claim().port


def start(
    fleet: Fleet,
    options: Options,
    endpoint: Endpoint,
    name: str,
    shown: dict[str, Any] | None,
    summary_file: Path,
) -> None:
    """Start the processes of a fleet; the world writes its report to ``summary_file`` at the end."""

    def common(member: str) -> dict[str, Any]:
        return {"endpoint": endpoint.seen_by(member), "fleet": name}

    fleet.start(ROUTER, "router", {"endpoint": endpoint})
    fleet.start(
        WORLD,
        "world",
        common(identity.WORLD)
        | {
            "scenario": options.scenario,
            "robots": options.robots,
            "seed": options.seed,
            "pace": options.pace,
            "limit": options.limit,
            "wait": options.wait,
            "watchers": 1 if shown is not None else 0,
            "report_to": summary_file,
            "snapshot": summary_file.with_name("world.snapshot"),
        },
    )
    if shown is not None:
        fleet.start(DASHBOARD, "dashboard", common(identity.WATCHER) | shown)
    everybody, size = names(options.robots), options.robots_per_process
    for first in range(0, options.robots, size):
        robots = everybody[first : first + size]
        fleet.start(
            ROBOT,
            robots[0] if len(robots) == 1 else f"{robots[0]}-{robots[-1]}",
            common(robots[0]) | {"robots": robots},
        )


def _watch(
    fleet: Fleet,
    endpoint: Endpoint,
    name: str,
    stop: Flag,
    console: Console,
    summary_file: Path,
    scenario: Scenario,
) -> str:
    """Show progress until the world ends or we are told to stop; return what went wrong, "" for nothing."""
    terminal = Terminal(console, home=scenario.settings.return_home)
    bus: Bus | None = None
    trouble = ""
    with ExitStack() as opened, terminal:
        while not stop.is_set():
            if bus is None and _listens(endpoint):  # until then nobody would watch the processes
                bus = opened.enter_context(Bus(endpoint.seen_by(identity.WATCHER), name))
                bus.watch_presence()
                for topic in FOLLOWED:
                    bus.listen(topic)
            _show(bus, terminal)
            for ended in fleet.watch(LOOK):
                if ended.status or ended.then not in {EarlyEnd.FINISH, EarlyEnd.LEAVE}:
                    trouble = _tell(ended, console.print, reported=summary_file.exists())
                elif ended.then is EarlyEnd.LEAVE and ended.name != DASHBOARD.name:
                    console.print(f"{ended.name} has left; the run goes on")
                if ended.then is EarlyEnd.FINISH:
                    _show(bus, terminal)
                    return trouble
    return "interrupted"


def _listens(endpoint: Endpoint) -> bool:
    """Return True if the router listens already."""
    try:
        endpoint.claim()
    except ConfigError:
        return True
    return False


def _show(bus: Bus | None, terminal: Terminal) -> None:
    while bus is not None and (arrived := bus.receive(0.0)) is not None:
        terminal.fold(arrived)
    terminal.refresh()


def _tell(ended: Ended, say: Callable[[str], None], reported: bool) -> str:
    how = f"was ended by signal {-ended.status}" if ended.status < 0 else f"ended with status {ended.status}"
    next_ = {
        EarlyEnd.FINISH: "the run ends",
        EarlyEnd.RESTART: "started again",
        EarlyEnd.REPORT: "the run goes on",
        EarlyEnd.LOSE: f"it is lost, after {RESTARTS} restarts within {WITHIN:g} s; the run goes on without it",
    }
    trouble = f"{ended.name} {how}; {next_[ended.then]}"
    if ended.name == "world" and ended.status == 1 and reported:
        return ""  # not complete: the report says why
    say(trouble)
    if ended.last_lines:
        say("\n".join(f"  {ended.name}| {line}" for line in ended.last_lines.splitlines()))
    return trouble


def _let_finish(fleet: Fleet, stop: Flag) -> None:
    deadline = monotonic() + FAREWELL
    while fleet.pid_of("dashboard") is not None and monotonic() < deadline and not stop.is_set():
        fleet.watch(LOOK, again=False)
