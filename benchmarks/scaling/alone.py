"""A fleet in one process, with the package beside any interpreter.

    python benchmarks/scaling/alone.py SECONDS ROBOTS SCENARIO | MAP.map FILE.scen

It prints as JSON the CPU time of a robot-tick, world included, the times to pack and to unpack a broadcast, and what
goes over the wire. Broadcasts are unpacked in the order in which they were sent: as a robot does that hears all others.
"""

import json
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from statistics import mean
from time import process_time
from typing import Final

from swarm import garbage
from swarm.bus.codec import decode, encode
from swarm.messages import RADIO, Broadcast
from swarm.robot.host.radio import zone_of
from swarm.scenario.benchmark import from_benchmark
from swarm.scenario.load import load
from swarm.scenario.shipped_scenarios import find_scenario
from world.simulate import Simulation, Tick

WARMED: Final = 40  # ticks before the measurement
LOOKED_AT: Final = 7  # every so many ticks the messages are looked at: no multiple of the ticks between two broadcasts


@cache  # several tables show it
def in_one_process(where: tuple[str, ...], robots: int, seconds: float, python: str) -> dict[str, float]:
    """Run a fleet for ``seconds`` of simulated time in a process of its own; return what that prints."""
    command = [python, __file__, f"{seconds:g}", str(robots), *(part for part in where if part != "--scen")]
    with tempfile.TemporaryDirectory() as empty:  # in a checkout, Python would import the code there
        answer = subprocess.run(command, cwd=empty, stdout=subprocess.PIPE, text=True, check=True)
    told: dict[str, float] = json.loads(answer.stdout)
    return told


def looked_at(tick: Tick, side: float) -> dict[str, float]:
    """Return the mean bytes of a sense and a command, and broadcasts sent and delivered by robot."""
    zones = {name: zone_of(sense.x, sense.y, side) for name, sense in tick.senses.items()}
    near = [
        max(abs(here[0] - there[0]), abs(here[1] - there[1])) <= 1
        for name, here in zones.items()
        for sender, there in zones.items()
        if sender in tick.spoken and sender != name
    ]
    return {
        "sense": mean(len(encode(sense)) for sense in tick.senses.values()),  # bytes
        "command": mean(len(encode(command)) for command in tick.commands.values()),  # bytes
        "delivered": sum(near) / len(zones),  # to all in the zone and the eight round it
        "spoken": len(tick.spoken) / len(zones),
    }


def main(seconds: float, robots: int, *where: str) -> None:
    """Run the fleet and print what it costs."""
    first, *scen = map(Path, where)
    scenario = from_benchmark(first, scen[0], robots) if scen else load(find_scenario(first))
    garbage.collect_seldom()  # as in all processes of `swarm run`
    simulation = Simulation.of(scenario, robots, 7)
    world, spoken, looks, cpu = simulation.world, list[Broadcast](), list[dict[str, float]](), 0.0
    for _ in range(WARMED):
        simulation.step()
    while world.time < seconds and not world.is_finished:
        began = process_time()
        tick = simulation.step()
        cpu += process_time() - began
        spoken += tick.spoken.values()
        if world.tick % LOOKED_AT == 0:
            looks.append(looked_at(tick, scenario.settings.radio.range))
    began = process_time()
    payloads = [encode(message) for message in spoken]
    packed = process_time()
    for payload in payloads:
        decode(payload, Broadcast, RADIO.limit)
    unpacked = process_time()
    print(json.dumps({
        "robot_tick": cpu / (world.tick - WARMED) / robots,  # s
        "length": mean(map(len, payloads)),  # bytes
        "pack": (packed - began) / len(payloads),  # s
        "unpack": (unpacked - packed) / len(payloads),  # s
        **{name: mean(look[name] for look in looks) for name in looks[0]},
    }))  # fmt: skip


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:])
