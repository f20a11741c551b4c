"""The forged and hostile messages: what a stranger on an open router can send."""

import os
import signal
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Final

from msgspec.structs import replace

from swarm.bus import Arrival, Bus
from swarm.bus.codec import encode
from swarm.errors import SwarmError
from swarm.launch.drill.faults import Fault
from swarm.launch.drill.fleet_under_drill import LOOK, LiveFleet
from swarm.launch.drill.floor import ROBOTS
from swarm.messages import (
    EDIT,
    JOIN,
    LEAVE,
    RADIO,
    SENSE,
    Activity,
    Clock,
    Command,
    Edit,
    Join,
    Kind,
    Leave,
    Message,
    Phase,
    Sense,
    State,
    Truth,
)
from swarm.scenario.starts import robot_names

Make = Callable[[Truth], Iterable[tuple[str, Message]]]  # key and message, from the newest truth
STOPS: Final = 2  # of each robot
TICKS: Final = 40  # for which a forged message is sent
AHEAD: Final = 1_000_000  # ticks
SPEED: Final = 20.0  # m/s, the most that a command can say
EDITS: Final = 190  # Hz
FLOOD: Final = 5.0  # s
GARBAGE: Final = 1000  # Hz
CORNER: Final = (11.4, 1.4), (11.6, 1.6)  # m, within a cell of the map that nobody needs any more
RUBBISH: Final = (
    b"",
    b"\xff\x00\xc1rubbish",
    b"\x93\x01\x02\x03",
    b"\x81\xa1v\x01",
    b"\x91" * 2000 + b"\x90",
    bytes(100_000),
)
KEYS: Final = (
    *(f"robot/r{robot}/{part}" for robot in (1, 2, 7) for part in ("sense", "cmd", "state", "plan")),
    "radio/0/0/r1", "radio/0/0/stranger", "radio/-1/0/r2", "world/clock", "world/event", "world/truth", "world/map",
    "world/action", "world/join", "world/edit", "alive/robot/r1/odd", "**", "robot/*/cmd", "nobody/knows/this",
)  # fmt: skip


def repeat_forgery(make: Make, then: Fault | None = None) -> Fault:
    """Return the fault that sends messages made from the newest truth for TICKS ticks, and does something ``then``."""

    def inject(live: LiveFleet) -> None:
        first = live.wait_for_truth(lambda truth: True, "the truth").tick
        newest = first
        while newest < first + TICKS:
            truth = live.wait_for_truth(lambda truth, newest=newest: truth.tick > newest, "the next tick")  # type: ignore[misc]
            newest = truth.tick
            for key, message in make(truth):
                live.stranger.send_bytes(key, encode(message))
        if then is not None:
            then(live)

    return inject


def forge_commands(*robots: str, **fields: object) -> Make:
    """Return what makes a command of each of some robots; apart from the ``fields`` it is that of one that stands."""
    stands = {
        "left": 0.0, "right": 0.0, "heading": 0.0, "activity": Activity.DRIVE, "reached": [False] * STOPS,
        "unreachable": [], "sent": False, "replans": 0,
    }  # fmt: skip

    def make(truth: Truth) -> Iterable[tuple[str, Message]]:
        for name in robots:
            yield f"robot/{name}/cmd", Command(run=truth.run, tick=truth.tick, **(stands | fields))  # type: ignore[arg-type]

    return make


def forge_new_run(truth: Truth) -> Iterable[tuple[str, Message]]:
    """r1 is told that a new run has begun."""
    yield (
        "robot/r1/sense",
        Sense(
            world="stranger", run=truth.run + 1, tick=0, time=0.0, lockstep=False, x=1.8, y=1.8, yaw=0.0, linear=0.0,
            angular=0.0,
            left=1.0, front=1.0, right=1.0, bearings=[None] * STOPS, hears=[], rays=[1.0] * 15,
        ),
    )  # fmt: skip


def all_reached(truth: Truth) -> Iterable[tuple[str, Message]]:
    """r3 says that it has reached all its stops."""
    yield (
        "robot/r3/state",
        State(
            robot="r3", run=truth.run, tick=truth.tick, activity=Activity.DONE, target=STOPS, reached=[True] * STOPS,
            unreachable=[], distance=0.0, replans=0,
        ),
    )  # fmt: skip


