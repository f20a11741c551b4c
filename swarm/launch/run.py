"""`swarm run`: a whole fleet on this machine, from the command to the exit status."""

import os
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from secrets import token_urlsafe
from threading import Event as Flag
from typing import IO, Any, Final, cast

from rich.console import Console

from dashboard.mode import BOX, TOKEN, answers, box_address, choose, has_screen, page_address, resolve_auto
from dashboard.terminal import FOLLOWED, Terminal, print_wrapped
from swarm.bus import Bus, Endpoint, Request
from swarm.errors import ConfigError, SwarmError
from swarm.installation import hint_for_extra
from swarm.kinds import list_kinds
from swarm.launch.fleet_registry import CARD, Listing, default_fleet_name, register_fleet
from swarm.launch.options import Options, check_output, ready
from swarm.launch.output import Output
from swarm.launch.processes import Processes
from swarm.launch.setup import BUSY, answer_setup, as_set, in_words
from swarm.launch.summary import format_recordings, format_tape_line, summary_lines, summary_of
from swarm.launch.supervise.fleet import Ended, Fleet
from swarm.launch.supervise.table import RESTARTS, WITHIN, EarlyEnd
from swarm.messages import CLOCK, SETUP, Clock
from swarm.scenario.starts import robot_names
from swarm.secure import Identity
from swarm.secure import names as members
from swarm.stop_signal import stop_flag
from world.views.report_file import write

ANSWERS: Final = 2.0  # s in which a world that lives tells its clock


def run(options: Options) -> int:
    """Launch a fleet, show it until its run is over, and return the exit status: 0 if it has passed, else 1.

    Raises:
        ConfigError: the scenario cannot be driven, the port is in use, or a file cannot be written.
    """
    asked, options = options.dashboard, replace(ready(options), dashboard=resolve_auto(options.dashboard, os.environ))
    for path in (options.record, options.tape, options.bag):
        if path is not None:
            check_output("--record", path)
    if options.report is not None:
        check_output("--report", options.report)
    mode = choose(options.dashboard, os.environ, record=options.record is not None)
    lacks = hint_for_extra("rerun")
    if mode is not None and lacks is not None:
        flag = f"--dashboard {options.dashboard}" if mode != "off-screen" else f"--record {options.record}"
        raise ConfigError(f"{flag}: {lacks}, or run without it")
    _check_bridges(options)
    if options.bag is not None and (lacks_foxglove := hint_for_extra("foxglove")) is not None:
        raise ConfigError(f"--record {options.bag}: {lacks_foxglove}, or run without it")
    endpoint = Endpoint("127.0.0.1", options.port, _router_of(options)).claim()
    with (
        stop_flag() as stop,
        register_fleet(
            options.fleet or default_fleet_name(options.scenario.settings.name), endpoint, options.tape
        ) as entry,
    ):
        name, home = entry.name, entry.home
        since = (home / CARD).stat().st_mtime_ns
        output = cast("IO[str]", Output(sys.stdout, stop))
        console = Console(file=output)
        say = partial(print_wrapped, console)
        say(f"fleet {name}: {in_words(options.robots)}, router {endpoint}")
        shown: dict[str, Any] = {"mode": mode, "record": options.record, "rules": options.rules}
        if mode == "web":
            ports = {"grpc_port": _free_port(), "web_port": _free_port()}
            say(f"watch it: {page_address(ports['web_port'], ports['grpc_port'])}")
            shown |= ports
        box = None
        if options.dashboard == BOX:
            port, secret = _free_port(), token_urlsafe(TOKEN)
            box = {"port": port, "token": secret, "open_page": has_screen(os.environ), "tape": entry.tape.absolute()}
            if asked == "auto" and box["open_page"] and lacks is not None:
                say(f"{lacks}; the box shows the fleet")
        report_of_world = home / "report.json"
        with Fleet(home, say) as fleet:
            processes = Processes(
                fleet, options, endpoint, name, shown if mode is not None else None, report_of_world, box,
                entry.tape,
            )  # fmt: skip
            try:
                processes.start()
                trouble = _watch(fleet, processes, entry, stop, console, box)
                if stop.is_set() and not report_of_world.exists():
                    fleet.stop()
                elif (mode is not None or options.bag is not None) and not stop.is_set():
                    processes.let_finish(stop)
            except SwarmError as fault:
                trouble = str(fault)
            options = processes.options
        known = {"scenario": options.scenario.settings.name, "seed": options.seed, "robots": options.robots}
        summary = summary_of(report_of_world, known, trouble, fleet.lost)
        record = options.record if mode is not None else None
        files = [
            *format_recordings(record, fleet.starts["dashboard"], since),
            *format_recordings(options.bag, fleet.starts["recorder"], since),
            *format_tape_line(entry.tape),
        ]
        for line in summary_lines(summary, files):
            say(line)
        if options.report is not None:
            write(summary, options.report)
    return 0 if summary["passed"] else 1


def _router_of(options: Options) -> Identity | None:
    """Check the keys of all processes that will run, and return the router's, or None for an open fleet."""
    if options.secure is None:
        return None
    if options.robots_per_process > 1:
        raise ConfigError(
            f"--robots-per-process: expected 1 with --secure, got {options.robots_per_process}: a robot's keys are for "
            "its name only, so it needs a process of its own; leave out one of the two"
        )
    steering = [members.OPERATOR] if options.dashboard == BOX else []
    for member in (members.ROUTER, members.WORLD, members.WATCHER, *steering, *robot_names(options.robots)):
        Identity(options.secure, member).check()
    return Identity(options.secure, members.ROUTER)


