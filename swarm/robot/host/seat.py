"""The place of one robot in its process: the sense that it has not answered yet, and its last answers."""

from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple, Protocol

import msgspec

from swarm.geometry import Pose, distance, wrap
from swarm.messages import Broadcast, Map, Sense, Took
from swarm.robot.brain import Inputs, Robot
from swarm.robot.host.radio import Pair, Zone
from swarm.robot.outputs import Outputs
from swarm.scenario.load import Scenario

OVERDUE: Final = 2.0  # s that lockstep waits for a broadcast that the sense lists as heard
OFF: Final = 0.01  # m; a third of the gap that the safety filter keeps to walls
TURNED: Final = 0.05  # rad
KEPT: Final = 5.0  # s for which answers are kept: a repeated sense gets the same answer
SAID_AGAIN: Final = 3  # last answers, said again after the router was away: others are a tick behind at most
DOUBTED: Final = 20  # last steps that are told when answers may be lost: a slow process is some ticks behind
EARLIER: Final = "the robot has answered a later one; the world goes on from before that"
MOST_NAMED: Final = 10  # reasons for dropping a sense that are logged, at most


Step = tuple[int, list[Pair], int | None]  # tick, broadcasts heard, and edits of a map that was fetched


class GivenAnswer(NamedTuple):
    """A robot's answer to one sense, and the radio zone that it is sent from."""

    outputs: Outputs
    zone: Zone
    sure: bool  # in lockstep the broadcast waits for room in the queue
    pose: Pose  # of the sense
    took: Took  # what the robot stepped with

    @property
    def step(self) -> Step:
        """The tick, the broadcasts that were heard, and the number of edits of the map that was fetched."""
        return self.outputs.command.tick, self.took.heard, self.took.edits

    def repeat_with(self, before: Sequence[Step] = ()) -> "GivenAnswer":
        """Return the answer as it is said again; ``before`` are the steps before it whose answers may be lost."""
        took = msgspec.structs.replace(self.took, again=True, before=[*before])
        return self._replace(
            outputs=self.outputs._replace(command=msgspec.structs.replace(self.outputs.command, took=took))
        )

    def fits(self, sense: Sense) -> bool:
        """Return True if the robot is where it was when it gave this answer, or nearly so."""
        away, turned = distance((sense.x, sense.y), self.pose[:2]), abs(wrap(sense.yaw - self.pose.yaw))
        return away <= OFF and turned <= TURNED

    def standing(self, tick: int) -> "GivenAnswer":
        """Return the answer to an earlier tick that stands, and else says what the robot says in this one."""
        still = {"tick": tick, "left": 0.0, "right": 0.0, "sent": False, "notes": []}
        command = msgspec.structs.replace(self.outputs.command, **still)
        return self._replace(outputs=Outputs(command, None, None, None))


