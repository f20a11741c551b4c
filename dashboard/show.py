"""The way from messages to recordings: the state of the run and its picture together, without the bus."""

from collections.abc import Callable

from dashboard.fold.collect import Collector
from dashboard.fold.overlays import robots_in_detail
from dashboard.fold.state import RunState
from dashboard.rerun import Picture, Recordings
from swarm.errors import SwarmError
from swarm.messages import Event, Events, Map


class Show:
    """The recordings of a fleet's runs. A new recording begins when the run or its list of robots changes.

    ``opened`` is called once, with the address for viewers, when there is something to see. ``selected`` is the robot
    whose rules are shown.
    """

    def __init__(
        self,
        recorder: Recordings,
        fleet: str,
        opened: Callable[[str], None] = lambda url: None,
        selected: str | None = None,
    ) -> None:
        self.state = RunState()
        self._recorder, self._fleet, self._opened = recorder, fleet, opened
        self._selected = selected
        self._view: Picture | None = None
        self._collector: Collector | None = None

    @property
    def hears(self) -> frozenset[str]:
        """Robots whose broadcasts are needed."""
        return self.state.robots_needed(self._robots_in_detail)

    @property
    def ready(self) -> bool:
        """True if map and fleet are known, so that no message is lost any more."""
        return self._view is not None

    def take(self, arrived: object) -> None:
        """Take in what ``Bus.receive`` returned, or a message, and collect what it changes."""
        try:
            news = self.state.take(arrived)
        except SwarmError as fault:
            print(f"dashboard: {fault}")
            return
        if isinstance(news, Map) and self._view is not None and self.state.scene is not None:
            self._view.stage.draw_map(self.state.scene)
        elif news is not None:
            begins = self._begin_if_changed()
            if self._collector is not None and not (begins and isinstance(news, Event | Events)):
                self._collector.take(news)  # a new collector has all events

    def draw(self) -> None:
        """Draw what was collected."""
        if self._view is not None and self._collector is not None:
            self._view.draw(self._collector.batch())

    @property
    def _robots_in_detail(self) -> tuple[str, ...]:
        """Robots whose sensors, held cells and joint plans are drawn."""
        return robots_in_detail(self.state.progress.order, self._selected)

    def _begin_if_changed(self) -> bool:
        """Begin a recording if the run or its list of robots is another one; return True if it is."""
        progress, scene = self.state.progress, self.state.scene
        collector, now = self._collector, (progress.run, progress.order)
        if collector is not None and (collector.run, collector.robots) == now:
            return False
        self.draw()
        self._collector = None
        if scene is None or progress.run < 0 or not progress.order:
            return False
        name = f"{self._fleet} {scene.settings.name} run {progress.run}"
        first = self._recorder.url is None
        self._view = self._recorder.begin(name, scene, progress.order, self._robots_in_detail)
        self._collector = Collector(self.state, self._selected)
        if first and self._recorder.url is not None:
            self._opened(self._recorder.url)
        return True
