"""A run again, from its tape, in one process: every robot answers what it answered then, or the first that does not."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import msgspec

from swarm.blackbox.replay.answer_values import Difference, Life, ReplayedTick, SavedWorld, Stepped
from swarm.blackbox.replay.outline import Outline
from swarm.blackbox.replay.replay_radio import Ear
from swarm.errors import ConfigError, SwarmError
from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.messages import Broadcast, Command, Event, Map, Sense
from swarm.robot.host.radio import Pair
from swarm.robot.host.seat import KEPT, GivenAnswer, Seat
from swarm.scenario.load import Scenario
from swarm.tape.reader import Answered, TapeFile, TapeRow
from swarm.tape.rows import ASK, GIVEN, JOIN, RESUME, SENSE, check_of
from world.fleet.publisher import EVENTS_KEPT, floor
from world.host.last_messages import LastMessages, Sent
from world.in_process import InProcess
from world.saving.snapshot_file import unpack_state
from world.tasks.places import Book
from world.world import World


def _silent(line: str) -> None:
    """Say nothing."""


class Replay(InProcess):
    """A recorded run that is run again, tick by tick. Call ``step`` until it returns None.

    Raises:
        ConfigError: the file is no tape, or what it has cannot have happened.
    """

    def __init__(self, file: TapeFile, outline: Outline | None = None) -> None:
        self.file, self.head = file, file.head
        self.outline = outline or Outline.read_outline(file)
        head = self.head
        try:
            scenario = Scenario.from_wire(head.map.scenario, head.map.packed)
        except SwarmError as fault:
            raise ConfigError(f"tape {file.path}: the map: {fault}") from None
        world = self._world(scenario, head.run, head.map.edits, None)
        super().__init__(world=world, scenario=scenario)
        self.difference: Difference | None = None
        self.seats: dict[str, Seat] = {}
        self.steps: dict[str, Stepped] = {}  # the newest of each robot
        self.done = 0  # whole ticks
        self._floors: dict[int, OccupancyMap] = {self.world.bodies.edits: self.world.bodies.floor}
        self._senses: dict[int, Mapping[str, Sense]] = {}
        self._lives: dict[int, Life] = {}  # of worlds that were killed, by number; the oldest first
        self._life = 0  # number of the present one
        self._gaps: dict[str, str] = {}  # the last ticks that each robot has not answered, in words
        self._born: dict[str, int] = {}  # the life of the world in which each robot's process has begun
        self._sensed = False
        self.when_sensed: Callable[[], None] = lambda: None  # called when the senses of a tick were made
        self._saved: dict[int, SavedWorld] = {}
        self.mark = file.begin  # the last row that was replayed
        self.rows: Iterator[TapeRow] = file.rows()
        self._tick: list[tuple[str, Command, Stepped | None]] = []
        self._joined: list[str] = []
        self.answers = 0
        self.events: tuple[Event, ...] = ()  # the last ones of this run
        self.answered: dict[str, int] = {}  # tick of this run in which each robot has joined, or answered last
        self.load_foreign()

    @property
    def lockstep(self) -> bool:
        """True if the world waited for every robot."""
        return self.head.pace == "max"

    def _world(self, scenario: Scenario, run: int, edits: int, places: Book | None) -> World:
        head = self.head
        poses = [Pose(*start) for start in head.starts.values()]
        return World(scenario, poses, head.seed, run, edits, head.identity, head.outside, places)

    # --- the rows ---

    def step(self) -> ReplayedTick | None:
        """Replay until the end of the next tick; return None at the end of the tape."""
        for row in self.rows:
            self.mark = row.mark
            if row.whole and not self._sensed and SENSE not in row.items:
                self._sense()
            for item in row.items:
                self._take(item)
            if row.number in self.outline.resumed:
                self._saved[row.number] = SavedWorld.of(self.world)
            if row.whole:
                return self._move()
        return None

    def _take(self, item: Any) -> None:  # noqa: ANN401
        match item:
            case Answered():
                self._answer(item)
            case "sense":
                self._sense()
            case "save":
                self.world.save()
                self.world.poses()
            case "restart":
                self._restart()
            case [kind, number, *rest] if kind in {JOIN, GIVEN}:
                name = self._name(number)
                if kind == JOIN:
                    self._join(name, ours=rest[0])
                elif not isinstance(rest[0], Broadcast):
                    self.last.take(name, rest[0], self.world.run, self.world.tick)
                    if isinstance(rest[0], Command):
                        self._tick.append((name, rest[0], None))
            case [kind, number, message] if kind == ASK:
                self._ask(number, message)
            case [kind, row] if kind == RESUME:
                self._resume(row)

    def _name(self, number: int) -> str:
        names = self.world.robots
        if number >= len(names):
            raise ConfigError(f"tape {self.file.path}: tick {self.world.tick}: there is no robot number {number}")
        return names[number]

    def _sense(self) -> None:
        world = self.world
        self._senses[world.tick] = world.senses(self.lockstep)
        self._sensed = True
        self.when_sensed()

    def _move(self) -> ReplayedTick:
        world = self.world
        senses = self._senses.get(world.tick, {})
        self.answered |= dict.fromkeys((*self._joined, *(name for name, *_ in self._tick)), world.tick)
        events = self.move()
        self.events = (*self.events, *events)[-EVENTS_KEPT:]
        self._sensed = False
        self.done += 1
        self._floors.setdefault(world.bodies.edits, world.bodies.floor)
        oldest = world.tick - self.outline.memory
        self._senses.pop(oldest, None)
        self._lives = {one: life for one, life in self._lives.items() if max(life.senses, default=0) >= oldest}
        if world.tick % self.outline.memory == 0:
            self.forget(oldest)
        tick, self._tick, self._joined = ReplayedTick(senses, self._tick, events, self._joined), [], []
        return tick

    def _join(self, name: str, *, ours: bool) -> None:
        self._joined.append(name)
        if not ours:
            self.seats.pop(name, None)
            self.steps.pop(name, None)
            return
        kept = round(KEPT * self.world.settings.rate)
        self._born[name] = self._life
        self.seats[name] = Seat(self.welcome_robot(name), Ear(), kept, _silent, self.world.identity)

    def _ask(self, number: int | None, message: Any) -> None:  # noqa: ANN401
        world = self.world
        try:
            match type(message).__name__:
                case "Edit":
                    world.edit(message, sensed=self._sensed)
                    self._floors.setdefault(world.bodies.edits, world.bodies.floor)
                case "PoolTargets":
                    world.put_in(message)
                case "Places":
                    world.open_places(message)
                case _ if number is not None:
                    world.request(self._name(number), message)
        except SwarmError as fault:
            self._differ(world.tick, "the world", f"a request that was carried out is refused: {fault}")
        world.poses()

    def _restart(self) -> None:
        old = self.world
        self._senses, self.broadcasts, self._lives = {}, {}, {}
        self._begin(self._world(self.scenario_on_floor(), old.run + 1, old.bodies.edits, old.tasks.places))
        self.events, self.answered = (), {}
        self.load_foreign()

    def _begin(self, world: World) -> None:
        """Begin or go on in another world."""
        world.poses()
        self.world, self.last, self._sensed, self._tick = world, LastMessages(), False, []

    def load_foreign(self) -> None:
        """Take in what robots of other code say in this run."""
        found = {(name, tick): one for (run, name, tick), one in self.outline.foreign.items() if run == self.world.run}
        self.broadcasts |= found

    # --- a world that was killed ---

    def revive_world(self, saved: SavedWorld) -> World:
        """Return a world that goes on from what was saved."""
        world = self._world(replace(self.scenario, map=saved.floor), saved.run, saved.edits, saved.places)
        world.restore(unpack_state(saved.state))
        return world

    def _resume(self, row: int) -> None:
        saved = self._saved.get(row)
        if saved is None:
            raise ConfigError(f"tape {self.file.path}: tick {self.world.tick}: nothing was saved at row {row}")
        if not self._sensed:
            self._sense()  # robots may have answered them, and the world died before it wrote a row
        self._lives[self._life] = Life(dict(self._senses), dict(self.broadcasts))
        self._life += 1
        world = self.revive_world(saved)
        before = self.last
        self._begin(world)
        self.last.states = {name: one for name, one in before.states.items() if one.tick <= world.tick}
        self.last.plans = {name: one for name, one in before.plans.items() if one.tick <= world.tick}
        self.answered = {name: min(tick, world.tick) for name, tick in self.answered.items()}

    # --- a robot ---

    def _answer(self, item: Answered) -> None:
        name, tick = self._name(item.robot), self.world.tick - item.lag
        senses, seat = self._senses.get(tick, {}), self.seats.get(name)
        if seat is None or name not in senses:
            self._differ(
                tick, name, "it has answered, and had joined no run" if seat is None else "it was sent no sense"
            )
            return
        for lag, heard, edits in item.before:
            self._earlier(name, self.world.tick - lag, heard, edits)
        sense = senses[name]
        if item.again:  # it had answered a world that was killed before that put it on the tape
            self._earlier(name, tick, item.heard or (), item.edits)
        if item.before:
            seat.doubt_last_answers()
        last = self.steps.get(name)
        if last is not None and last.sense.run == sense.run and tick - last.sense.tick > 1:
            ticks = f"ticks {last.sense.tick + 1} to {tick - 1}"
            self._gaps[name] = f"; what it may have done in {ticks} is not on the tape: those answers did not arrive"
        pairs = sense.hears if item.heard is None else self._pairs(tick, item.heard)
        given = self._step_robot(name, sense, pairs, self.broadcasts, item.edits)
        if given is None:
            self._differ(tick, name, "it has answered a sense that it must drop")
            return
        if check_of(given.outputs.command) != item.check:
            self._differ(tick, name, f"its answer is another one{self._gaps.get(name, '')}")
        self.answers += 1
        outputs = given.outputs
        self.deliver(name, outputs.command, outputs.broadcast)
        for said in (outputs.state, outputs.plan):
            if said is not None:
                self.last.take(name, said, self.world.run, self.world.tick)
        self._tick.append((name, outputs.command, self.steps.get(name)))

    def _earlier(self, name: str, tick: int, heard: Iterable[tuple[int, int]], edits: int | None) -> None:
        """Let a robot make a step that it has made before, in this or an earlier life of the world, if it lacks it."""
        present = Life(self._senses, self.broadcasts)
        for number, life in (*self._lives.items(), (self._life, present)):
            sense = life.senses.get(tick, {}).get(name)
            if sense is not None and number >= self._born[name]:
                self._step_robot(name, sense, self._pairs(tick, heard), life.broadcasts, edits)
                return

    def _pairs(self, tick: int, heard: Iterable[tuple[int, int]]) -> list[Pair]:
        return [(self._name(number), tick - age) for number, age in heard]

    def _step_robot(
        self, name: str, sense: Sense, pairs: Iterable[Pair], said: Mapping[Sent, Broadcast], edits: int | None
    ) -> GivenAnswer | None:
        """Let a robot answer a sense; return None if it drops that."""
        seat = self.seats[name]
        if (again := seat.repeat(sense)) is not None:
            return again
        heard = []
        for pair in pairs:
            if (one := said.get(pair)) is None:
                self._differ(sense.tick, name, f"it has heard {pair[0]} of tick {pair[1]}, who said nothing then")
            else:
                heard.append(one)
        seat.take(sense)
        if seat.sense is None:
            return None
        ear = seat.receiver
        assert isinstance(ear, Ear)
        ear.heard = heard
        given = seat.answer(lambda: self._fetch_map(edits))
        self.steps[name] = Stepped(sense, tuple(heard), given.outputs)
        return given

    def _fetch_map(self, edits: int | None) -> list[Map]:
        """Return the map that a robot has fetched."""
        if edits is None or edits not in self._floors:
            return []
        found = floor(replace(self.scenario, map=self._floors[edits]), self.world)
        return [msgspec.structs.replace(found, edits=edits)]

    def _differ(self, tick: int, robot: str, text: str) -> None:
        if self.difference is None:
            self.difference = Difference(tick, tick * self.world.dt, robot, text)


def replay_tape(
    file: TapeFile,
    each: Callable[[Replay, ReplayedTick], None] = lambda replay, tick: None,
    outline: Outline | None = None,
) -> Replay:
    """Replay a whole tape; ``each`` is called after every tick."""
    replay = Replay(file, outline)
    while (tick := replay.step()) is not None:
        each(replay, tick)
    return replay
