"""The world as a process: it waits for its robots, owns the clock, senses for all, moves all, and reports."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Event as Flag
from time import monotonic
from typing import Final

from swarm.bus import Arrival, Bus, Endpoint, Presence, Request
from swarm.bus.session import Link
from swarm.errors import ConfigError
from swarm.messages import (
    ACTION,
    CLOCK,
    COMMAND,
    EDIT,
    EVENT,
    JOIN,
    MAP,
    PLAN,
    SENSE,
    STATE,
    TRUTH,
    Accepted,
    Action,
    Clock,
    Command,
    Do,
    Edit,
    Event,
    Floor,
    Join,
    Phase,
    Plan,
    State,
    Welcome,
)
from swarm.robot.ground import planning_grid
from swarm.scenario.load import Scenario
from swarm.scenario.starts import starts
from swarm.stopping import told_to_stop
from world.pace import Pace, Stopwatch, Timetable
from world.report import missing, report, write
from world.world import World, merged

LOOK: Final = 0.25  # s between two looks whether we are told to stop
SILENT: Final = 5.0  # s that lockstep waits for a robot which is there and does not answer
PROMISED: Final = 5.0  # s that a place is kept for a robot which was welcomed and is not there yet
WATCHERS: Final = 15.0  # s that the start waits for a dashboard that was announced

# fmt: off
#             while the run is     it may be asked to     and is then
BUTTONS: Final = {
    Phase.WAITING: {Do.GO: Phase.RUNNING, Do.RESTART: Phase.WAITING, Do.STOP: Phase.OVER},
    Phase.RUNNING: {Do.PAUSE: Phase.PAUSED, Do.RESTART: Phase.RUNNING, Do.STOP: Phase.OVER},
    Phase.PAUSED:  {Do.RESUME: Phase.RUNNING, Do.GO: Phase.RUNNING, Do.RESTART: Phase.PAUSED, Do.STOP: Phase.OVER},
    Phase.OVER:    {},
}
# fmt: on


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
    """Be the world of a fleet until its run is over; the exit status says whether it was completed.

    Raises:
        ConfigError: there is no router, or the starts have no room for so many robots.
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
    """One fleet's world, its robots' last words, and where the run stands."""

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
        self._bus, self._scenario, self._seed, self._pace, self._limit, self._log = (
            bus,
            scenario,
            seed,
            pace,
            limit,
            log,
        )
        self._grid = planning_grid(scenario)
        self._starts = starts(scenario, self._grid, robots, seed)
        self._world = World(scenario, self._starts, seed)
        self._wire = scenario.to_wire()
        self.phase = Phase.WAITING
        self._held = wait  # stands until somebody says go
        self._watchers, self._watchers_until = watchers, monotonic() + WATCHERS
        self._sessions: dict[str, set[str]] = {name: set() for name in self._world.robots}
        self._dashboards: set[str] = set()
        self._promised: dict[str, float] = {}
        self._commands: dict[str, Command] = {}
        self._states: dict[str, State] = {}
        self._plans: dict[str, Plan] = {}
        self._deaf: set[str] = set()  # there, but they did not answer in time
        self._linked = True
        self._late = 0
        self._reason = ""
        self._stopwatch = Stopwatch()
        self._timetable = Timetable(self._world.dt, 1.0 if pace == "max" else pace)
        self._clock_told = float("-inf")
        self._truth_every = max(1, round(scenario.settings.rate / TRUTH.rate))

    # --- the wire ---

    def open(self) -> None:
        """Listen, answer, and be present."""
        bus = self._bus
        for topic in (COMMAND, STATE, PLAN):
            bus.listen(topic)
        for question in (ACTION, EDIT, JOIN):
            bus.serve(question)
        bus.keep(MAP, lambda: {MAP.key: self._floor()})
        bus.keep(CLOCK, lambda: {CLOCK.key: self._clock()})
        bus.keep(STATE, lambda: {STATE.key.format(robot=name): s for name, s in list(self._states.items())})
        bus.keep(PLAN, lambda: {PLAN.key.format(robot=name): p for name, p in list(self._plans.items())})
        bus.watch_presence()
        bus.announce("world", "world")

    def _floor(self) -> Floor:
        settings, packed = self._wire
        homes = dict(zip(self._world.robots, self._starts, strict=True))
        return Floor(packed=packed, scenario=settings | {"starts": homes}, edits=self._world.edits)

    def _clock(self) -> Clock:
        world = self._world
        present = [name for name, sessions in self._sessions.items() if sessions]
        return Clock(
            run=world.run,
            tick=world.tick,
            time=world.time,
            phase=self.phase,
            robots=list(world.robots),
            present=present,
        )

    def _tell_clock(self) -> None:
        self._clock_told = monotonic()
        self._bus.send(CLOCK, self._clock())

    def _tell(self, event: Event) -> None:
        self._bus.send(EVENT, event)
        self._log(f"{event.time:8.2f} s  {event.robot + ' ' if event.robot else ''}{event.text}")

    # --- the run ---

    def serve(self, stop: Flag) -> None:
        """Run until the run is over, or we are told to stop."""
        self._tell_clock()
        while self.phase is not Phase.OVER:
            if stop.is_set():
                self._end("interrupted")
            elif self.phase is Phase.RUNNING and self._linked:
                self._tick(stop)
            else:
                self._stopwatch.halt()
                self._take(self._bus.receive(LOOK))
                self._begin_if_all_are_here()
            if monotonic() - self._clock_told >= 1.0 / CLOCK.rate:
                self._tell_clock()
        self._stopwatch.halt()
        self._bus.send(TRUTH, self._world.truth())
        self._tell_clock()

    def _begin_if_all_are_here(self) -> None:
        if self.phase is not Phase.WAITING or self._held or not all(self._sessions.values()):
            return
        if len(self._dashboards) < self._watchers and monotonic() < self._watchers_until:
            return
        self._go_to(Phase.RUNNING)

    def _go_to(self, phase: Phase) -> None:
        self.phase = phase
        self._timetable.start()
        self._tell(self._world.event("phase", f"the run is {phase.value}"))
        self._tell_clock()

    def _end(self, reason: str) -> None:
        self._reason = reason
        self._go_to(Phase.OVER)

    def _tick(self, stop: Flag) -> None:
        """One tick: sense for all, wait for their commands or for the time to pass, move all."""
        self._stopwatch.go()
        world, bus = self._world, self._bus
        lockstep = self._pace == "max"
        for name, sense in world.senses(lockstep).items():
            if self._sessions[name]:
                bus.send(SENSE, sense, robot=name)
        if world.tick % self._truth_every == 0 and bus.wanted(TRUTH):
            bus.send(TRUTH, world.truth())
        if lockstep:
            self._await_all(stop)
        else:
            self._await_time(stop)
        if self.phase is Phase.OVER or self._world is not world or not self._linked:
            return  # stopped or restarted meanwhile; a pause begins after the tick
        for event in world.step(self._commands):
            self._tell(event)
        self._commands = {}
        if world.floor is not self._scenario.map:  # an edit of the scenario's own
            self._tell_map()
        if world.finished:
            self._end(missing(world))
        elif world.time >= self._limit:
            self._end(f"time limit of {self._limit:g} s; {missing(world)}")

    def _await_all(self, stop: Flag) -> None:
        world, deadline = self._world, monotonic() + SILENT
        while self.phase is not Phase.OVER and self._world is world and self._linked and not stop.is_set():
            awaited = [name for name, sessions in self._sessions.items() if sessions and name not in self._deaf]
            lacking = [name for name in awaited if name not in self._commands]
            if not awaited:
                self._take(self._bus.receive(LOOK))  # nobody answers: time for somebody to come back
                return
            if not lacking:
                return
            if monotonic() > deadline:
                for name in lacking:
                    self._deaf.add(name)
                    self._tell(self._world.event("silent", f"is there but has not answered for {SILENT:g} s", name))
                return
            self._take(self._bus.receive(LOOK))

    def _await_time(self, stop: Flag) -> None:
        self._timetable.tick()
        while self.phase is not Phase.OVER and not stop.is_set():
            left = self._timetable.left
            arrived = self._bus.receive(left)
            if arrived is None and left == 0.0:
                return
            self._take(arrived)

    # --- what arrives ---

    def _take(self, arrived: Arrival | Presence | Link | Request | None) -> None:
        match arrived:
            case Arrival(topic=topic, ids=ids, message=message) if ids["robot"] in self._sessions:
                self._take_message(topic.key, ids["robot"], message)
            case Presence():
                self._take_presence(arrived)
            case Request(message=Action()):
                self._press(arrived)
            case Request(message=Edit()):
                self._edit(arrived)
            case Request(message=Join()):
                self._welcome(arrived)
            case Link(up=up):
                self._linked = up
                self._log(f"the router is {'back' if up else 'gone; the clock stands until it is back'}")

    def _take_message(self, key: str, name: str, message: Command | State | Plan) -> None:
        world = self._world
        if message.run != world.run or message.tick > world.tick:
            return  # of a run that is over, or of a tick that nobody was told of
        match message:
            case Command():
                self._deaf.discard(name)
                if message.tick < world.tick:
                    self._late += 1
                known = self._commands.get(name)
                self._commands[name] = message if known is None else merged(message, known)
            case State():
                self._states[name] = message
            case Plan():
                self._plans[name] = message

    def _take_presence(self, presence: Presence) -> None:
        name, session = presence.id, presence.session
        if presence.role == "dashboard":
            (self._dashboards.add if presence.alive else self._dashboards.discard)(session)
        if presence.role != "robot" or name not in self._sessions:
            return
        sessions = self._sessions[name]
        if presence.alive:
            sessions.add(session)
            self._promised.pop(name, None)
            if len(sessions) > 1:
                self._tell(self._world.event("duplicate", f"is there {len(sessions)} times; stop all but one", name))
        else:
            sessions.discard(session)
            if not sessions and self.phase is Phase.RUNNING and self._linked:
                self._tell(self._world.event("gone", "is gone; its body stops", name))
        self._tell_clock()

    def _welcome(self, request: Request) -> None:
        """Give a robot process its place."""
        asked, now = request.message.robot, monotonic()
        taken = {n for n, s in self._sessions.items() if s}
        free = [n for n in self._world.robots if n not in taken and self._promised.get(n, 0.0) < now]
        if asked is not None and asked not in self._sessions:
            request.refuse(
                f"expected one of {', '.join(self._world.robots)}, got {asked!r}; the fleet has no such robot"
            )
        elif asked is not None and asked in taken:
            request.refuse(f"robot {asked!r} is here already; stop that one first, or join without a name")
        elif asked is None and not free:
            request.refuse(f"all {len(self._world.robots)} places are taken; start the world with more robots")
        else:
            name = asked or free[0]
            self._promised[name] = now + PROMISED
            state = self._states.get(name)
            settings, packed = self._wire
            request.accept(
                Welcome(
                    robot=name,
                    scenario=settings,
                    packed=packed,
                    edits=self._world.edits,
                    start=self._starts[self._world.robots.index(name)],
                    state=state if state is not None and state.run == self._world.run else None,
                )
            )

    def _press(self, request: Request) -> None:
        """Do what a button says, if the table lets it."""
        do = request.message.do
        phase = BUTTONS[self.phase].get(do)
        if phase is None:
            can = ", ".join(BUTTONS[self.phase]) or "nothing"
            request.refuse(f"the run is {self.phase.value}: expected one of ({can}), got {do.value}")
            return
        if do is Do.GO:
            lacking = [name for name, sessions in self._sessions.items() if not sessions]
            if lacking:
                request.refuse(f"expected all robots to be there, {', '.join(lacking)} are not; wait for them")
                return
            self._held = False
        if do is Do.RESTART:
            self._restart()
        if do is Do.STOP:
            self._end("stopped by command")
        elif phase is not self.phase or do is Do.RESTART:
            self._go_to(phase)
        request.accept(Accepted(text=f"the run is {self.phase.value}"))

    def _edit(self, request: Request) -> None:
        """Add or remove walls, and let those who watch know."""
        edit = request.message
        try:
            self._world.edit(edit)
        except ConfigError as fault:
            request.refuse(str(fault))
            return
        text = f"{edit.kind.value} from {edit.low} to {edit.high}"
        self._tell(self._world.event("edit", text))
        self._tell_map()
        request.accept(Accepted(text=text))

    def _tell_map(self) -> None:
        """Take the world's floor over as it is now, and let those who watch, join or begin again know."""
        self._scenario = replace(self._scenario, map=self._world.floor)
        self._wire = self._scenario.to_wire()
        self._grid = planning_grid(self._scenario)
        self._bus.send(MAP, self._floor())

    def _restart(self) -> None:
        """All back to their starts, progress cleared; a run of its own begins."""
        self._world = World(self._scenario, self._starts, self._seed, run=self._world.run + 1, edits=self._world.edits)
        self._commands, self._states, self._plans = {}, {}, {}
        self._late = 0
        self._stopwatch = Stopwatch()

    def report(self) -> dict[str, object]:
        """Sum the run up."""
        return report(
            self._world,
            self._grid,
            scenario=self._scenario.settings.name,
            seed=self._seed,
            pace="max" if self._pace == "max" else "realtime" if self._pace == 1.0 else f"{self._pace:g}",
            wall_time=self._stopwatch.seconds,
            late_commands=self._late,
            reason=self._reason or missing(self._world),
        )
