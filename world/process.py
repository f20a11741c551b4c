"""The world process: it waits for the robots, keeps the clock, senses for all, moves all, and writes the report."""

from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Event as Flag
from time import monotonic
from typing import Final

from swarm.bus import Arrival, Bus, Endpoint, Link, Presence, Request
from swarm.errors import SwarmError
from swarm.messages import (
    ACTION,
    CLOCK,
    COMMAND,
    EDIT,
    JOIN,
    MAP,
    PLAN,
    SENSE,
    STATE,
    TRUTH,
    Accepted,
    Action,
    Clock,
    Do,
    Edit,
    Join,
    Message,
    Phase,
    Sense,
    Welcome,
)  # fmt: skip
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import planning_grid, prepare
from swarm.settings import Pace
from swarm.stopping import told_to_stop
from world.answers import SILENT, Asked, LastMessages
from world.controls import pressed
from world.lobby import Lobby
from world.pace import Stopwatch, Times, Timetable
from world.report import missing, report, write
from world.speaker import Speaker
from world.world import World

LOOK: Final = 0.25  # s between two checks whether we are told to stop


def run(
    endpoint: Endpoint,
    fleet: str,
    scenario: Scenario,
    robots: int,
    seed: int,
    pace: Pace,
    limit: float,
    wait: bool = False,
    watchers: int = 0,
    report_to: Path | None = None,
    log: Callable[[str], None] = print,
) -> int:
    """Run the world of a fleet until its run is over; return the exit status, 0 complete or 1 not complete.

    Raises:
        ConfigError: there is no router, the starts have no room for so many robots, or the report cannot be written.
    """
    with told_to_stop() as stop, Bus(endpoint, fleet, log) as bus:
        host = Host(bus, scenario, robots, seed, pace, limit, wait, watchers, log)
        host.open()
        host.serve(stop)
        summary = host.report()
        if report_to is not None:
            write(summary, report_to)
        return 0 if summary["complete"] else 1


