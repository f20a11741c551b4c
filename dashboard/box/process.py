"""The process of the box: it listens to a fleet, shows it to browsers, and hands their requests to the wire.

It takes no part in the fleet: the fleet runs the same without it, with one browser, or with ten.
"""

import webbrowser
from collections.abc import Callable
from time import monotonic
from typing import Any, Final

from dashboard.box import frames as telling
from dashboard.box.address import address
from dashboard.box.asking import Asking
from dashboard.box.radio import Hearing
from dashboard.box.server import Server
from dashboard.box.viewer import RerunPage
from dashboard.fold.progress import Progress, fold
from dashboard.fold.radio import wanted
from dashboard.fold.scene import Scene, scene_of
from dashboard.mode import LOOPBACK
from swarm.bus import Arrival, Bus, Endpoint, Link
from swarm.errors import SwarmError
from swarm.fuzzy import Controller, Profile
from swarm.messages import (
    CLOCK,
    EVENT,
    EVENTS,
    MAP,
    PLAN,
    SETUP,
    STATE,
    TRUTH,
    Broadcast,
    Clock,
    Event,
    Events,
    Map,
    Message,
    Plan,
    Topic,
    Truth,
)
from swarm.scenario.shipped import shipped
from swarm.stopping import told_to_stop

PERIOD: Final = 0.1  # s between two sets of frames
SOON: Final = 0.08  # s after the last set from which new poses are shown at once
OVERVIEW_EVERY: Final = 3  # frames between two overviews
ASK_EVERY: Final = 1.0  # s between two requests for a map that has not come yet
LAST_WORDS: Final = 0.3  # s for messages that are still under way when we are told to stop
LISTEN: Final[tuple[Topic[Any], ...]] = (CLOCK, STATE, PLAN, EVENT, MAP, TRUTH)
CATCH_UP: Final[tuple[Topic[Any], ...]] = (CLOCK, STATE, PLAN, EVENTS, MAP, TRUTH)


def run(
    endpoint: Endpoint,
    fleet: str,
    port: int,
    token: str,
    *,
    open_page: bool = False,
    log: Callable[[str], None] = print,
) -> int:
    """Serve the box until we are told to stop; ``open_page`` shows it in this machine's browser.

    Raises:
        ConfigError: the port is in use, or there is no router.
    """
    with (
        told_to_stop() as stop,
        Bus(endpoint, fleet, log) as bus,
        RerunPage(endpoint, fleet, log) as viewer,
        Server(LOOPBACK, port, token, Asking(bus, viewer.address)) as server,
    ):
        server.show({telling.HELLO: telling.hello(fleet, shipped())})
        if open_page:
            webbrowser.open(address(port, token))
        follow(bus, Page(bus, server, log), stop.is_set)
    return 0


def follow(bus: Bus, shown: "Page", stopped: Callable[[], bool]) -> None:
    """Take in what arrives and show it ten times a second, until we are told to stop."""
    for topic in LISTEN:
        bus.listen(topic)
    shown.catch_up()
    asked = monotonic()
    due = soon = asked  # when a set is shown at the latest, and when it is if there are new poses
    while not stopped():
        now = monotonic()
        if now >= due or (now >= soon and shown.moved):
            shown.show()
            due, soon = now + PERIOD + SOON / 2, now + SOON
        if shown.scene is None and now - asked >= ASK_EVERY:
            shown.catch_up()
            asked = now
        shown.take(bus.receive(timeout=max(0.0, (soon if shown.moved else due) - monotonic())))
    end = monotonic() + LAST_WORDS
    while (now := monotonic()) < end:
        shown.take(bus.receive(timeout=end - now))
    shown.show(last=True)


class Page:
    """What is known of the fleet, and what of it is new to browsers."""

    def __init__(self, bus: Bus, server: Server, log: Callable[[str], None]) -> None:
        self.scene: Scene | None = None
        self._progress = Progress()
        self._bus, self._server, self._log = bus, server, log
        self._hearing = Hearing(bus)
        self._controller: Controller | None = None
        self._truth: Truth | None = None
        self._clock: Clock | None = None
        self._plans: dict[str, Plan] = {}
        self._new: set[str] = set()  # keys of frames that have changed since the last ones
        self._link = True
        self._frames = 0

    def catch_up(self) -> None:
        """Fetch the last messages that the world keeps, and the launcher's set-up."""
        for topic in CATCH_UP:
            for message in self._bus.fetch(topic, timeout=1.0):
                self._fold(message)
        for setup in self._bus.fetch(SETUP, timeout=1.0):
            self._server.show({SETUP.key: setup})

    def take(self, arrived: object) -> None:
        """Take in what ``Bus.receive`` returned."""
        before, fleet = self._progress.run, self._progress.order
        match arrived:
            case Arrival(message=message):
                self._fold(message)
            case Link(up=up):
                self._link = up
        again = before >= 0 and (self._progress.run, self._progress.order) != (before, fleet)
        if again or arrived == Link(up=True):
            self.catch_up()  # another set-up, perhaps; and messages of the new run may have come before the world's

    def show(self, *, last: bool = False) -> None:
        """Show what is new. The overview comes less often: each robot's progress changes about once a second."""
        self._frames += 1
        contents: dict[str, object] = {
            CLOCK.key: self._clock,
            TRUTH.key: self._truth,
            PLAN.key: list(self._plans.values()),
            EVENTS.key: Events(events=list(self._progress.events)),
        }
        frames = {key: contents[key] for key in self._new}
        self._new.clear()
        if (selected := self._server.selected) and self._truth and self._controller and self.scene:
            frames[telling.RULES] = telling.rules(self._controller, self.scene, self._truth, selected)
        if self._frames % OVERVIEW_EVERY == 0 or last:
            home = self.scene is not None and self.scene.settings.return_home
            frames[telling.OVERVIEW] = telling.Overviewing(self._progress, home, self._link)
            self._hearing.turn_to(wanted(self.scene, self._truth, selected))
            if self._truth is not None:
                frames[telling.LEARNED] = self._hearing.learned(self._truth)
                frames[telling.JOINT] = self._hearing.joint(self._truth, selected)
        if frames:
            self._server.show(frames)

    @property
    def moved(self) -> bool:
        """True if there are poses that have not been shown."""
        return TRUTH.key in self._new

    def _fold(self, message: Message) -> None:
        if isinstance(message, Events):
            for event in message.events:
                self._fold(event)
            return
        before = self._progress.run
        self._progress = fold(self._progress, message)
        run = self._progress.run
        if run != before:
            self._plans, self._truth = {}, None
            self._new = {*self._new, PLAN.key} - {TRUTH.key}
        match message:
            case Map():
                self._take_floor(message)
            case Broadcast(run=said) if said == run:
                self._hearing.hear(message)
            case Truth(run=said) if said == run:
                self._truth = message
                self._new.add(TRUTH.key)
            case Plan(run=said) if said == run:
                self._plans[message.robot] = message
                self._new.add(PLAN.key)
            case Clock(run=said) if said == run:
                self._clock = message
                self._new.add(CLOCK.key)
            case Event():
                self._new.add(EVENTS.key)

    def _take_floor(self, floor: Map) -> None:
        try:
            self.scene = scene_of(floor)
            profile = self.scene.profile
            self._controller = Controller(Profile.from_builtins(profile)) if profile is not None else None
            self._hearing.take(self.scene)
        except SwarmError as fault:
            self._log(f"box: {fault}")
            return
        self._server.show({MAP.key: floor})
