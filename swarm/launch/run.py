"""`swarm run`: a whole fleet on this machine, from the command to the exit status."""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event as Flag
from time import monotonic
from typing import Any, Final

from rich.console import Console

from dashboard.mode import choose, missing, page_address
from dashboard.terminal import Terminal
from swarm.bus import Bus, Endpoint
from swarm.errors import ConfigError
from swarm.launch.fleet import Ended, Fleet
from swarm.launch.running import registered
from swarm.launch.table import DASHBOARD, ROBOT, ROUTER, WORLD, EarlyEnd
from swarm.messages import CLOCK, EVENT, STATE
from swarm.scenario.check import check
from swarm.scenario.load import Scenario
from swarm.scenario.starts import names
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


def run(options: Options) -> int:
    """Launch a fleet, show it until its run is over, and return the exit status: 0 complete, 1 not complete.

    Raises:
        ConfigError: the scenario cannot be driven, the port is in use, or a file cannot be written.
    """
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
    endpoint = Endpoint("127.0.0.1", options.port).claim()
    console = Console()
    with told_to_stop() as stop, registered(options.fleet or options.scenario.settings.name, endpoint) as (name, home):
        say = console.print if console.is_terminal else _say
        say(f"fleet {name}: {options.robots} robots, router {endpoint}")
        shown: dict[str, Any] = {"mode": mode, "record": options.record, "rules": options.rules}
        if mode == "web":
            ports = {"grpc_port": _free_port(), "web_port": _free_port()}
            say(f"watch it: {page_address(ports['web_port'], ports['grpc_port'])}")
            shown |= ports
        with Fleet(home, say) as fleet:
            summary_file = home / "report.json"
            start(fleet, options, endpoint, name, shown if mode is not None else None, summary_file)
            trouble = _watch(fleet, endpoint, name, stop, console, summary_file, options.scenario)
            if stop.is_set() and not summary_file.exists():
                fleet.stop()
            elif mode is not None and not stop.is_set():
                _let_finish(fleet, stop)
        summary = _summary(summary_file, options, trouble)
        if trouble and summary["reason"] == "interrupted":  # we interrupted the run because of this trouble
            summary["reason"] = trouble
    if options.report is not None:
        options.report.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    for line in closing_lines(summary, options.record if mode is not None else None):
        say(line)
    return 0 if summary["complete"] else 1


def _say(line: str) -> None:
    print(line, flush=True)


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
    common = {"endpoint": endpoint, "fleet": name}
    fleet.start(ROUTER, "router", {"endpoint": endpoint})
    fleet.start(
        WORLD,
        "world",
        common
        | {
            "scenario": options.scenario,
            "robots": options.robots,
            "seed": options.seed,
            "pace": options.pace,
            "limit": options.limit,
            "wait": options.wait,
            "watchers": 1 if shown is not None else 0,
            "report_to": summary_file,
        },
    )
    if shown is not None:
        fleet.start(DASHBOARD, "dashboard", common | shown)
    everybody, size = names(options.robots), options.robots_per_process
    for first in range(0, options.robots, size):
        robots = everybody[first : first + size]
        fleet.start(ROBOT, robots[0] if len(robots) == 1 else f"{robots[0]}-{robots[-1]}", common | {"robots": robots})


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
    with Bus(endpoint, name) as bus, terminal:
        bus.watch_presence()
        for topic in (CLOCK, STATE, EVENT):
            bus.listen(topic)
        trouble = ""
        while not stop.is_set():
            while (arrived := bus.receive(0.0)) is not None:
                terminal.fold(arrived)
            terminal.refresh()
            for ended in fleet.watch(LOOK):
                if ended.status or ended.then not in {EarlyEnd.FINISH, EarlyEnd.LEAVE}:
                    trouble = _tell(ended, console.print, reported=summary_file.exists())
                if ended.then is EarlyEnd.FINISH:
                    while (arrived := bus.receive(0.0)) is not None:
                        terminal.fold(arrived)
                    return trouble
    return "interrupted"


def _tell(ended: Ended, say: Callable[[str], None], reported: bool) -> str:
    how = f"was ended by signal {-ended.status}" if ended.status < 0 else f"ended with status {ended.status}"
    next_ = {EarlyEnd.FINISH: "the run ends", EarlyEnd.RESTART: "started again", EarlyEnd.REPORT: "the run goes on"}
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
        fleet.watch(LOOK)


def _summary(path: Path, options: Options, trouble: str) -> dict[str, Any]:
    """Return the world's report, or a short one with the reason if the world wrote none."""
    if path.exists():
        summary: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return summary
    return {
        "scenario": options.scenario.settings.name,
        "seed": options.seed,
        "robots": options.robots,
        "complete": False,
        "reason": trouble or "the world ended without a report",
    }


def closing_lines(summary: dict[str, Any], record: Path | None) -> list[str]:
    """Return the summary of a run as lines for people."""
    if "contacts" not in summary:
        return [f"not complete: {summary['reason']}"]
    contacts = ", ".join(f"{count} {kind}" for kind, count in summary["contacts"].items())
    gap = summary["clearance_min"]
    lines = [
        "complete" if summary["complete"] else f"not complete: {summary['reason']}",
        f"  simulated {summary['sim_time']:.1f} s in {summary['wall_time']:.1f} s "
        f"({summary['real_time_factor']:.1f} x real time), {summary['late_commands']} late commands",
        f"  contacts: {contacts}; smallest gap {f'{gap:.2f} m' if gap is not None else 'none'}; "
        f"the fuzzy tables steered {summary['steering']['angle']['tables']:.0%} of all turning",
    ]
    if summary["robots_per_process"] > 1:
        lines.append(f"  not a process for each robot: up to {summary['robots_per_process']} robots shared one")
    for robot, row in summary["per_robot"].items():
        reached = ", ".join("-" if time is None else f"{time:.0f} s" for time in row["reached"])
        lines.append(f"  {robot}: stops at {reached}; drove {row['path_length']:.1f} m, waited {row['waiting']:.1f} s")
    if record is not None and record.exists():
        lines.append(f"  recorded: {record}  (open it with: rerun {record})")
    return lines
