"""The world process: it waits for the robots, keeps the clock, senses for all, moves all, and writes the report."""

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path
from threading import Event as Flag
from typing import Final

from swarm.bus import Arrival, Bus, Endpoint, Link, Presence, Request
from swarm.errors import ConfigError
from swarm.heartbeat import Heartbeat
from swarm.messages import BODY, CLOCK, COMMAND, PLAN, RADIO, SENSE, STATE, STATUS, TRUTH, Phase, Sense
from swarm.scenario.load import Scenario
from swarm.secure import Identity
from swarm.settings import Pace
from swarm.stop_signal import stop_flag
from world.fleet.membership import HAS_LEFT
from world.fleet.single_world import check_alone
from world.host.last_messages import SILENT, SenseTimes
from world.host.request_answers import answer
from world.host.requests import ANSWERED, Requests, waits_in_tick
from world.host.run import Run
from world.host.tape_feed import foreign, put_broadcast_on_tape, put_message_on_tape
from world.saving.snapshot_file import make_room, remove
from world.views.report_file import write

LEFT: Final = 3  # exit status of a world that has left its run to the next one
LOOK: Final = 0.25  # s between two checks whether we are told to stop
FIND: Final = 2.0  # s between two looks for robots that are away
PEEK: Final = 0.02  # s between two looks while it is open whether a robot has gone
BODY_OF: Final = "the body of {}".format
TAKEN: Final = 5000  # arrivals taken in after the time of a tick is up, at most


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
    snapshot: Path | None = None,
    log: Callable[[str], None] = print,
    outside: Sequence[str] = (),
    first_run: int = 0,
    given_up: Path | None = None,
    tape: Path | None = None,
    hand_over: bool = False,
) -> int:
    """Run the world of a fleet until its run is over; return the exit status, 0 if it has passed, else 1.

    The state is saved to the file ``snapshot`` at least once a simulated second. If the file exists, the run that it
    was saved from goes on. The bodies of the robots ``outside`` are reported by other processes. ``first_run`` is the
    number of the first run: above those of a world before in the same fleet, or listeners would take it for older. The
    file ``given_up`` will have the names of robots that nobody starts again. The tape of the run is appended to the
    file ``tape``. With ``hand_over``, a world that is told to stop leaves the run to the next one, which begins with
    the snapshot; the status is ``LEFT``. The snapshot of a run that has passed is removed then.

    Raises:
        ConfigError: there is no router, the fleet has a world, the starts have no room for so many robots, the snapshot
            is of another run, or the report cannot be written.
    """
    with stop_flag() as stop, Bus(endpoint, fleet, log, Heartbeat()) as bus:
        run = Run(
            bus, scenario, robots, seed, pace, limit, wait, watchers, snapshot, log, outside, first_run, given_up, tape
        )
        host = Host(bus, run, log, endpoint.identity)
        with check_alone(bus, fleet, log) as silent:
            host.open(silent)
        host.serve(stop, hand_over=hand_over)
        run.tape.close()
        if run.phase is not Phase.OVER:
            log(f"the run is left in {snapshot}; the same command goes on with it")
            return LEFT
        summary = run.report()
        if report_to is not None:
            try:
                write(summary, report_to)
            except ConfigError:
                if snapshot is None:
                    raise
                make_room(snapshot)  # the disk may be full
                write(summary, report_to)
        if summary["passed"] and hand_over and snapshot is not None:
            remove(snapshot)  # there is nothing to go on with
        return 0 if summary["passed"] else 1


