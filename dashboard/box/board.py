"""What browsers are to see: the newest frame of each kind. Pure: no socket, no clock.

A browser that is slow gets the newest frame of each kind when it is ready for it; the ones between are dropped. So
neither the frames that wait for a browser nor the delay to the fleet can grow. A frame is written as text when the
first browser takes it: while nobody looks, nothing is written.
"""

from functools import cached_property
from typing import Final

from dashboard.box.frames import make_frame

MOST_VIEWERS: Final = 32


class Frame:
    """The content of a kind, and its text as soon as somebody needs it."""

    def __init__(self, key: str, content: object) -> None:
        self.key, self.content = key, content

    @cached_property
    def text(self) -> str:
        """The text, written once for all browsers."""
        return make_frame(self.key, self.content)


class Viewer:
    """One browser: the robot that it has selected, and the frames that it has not got yet."""

    def __init__(self, frames: dict[str, Frame]) -> None:
        self.selected: str | None = None
        self._waiting = dict(frames)

    def queue_frame(self, frame: Frame) -> None:
        """Let a frame wait in place of the one before of its kind."""
        self._waiting.pop(frame.key, None)  # the newest comes last
        self._waiting[frame.key] = frame

    def take(self) -> list[str]:
        """Return the frames that wait, the oldest first; none of them waits any more."""
        frames, self._waiting = list(self._waiting.values()), {}
        return [frame.text for frame in frames]


class Board:
    """The newest frame of each kind, and the browsers that look at them."""

    def __init__(self) -> None:
        self.viewers: set[Viewer] = set()
        self._frames: dict[str, Frame] = {}

    @property
    def full(self) -> bool:
        """True if no more browsers are let in."""
        return len(self.viewers) >= MOST_VIEWERS

    @property
    def selection(self) -> frozenset[str]:
        """The robots that browsers have selected."""
        return frozenset(viewer.selected for viewer in tuple(self.viewers) if viewer.selected is not None)

    def enter(self) -> Viewer:
        """Return a new browser; all that is on the board waits for it."""
        viewer = Viewer(self._frames)
        self.viewers.add(viewer)
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """Forget a browser."""
        self.viewers.discard(viewer)

    def show(self, key: str, content: object) -> bool:
        """Put a frame on the board for all browsers; return False, and do nothing, if it is there already."""
        if key in self._frames and self._frames[key].content == content:
            return False
        self._frames[key] = frame = Frame(key, content)
        for viewer in self.viewers:
            viewer.queue_frame(frame)
        return True
