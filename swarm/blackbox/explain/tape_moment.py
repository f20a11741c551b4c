"""A moment of a run over processes, which is replayed from its tape."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from swarm.blackbox.explain.moment import Instant
from swarm.blackbox.explain.run_history import Next, TakenAnswer
from swarm.blackbox.explain.timeline import Timeline
from swarm.blackbox.replay.answer_values import ReplayedTick
from swarm.blackbox.replay.keyframes import Keyframes
from swarm.blackbox.replay.outline import Outline
from swarm.blackbox.replay.replay import Replay
from swarm.robot.brain import Robot
from swarm.tape.reader import TapeFile
from world.world import World


class Taped(Instant):
    """A moment of a run on a tape; ``room`` is the folder for keyframes, None: there are none.

    Raises:
        ConfigError: a row of the tape is none, or what it has cannot have happened.
    """

    def __init__(self, file: TapeFile, room: Path | None = None) -> None:
        self.timeline = Timeline(file)
        outline = Outline.read_outline(file, self.timeline.take)
        self._keyframes = Keyframes(file, room)
        self.replay = Replay(file, outline)
        self._run = self.replay.world.run
        self._next: tuple[int, Mapping[int, Next]] = -1, {}  # at a number of ticks lived
        super().__init__(self.replay.scenario)

    @property
    def world(self) -> World:
        """The world as it is then."""
        return self.replay.world

    @property
    def robots(self) -> Mapping[str, Robot]:
        """The robots of our code by name; a tape has what others answered, not why."""
        seats = self.replay.seats
        return {name: seats[name].robot for name in self.world.robots if name in seats}

    @property
    def doubt(self) -> str | None:
        """What is wrong with this moment; None: all answers are as they were."""
        found = self.replay.difference
        if found is None:
            return None
        first = f"the first answer that is not as it was is that of {found.robot} for {found.time:.2f} s: {found.text}"
        return f"{first}; this code has computed what follows, and it may not be what happened"

    @property
    def outside(self) -> list[str]:
        """The robots whose body is outside the world."""
        return self.replay.head.outside

    def step(self) -> bool:
        """Go on by one tick; return False if the tape ends."""
        tick = self.replay.step()
        if tick is None:
            return False
        if self.world.run != self._run:
            self._run, self.past = self.world.run, self._no_past()
        self.past.take(self.world.tick - 1, tick.senses, answers_of(self.replay, tick), tick.joined)
        if self._keyframes.is_due(self.replay):
            self._keyframes.keep(self.replay, (self.replay, self.past), moment=self)
        return True

    def is_away(self, robot: str, tick: int) -> bool:
        """Return True if a robot was away in the last tick, and has not come back by a tick to come."""
        coming = self.next_of(robot)
        if self.past.answers(robot) or coming is None:
            return False
        return coming.came is None or tick < coming.came

    def next_of(self, robot: str) -> Next | None:
        """Return when a robot answers next, by the tape."""
        if self._next[0] != self.replay.done:
            self._next = self.replay.done, self.timeline.next_answers(self.replay.mark)
        return self._next[1].get(self.world.robots.index(robot), Next(None))

    def run_through(
        self, run: int | None, tick: int | None, each: Callable[[Replay], None] = lambda replay: None
    ) -> None:
        """Run on through a tick of a run; None: the newest, of the last one. ``each`` is called after every tick.

        Raises:
            ConfigError: there is no such tick.
        """
        lived = self.timeline.last(run, tick)
        self._jump(lived)
        while self.replay.done < lived and self.step():
            each(self.replay)

    def _jump(self, lived: int) -> None:
        """Go on from the newest keyframe before a number of ticks lived, if that is later than this moment."""
        found = self._keyframes.nearest(lived)
        if found is not None and found.ticks > self.replay.done:
            state = self._keyframes.state(found, self.replay, moment=self)
            if state is not None:
                self.replay, self.past = state
                self.replay.load_foreign()
                self._run = self.world.run


def answers_of(replay: Replay, tick: ReplayedTick) -> Iterator[TakenAnswer]:
    """Yield the answers of a tick, in the order in which the world took them."""
    for name, command, stepped in tick.steps:
        hears = stepped.sense.hears if stepped is not None else []
        heard = command.took.heard if command.took is not None else hears
        spoken = replay.broadcasts.get((name, command.tick)) if command.sent else None
        yield TakenAnswer(name, command, list(heard), spoken)
