"""What the box costs: CPU of its server, bytes for a browser, how far a browser is behind.

    python -m benchmarks.box [--seconds 20] [--robots 64]

A run of real robots on a floor of racks (more than 10,000 wall cells) is recorded in one process, then played through
a real router at real rates, so that the robots themselves cost nothing meanwhile. The first seconds, in which Python
starts, are not counted. `behind` is from the send of a tick's poses until a browser has them; in Chromium, until they
are drawn.
"""

import argparse
import asyncio
import json
import multiprocessing
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from math import ceil
from multiprocessing.queues import Queue
from random import Random
from socket import create_connection
from statistics import median
from time import CLOCK_REALTIME, clock_gettime, monotonic, sleep
from typing import Any, Final, NamedTuple

import aiohttp
import psutil
from msgspec.structs import replace

from benchmarks.dashboard import WARM_UP, router
from benchmarks.measure import machine, table
from dashboard.box.process import run as serve
from dashboard.mode import box_address
from swarm.bus import Bus, Endpoint
from swarm.fuzzy import load_profile
from swarm.maps.text import from_text
from swarm.messages import CLOCK, EVENT, MAP, PLAN, STATE, TRUTH, Clock, Map, Message, Phase, Sense, Topic
from swarm.robot.brain import Inputs, Robot
from swarm.robot.outputs import Outputs
from swarm.scenario.load import Scenario, check_values
from tests.dashboard.browsing import LACKS, PROGRAM, browser
from world.simulate import Simulation, Tick
from world.views.truth import make_truth

RATE: Final = 20  # Hz, control steps
FLEET: Final = "bench"
TOKEN: Final = "token-of-the-benchmark"
WALLS: Final = 10_000  # cells
CELL: Final = 0.5  # m
RACK: Final = (20, 4)  # cells
AISLE: Final = 6  # cells
RACKS: Final = (11, 12)
TARGETS: Final = 4  # of each robot
SEED: Final = 7
BROWSERS: Final = (0, 1, 8)

Sent = tuple[Topic[Any], Message, dict[str, Any]]

# In the page: which tick has been drawn when, as frames are shown.
WATCH: Final = """async () => {
  const { state } = await import("/page/state.js");
  const seen = (window.seen = []);
  let last = -1;
  const look = () => {
    const tick = state.truth?.tick ?? -1;
    if (tick !== last) seen.push([last = tick, Date.now() / 1000]);
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}"""
FIRST: Final = """async () => {
  const { state } = await import("/page/state.js");
  while (!state.truth || !state.floor) await new Promise(requestAnimationFrame);
  await new Promise(requestAnimationFrame);
  return performance.now() / 1000;
}"""


class Spoken:
    """A robot whose last outputs are kept."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.outputs: Outputs | None = None

    def has_missed_edits(self, sense: Sense) -> bool:
        """Return True if the robot's floor is older than that of the sense."""
        return self._robot.has_missed_edits(sense)

    def step(self, inputs: Inputs) -> Outputs:
        """Step the robot."""
        self.outputs = self._robot.step(inputs)
        return self.outputs

    def said(self, name: str) -> list[Sent]:
        """Return what it says to all in this tick."""
        if self.outputs is None:
            return []
        told = ((STATE, self.outputs.state), (PLAN, self.outputs.plan))
        return [(topic, message, {"robot": name}) for topic, message in told if message is not None]


def floor() -> str:
    """Return a drawing of racks with aisles between them, and a wall around."""
    (wide, deep), (across, up) = RACK, RACKS
    columns, rows = AISLE + across * (wide + AISLE), AISLE + up * (deep + AISLE)
    lines = [
        "".join("#" if x % (wide + AISLE) >= AISLE and y % (deep + AISLE) >= AISLE else "." for x in range(columns))
        for y in range(rows)
    ]
    return "\n".join(["#" * (columns + 2), *(f"#{line}#" for line in lines), "#" * (columns + 2)]) + "\n"