def _check_bridges(options: Options) -> None:
    """Check that what bridges need is there.

    Raises:
        ConfigError: a library is missing, or the fleet has keys.
    """
    for bridge in options.bridges:
        if (lacks := hint_for_extra(bridge)) is not None:
            raise ConfigError(f"--bridge {bridge}: {lacks}")
        if options.secure is not None:
            raise ConfigError(
                f"--bridge {bridge}: expected a fleet without keys, got --secure: its router serves nobody else; "
                f"name another router with `swarm bridge {bridge}`"
            )


def _free_port() -> int:
    return Endpoint("127.0.0.1", 0).claim().port


def _watch(
    fleet: Fleet, processes: Processes, entry: Listing, stop: Flag, console: Console, box: dict[str, Any] | None
) -> str:
    """Show progress until the world ends or we are told to stop; return what went wrong, "" for nothing.

    The address of the ``box`` is said once it answers.
    """
    endpoint = processes.endpoint
    terminal = Terminal(
        console,
        home=processes.options.scenario.settings.return_home,
        quiet=processes.options.quiet,
        held=processes.options.wait,
        kinds=_kinds_of(processes.options),
    )
    say = partial(print_wrapped, console)
    bus: Bus | None = None
    trouble = ""
    with ExitStack() as opened, terminal:
        while not stop.is_set():
            if bus is None and _listens(endpoint):  # until then nobody would watch the processes
                bus = opened.enter_context(Bus(endpoint.endpoint_for_member(members.WATCHER), processes.name))
                _follow(bus, processes)
            if box is not None and answers(box["port"]):
                page, box = box_address(box["port"], box["token"]), None
                entry.tell_box(page)
                say(f"box: {page}")
            for request in _show(bus, terminal):
                _set_up(request, processes, terminal, bus, stop, say)
            if processes.has_new_robots(terminal.progress.order) and (clock := _clock(bus)) is not None:
                processes.add(clock.robots, say)  # what was heard may be anybody's, so the world is asked
            if said := entry.keep():
                say(said)
            for ended in fleet.watch():
                if ended.status or ended.then not in {EarlyEnd.FINISH, EarlyEnd.LEAVE}:
                    trouble = _tell(ended, say, reported=processes.summary_file.exists())
                elif ended.then is EarlyEnd.LEAVE and ended.robots:
                    say(f"{ended.name} has left; the run goes on")
                lost = ["lost"] if ended.then is EarlyEnd.LOSE else []
                terminal.explain(ended.robots, ["gone", "left", *lost])
                if lost:
                    fleet.tell_lost(processes.given_up_file)
                if ended.then is EarlyEnd.FINISH:
                    _show(bus, terminal)
                    return trouble
    return "interrupted"


def _kinds_of(options: Options) -> dict[str, str]:
    """Return the kind of each robot by name; none in a fleet without kinds."""
    settings = options.scenario.settings
    return dict(zip(robot_names(options.robots), list_kinds(settings), strict=True)) if settings.kinds else {}


def _follow(bus: Bus, processes: Processes) -> None:
    """Listen to all that the terminal shows, and to set-ups; with keys nobody may answer those."""
    bus.watch_presence()
    for topic in FOLLOWED:
        bus.listen(topic)
    if processes.endpoint.identity is None:
        bus.keep(SETUP, lambda: {SETUP.key: as_set(processes.options)})
        bus.serve(SETUP)


def _set_up(
    request: Request, processes: Processes, terminal: Terminal, bus: Bus | None, stop: Flag, say: Callable[[str], None]
) -> None:
    """Answer a request for another set-up; if it is accepted, start the fleet again."""
    if processes.first_run > 0 and not terminal.progress.order:  # the world of the last set-up has not spoken yet
        request.refuse(BUSY)
        return
    another = answer_setup(request, processes.options, lambda: _clock(bus), processes.added)
    if another is None:
        return
    scenario = another.options.scenario.settings
    say(f"another set-up: {scenario.name}, {in_words(another.options.robots)}; the fleet starts again")
    processes.start_again(another.options, another.run, stop)
    if not stop.is_set():
        terminal.start_again(another.run, home=scenario.return_home, kinds=_kinds_of(another.options))


def _clock(bus: Bus | None) -> Clock | None:
    """Return the clock that the world tells when it is asked; None: there is no answer."""
    clocks = bus.fetch(CLOCK, ANSWERS) if bus is not None else []
    return clocks[0] if clocks else None


def _listens(endpoint: Endpoint) -> bool:
    """Return True if the router listens already."""
    try:
        endpoint.claim()
    except ConfigError:
        return True
    return False


def _show(bus: Bus | None, terminal: Terminal) -> list[Request]:
    """Show all that has arrived; return the requests among it."""
    requests = []
    while bus is not None and (arrived := bus.receive(0.0)) is not None:
        if isinstance(arrived, Request):
            requests.append(arrived)
        terminal.take(arrived)
    terminal.refresh()
    return requests


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
