"""The dashboard process: it listens, folds messages, draws twice a second, and ends with the run."""

import subprocess
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from time import monotonic
from typing import Final

from dashboard.fleet_listener import FleetListener
from dashboard.mode import LOOPBACK, Mode
from dashboard.rerun import Recordings
from dashboard.rerun.recorder import SMALLER
from dashboard.show import Show
from dashboard.viewers import open_window, rerun_program, serve_page
from swarm.bus import Bus, Endpoint
from swarm.errors import ConfigError
from swarm.heartbeat import Heartbeat
from swarm.messages import STATUS, Phase
from swarm.stop_signal import stop_flag

DRAW_EVERY: Final = 0.5  # s, wall time
MEASURED_EVERY: Final = 2.0  # s, wall time between two requests for what the world has measured
ASK_EVERY: Final = 0.2  # s, wall time between two requests for a map that has not come yet
HURRY: Final = 2.0  # s to make files smaller if we were told to stop; the launcher kills after 5 s
LAST_WORDS: Final = 0.3  # s, wall time for messages that are still under way when the run is over


def run(
    endpoint: Endpoint,
    fleet: str,
    mode: Mode,
    record: Path | None = None,
    *,
    bind: str = LOOPBACK,
    grpc_port: int = 0,
    web_port: int = 0,
    rules: str | None = None,
) -> int:
    """Show a fleet until its run is over or we are told to stop; a port of 0 becomes a free port.

    ``rules`` is the robot whose fired rules are shown, by default the first.

    Raises:
        ConfigError: a port is in use, the file cannot be written, there is no router or no viewer.
    """
    if record is not None and not record.parent.is_dir():
        raise ConfigError(f"record: expected a folder {record.parent}, found none; make it or choose another file")
    if mode == "off-screen" and record is None:
        raise ConfigError("dashboard: expected a file to record to, as nothing is shown; give --record FILE.rrd")
    data = 0 if mode == "off-screen" else Endpoint(bind, grpc_port).claim().port
    page = Endpoint(bind, web_port).claim().port if mode == "web" else 0
    if mode != "off-screen" and not Endpoint(bind, data).is_local:
        print(f"dashboard: {bind} is open: anybody who reaches it sees the fleet, since Rerun has no keys")
    program = rerun_program() if mode != "off-screen" else Path()
    windows: list[subprocess.Popen[bytes]] = []
    recorder = Recordings(serve=(bind, data) if data else None, record=record)
    with stop_flag() as stop, ExitStack() as closing:
        bus = closing.enter_context(Bus(endpoint, fleet, heart=Heartbeat()))
        closing.callback(lambda: recorder.close(HURRY if stop.is_set() else SMALLER))

        def open_outputs(url: str) -> None:
            if mode == "web":
                closing.enter_context(serve_page(url, program, bind, page, data))
            elif mode == "viewer":
                windows.append(open_window(url, program))

        show = Show(recorder, fleet, open_outputs, rules)
        follow(bus, show, stop.is_set)
        show.draw()
        if stop.is_set():  # a window stays open after the run
            for window in windows:
                window.terminate()
                window.wait(5)
    return 0


def follow(bus: Bus, show: Show, stopped: Callable[[], bool]) -> None:
    """Take in and draw everything that arrives until the run is over; announce the dashboard once it can draw."""
    listener = FleetListener(bus, STATUS)
    bus.watch_presence()

    def catch_up() -> None:
        for message in listener.get_last_messages():
            show.take(message)

    def take(arrived: object) -> None:
        before = show.state.progress.run
        show.take(arrived)
        if show.state.progress.run != before >= 0:
            catch_up()  # robots' messages of the new run may have come before the world's

    catch_up()
    asked = drawn = measured = monotonic()
    announced = False
    while not stopped() and show.state.progress.phase is not Phase.OVER:
        if show.ready and not announced:
            bus.announce("dashboard", "dashboard")
            announced = True
        now = monotonic()
        if now - drawn >= DRAW_EVERY:
            show.draw()
            listener.turn_to(show.hears)
            drawn = now = monotonic()
        if show.ready and now - measured >= MEASURED_EVERY:
            for status in bus.fetch(STATUS, timeout=1.0):
                show.take(status)
            measured = now = monotonic()
        if not show.ready and now - asked >= ASK_EVERY:
            catch_up()
            asked = now = monotonic()
        due = drawn + DRAW_EVERY if show.ready else min(drawn + DRAW_EVERY, asked + ASK_EVERY)
        take(bus.receive(timeout=max(0.0, due - now)))
    end = monotonic() + LAST_WORDS
    while not stopped() and (now := monotonic()) < end:
        take(bus.receive(timeout=end - now))
