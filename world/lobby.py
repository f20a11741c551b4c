"""The robots and dashboards that are present, by their sessions, and the places promised to robots that are joining."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from swarm.bus import Presence
from swarm.errors import PeerError

PROMISED: Final = 5.0  # s that a place is kept for a robot that was welcomed and is not present yet
WATCHERS: Final = 15.0  # s that the start waits for a dashboard that was announced


class Note(NamedTuple):
    """A change that is worth an event."""

    kind: str
    text: str
    robot: str


class Lobby:
    """The robots and dashboards that are present. The caller passes the time ``now`` [s], always of one clock."""

    def __init__(self, robots: Sequence[str], watchers: int, now: float) -> None:
        self._sessions: dict[str, set[str]] = {name: set() for name in robots}
        self._dashboards: set[str] = set()
        self._promised: dict[str, float] = {}
        self.most_in_one = 0  # robots that were present from one process at a time
        self._watchers, self._watchers_until = watchers, now + WATCHERS

    @property
    def present(self) -> list[str]:
        """Robots whose process is present."""
        return [name for name, sessions in self._sessions.items() if sessions]

    @property
    def absent(self) -> list[str]:
        """Robots whose process is not present."""
        return [name for name, sessions in self._sessions.items() if not sessions]

    def knows(self, robot: str) -> bool:
        """Return True if the fleet has a robot of that name."""
        return robot in self._sessions

    def ready(self, now: float) -> bool:
        """Return True if all robots are present, and the announced dashboards are present or took too long."""
        return not self.absent and (len(self._dashboards) >= self._watchers or now >= self._watchers_until)

    def take(self, presence: Presence) -> Note | None:
        """Take in that a process came or went; return a note if it is worth an event."""
        name, session = presence.id, presence.session
        if presence.role == "dashboard":
            (self._dashboards.add if presence.alive else self._dashboards.discard)(session)
        if presence.role != "robot" or name not in self._sessions:
            return None
        sessions = self._sessions[name]
        if presence.alive:
            sessions.add(session)
            together = sum(session in others for others in self._sessions.values())
            self.most_in_one = max(self.most_in_one, together)
            self._promised.pop(name, None)
            many = len(sessions)
            return Note("duplicate", f"runs in {many} processes; stop all but one", name) if many > 1 else None
        sessions.discard(session)
        return None if sessions else Note("gone", "has lost its process; its body stops", name)

    def place(self, asked: str | None, now: float) -> str:
        """Return a place and promise it: the place that is asked for, or the first free one.

        Raises:
            PeerError: there is no such robot, it is present already, or all places are taken.
        """
        taken = self.present
        free = [name for name in self.absent if self._promised.get(name, 0.0) < now]
        if asked is not None and asked not in self._sessions:
            raise PeerError(f"expected one of {', '.join(self._sessions)}, got {asked!r}; the fleet has no such robot")
        if asked is not None and asked in taken:
            raise PeerError(f"robot {asked!r} is here already; stop that one first, or join without a name")
        if asked is None and not free:
            raise PeerError(f"all {len(self._sessions)} places are taken; start the world with more robots")
        name = asked or free[0]
        self._promised[name] = now + PROMISED
        return name
