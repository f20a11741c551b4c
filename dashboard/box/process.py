"""The process of the box: it listens to a fleet, shows it to browsers, and hands their requests to the wire.

It takes no part in the fleet: the fleet runs the same without it, with one browser, or with ten.
"""

import webbrowser
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from time import monotonic
from typing import Final

from dashboard.box import frames as telling
from dashboard.box.browser_request import Asking
from dashboard.box.server import Server
from dashboard.box.tape_process import TapeProcess
from dashboard.box.viewer import RerunPage
from dashboard.fleet_listener import FleetListener
from dashboard.fold.overlays import DETAILED
from dashboard.fold.state import RunState
from dashboard.mode import LOOPBACK, box_address
from swarm.bus import Bus, Endpoint, Link
from swarm.errors import SwarmError
from swarm.heartbeat import Heartbeat
from swarm.messages import CLOCK, EVENTS, MAP, PLAN, SETUP, TRUTH, Clock, Event, Events, Map, Plan, Truth
from swarm.scenario.shipped_scenarios import shipped_scenarios
from swarm.stop_signal import stop_flag

PERIOD: Final = 0.1  # s between two sets of frames
SOON: Final = 0.08  # s after the last set from which new poses are shown at once
OVERVIEW_EVERY: Final = 3  # frames between two overviews
ASK_EVERY: Final = 1.0  # s between two requests for a map that has not come yet
LAST_WORDS: Final = 0.3  # s for messages that are still under way when we are told to stop
KEYS: Final[dict[type, str]] = {  # of news -> of the frame that shows it
    Clock: CLOCK.key,
    Event: EVENTS.key,
    Events: EVENTS.key,
    Map: MAP.key,
    Plan: PLAN.key,
    Truth: TRUTH.key,
}


def run(
    endpoint: Endpoint,
    fleet: str,
    port: int,
    token: str,
    *,
    open_page: bool = False,
    tape: Path | None = None,
    bind: str = LOOPBACK,
    log: Callable[[str], None] = lambda line: None,
) -> int:
    """Serve the box until we are told to stop; ``open_page`` shows it in this machine's browser.

    ``tape`` is the file of the run's tape. Only the names of this machine's loopback are answered, whatever the box is
    bound to: a container that publishes its port there has to ``bind`` more. ``log`` gets the address once it answers.

    Raises:
        ConfigError: the port is in use, or there is no router.
    """
    with (
        stop_flag() as stop,
        Bus(endpoint, fleet, heart=Heartbeat()) as bus,
        closing(RerunPage(endpoint, fleet)) as viewer,
        closing(TapeProcess(tape)) as past,
        Server(port, token, Asking(bus, viewer.address, past), bind) as server,
    ):
        log(f"box: {box_address(port, token)}")
        server.show({telling.HELLO: telling.hello(fleet, shipped_scenarios(), tape)})
        if open_page:
            webbrowser.open(box_address(port, token))
        follow(bus, Page(bus, server), stop.is_set)
    return 0


def follow(bus: Bus, shown: "Page", stopped: Callable[[], bool]) -> None:
    """Take in what arrives and show it ten times a second, until we are told to stop."""
    shown.catch_up()
    asked = monotonic()
    due = soon = asked  # when a set is shown at the latest, and when it is if there are new poses
    while not stopped():
        now = monotonic()
        if now >= due or (now >= soon and shown.has_new_poses):
            shown.show()
            due, soon = now + PERIOD + SOON / 2, now + SOON
        if shown.state.scene is None and now - asked >= ASK_EVERY:
            shown.catch_up()
            asked = now
        shown.take(bus.receive(timeout=max(0.0, (soon if shown.has_new_poses else due) - monotonic())))
    end = monotonic() + LAST_WORDS
    while (now := monotonic()) < end:
        shown.take(bus.receive(timeout=end - now))
    shown.show(last=True)


class Page:
    """What is known of the fleet, and what of it is new to browsers."""

    def __init__(self, bus: Bus, server: Server) -> None:
        self.state = RunState()
        self._bus, self._server = bus, server
        self._listener = FleetListener(bus)
        self._new: set[str] = set()  # keys of frames that have changed since the last ones
        self._link = True
        self._frames = 0

    def catch_up(self) -> None:
        """Fetch the last messages that the world keeps, and the launcher's set-up."""
        for message in self._listener.get_last_messages():
            self._note(message)
        for setup in self._bus.fetch(SETUP, timeout=1.0):
            self._server.show({SETUP.key: setup})

    def take(self, arrived: object) -> None:
        """Take in what ``Bus.receive`` returned."""
        before = self.state.progress
        self._note(arrived)
        now = self.state.progress
        if isinstance(arrived, Link):
            self._link = arrived.up
        if arrived == Link(up=True) or ((now.run, now.order) != (before.run, before.order) and before.run >= 0):
            self.catch_up()  # another set-up, perhaps; and messages of the new run may have come before the world's

    def show(self, *, last: bool = False) -> None:
        """Show what is new. The overview comes less often: each robot's progress changes about once a second."""
        self._frames += 1
        state = self.state
        frames = {key: content for key, content in telling.encode_wire_frames(state).items() if key in self._new}
        self._new.clear()
        selected = self._server.selection
        if self._frames % OVERVIEW_EVERY == 0 or last:
            frames |= telling.encode_run_frames(state, selected, link=self._link)
            few = self._server.is_watched and len(state.progress.order) <= DETAILED
            self._listener.turn_to(state.robots_needed(state.progress.order if few else selected))
        frames |= telling.encode_robot_frame(state, selected)
        if frames:
            self._server.show(frames)

    @property
    def has_new_poses(self) -> bool:
        """True if there are poses that have not been shown."""
        return TRUTH.key in self._new

    def _note(self, arrived: object) -> None:
        run = self.state.progress.run
        try:
            news = self.state.take(arrived)
        except SwarmError as fault:
            print(f"box: {fault}")
            return
        if self.state.progress.run != run:
            self._new = {*self._new, PLAN.key} - {TRUTH.key}
        if (key := KEYS.get(type(news))) is not None:
            self._new.add(key)
