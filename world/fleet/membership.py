"""The robots and dashboards that are present, and the places of robots: one is taken only by who joined and lives."""

from collections.abc import Iterable, Sequence
from math import inf
from typing import Final, NamedTuple

from swarm.bus import Presence
from swarm.errors import PeerError

PROMISED: Final = 5.0  # s that a place is kept for a robot that was welcomed and is not present yet
WATCHERS: Final = 15.0  # s that the start waits for a dashboard that was announced
HOLD: Final = 0.2  # s; when the router goes, all tokens go, some of them before the link's own end is told
BACK: Final = 10.0  # s that the clock waits for robots to come back, after the router or the world was away
PARTING: Final = 5.0  # s from a robot's leave to the end of its token; if that ends later, the robot was lost
HAS_LEFT: Final = ("left", "has left; its body stays where it stands until a process takes its place")
STRANGERS: Final = 16  # sessions that announce a robot without having joined, and are remembered


class Note(NamedTuple):
    """A change that is worth an event."""

    kind: str
    text: str
    robot: str


class Welcomed(NamedTuple):
    """A session that was welcomed in a robot's place; its token takes the place."""

    sender: int | None  # what it attaches to its messages; None: anything, or nothing
    until: float  # s; for so long the place is promised to it


class Membership:
    """The robots and dashboards that are present. The caller passes the time ``now`` [s], always of one clock."""

    def __init__(self, robots: Sequence[str], watchers: int, now: float) -> None:
        self._joined: dict[str, str] = {}  # robot -> the session that has its place
        self._welcomed: dict[str, dict[str, Welcomed]] = {name: {} for name in robots}  # robot -> by session
        self._tokens: dict[str, set[str]] = {name: set() for name in robots}  # robot -> sessions that announce it
        self._parting: dict[str, float] = {}  # robot -> when it said that it leaves
        self._leaving: dict[str, float] = {}  # robot -> when its token went away
        self._replaced: list[str] = []  # robots whose place a new process took before the old one was given up
        self._expected: set[str] = set()  # robots that were present before the router or the world went away
        self._expected_until = inf
        self._named: set[tuple[str, str]] = set()  # duplicates
        self._dashboards: set[str] = set()
        self._away: dict[str, float] = {}  # robot -> s for which it has been absent
        self._looked_at = now
        self.most_in_one = 0  # robots that were present from one process at a time
        self._watchers, self._watchers_until = watchers, now + WATCHERS

    @property
    def present(self) -> list[str]:
        """Robots whose process is present."""
        return [name for name in self._tokens if self.is_present(name)]

    @property
    def absent_robots(self) -> list[str]:
        """Robots whose process is not present."""
        return [name for name in self._tokens if not self.is_present(name)]

    def is_present(self, name: str) -> bool:
        """Return True if the process of a robot of the fleet is present."""
        return self._joined.get(name) in self._tokens[name] or name in self._leaving

    @property
    def members(self) -> list[str]:
        """Robots that are present, or were and are expected back."""
        return [name for name in self._tokens if self.is_present(name) or name in self._expected]

    @property
    def is_unsettled(self) -> bool:
        """True if it is open whether a robot has gone."""
        return bool(self._leaving or self._expected)

    @property
    def robots_awaited(self) -> list[str]:
        """Robots that were present before the router or the world went away, and are expected back."""
        return list(self._expected)

    def absence_time(self, name: str) -> float:
        """Return for how long [s] a robot has been absent while the clock ran."""
        return self._away.get(name, 0.0)

    def knows(self, robot: str) -> bool:
        """Return True if the fleet has a robot of that name."""
        return robot in self._tokens

    def add(self, robots: Iterable[str]) -> None:
        """Have places for more robots; the tables are replaced as a whole, since other threads read them."""
        robots = list(robots)
        self._welcomed = self._welcomed | {name: {} for name in robots}
        self._tokens = self._tokens | {name: set() for name in robots}

    def speaks(self, robot: str, sender: int | None) -> bool:
        """Return True if a message in a robot's name is of the process that has its place, as far as one can tell."""
        welcomed = self._welcomed[robot].get(self._joined.get(robot, "")) if self.knows(robot) else None
        return welcomed is not None and welcomed.sender in {None, sender}

    def ready(self, now: float) -> bool:
        """Return True if all robots are present, and the announced dashboards are present or took too long."""
        return not self.absent_robots and (len(self._dashboards) >= self._watchers or now >= self._watchers_until)

    def expect(self, robots: Iterable[str], until: float) -> None:
        """Wait for robots that were present before, until a time [s]."""
        self._expected = {name for name in robots if self.knows(name) and not self.is_present(name)}
        self._expected_until = until

    def link(self, up: bool, now: float) -> None:
        """Take in that the router has gone, and with it all tokens, or is back."""
        if up:
            self._expected_until = now + BACK
            return
        self._expected |= set(self.present)
        self._expected_until = inf
        self._leaving.clear()
        for sessions in self._tokens.values():
            sessions.clear()
        self._dashboards.clear()

    def take(self, presence: Presence, now: float) -> Note | None:
        """Take in that a process came or went; return a note if it is worth an event."""
        name, session = presence.id, presence.session
        if presence.role == "dashboard":
            (self._dashboards.add if presence.alive else self._dashboards.discard)(session)
        if presence.role != "robot" or not self.knows(name):
            return None
        tokens, owner = self._tokens[name], self._joined.get(name)
        if not presence.alive:
            lost = session in tokens and session == owner
            tokens.discard(session)
            heirs = [other for other in self._welcomed[name] if other in tokens]
            if lost and now - self._parting.pop(name, -inf) < PARTING:
                del self._joined[name]
                return Note(*HAS_LEFT, name)
            if lost and heirs:  # welcomed as well, it came second
                self._replaced.append(name)
                self._joined[name] = heirs[0]
                self._take_token(name)
            elif lost:
                self._leaving[name] = now
            return None
        if session in self._welcomed[name] or len(tokens) < STRANGERS:
            tokens.add(session)
        if session in self._welcomed[name] and (session == owner or owner not in tokens):
            self._joined[name] = session
            self._take_token(name)
        elif owner in tokens and (name, session) not in self._named and len(self._named) < STRANGERS:
            self._named.add((name, session))
            return Note("duplicate", "is announced by a second process, which has not joined; it is ignored", name)
        return None

    def _take_token(self, name: str) -> None:
        self._leaving.pop(name, None)
        self._away.pop(name, None)
        self._expected.discard(name)
        self._welcomed[name][self._joined[name]] = self._welcomed[name][self._joined[name]]._replace(until=-inf)
        together = sum(self._joined.get(other) == self._joined[name] for other in self.present)
        self.most_in_one = max(self.most_in_one, together)

    def look(self, now: float, *, running: bool) -> list[Note]:
        """Return notes about robots that have gone for good; count how long robots are absent while ``running``."""
        gone = [name for name, since in self._leaving.items() if now - since > HOLD]
        for name in gone:
            del self._leaving[name]
        gone += self._replaced
        self._replaced = []
        if now > self._expected_until:
            gone += sorted(self._expected)
            self._expected.clear()
        if running:
            for name in self.absent_robots:
                self._away[name] = self._away.get(name, 0.0) + now - self._looked_at
        self._looked_at = now
        return [Note("gone", "has lost its process; its body stops", name) for name in gone]

    def place(self, asked: str | None, session: str, now: float, sender: int | None = None) -> str:
        """Return a place and promise it to a session: the place that is asked for, or the first free one.

        It is the session's only with its token: who asks and is not there keeps nobody out who asks and is.

        Raises:
            PeerError: there is no such robot, it is present already, all places are taken, or the session has joined
                with another sender.
        """
        everybody = list(self._tokens)
        if asked is not None and asked not in everybody:
            raise PeerError(f"expected one of {', '.join(everybody)}, got {asked!r}; the fleet has no such robot")
        if (
            asked is not None
            and asked in self.present
            and asked not in self._leaving
            and session != self._joined.get(asked)
        ):
            raise PeerError(f"robot {asked!r} is here already; stop that one first, or join without a name")
        free = [name for name in self.absent_robots if all(one.until < now for one in self._welcomed[name].values())]
        if asked is None and not free:
            raise PeerError(f"all {len(everybody)} places are taken; start the world with more robots")
        name = asked or min(free, key=lambda name: name in self._expected)
        owner, tokens = self._joined.get(name), self._tokens[name]
        known = next((row[session] for row in self._welcomed.values() if session in row), None)
        if known is not None and known.sender != sender:
            raise PeerError(f"{name}: expected the sender that this session joined with, got another; join with that")
        self._welcomed[name] = {
            other: one for other, one in self._welcomed[name].items() if other == owner or one.until >= now
        } | {session: Welcomed(sender, now + PROMISED)}
        if self._leaving.pop(name, None) is not None:
            self._replaced.append(name)
        if session in tokens:
            self._joined[name] = session
            self._take_token(name)
        return name

    def leave(self, name: str, session: str, now: float) -> bool:
        """Free the place of a robot whose process ends; return False if its token is still there.

        The place is free when the token goes: nobody else can make a robot leave that stays. Nobody waits for it then.

        Raises:
            PeerError: the session does not have that place.
        """
        if not self.knows(name) or self._joined.get(name) != session:
            raise PeerError(f"{name}: expected the session that has this place, got another one; only it can leave")
        self._leaving.pop(name, None)
        self._expected.discard(name)
        if stays := session in self._tokens[name]:
            self._parting[name] = now
        else:
            del self._joined[name]
        return not stays
