"""All that is known of a fleet's run: what Rerun's picture and the box show. No clock, no I/O."""

from collections.abc import Collection
from typing import Final, NamedTuple

from dashboard.fold.overlays import Overlays
from dashboard.fold.progress import Progress, fold
from dashboard.fold.scene import Scene, scene_of
from swarm.bus import Arrival, Presence
from swarm.messages import (
    Activity,
    Broadcast,
    Clock,
    Event,
    Events,
    Liveness,
    Map,
    Message,
    Plan,
    Point,
    Status,
    Truth,
)

ALL: Final = "*"  # as in a key: any robot
UNDER_WAY: Final = frozenset({Activity.DRIVE, Activity.GIVE_WAY, Activity.BLOCKED})


class QueuePlace(NamedTuple):
    """The place of a robot in the queue for its target."""

    number: int  # 1: it is next
    of: int  # robots that drive to that target


class RunState:
    """The state of a run, from the messages of its fleet. Poses and paths are those of the present run only."""

    def __init__(self) -> None:
        self.progress = Progress()
        self.floor: Map | None = None
        self.scene: Scene | None = None
        self.overlays: Overlays | None = None  # None until the floor is known
        self.clock: Clock | None = None
        self.truth: Truth | None = None
        self.paths: dict[str, Plan] = {}  # the newest of each robot

    def take(self, arrived: object) -> Message | None:
        """Take in what ``Bus.receive`` returned, or a message; return what of it is news, None for nothing.

        Of ``Events``, those are news that were not told before. A status is news for whoever needs it.

        Raises:
            SwarmError: the floor that the world tells is not valid.
        """
        match arrived:
            case Arrival(message=message):
                return self.take(message)
            case Presence():
                self.progress = fold(self.progress, arrived)
            case Events(events=events):
                fresh = [event for event in events if self.take(event) is not None]
                return Events(events=fresh) if fresh else None
            case Map() if arrived != self.floor:
                self.scene = scene_of(arrived)
                self.floor, self.overlays = arrived, Overlays(self.scene)
                return arrived
            case Status():
                return arrived
            case Message():
                return arrived if self._fold(arrived) else None
        return None

    def _fold(self, message: Message) -> bool:
        """Take in a message of a run; return True if it is news."""
        before = self.progress
        self.progress = fold(before, message)
        if self.progress.run != before.run:
            self.clock, self.truth, self.paths = None, None, {}
        match message:
            case Event():
                pass
            case _ if getattr(message, "run", None) != self.progress.run:
                return False
            case Truth() if self.truth is None or message.tick >= self.truth.tick:
                self.truth = message
                return True
            case Plan() if (known := self.paths.get(message.robot)) is None or message.tick > known.tick:
                self.paths[message.robot] = message
                return True
            case Clock() if self.progress is not before:
                self.clock = message
            case Broadcast() if self.overlays is not None:
                self.overlays.hear(message)
        return self.progress is not before

    def turns(self) -> dict[str, QueuePlace]:
        """Return the turn of each robot whose target other robots drive to as well: their paths end in one point.

        Robots of one joint plan come in its order, if their broadcasts are heard; the others by the length of the path
        that is left. Robots that are done, were told to stop, or are silent are not counted.
        """
        progress, queues = self.progress, dict[Point, list[str]]()
        for name in progress.order:
            path = self.paths.get(name)
            under_way = progress.robot(name).activity in UNDER_WAY and progress.radio_freshness(name) is Liveness.ALIVE
            if under_way and path is not None and path.points:
                queues.setdefault(path.points[-1], []).append(name)
        found: dict[str, QueuePlace] = {}
        for queue in queues.values():
            if len(queue) > 1:
                order = sorted(queue, key=lambda name: progress.robot(name).distance)
                if self.overlays is not None and self.truth is not None:
                    order = self.overlays.sort_by_turn(order, self.truth)
                found |= {name: QueuePlace(number, len(order)) for number, name in enumerate(order, start=1)}
        return found

    def robots_needed(self, looked_at: Collection[str]) -> frozenset[str]:
        """Return the robots whose broadcasts are needed if these are looked at; ``ALL`` for those of all.

        Where robots learn the floor, all are heard; else only the members of the joint plans of those looked at.
        """
        if self.scene is None:
            return frozenset()
        if not self.scene.settings.map.known:
            return frozenset({ALL})
        bodies = self.truth.bodies if self.truth is not None else ()
        return frozenset(member for body in bodies if body.robot in looked_at for member in body.members)