def scenario(robots: int) -> Scenario:
    """Return a scenario in which each robot visits crossings of aisles that the seed draws."""
    chance, drawn, ((wide, deep), (across, up)) = Random(SEED), floor(), (RACK, RACKS)
    half, width, height = CELL * (1 + AISLE / 2), CELL * (wide + AISLE), CELL * (deep + AISLE)

    def crossing() -> list[float]:
        return [half + width * chance.randrange(across), half + height * chance.randrange(up)]

    raw = {
        "name": "racks",
        "map": {"text": drawn, "cell": CELL},
        "start": {"area": [0.6, 0.6, half * 2 + width * across - 0.6, half * 2 + height * up - 0.6]},
        "targets": [],
        "own_targets": [[crossing() for _ in range(TARGETS)] for _ in range(robots)],
        "robot": {"radius": 0.2, "track_width": 0.4, "speed_scale": 0.4},
        "radio": {"range": 8.0},
    }
    assert drawn.count("#") >= WALLS
    return Scenario(check_values(raw, "racks"), from_text(drawn, CELL), load_profile("paper"))


class Played:
    """A recorded run: what is sent at each tick, and what late joiners get."""

    def __init__(self, robots: int, seconds: float) -> None:
        simulation = Simulation.of(scenario(robots), robots, SEED)
        world, speakers = simulation.world, [Spoken(robot) for robot in simulation.robots]
        simulation.robots[:] = speakers  # type: ignore[assignment]
        self.names, self.ticks, self.now = list(world.robots), list[list[Sent]](), 0
        said, packed = simulation.scenario.to_wire()
        self._map = Map(scenario=said, packed=packed)
        for tick in range(ceil(seconds * RATE)):
            stepped = simulation.step()
            sent: list[Sent] = [(EVENT, event, {}) for event in stepped.events]
            sent += self.besides(stepped)
            sent += [part for name, robot in zip(self.names, speakers, strict=True) for part in robot.said(name)]
            if tick % RATE == 0:
                sent.append((CLOCK, self._clock(tick), {}))
            if tick % round(RATE / TRUTH.rate) == 0:
                sent.append((TRUTH, replace(make_truth(world), run=0, tick=tick), {}))
            self.ticks.append(sent)

    def besides(self, tick: Tick) -> list[Sent]:
        """Return what is sent of a tick beside what a box hears."""
        return []

    def _clock(self, tick: int) -> Clock:
        return Clock(run=0, tick=tick, time=tick / RATE, phase=Phase.RUNNING, robots=self.names, present=self.names)

    def serve(self, bus: Bus) -> None:
        """Answer late joiners from now on."""
        bus.keep(MAP, lambda: {MAP.key: self._map})
        bus.keep(CLOCK, lambda: {CLOCK.key: self._clock(self.now)})

    def play(self, bus: Bus, seconds: float, after: float) -> Iterator[float]:
        """Send it at its pace, from the first tick on; yield when ``after`` [s] have passed, and at the end."""
        start, self.now, told = monotonic(), 0, False
        self.sent: dict[int, tuple[float, float]] = {}  # tick -> monotonic and real time [s]
        while self.now < ceil((seconds + after) * RATE):
            sleep(max(0.0, start + self.now / RATE - monotonic()))
            if not told and self.now >= after * RATE:
                told = True
                yield monotonic()
            for topic, message, ids in self.ticks[self.now]:
                if topic is TRUTH:
                    self.sent[self.now] = monotonic(), clock_gettime(CLOCK_REALTIME)
                bus.send(topic, message, **ids)
            self.now += 1
        yield monotonic()


class Got(NamedTuple):
    """What browsers without a picture got: bytes by kind of frame, and when the first of them had each tick."""

    sizes: Counter[str]
    at: dict[int, float]  # s, monotonic


async def _listen(port: int, got: Got) -> None:
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"http://127.0.0.1:{port}/live?token={TOKEN}") as live,
    ):
        async for frame in live:
            got.sizes[str(frame.data[8 : frame.data.index('"', 8)])] += len(frame.data)
            if frame.data.startswith('{"key":"world/truth"'):
                got.at.setdefault(json.loads(frame.data)["message"]["tick"], monotonic())


def listen(port: int, browsers: int, results: "Queue[Got]") -> None:
    """Be some browsers until the box ends."""

    async def all_of_them(got: Got) -> None:
        await asyncio.gather(*(_listen(port, got) for _ in range(browsers)))

    got = Got(Counter(), {})
    asyncio.run(all_of_them(got))
    results.put(got)


@contextmanager
def box(endpoint: Endpoint, port: int) -> Iterator[psutil.Process]:
    """Run a box in a process of its own inside the block."""
    process = multiprocessing.get_context("spawn").Process(target=serve, args=(endpoint, FLEET, port, TOKEN))
    process.start()
    try:
        while not _answers(port):
            sleep(0.05)
        yield psutil.Process(process.pid)
    finally:
        process.terminate()
        process.join()