def forge_future_sense(live: LiveFleet) -> None:
    """Send r1 a `sense` in the name of its world, with a tick far ahead."""
    with Bus(live.endpoint, live.fleet, lambda line: None) as bus:
        bus.listen(SENSE, robot="r1")
        heard = live.await_that(lambda: bus.receive(LOOK), "a sense of r1").message
    for _ in range(TICKS):
        live.stranger.send_bytes("robot/r1/sense", encode(replace(heard, tick=heard.tick + AHEAD, hears=[])))
        live.take()


def forge_leaves(live: LiveFleet) -> None:
    """Say in the name of each robot that it leaves; its session is read from its token."""
    with Bus(live.endpoint, live.fleet, lambda line: None) as bus:
        bus.watch_presence("robot")
        for _ in range(ROBOTS):
            here = live.await_that(lambda: bus.receive(LOOK), "a robot's token")
            bus.ask(LEAVE, Leave(robot=here.id, session=here.session))


def forge_joins(live: LiveFleet) -> None:
    """Ask for the place of r1 again and again, for sessions that nobody has, and kill r1."""

    def work() -> None:
        with Bus(live.endpoint, live.fleet, lambda line: None) as bus:
            number = 0
            while not live.over.wait(0.01):
                number += 1
                with suppress(SwarmError):  # a refusal is an answer
                    bus.ask(JOIN, Join(robot="r1", session=f"nobody-{number}", world=None))

    live.run_in_background(work)
    os.kill(live.member("r1"), signal.SIGKILL)


def forge_end(truth: Truth) -> Iterable[tuple[str, Message]]:
    """The world says that the run is over."""
    robots = list(robot_names(ROBOTS))
    yield (
        "world/clock",
        Clock(run=truth.run, tick=truth.tick, time=100_000.0, phase=Phase.OVER, robots=robots, present=robots),
    )


def forge_presence(token: str, victim: str) -> Fault:
    """Return the fault that announces somebody who is not there, and then kills a robot."""

    def inject(live: LiveFleet) -> None:
        live.stranger.announce_absent(token)
        os.kill(live.member(victim), signal.SIGKILL)

    return inject


def forge_host(live: LiveFleet) -> None:
    """Answer for the world when robots join, and kill one."""
    live.stranger.answer("world/join", lambda request: b"\xff")
    os.kill(live.member("r1"), signal.SIGKILL)


def send_on_all_keys(live: LiveFleet) -> None:
    """Send one message on all keys at once."""
    for payload in RUBBISH:
        live.stranger.send_bytes("**", payload)


def forge_broadcasts(live: LiveFleet) -> None:
    """Send the broadcasts of a while again, and false ones in the name of r2."""
    with Bus(live.endpoint, live.fleet, lambda line: None) as bus:
        bus.listen(RADIO)
        heard = [one for _ in range(100) if isinstance(one := bus.receive(0.05), Arrival)]
    for _ in range(20):
        for one in heard:
            key = RADIO.key.format(**one.ids)
            live.stranger.send_bytes(key, encode(one.message))
            if one.ids["robot"] == "r2":
                message = one.message
                live.stranger.send_bytes(key, encode(type(message)(
                    robot="r2", run=message.run, tick=message.tick, x=6.5, y=3.5, yaw=0.0, activity=Activity.DONE,
                    target=STOPS, distance=0.0, reached=[True] * STOPS,
                )))  # fmt: skip
        live.take()


def garbage(live: LiveFleet) -> None:
    """Send garbage on all keys until the run is over."""

    def work() -> None:
        number = 0
        while not live.over.wait(0.01):
            for _ in range(GARBAGE // 100):
                live.stranger.send_bytes(KEYS[number % len(KEYS)], RUBBISH[number % len(RUBBISH)])
                number += 1

    live.run_in_background(work)


def edits(kinds: tuple[Kind, ...], count: int) -> Fault:
    """Return the fault that asks for many edits of one place, of the kinds in turn, at EDITS a second."""

    def inject(live: LiveFleet) -> None:
        def work() -> None:
            with Bus(live.endpoint, live.fleet, lambda line: None) as bus:
                for number in range(count):
                    if live.over.wait(1.0 / EDITS):
                        return
                    low, high = CORNER
                    with suppress(SwarmError):  # a refusal is an answer
                        bus.ask(EDIT, Edit(kind=kinds[number % len(kinds)], low=low, high=high))

        live.run_in_background(work)

    return inject
