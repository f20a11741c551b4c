"""The run of one fleet's world: its phase, its state beside the world's own, and everything that changes it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import isinf
from pathlib import Path
from threading import Lock
from typing import Final

from swarm.bus import Bus
from swarm.maps.wire import unpack
from swarm.messages import Accepted, Clock, Event, Phase, Places, Sense, State, Status, Truth
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import prepare
from swarm.settings import Pace
from swarm.suspend_clock import Awake
from swarm.tape.writer import Tape
from world.bodies.external import check_external
from world.fleet.liveness import Liveliness, is_lost
from world.fleet.membership import BACK, HAS_LEFT, Membership
from world.fleet.publisher import Publisher, floor
from world.fleet.single_world import new_identity
from world.host.last_messages import LastMessages
from world.host.pace import Stopwatch, Times, Timetable
from world.host.reproducible import Repeatable
from world.saving.snapshot_file import HostState, Saver, Snapshot, newest
from world.tasks.places import Book
from world.views.metrics import shortest_lengths
from world.views.report import ROOM, list_within, missing, report
from world.views.status import states, status
from world.views.truth import make_truth
from world.world import World

NAMED: Final = 64  # named buttons whose answers are kept


class Run:
    """What has become of the run so far. It is new, or goes on from the file ``snapshot`` if that exists."""

    def __init__(
        self,
        bus: Bus,
        scenario: Scenario,
        robots: int,
        seed: int,
        pace: Pace,
        limit: float,
        wait: bool,
        watchers: int,
        snapshot: Path | None,
        log: Callable[[str], None],
        outside: Sequence[str] = (),
        first_run: int = 0,
        given_up: Path | None = None,
        tape: Path | None = None,
    ) -> None:
        self.scenario, self._starts = prepare(scenario, robots, seed)
        self.seed, self.pace, self._limit = seed, pace, limit
        self._saver = Saver(snapshot, self.scenario, seed, log)
        self.outside = check_external(outside, robots)
        self.world = self._make_world(first_run, 0, new_identity(), None)
        self.publisher = Publisher(bus, self.scenario, self.world, log)
        self.awake = Awake()
        self.membership = Membership(self.world.robots, watchers, self.awake.now())
        self.liveliness = Liveliness(self.world.robots, self.awake.now())
        self._moving = Lock()  # held while bodies move: others read the poses of one tick
        self.repeatable = Repeatable(lockstep=self.lockstep, outside=self.outside)
        self.phase, self.held, self._attended = Phase.WAITING, wait, wait  # held until go; attended: go was waited for
        self.last = LastMessages()
        self._given_up, self._reason = given_up, ""
        self._lengths: list[float | None] = []  # m, once the run is over
        self._lost: list[str] = []
        self.stopwatch = Stopwatch()
        self.timetable = Timetable(self.world.dt, 1.0 if pace == "max" else pace)
        self.pressed: dict[str, str] = {}  # the answer to each named button, the newest last
        self.in_tick = False  # robots were sent the senses of a tick that is not over
        self._unsaved = True
        self.tape = Tape(tape, log)
        if snapshot is not None and (found := newest(snapshot, self.scenario, robots, seed, log)) is not None:
            self._resume(found)
            self.tape.go_on(found.host.tape, self.world.identity)
            over = f"; remove {snapshot} to begin a new run" if self.phase is Phase.OVER else ""
            log(f"the run goes on at {self.world.time:.2f} s, {self.phase.value}{over}")
        else:
            self.tape.begin(
                seed=seed, pace=str(pace), limit=limit, identity=self.world.identity, run=first_run,
                outside=list(self.outside), map=self.publisher.floor,
            )  # fmt: skip
        self.world.poses()

    @contextmanager
    def lock_for_change(self) -> Iterator[None]:
        """Keep other threads from reading while bodies change; then read all poses: later readers change nothing."""
        with self._moving:
            yield
            self.world.poses()

    @property
    def lockstep(self) -> bool:
        """True if each tick waits for all robots."""
        return self.pace == "max"

    @property
    def stands(self) -> bool:
        """True if the clock is stopped: the run is not running, robots are expected back, or nothing is left to do."""
        return self.phase is not Phase.RUNNING or bool(self.membership.robots_awaited) or self._rests

    @property
    def stays(self) -> bool:
        """True if the run does not end by itself: the fleet serves, or somebody who attends has cancelled a mission."""
        return self.world.settings.serve or (self._attended and bool(self.world.tasks.missions.dropped_targets))

    @property
    def _rests(self) -> bool:
        """True if nothing would happen until somebody asks for something, and no limit is waited for."""
        limited = self.world.settings.serve and not isinf(self._limit)
        may_rest = self.stays and self.lockstep and not limited and not self.in_tick
        return may_rest and self.world.rests(self.membership.members)

    @property
    def waits(self) -> bool:
        """True if only robots that are absent have anything left to do."""
        left = self.world.tasks.waits_for(self.membership.members)
        return bool(left) and set(left).issubset(self.membership.absent_robots)

    def _make_world(self, run: int, edits: int, identity: str, places: Book | None) -> World:
        """Return the world at the beginning of a run."""
        return World(self.scenario, self._starts, self.seed, run, edits, identity, self.outside, places)

    def _resume(self, found: Snapshot) -> None:
        """Go on with the run of a snapshot."""
        host = found.host
        if found.floor is not None:
            self.scenario = replace(self.scenario, map=unpack(found.floor))
        self.world = self._make_world(found.run, found.state.bodies.edits, found.identity, found.places)
        self.publisher.floor = floor(self.scenario, self.world)
        self._admit(self.world.robots[len(self._starts) :])
        self.world.restore(found.state)
        self.phase, self.held, self._reason, self._lost = host.phase, host.held, host.reason, host.lost
        self.last.late, self.last.states, self.last.plans = host.late, host.states, host.plans
        self.stopwatch, self.timetable.times = Stopwatch(host.wall_time), Times(host.tick_bins, host.tick_longest)
        self.repeatable.reasons = host.not_reproducible
        self.publisher.events = tuple(host.events)
        self.liveliness.restore(host.seen, host.left)
        self.pressed, self.membership.most_in_one = host.pressed, host.most_in_one
        self.membership.expect(host.present, self.awake.now() + BACK)

    # --- saving ---

    def save(self) -> None:
        """Save the state if it has changed; in lockstep only while no tick is under way."""
        if self._unsaved and not (self.lockstep and self.in_tick):
            self._unsaved = False
            rows = self.tape.note_save() if self._saver.is_on else 0
            with self.lock_for_change():
                self._saver.save(self.world, lambda: self._state(rows))

    @property
    def is_saved(self) -> bool:
        """True if a world that comes after this one finds a state to go on with."""
        return self._saver.is_on and not self._saver.failed

    def save_soon(self) -> None:
        """Save the state now, or in lockstep after the tick that is under way."""
        self._unsaved = True
        self.save()

    def _state(self, rows: int) -> HostState:
        times = self.timetable.times
        return HostState(
            phase=self.phase, held=self.held, reason=self._reason, lost=self._lost, wall_time=self.stopwatch.seconds,
            present=self.membership.members, most_in_one=self.membership.most_in_one, late=self.last.late,
            states=self.last.states, plans=self.last.plans, tick_bins=times.bins, tick_longest=times.longest,
            not_reproducible=self.repeatable.reasons, events=list(self.publisher.events),
            seen=dict(self.liveliness.seen), left=self.liveliness.left, pressed=self.pressed,
            tape=rows,
        )  # fmt: skip

    # --- telling; what only reads may be called from any thread ---

    def clock(self) -> Clock:
        """Return the message with the time and phase of the run."""
        return self.publisher.clock(self.world, self.phase, self.membership.present, self.liveliness.seen)

    def truth(self) -> Truth:
        """Return the true state of all bodies."""
        with self._moving:
            return make_truth(self.world)

    def states(self) -> dict[str, State]:
        """Return the state of every robot; of one that is not there, its last."""
        with self._moving:
            return states(self.world, self.last.states)

    def status(self) -> Status:
        """Return the status of the run."""
        with self._moving:
            world, over = self.world, self.phase is Phase.OVER
            reason = self._reason or missing(world) if over and not world.tasks.complete else ""
            shortest = self._shortest() if over else [None] * len(world.robots)
            return status(
                world, self.phase, reason, self.liveliness.seen, self.last.states, self.publisher.events, shortest
            )

    def tell_clock(self) -> None:
        """Send the time and phase of the run."""
        self.publisher.tell_clock(self.clock())

    def tell(self, kind: str, text: str, robot: str | None = None) -> None:
        """Send an event of the present tick."""
        self.publisher.tell(self.world.event(kind, text, robot))

    def part(self, name: str) -> None:
        """Take in that a robot has left."""
        self.liveliness.left.add(name)
        self.repeatable.no_longer(f"{name} has left", self.world.time)
        self.say_saved([self.world.event(*HAS_LEFT, name)])
        self.tell_clock()

    def tell_map(self) -> None:
        """Send the world's current floor to all listeners; robots that join or restart get it."""
        self.scenario = replace(self.scenario, map=self.world.bodies.floor)
        self.publisher.tell_map(self.scenario, self.world)

    def say_saved(self, events: Sequence[Event]) -> None:
        """Save the state before its events go out: a world that is killed in between tells them once."""
        self.publisher.keep(events)
        self.save_soon()
        self.publisher.say(events)

    # --- changing ---

    def remember(self, name: str, text: str) -> None:
        """Keep the answer to a button that was named, for a retry; the caller saves it."""
        self.pressed[name] = text
        if len(self.pressed) > NAMED:
            del self.pressed[next(iter(self.pressed))]

    def senses(self) -> Mapping[str, Sense]:
        """Begin a tick: return what every robot senses."""
        self.tape.note_senses()
        self.in_tick = True
        return self.world.senses(self.lockstep)

    def step(self) -> None:
        """Move all robots to the next tick by the commands that have come."""
        self.tape.step()
        self.world.bodies.external.told = self.last.bodies
        with self.lock_for_change():
            events = self.world.step(self.last.commands, self.last.sent)
        for event in events:
            self.repeatable.hear(event)
        self.publisher.keep(events)
        self.last.forget_commands()
        self.in_tick = False
        if self.world.due:
            self.save_soon()
        self.publisher.say(events)
        if self.world.bodies.floor is not self.scenario.map:  # the scenario has made an edit
            self.tell_map()
        self._end_if_over()

    def _end_if_over(self) -> None:
        world, unfinished, stays = self.world, self.world.tasks.unfinished_robots, self.stays
        away = {name: self.membership.absence_time(name) for name in unfinished}
        if not stays and world.is_finished:
            self.end(missing(world))
        elif unfinished and not stays and is_lost(away, self._given_up) and not world.plans_matter:
            self._lost = unfinished
            self.end(
                f"lost {list_within(unfinished, ', ', ROOM)}: absent for {min(away.values()):.0f} s; {missing(world)}"
            )
        elif world.time >= self._limit:
            self.end(f"time limit of {self._limit:g} s; {missing(world)}")

    def open_places(self, request: Places) -> tuple[Accepted, list[Event]]:
        """Open places for more robots; for the result and errors see ``World.open_places``."""
        with self.lock_for_change():
            answer, events = self.world.open_places(request)
            self._admit([event.robot for event in events if event.robot is not None])
        return answer, events

    def _admit(self, robots: Sequence[str]) -> None:
        """Let processes take the places of more robots."""
        self.membership.add(robots)
        self.liveliness.add(robots, self.world.time)

    def go_to(self, phase: Phase) -> None:
        """Enter a phase."""
        self.phase = phase
        self.timetable.start()
        self.say_saved([self.world.event("phase", f"the run is {phase.value}")])
        self.publisher.tell_status(self.truth(), self.status())
        self.tell_clock()  # the last message of a run: who hears it has heard all

    def end(self, reason: str) -> None:
        """End the run; the reason counts if it is not complete."""
        self._reason, self.in_tick = reason, False
        self.go_to(Phase.OVER)

    def restart(self) -> None:
        """Begin a new run: all robots are back at their starts, progress is cleared."""
        self.publisher.tell_status(self.truth(), self.status())  # how the old one ended
        old = self.world
        self.tape.note_restart()
        with self.lock_for_change():
            self.world = self._make_world(old.run + 1, old.bodies.edits, old.identity, old.tasks.places)
            self.last = LastMessages()
        self.stopwatch, self.timetable.times, self._lengths = Stopwatch(), Times(), []
        self.repeatable.begin()
        self.liveliness.begin()
        self.in_tick = False

    def _shortest(self) -> list[float | None]:
        """Return each robot's shortest length [m] on the floor at the end; it takes long, so it is computed once."""
        self._lengths = self._lengths or shortest_lengths(self.world)
        return self._lengths

    def report(self) -> dict[str, object]:
        """Return the report of the run."""
        return report(
            self.world, self._shortest(), scenario=self.scenario.settings.name,
            seed=self.seed, robots_per_process=self.membership.most_in_one,
            pace="max" if self.pace == "max" else "realtime" if self.pace == 1.0 else f"{self.pace:g}",
            wall_time=self.stopwatch.seconds, late_commands=self.last.late,
            tick_wall=self.timetable.times.report(), reason=self._reason or missing(self.world),
            not_reproducible=self.repeatable.reasons, lost=self._lost,
        )  # fmt: skip
