"""Rerun's recording of a run afterwards, from its tape: its messages go into the show that a dashboard draws."""

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from dashboard.fold.state import ALL
from dashboard.rerun import Recordings
from dashboard.show import Show
from swarm.blackbox.replay.replay import Replay
from swarm.blackbox.replay.wire import Wire
from swarm.messages import TRUTH, Broadcast, Message, Phase, Truth

DRAW_EVERY: Final = 0.5  # s of the run, as a dashboard draws in real time


class TapedShow:
    """The recording of a run that is replayed. Call ``take`` after every tick, and ``close`` after the last one.

    ``rules`` is the robot whose fired rules are shown, by default the first.
    """

    def __init__(self, replay: Replay, wire: Wire, record: Path, rules: str | None = None) -> None:
        rate = replay.world.settings.rate
        self._replay, self._wire = replay, wire
        self._recorder = Recordings(serve=None, record=record)
        self._show = Show(self._recorder, replay.file.path.stem, selected=rules)
        self._draw_every, self._truth_every = max(1, round(DRAW_EVERY * rate)), max(1, round(rate / TRUTH.rate))
        self._hears: frozenset[str] = frozenset()

    def take(self, messages: Iterable[Message]) -> None:
        """Take in what was sent in a tick that was replayed just now.

        Raises:
            ConfigError: the file cannot be written.
        """
        for message in messages:
            if self._is_heard(message):
                self._show.take(message)
        if self._replay.world.tick % self._draw_every == 0:
            self._show.take(self._wire.status(Phase.RUNNING))
            self._show.draw()
            self._hears = self._show.hears

    def close(self, messages: Iterable[Message]) -> list[Path]:
        """Draw the end of the run, finish the files, and return them; there is none if there was no tick."""
        for message in messages:
            self._show.take(message)
        self._show.draw()
        return self._recorder.close()

    def _is_heard(self, message: Message) -> bool:
        """Return True if a dashboard hears a message: not every truth is sent, nor every broadcast listened to."""
        match message:
            case Truth():
                return message.tick % self._truth_every == 0
            case Broadcast():
                return ALL in self._hears or message.robot in self._hears
        return True