class Repeats:
    """The answers of the last ticks: a robot steps once per tick, and a repeated sense gets the same answer."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._given: dict[tuple[int, int], GivenAnswer] = {}  # by run and tick, oldest first

    def find_answer(self, sense: Sense) -> GivenAnswer | None:
        """Return the earlier answer to this sense, or None."""
        return self._given.get((sense.run, sense.tick))

    def first_answer_after(self, sense: Sense) -> GivenAnswer | None:
        """Return the first answer kept that is later than a sense, in the same run, or None."""
        later = [key for key in self._given if key[0] == sense.run and key[1] > sense.tick]
        return self._given[min(later)] if later else None

    def answers_before(self, sense: Sense) -> list[GivenAnswer]:
        """Return the answers kept that are earlier than a sense, in the same run, oldest first."""
        return [given for (run, tick), given in self._given.items() if run == sense.run and tick < sense.tick]

    def last(self) -> list[GivenAnswer]:
        """Return the last few answers, oldest first."""
        return list(self._given.values())[-SAID_AGAIN:]

    def keep(self, sense: Sense, answer: GivenAnswer) -> None:
        """Store an answer; drop the oldest one if there are too many."""
        self._given[sense.run, sense.tick] = answer
        if len(self._given) > self._most:
            del self._given[next(iter(self._given))]


class Hearing(Protocol):
    """What a robot hears by; see ``Receiver``."""

    def tune(self, x: float, y: float) -> Zone:
        """Be at a point [m]; return the zone that broadcasts are sent from."""

    def close(self) -> None:
        """Hear nothing any more."""

    def begin(self, run: int) -> None:
        """Begin a run."""

    def misses_broadcast(self, hears: Iterable[Pair]) -> bool:
        """Return True if a broadcast has not arrived that the sense lists."""

    def listed_broadcasts(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return what is heard in lockstep."""

    def what_came(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return what is heard in real time."""


class Seat:
    """The place of one robot in its process: what it has to answer.

    The caller passes the time ``now`` [s], always of one clock.
    """

    def __init__(
        self, robot: Robot, receiver: Hearing, kept: int, log: Callable[[str], None], world: str = "local"
    ) -> None:
        self.name = robot.name
        self._world = world  # the identity of the one that is obeyed
        self.speaker: int | None = None  # what its world attaches to its messages; None: anything, or nothing
        self.sense: Sense | None = None  # not answered yet
        self.robot = robot
        self.receiver = receiver
        self._repeats = Repeats(kept)
        self._log = log
        self._born: tuple[int, int] | None = None  # run and tick of the first sense
        self._newest = (-1, -1)  # run and tick of the newest sense that the robot has stepped with
        self._until: float | None = None  # s; lockstep waits for missing broadcasts until then
        self._named: set[str] = set()
        self._doubts = False

    def obeys(self, sender: int | None) -> bool:
        """Return True if a sense comes from the world that welcomed this robot, as far as one can tell; log if not."""
        fits = self.speaker in {None, sender}
        if not fits:
            self._log_once("a sense was dropped: it is of somebody else in the world's name")
        return fits

    def _log_once(self, text: str, at: str = "") -> None:
        if text not in self._named and len(self._named) < MOST_NAMED:
            self._named.add(text)
            self._log(f"{self.name}: {at}{text}")

    def take(self, sense: Sense) -> None:
        """Take a sense to answer, unless a newer one waits; drop one that does not fit and log each reason once."""
        fault = self.robot.fault_of(sense) if sense.world == self._world else "it is of another world"
        if fault is not None:
            self._log_once(f"the sense was dropped: {fault}", f"tick {sense.tick}: ")
        elif (sense.run, sense.tick) <= self._newest and self._repeats.find_answer(sense) is None:
            self._log_once(f"the sense was dropped: {EARLIER}", f"tick {sense.tick}: ")
        elif self.sense is None or (sense.run, sense.tick) > (self.sense.run, self.sense.tick):
            self.sense, self._until = sense, None
            self._born = self._born or (sense.run, sense.tick)
            if sense.run != self.robot.run:
                self.receiver.begin(sense.run)

    def repeat(self, sense: Sense) -> GivenAnswer | None:
        """Return the answer to a sense that was answered before: the world goes on from a snapshot, or missed it.

        A robot never steps back in time. A tick that it left out before the world came back it leaves out again. In
        lockstep, where the world waits, it answers that it stands. In real time answers come back in other ticks than
        the first time, so a robot may be elsewhere than it was: then it stands too, until the ticks are new.
        """
        if sense.world != self._world:
            return None
        given = self._repeats.find_answer(sense)
        if given is None and sense.lockstep and (sense.run, sense.tick) < self._newest:
            later = self._repeats.first_answer_after(sense)
            return later and later.repeat_with().standing(sense.tick)
        if given is None:
            return None
        again = given.repeat_with(self._doubtful_steps(sense))
        return again if given.fits(sense) else again.standing(sense.tick)

    def last_answers(self) -> list[GivenAnswer]:
        """Return what was said last in lockstep, oldest first: the router may have lost it."""
        return [given for given in self._repeats.last() if given.sure]

    def wait_again(self) -> None:
        """Wait for missing broadcasts from now on: the router was away."""
        self._until = None

    def doubt_last_answers(self) -> None:
        """Take in that the last answers may be lost: the next one tells what the robot stepped with for them."""
        self._doubts = True

    def _misses_broadcast(self, sense: Sense) -> bool:
        """Return True if a broadcast is missing that the robot can have received.

        Those from before its first sense, in the middle of a run, may have been sent before it listened.
        """
        run, tick = self._born or (0, 0)
        before = tick if tick and sense.run == run else -1
        return self.receiver.misses_broadcast(pair for pair in sense.hears if pair[1] > before)

    def ready(self, now: float) -> bool:
        """Return True if there is a sense and, in lockstep, the broadcasts that it lists are here or overdue."""
        sense = self.sense
        if sense is None:
            return False
        if not sense.lockstep or self._repeats.find_answer(sense) is not None or not self._misses_broadcast(sense):
            return True
        if self._until is None:
            self._until = now + OVERDUE
        return now > self._until

    def answer(self, fetch: Callable[[], Iterable[Map]]) -> GivenAnswer:
        """Return the answer to the sense; ``fetch`` returns the world's map, for a robot that has missed edits."""
        sense, self.sense = self.sense, None
        assert sense is not None
        if (given := self._repeats.find_answer(sense)) is not None:
            return given.repeat_with(self._doubtful_steps(sense))
        overdue = sense.lockstep and self._misses_broadcast(sense)
        heard = (self.receiver.listed_broadcasts if sense.lockstep else self.receiver.what_came)(
            sense.hears, sense.tick
        )
        fetched = None
        if self.robot.has_missed_edits(sense):
            for floor in fetch():
                self.robot.take_map(Scenario.from_wire(floor.scenario, floor.packed), floor.edits)
                fetched = floor.edits
        zone = self.receiver.tune(sense.x, sense.y)
        outputs = self.robot.step(Inputs(sense, heard))
        self._newest = sense.run, sense.tick
        took = Took(heard=[(one.robot, one.tick) for one in heard], edits=fetched)
        before, self._doubts = self._doubtful_steps(sense), False
        if fetched is not None or took.heard != sense.hears or before:
            says = msgspec.structs.replace(took, before=before)
            outputs = outputs._replace(command=msgspec.structs.replace(outputs.command, took=says))
        if overdue:
            text = f"went on without a broadcast that did not arrive in {OVERDUE:g} s"
            self._log(f"{self.name}: tick {sense.tick}: {text}")
            notes = [*outputs.command.notes, ("overdue", text)]
            outputs = outputs._replace(command=msgspec.structs.replace(outputs.command, notes=notes))
        given = GivenAnswer(outputs, zone, sense.lockstep, Pose(sense.x, sense.y, sense.yaw), took)
        self._repeats.keep(sense, given)
        return given

    def _doubtful_steps(self, sense: Sense) -> list[Step]:
        """Return the last steps before a sense, oldest first, if their answers may be lost."""
        return [given.step for given in self._repeats.answers_before(sense)[-DOUBTED:]] if self._doubts else []

    def leave(self) -> None:
        """End the subscriptions to the radio zones around the robot."""
        self.receiver.close()