class Host:
    """The main loop of one fleet's world, and the phase of its run."""

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
        log: Callable[[str], None],
    ) -> None:
        self._bus, self._log = bus, log
        scenario, _, starts = prepare(scenario, robots, seed)
        self._seed, self._pace, self._limit = seed, pace, limit
        self._world = World(scenario, starts, seed)
        self._speaker = Speaker(bus, scenario, log)
        self._lobby = Lobby(self._world.robots, watchers, monotonic())
        self.phase = Phase.WAITING
        self._held = wait  # waits until somebody presses go
        self._last = LastMessages()
        self._linked = True
        self._reason = ""
        self._stopwatch = Stopwatch()
        self._timetable = Timetable(self._world.dt, 1.0 if pace == "max" else pace)

    def open(self) -> None:
        """Listen to the robots, answer requests, and announce this process."""
        bus = self._bus
        for topic in (COMMAND, STATE, PLAN):
            bus.listen(topic)
        for question in (ACTION, EDIT, JOIN):
            bus.serve(question)
        bus.keep(MAP, lambda: {MAP.key: self._speaker.floor(self._world)})
        bus.keep(CLOCK, lambda: {CLOCK.key: self._clock()})
        bus.keep(STATE, lambda: {STATE.key.format(robot=name): s for name, s in list(self._last.states.items())})
        bus.keep(PLAN, lambda: {PLAN.key.format(robot=name): p for name, p in list(self._last.plans.items())})
        bus.watch_presence()
        bus.announce("world", "world")

    def _clock(self) -> Clock:
        return self._speaker.clock(self._world, self.phase, self._lobby.present)

    def _tell_clock(self) -> None:
        self._speaker.tell_clock(self._clock())

    def _tell(self, kind: str, text: str, robot: str | None = None) -> None:
        self._speaker.tell(self._world.event(kind, text, robot))

    def serve(self, stop: Flag) -> None:
        """Serve until the run is over or this process is told to stop."""
        self._tell_clock()
        while self.phase is not Phase.OVER:
            if stop.is_set():
                self._end("interrupted")
            elif self.phase is Phase.RUNNING and self._linked:
                self._tick(stop)
            else:
                self._stopwatch.halt()
                self._take(self._bus.receive(LOOK))
                if self.phase is Phase.WAITING and not self._held and self._lobby.ready(monotonic()):
                    self._go_to(Phase.RUNNING)
            if self._speaker.clock_is_due:
                self._tell_clock()
        self._stopwatch.halt()
        self._bus.send(TRUTH, self._world.truth())
        self._tell_clock()

    def _go_to(self, phase: Phase) -> None:
        self.phase = phase
        self._timetable.start()
        self._tell("phase", f"the run is {phase.value}")
        self._tell_clock()

    def _end(self, reason: str) -> None:
        self._reason = reason
        self._go_to(Phase.OVER)

    def _tick(self, stop: Flag) -> None:
        """Run one tick: sense for all robots, wait for their commands or for the time to pass, move all."""
        self._stopwatch.go()
        world, bus = self._world, self._bus
        lockstep = self._pace == "max"
        senses = world.senses(lockstep)
        for name in self._lobby.present:
            bus.send(SENSE, senses[name], robot=name)
        self._speaker.tell_truth(world)
        if lockstep:
            self._await_all(stop, senses)
        else:
            self._await_time(stop)
        if self.phase is Phase.OVER or self._world is not world or not self._linked:
            return  # stopped or restarted meanwhile; a pause begins after the tick
        for event in world.step(self._last.commands):
            self._speaker.tell(event)
        self._last.carried_out()
        if world.floor is not self._speaker.scenario.map:  # the scenario has made an edit
            self._tell_map()
        if world.finished:
            self._end(missing(world))
        elif world.time >= self._limit:
            self._end(f"time limit of {self._limit:g} s; {missing(world)}")

    def _await_all(self, stop: Flag, senses: Mapping[str, Sense]) -> None:
        """Wait for the commands of all present robots; send the sense again to robots that came late or are silent."""
        world, asked = self._world, Asked(self._lobby.present, monotonic())
        while self.phase is not Phase.OVER and self._world is world and self._linked and not stop.is_set():
            present = self._lobby.present
            lacking = self._last.lacking(present, world.tick)
            if not self._last.awaited(present):
                self._take(self._bus.receive(LOOK))  # no robot answers: wait for one to come back
                return
            if not lacking:
                return
            for name in asked.again(lacking, monotonic()):
                self._bus.send(SENSE, senses[name], robot=name)
            for name in asked.overdue(lacking, monotonic()):
                self._last.deaf.add(name)
                self._tell("silent", f"has not answered for {SILENT:g} s; the run goes on without it", name)
            self._take(self._bus.receive(LOOK))

    def _await_time(self, stop: Flag) -> None:
        self._timetable.tick()
        while self.phase is not Phase.OVER and not stop.is_set():
            left = self._timetable.look(answered=self._last.in_time >= len(self._lobby.present))
            arrived = self._bus.receive(left)
            if arrived is None and left == 0.0:
                return
            self._take(arrived)

    def _take(self, arrived: Arrival | Presence | Link | Request | None) -> None:
        match arrived:
            case Arrival(ids=ids, message=message) if self._lobby.knows(ids["robot"]):
                self._last.take(ids["robot"], message, self._world.run, self._world.tick)
            case Presence():
                self._take_presence(arrived)
            case Request():
                self._answer(arrived)
            case Link(up=up):
                self._linked = up
                self._log(f"the router is {'back' if up else 'gone; the clock stops until it is back'}")

    def _take_presence(self, presence: Presence) -> None:
        note = self._lobby.take(presence)
        if note is not None and (note.kind != "gone" or (self.phase is Phase.RUNNING and self._linked)):
            self._tell(*note)
        if presence.role == "robot" and self._lobby.knows(presence.id):
            self._tell_clock()

    def _answer(self, request: Request) -> None:
        """Carry out a request, or refuse it with the reason."""
        try:
            match request.message:
                case Action(do=do):
                    reply: Message = self._press(do)
                case Edit() as edit:
                    reply = self._edit(edit)
                case Join(robot=asked):
                    reply = self._welcome(asked)
        except SwarmError as fault:
            request.refuse(str(fault))
        else:
            request.accept(reply)

    def _welcome(self, asked: str | None) -> Welcome:
        """Assign a robot process its place in the fleet."""
        name = self._lobby.place(asked, monotonic())
        state = self._last.states.get(name)
        return Welcome(
            robot=name,
            scenario=self._speaker.settings,
            packed=self._speaker.packed,
            edits=self._world.edits,
            start=self._world.starts[self._world.robots.index(name)],
            state=state if state is not None and state.run == self._world.run else None,
        )

    def _press(self, do: Do) -> Accepted:
        """Carry out a button if it may be pressed in this phase."""
        phase = pressed(self.phase, do, self._lobby.absent)
        self._held = self._held and do is not Do.GO
        if do is Do.RESTART:
            self._restart()
        if do is Do.STOP:
            self._end("stopped by command")
        elif phase is not self.phase or do is Do.RESTART:
            self._go_to(phase)
        return Accepted(text=f"the run is {self.phase.value}")

    def _edit(self, edit: Edit) -> Accepted:
        """Add or remove walls, and send the new map to all listeners."""
        self._world.edit(edit)
        text = f"{edit.kind.value} from {edit.low} to {edit.high}"
        self._tell("edit", text)
        self._tell_map()
        return Accepted(text=text)

    def _tell_map(self) -> None:
        """Take over the world's current floor and send it to all listeners."""
        self._speaker.take_map(self._world.floor)
        self._speaker.tell_map(self._world)

    def _restart(self) -> None:
        """Begin a new run: all robots are back at their starts, progress is cleared."""
        old = self._world
        self._world = World(self._speaker.scenario, old.starts, self._seed, run=old.run + 1, edits=old.edits)
        self._last, self._stopwatch = LastMessages(), Stopwatch()
        self._timetable.times = Times()

    def report(self) -> dict[str, object]:
        """Return the report of the run."""
        settings = self._speaker.scenario.settings
        return report(
            self._world, planning_grid(self._speaker.scenario), scenario=settings.name, seed=self._seed,
            robots_per_process=self._lobby.most_in_one,
            pace="max" if self._pace == "max" else "realtime" if self._pace == 1.0 else f"{self._pace:g}",
            wall_time=self._stopwatch.seconds, late_commands=self._last.late,
            tick_wall=self._timetable.times.report(), reason=self._reason or missing(self._world),
        )  # fmt: skip