class Host:
    """The main loop of one fleet's world."""

    def __init__(self, bus: Bus, run: Run, log: Callable[[str], None], identity: Identity | None = None) -> None:
        self._bus, self._run, self._log, self._identity = bus, run, log, identity
        self._requests = Requests(run.world.dt)
        self._linked = True
        self._looked_at = float("-inf")  # s, for robots that have gone
        self._found_at = 0.0  # s, when robots that are away were looked for last
        self._asked = SenseTimes([], 0.0)
        self._senses: Mapping[str, Sense] = {}
        self._worlds = {bus.id}  # sessions that announce a world and are no rivals
        self._rival = False  # another world was seen
        self._impostors: set[str] = set()  # robots in whose name somebody else has spoken

    def open(self, silent: AbstractSet[str] = frozenset()) -> None:
        """Listen to the robots, answer requests, and announce this process; ``silent`` worlds do not answer."""
        bus, run = self._bus, self._run
        self._worlds = {bus.id, *silent}
        for topic in (COMMAND, STATE, PLAN, *((BODY,) if run.outside else ())):
            bus.listen(topic)
        for name in foreign(run):
            bus.listen(RADIO, quiet=True, robot=name)
        for question in ANSWERED:
            bus.serve(question)
        run.publisher.answer()
        bus.keep(CLOCK, lambda: {CLOCK.key: run.clock()})
        bus.keep(TRUTH, lambda: {TRUTH.key: run.truth()})
        bus.keep(STATUS, lambda: {STATUS.key: run.status()})
        bus.keep(STATE, lambda: {STATE.key.format(robot=name): state for name, state in run.states().items()})
        bus.keep(PLAN, lambda: {PLAN.key.format(robot=name): p for name, p in list(run.last.plans.items())})
        bus.watch_presence()
        bus.announce("world", "world")

    def serve(self, stop: Flag, *, hand_over: bool = False) -> None:
        """Serve until the run is over, or until told to stop: that ends the run, or it is left to the next world."""
        run = self._run
        run.tell_clock()
        while run.phase is not Phase.OVER:
            run.save()
            stands = run.stands or not self._linked
            if stands:
                self._requests.idle()
            self._serve_requests()
            if stop.is_set() and hand_over and run.is_saved:
                break
            if stop.is_set():
                run.end("interrupted")
            elif stands:
                run.stopwatch.halt()
                self._receive(LOOK)
                if not self._linked and self._lacks_keys(leave=hand_over):
                    break
                if run.phase is Phase.WAITING and not run.held and run.membership.ready(run.awake.now()):
                    run.go_to(Phase.RUNNING)
            elif run.phase is Phase.RUNNING:
                self._tick(stop)
            if run.publisher.clock_is_due:
                run.tell_clock()
        if run.phase is not Phase.OVER:
            run.save_soon()
        run.stopwatch.halt()
        run.tell_clock()

    def _lacks_keys(self, *, leave: bool) -> bool:
        """End the run, or return True to ``leave`` it, if the keys have expired: no router lets this process in."""
        try:
            if self._identity is not None:
                self._identity.check()
        except ConfigError as fault:
            text = f"no router can be reached any more: {fault}"
            if leave and self._run.is_saved:
                self._log(text)
                return True
            self._run.end(text)
        return False

    def _serve_requests(self) -> None:
        self._requests.serve(lambda request: answer(request, self._run, self._bus), closed=self._is_closed)

    def _is_closed(self, request: Request) -> bool:
        run = self._run
        is_there = run.world.is_at_next_stop
        return run.in_tick and waits_in_tick(request, lockstep=run.lockstep, is_there=is_there)

    def _tick(self, stop: Flag) -> None:
        """Run one tick: sense for all robots, wait for their commands or for the time to pass, move all."""
        run = self._run
        run.stopwatch.go()
        world = run.world
        if not run.in_tick:  # if the router was away meanwhile, the tick goes on
            self._senses = run.senses()
        for name in run.membership.present:
            self._bus.send(SENSE, self._senses[name], robot=name)
        run.publisher.tell_truth(world.tick, run.truth)
        if run.lockstep:
            if run.waits:  # else hours would be over before they are back
                self._let_pass(world.dt, stop)
            self._await_all(stop)
        else:
            self._await_time(stop)
        if run.world is world and run.in_tick and self._linked and not stop.is_set():
            run.step()  # else it was ended or restarted, or goes on later; a pause begins after the tick

    def _let_pass(self, seconds: float, stop: Flag) -> None:
        """Receive for some time of the wall clock."""
        run = self._run
        until = run.awake.now() + seconds
        while run.in_tick and not stop.is_set() and (left := until - run.awake.now()) > 0.0:
            self._receive(left)

    def _await_all(self, stop: Flag) -> None:
        """Wait for the commands of all present robots; send the sense again to robots that came late or are silent."""
        run, last = self._run, self._run.last
        world = run.world
        asked = self._asked = SenseTimes([*run.membership.present, *map(BODY_OF, run.outside)], run.awake.now())
        while run.in_tick and run.world is world and self._linked and not stop.is_set():
            present = run.membership.present
            lacking = last.robots_without_answer(present, world.tick)
            if not last.robots_awaited(present):
                self._receive(LOOK)  # no robot answers: wait for one to come back
                return
            bodies = {BODY_OF(name): name for name in last.lacking_bodies(run.outside, present, world.tick)}
            if not lacking and not bodies:
                return
            for name in asked.robots_to_send_again([*lacking, *bodies], run.awake.now()):
                robot = bodies.get(name, name)  # the robot says its command again, and the body may answer that
                self._bus.send(SENSE, self._senses[robot], robot=robot)
            last.bodiless.update(bodies[name] for name in asked.overdue(list(bodies), run.awake.now()))
            for name in asked.overdue(lacking, run.awake.now()):
                last.deaf.add(name)
                text = f"has not answered for {SILENT:g} s; the run goes on without it"
                run.tell("silent", text, name)
                run.repeatable.no_longer(f"{name} {text}", world.time)
            self._receive(LOOK)

    def _await_time(self, stop: Flag) -> None:
        run = self._run
        run.timetable.tick()
        taken = 0
        while run.in_tick and not stop.is_set() and taken < TAKEN:
            left = run.timetable.look(answered=run.last.in_time >= len(run.membership.present))
            taken += left == 0.0
            soon = self._requests.wait(closed=self._is_closed)
            if not self._receive(min(left, soon)) and left == 0.0:
                return

    def _receive(self, timeout: float) -> bool:
        """Take in the next arrival within a time [s]; return False if there is none."""
        run = self._run
        arrived = self._bus.receive(min(timeout, PEEK) if run.membership.is_unsettled else timeout)
        match arrived:
            case Arrival(topic=topic, ids=ids, message=message) if topic is BODY and run.membership.knows(ids["robot"]):
                put_message_on_tape(run, ids["robot"], message)
            case Arrival(topic=topic, message=message) if topic is RADIO:
                put_broadcast_on_tape(run, message)
            case Arrival(ids=ids, message=message, sender=sender):
                if run.membership.speaks(ids["robot"], sender):
                    run.liveliness.note_message(ids["robot"])
                    put_message_on_tape(run, ids["robot"], message)
                else:
                    self._name_impostor(ids["robot"])
            case Presence():
                self._take_presence(arrived)
            case Request():
                self._requests.add(arrived)
            case Link(up=up):
                self._linked = up
                run.membership.link(up, run.awake.now())
                self._log(f"the router is {'back' if up else 'gone; the clock stops until it is back'}")
        self._serve_requests()
        often = isinstance(arrived, Arrival) and run.awake.now() - self._looked_at < PEEK
        if self._linked and not often:
            self._look_who_has_gone()
            self._find_absent()
        return arrived is not None

    def _take_presence(self, presence: Presence) -> None:
        run = self._run
        note = run.membership.take(presence, run.awake.now())
        if note is not None and note[:2] == HAS_LEFT:
            run.part(note.robot)
        elif note is not None:
            run.tell(*note)
        if presence.role == "world" and presence.alive and presence.session not in self._worlds and not self._rival:
            self._rival = True
            run.tell("rival", "another world has come; each robot obeys the one that welcomed it; stop one of the two")
        if presence.role == "robot" and presence.alive and run.membership.knows(presence.id):
            self._asked.forget(presence.id)
            run.tell_clock()

    def _find_absent(self) -> None:
        """Ask for the tokens of robots that are away: one that came before the old link's end was told is forgotten."""
        membership, now = self._run.membership, self._run.awake.now()
        if now - self._found_at > FIND and membership.absent_robots:
            self._found_at = now
            for presence in self._bus.query_announced("robot", LOOK):
                if presence.id in membership.absent_robots:
                    self._take_presence(presence)

    def _name_impostor(self, robot: str) -> None:
        """Tell once for each robot that somebody else speaks in its name."""
        membership = self._run.membership
        if robot not in self._impostors and membership.knows(robot) and membership.is_present(robot):
            self._impostors.add(robot)
            self._run.tell("impostor", "has another process that sends in its name; that is ignored", robot)

    def _look_who_has_gone(self) -> None:
        run = self._run
        membership, liveliness, now = run.membership, run.liveliness, run.awake.now()
        self._looked_at = now
        running = not run.stands
        gone = membership.look(now, running=running)
        told = gone if run.phase is Phase.RUNNING else []
        before, away = liveliness.seen, {name: membership.absence_time(name) for name in membership.absent_robots}
        names = [note.robot for note in told]
        time = run.world.time
        changed = liveliness.look(now, time, away, running=running, gone=names, expected=membership.robots_awaited)
        for note in told:
            run.repeatable.no_longer(f"{note.robot} has lost its process", time)
        for note in (*told, *changed):
            run.tell(*note)
        if gone or liveliness.seen is not before:
            run.tell_clock()