def _answers(port: int) -> bool:
    with suppress(OSError), create_connection(("127.0.0.1", port), 1.0):
        return True
    return False


def busy(*processes: psutil.Process) -> float:
    """Return the CPU time [s] that processes have used."""
    times = [process.cpu_times() for process in processes]
    return sum(used.user + used.system for used in times)


def behind(sent: Iterable[tuple[int, float]], at: dict[int, float], since: int) -> str:
    """Return how much later [ms] ticks came than they were sent: half of them, and the slowest of a hundred."""
    late = sorted(1e3 * (at[tick] - when) for tick, when in sent if tick >= since and tick in at)
    return f"{median(late):.0f}, {late[int(0.99 * len(late))]:.0f}" if late else "-"


def with_sockets(played: Played, browsers: int, seconds: float) -> tuple[str, ...]:
    """Measure with browsers that only listen."""
    results: Queue[Got] = multiprocessing.get_context("spawn").Queue()
    with router() as endpoint, Bus(endpoint, FLEET) as bus:
        played.serve(bus)
        port = Endpoint("127.0.0.1", 0).claim().port
        with box(endpoint, port) as process:
            crowd = multiprocessing.get_context("spawn").Process(target=listen, args=(port, browsers, results))
            crowd.start()
            used = [busy(process) for _ in played.play(bus, seconds, WARM_UP)]
            memory = process.memory_full_info().uss
        got = results.get()
        crowd.join()
    sent = [(tick, when) for tick, (when, _) in played.sent.items()]
    rate = sum(got.sizes.values()) / max(1, browsers) / (seconds + WARM_UP)
    return (
        f"{browsers} that listen", f"{(used[1] - used[0]) / seconds:.1%}", f"{memory / 1e6:.0f}",
        f"{rate / 1e3:.0f}" if browsers else "-", behind(sent, got.at, int(WARM_UP * RATE)), "-", "-", "-",
    )  # fmt: skip


def with_chromium(played: Played, seconds: float) -> tuple[str, ...]:
    """Measure with a page that is drawn, by software, without a window."""
    with router() as endpoint, Bus(endpoint, FLEET) as bus, browser() as chromium:
        played.serve(bus)
        port = Endpoint("127.0.0.1", 0).claim().port
        with box(endpoint, port) as process:
            page = chromium.new_page(viewport={"width": 1280, "height": 800})
            started = played.play(bus, seconds, WARM_UP + 2.0)
            for topic, message, ids in played.ticks[0]:
                bus.send(topic, message, **ids)
            page.goto(box_address(port, TOKEN))
            first = page.evaluate(FIRST)
            page.evaluate(WATCH)
            session = page.context.new_cdp_session(page)
            session.send("Performance.enable")
            used, drawn = [], []
            for _ in started:
                used.append(busy(process))
                told = session.send("Performance.getMetrics")["metrics"]
                drawn.append({entry["name"]: entry["value"] for entry in told})
            memory = process.memory_full_info().uss
            seen = {tick: at for tick, at in page.evaluate("window.seen") if tick >= (WARM_UP + 2.0) * RATE}
    sent = [(tick, when) for tick, (_, when) in played.sent.items()]
    share = (drawn[1]["TaskDuration"] - drawn[0]["TaskDuration"]) / seconds
    return (
        "Chromium", f"{(used[1] - used[0]) / seconds:.1%}", f"{memory / 1e6:.0f}", "-", behind(sent, seen, 0),
        f"{first:.2f}", f"{len(seen) / seconds:.1f}", f"{share:.0%}",
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="What the box costs.")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--robots", type=int, default=64)
    given = parser.parse_args()
    print(machine())
    played = Played(given.robots, given.seconds + WARM_UP + 3.0)
    rows: list[Sequence[str]] = [
        ("browsers", "server, CPU of a core", "own memory [MB]", "kB/s to each", "behind [ms]: half, 99 %",
         "first picture [s]", "pictures/s", "page, CPU of a core"),
        ("needed", "< 3 %", "", "", "< 300", "< 2", "10", ""),
    ]  # fmt: skip
    rows += [with_sockets(played, browsers, given.seconds) for browsers in BROWSERS]
    if PROGRAM is not None:
        rows.append(with_chromium(played, given.seconds))
    print(f"{given.robots} robots, {floor().count('#'):,} wall cells, {TRUTH.rate:g} Hz")
    print(table(rows))
    if PROGRAM is None:
        print(LACKS)


if __name__ == "__main__":
    main()
