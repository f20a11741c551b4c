"""The dashboard process: it listens, folds messages, draws twice a second, and ends with the run."""

import os
import subprocess
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from time import monotonic
from typing import Any, Final

from dashboard.fold.progress import presence
from dashboard.fold.radio import HeardRadio
from dashboard.mode import LOOPBACK, Mode, viewer_program
from dashboard.rerun import Recordings
from dashboard.rerun.recorder import SMALLER
from dashboard.show import Show
from dashboard.viewer_page import QUIET, ViewerPage
from swarm.bus import Arrival, Bus, Endpoint, Link, Presence, Request
from swarm.errors import ConfigError
from swarm.messages import CLOCK, EVENT, EVENTS, MAP, PLAN, STATE, STATUS, TRUTH, Phase, Topic
from swarm.stopping import told_to_stop

DRAW_EVERY: Final = 0.5  # s, wall time
KEEP_EVERY: Final = 2.0  # s, wall time between two accounts in the file: a dashboard that is killed loses no more
ASK_EVERY: Final = 0.2  # s, wall time between two requests for a map that has not come yet
HURRY: Final = 2.0  # s to make files smaller if we were told to stop; the launcher kills after 5 s
LAST_WORDS: Final = 0.3  # s, wall time for messages that are still under way when the run is over
LISTEN: Final[tuple[Topic[Any], ...]] = (STATE, PLAN, TRUTH, CLOCK, EVENT, MAP, STATUS)
CATCH_UP: Final[tuple[Topic[Any], ...]] = (CLOCK, STATE, PLAN, MAP, EVENTS, TRUTH, STATUS)


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
    earlier: Sequence[Path] = (),
    log: Callable[[str], None] = print,
) -> int:
    """Show a fleet until its run is over or we are told to stop; a port of 0 becomes a free port.

    ``rules`` is the robot whose fired rules are shown, by default the first. ``earlier`` are files of dashboards
    of this fleet that were killed, the newest first: what they have of the run is shown too.

    Raises:
        ConfigError: a port is in use, the file cannot be written, there is no router or no viewer.
    """
    if record is not None and not record.parent.is_dir():
        raise ConfigError(f"record: expected a folder {record.parent}, found none; make it or choose another file")
    if mode == "off-screen" and record is None:
        raise ConfigError("dashboard: expected a file to record to, as nothing is shown; give --record FILE.rrd")
    data = 0 if mode == "off-screen" else Endpoint(bind, grpc_port).claim().port
    page = Endpoint(bind, web_port).claim().port if mode == "web" else 0
    if mode != "off-screen" and not Endpoint(bind, data).local:
        log(f"dashboard: {bind} is open: anybody who reaches it sees the fleet, since Rerun has no keys")
    recorder = Recordings(serve=(bind, data) if data else None, record=record)
    with told_to_stop() as stop, ExitStack() as closing:
        bus = closing.enter_context(Bus(endpoint, fleet, log))
        closing.callback(lambda: recorder.close(HURRY if stop.is_set() else SMALLER))

        opened: Callable[[str], None] = log  # off-screen there is nothing to open
        if mode == "web":
            opened = ViewerPage(_rerun(), bind, page, data, log)
            closing.callback(opened.close)
        elif mode == "viewer":
            opened = ViewerWindow(log)
        show = Show(recorder, fleet, log, opened, selected=rules, earlier=earlier)
        follow(bus, show, stop.is_set)
        show.draw()
        if stop.is_set() and isinstance(opened, ViewerWindow):
            opened.close()
    return 0


def follow(bus: Bus, show: Show, stopped: Callable[[], bool]) -> None:
    """Take in and draw everything that arrives until the run is over; announce the dashboard once it can draw."""
    for topic in LISTEN:
        bus.listen(topic)
    bus.watch_presence()
    _catch_up(bus, show)
    show.lost = bus.lost
    asked = drawn = kept = monotonic()
    announced, radio = False, HeardRadio(bus)
    while not stopped() and show.progress.phase is not Phase.OVER:
        if show.ready and not announced:
            bus.announce("dashboard", "dashboard")
            announced = True
        now = monotonic()
        if now - drawn >= DRAW_EVERY:
            show.draw()
            radio.turn_to(show.hears)
            drawn = now = monotonic()
        if show.ready and now - kept >= KEEP_EVERY:
            for status in bus.fetch(STATUS, timeout=1.0):
                show.take(status)
            kept = now = monotonic()
        if not show.ready and now - asked >= ASK_EVERY:
            _catch_up(bus, show)
            asked = now = monotonic()
        due = drawn + DRAW_EVERY if show.ready else min(drawn + DRAW_EVERY, asked + ASK_EVERY)
        _take(bus, show, bus.receive(timeout=max(0.0, due - now)))
    end = monotonic() + LAST_WORDS
    while not stopped() and (now := monotonic()) < end:
        _take(bus, show, bus.receive(timeout=end - now))


def _take(bus: Bus, show: Show, arrived: Arrival | Presence | Link | Request | None) -> None:
    match arrived:
        case Arrival(topic=topic, message=message):
            show.heard[topic.key] += 1
            before = show.progress.run
            show.take(message)
            if show.progress.run != before >= 0:
                _catch_up(bus, show)  # robots' messages of the new run may have come before the world's
        case Presence(role="robot"):
            show.progress = presence(show.progress, arrived.id, arrived.session, arrived.alive)


def _catch_up(bus: Bus, show: Show) -> None:
    """Fetch the last messages that the world keeps."""
    for topic in CATCH_UP:
        if topic is not MAP or show.scene is None:
            for message in bus.fetch(topic, timeout=1.0):
                show.take(message)


def _rerun() -> Path:
    """Return the program of Rerun.

    Raises:
        ConfigError: it is not installed.
    """
    program = viewer_program()
    if program is None:
        raise ConfigError("dashboard: expected the program `rerun`, found none; install rerun-sdk again")
    return program


class ViewerWindow:
    """The native viewer of Rerun in its own window. It stays open after the run, and closes when we are stopped."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self._process: subprocess.Popen[bytes] | None = None
        self._program = _rerun()

    def __call__(self, url: str) -> None:
        """Open the viewer at an address."""
        self._log(f"dashboard: {url}")
        quiet = subprocess.DEVNULL
        arguments = [str(self._program), url, "--hide-welcome-screen", "--port", "auto", "--bind", LOOPBACK]
        self._process = subprocess.Popen(
            arguments, stdin=quiet, stdout=quiet, stderr=quiet, env=os.environ | QUIET, start_new_session=True
        )

    def close(self) -> None:
        """Close the viewer if it is open."""
        if self._process is not None:
            self._process.terminate()
            self._process.wait(5)
