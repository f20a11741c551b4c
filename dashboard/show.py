"""The way from messages to recordings: the fold and the drawing together, without the bus."""

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from dashboard.fold.account import saved, written
from dashboard.fold.collect import Collector
from dashboard.fold.overlays import Overlays, detailed
from dashboard.fold.progress import Progress, fold
from dashboard.fold.radio import wanted
from dashboard.fold.scene import Scene, scene_of
from dashboard.recording.earlier import earlier
from dashboard.rerun import Picture, Recordings
from swarm.errors import SwarmError
from swarm.messages import Broadcast, Event, Events, Map, Message, Status, Truth

OVERLAY: Final = 0.75  # s, simulated, at least between two overlays within a drawing; every drawing ends with one
OVERLAYS: Final = 10  # most overlays in one drawing, about, if time runs faster


class Show:
    """The recordings of a fleet's runs. A new recording begins when the run or its list of robots changes.

    ``opened`` is called once, with the address for viewers, when there is something to see.
    """

    def __init__(
        self,
        recorder: Recordings,
        fleet: str,
        log: Callable[[str], None] = print,
        opened: Callable[[str], None] = lambda url: None,
        selected: str | None = None,
        earlier: Sequence[Path] = (),
    ) -> None:
        self.progress = Progress()
        self.scene: Scene | None = None
        self.heard: Counter[str] = Counter()  # messages that came, by topic
        self.lost: Counter[str] = Counter()  # messages that did not
        self._recorder = recorder
        self._fleet = fleet
        self._log = log
        self._opened = opened
        self._earlier = earlier  # files of dashboards that were killed, the newest first
        self._selected = selected  # the robot whose rules are shown
        self._overlays: Overlays | None = None
        self._truth: Truth | None = None  # the newest that no overlay shows
        self._last: Truth | None = None
        self._laid = 0.0  # s, simulated time of the last overlay
        self._drawn = 0.0  # s, simulated time of the last drawing
        self._gap = OVERLAY
        self._shown = -1
        self._view: Picture | None = None
        self._collector: Collector | None = None

    @property
    def detailed(self) -> tuple[str, ...]:
        """Robots whose sensors, held cells and joint plans are drawn."""
        return detailed(self.progress.order, self._selected)

    @property
    def hears(self) -> frozenset[str]:
        """Robots whose broadcasts are needed."""
        return wanted(self.scene, self._last, self.detailed)

    @property
    def ready(self) -> bool:
        """True if map and fleet are known, so that no message is lost any more."""
        return self._view is not None

    def take(self, message: Message) -> None:
        """Fold a message and collect what it changes."""
        if isinstance(message, Map):
            self._take_floor(message)
            return
        if isinstance(message, Events):
            for event in message.events:
                self.take(event)
            return
        if isinstance(message, Status):
            self._keep(message)
            return
        before = self.progress
        self.progress = fold(before, message)
        if isinstance(message, Broadcast) and message.run == self.progress.run and self._overlays is not None:
            self._overlays.hear(message)
        if self.progress is before:
            return
        if self.progress.run != before.run or self.progress.order != before.order:
            self.draw()
            self._collector, self._laid, self._drawn = None, 0.0, 0.0
        fresh = self._collector is None
        if fresh:
            self._begin()
        if self._collector is not None and not (fresh and isinstance(message, Event)):  # a new collector has all events
            self._collector.take(self.progress, message)
        if isinstance(message, Truth):
            self._truth = self._last = message
            if message.time >= self._laid + self._gap:
                self._lay_over()

    def _keep(self, status: Status) -> None:
        """Keep what a status says of the run that is shown; show what was before this dashboard came."""
        if self._view is None or self._collector is None or status.run != self._shown:
            return
        self._collector.contacts = sum(status.contacts.values())
        account = saved(status, self.heard, self.lost)
        if account is not None:
            if self._recorder.records:
                self._view.keep(status.time, written(account))
            files, self._earlier = self._earlier, ()
            path = earlier(files, account)
            if path is not None and self._goes_on_from(path):
                self._collector.knows_past()
            self._collector.look_back(self.progress, account)

    def _goes_on_from(self, path: Path) -> bool:
        """Send what is in a file of a dashboard that was killed; return False, and say why, if that is not possible."""
        assert self._view is not None
        try:
            self._view.go_on_from(path)
        except (OSError, ValueError, RuntimeError) as fault:
            self._log(f"dashboard: expected to go on from {path}, got {fault}; the run is shown from now on")
            return False
        return True

    def draw(self) -> None:
        """Draw what was collected."""
        if self._view is not None and self._collector is not None:
            self._lay_over()
            self._view.draw(self._collector.batch())
            self._gap = max(OVERLAY, (self.progress.time - self._drawn) / OVERLAYS)
            self._drawn = self.progress.time

    def _lay_over(self) -> None:
        if self._collector is not None and self._overlays is not None and self._truth is not None:
            self._collector.lay_over(self._overlays.at(self._truth))
            self._laid, self._truth = self._truth.time, None

    def _take_floor(self, floor: Map) -> None:
        try:
            self.scene = scene_of(floor)
            self._overlays = Overlays(self.scene, self._selected)
        except SwarmError as fault:
            self._log(f"dashboard: {fault}")
            return
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
            self._view = self._recorder.begin(name, scene, progress.order, self.detailed)
            self._shown = progress.run
            if first and self._recorder.url is not None:
                self._opened(self._recorder.url)
        self._collector = Collector(progress, scene.settings.return_home)
