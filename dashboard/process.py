"""The dashboard as a process: listens, folds, draws twice a second, and ends with the run."""

import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from shutil import which
from time import monotonic
from typing import Any, Final

from dashboard.collect import Collector
from dashboard.mode import Mode
from dashboard.progress import Progress, fold, presence
from dashboard.scene import Scene, scene_of
from dashboard.stopping import told_to_stop
from dashboard.view import Recorder, View, serve_page
from swarm.bus import Arrival, Bus, Endpoint, Presence
from swarm.errors import ConfigError, SwarmError
from swarm.messages import CLOCK, EVENT, MAP, PLAN, RADIO, STATE, TRUTH, Floor, Message, Phase, Topic

DRAW_EVERY: Final = 0.5  # s, wall time
ASK_EVERY: Final = 1.0  # s, wall time between two questions for a map that is not there yet
LISTEN: Final[tuple[Topic[Any], ...]] = (RADIO, STATE, PLAN, TRUTH, CLOCK, EVENT, MAP)
CATCH_UP: Final[tuple[Topic[Any], ...]] = (CLOCK, MAP, STATE, PLAN)


def run(
    endpoint: Endpoint,
    fleet: str,
    mode: Mode,
    record: Path | None = None,
    *,
    bind: str = "127.0.0.1",
    grpc_port: int = 0,
    web_port: int = 0,
    log: Callable[[str], None] = print,
) -> int:
    """Show a fleet until its run is over or we are told to stop; 0 ports are chosen freely.

    Raises:
        ConfigError: a port is in use, the file cannot be written, there is no router or no viewer.
    """
    if record is not None and not record.parent.is_dir():
        raise ConfigError(f"record: expected a folder {record.parent}, found none; make it or choose another file")
    if mode == "off-screen" and record is None:
        raise ConfigError("dashboard: expected a file to record to, as nothing is shown; give --record FILE.rrd")
    serve = None if mode == "off-screen" else (bind, Endpoint(bind, grpc_port).claim().port)
    page = Endpoint("0.0.0.0", web_port).claim().port if mode == "web" else 0
    recorder = Recorder(serve=serve, record=record)
    with told_to_stop() as stop, ExitStack() as closing:
        bus = closing.enter_context(Bus(endpoint, fleet, log))
        closing.callback(recorder.close)
        show = Show(recorder, fleet, lambda url: _open(mode, url, page, bind, log))
        follow(bus, show, stop.is_set)
        show.draw()
        if stop.is_set():
            show.leave()
    return 0


class Show:
    """The recordings of a fleet's runs: a new one whenever the run, or who is in it, changes."""

    def __init__(
        self, recorder: Recorder, fleet: str, opened: "Callable[[str], subprocess.Popen[bytes] | None]"
    ) -> None:
        self.progress = Progress()
        self.scene: Scene | None = None
        self._recorder = recorder
        self._fleet = fleet
        self._opened = opened
        self._viewer: subprocess.Popen[bytes] | None = None
        self._shown = -1
        self._view: View | None = None
        self._collector: Collector | None = None

    def take(self, message: Message) -> None:
        """Fold a message, and gather what it brings."""
        if isinstance(message, Floor):
            self._take_floor(message)
            return
        before = self.progress
        self.progress = fold(before, message)
        if self.progress is before:
            return
        if self.progress.run != before.run or self.progress.order != before.order:
            self.draw()
            self._collector = None
        if self._collector is None:
            self._begin()
        if self._collector is not None:
            self._collector.take(self.progress, message)

    def draw(self) -> None:
        """Draw what has gathered."""
        if self._view is not None and self._collector is not None:
            self._view.draw(self._collector.batch())

    def leave(self) -> None:
        """Close the viewer that was opened."""
        if self._viewer is not None:
            self._viewer.terminate()
            self._viewer.wait(5)

    def _take_floor(self, floor: Floor) -> None:
        self.scene = scene_of(floor)
        if self._view is not None:
            self._view.draw_map(self.scene)
        else:
            self._begin()

    def _begin(self) -> None:
        progress, scene = self.progress, self.scene
        if scene is None or progress.run < 0 or not progress.order:
            return
        if self._view is None or self._shown != progress.run or self._view.robots != progress.order:
            name = f"{self._fleet} {scene.settings.name} run {progress.run}"
            first = self._recorder.url is None
            self._view = self._recorder.begin(name, scene, progress.order)
            self._shown = progress.run
            if first and self._recorder.url is not None:
                self._viewer = self._opened(self._recorder.url)
        self._collector = Collector(progress, scene.settings.return_home)


def follow(bus: Bus, show: Show, stopped: Callable[[], bool]) -> None:
    """Take in all that arrives and draw it, until the run is over."""
    bus.announce("dashboard", "dashboard")
    for topic in LISTEN:
        bus.listen(topic)
    bus.watch_presence()
    _catch_up(bus, show)
    asked = drawn = monotonic()
    while not stopped() and show.progress.phase is not Phase.OVER:
        now = monotonic()
        if now - drawn >= DRAW_EVERY:
            show.draw()
            drawn = now = monotonic()
        arrived = bus.receive(timeout=max(0.0, drawn + DRAW_EVERY - now))
        match arrived:
            case Arrival(message=message):
                before = show.progress.run
                _take(show, message)
                if show.progress.run != before >= 0:
                    _catch_up(bus, show)
            case Presence(role="robot"):
                show.progress = presence(show.progress, arrived.id, arrived.session, arrived.alive)
        if show.scene is None and now - asked >= ASK_EVERY:
            _catch_up(bus, show)
            asked = now


def _catch_up(bus: Bus, show: Show) -> None:
    """Ask the world for the last of everything: we may have come late, and a message may have come too early."""
    for topic in CATCH_UP:
        if topic is not MAP or show.scene is None:
            for message in bus.fetch(topic, timeout=1.0):
                _take(show, message)


def _take(show: Show, message: Message) -> None:
    try:
        show.take(message)
    except ConfigError:
        raise
    except SwarmError as fault:
        print(f"dashboard: {fault}", file=sys.stderr)


def _open(mode: Mode, url: str, page: int, bind: str, log: Callable[[str], None]) -> "subprocess.Popen[bytes] | None":
    """Open the native viewer, or serve the web viewer and say where."""
    if mode == "web":
        log(f"dashboard: {serve_page(page, url, '127.0.0.1' if bind == '0.0.0.0' else bind)}")
        return None
    program = which("rerun", path=str(Path(sys.executable).parent)) or which("rerun")
    if program is None:
        raise ConfigError(
            "dashboard: expected the program `rerun`, found none; install rerun-sdk, or use --dashboard web"
        )
    log(f"dashboard: {url}")
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        [program, url, "--hide-welcome-screen"], stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True
    )
