"""One fleet in one process, run by `benchmarks.scale` with the interpreter of the package that is measured.

    python benchmarks/scale_peer.py SECONDS ROBOTS SCENARIO | MAP.map FILE.scen

It prints as JSON the CPU time of a robot-tick, world included, the length of a broadcast, and the times to pack and to
unpack it. Broadcasts are unpacked in the order in which they were sent: as a robot does that hears all others.
"""

import json
import sys
from pathlib import Path
from statistics import mean
from time import process_time

from swarm.bus.codec import decode, encode
from swarm.messages import RADIO, Broadcast
from swarm.scenario.benchmark import from_benchmark
from swarm.scenario.load import load
from swarm.scenario.shipped import found
from world.simulate import Simulation

WARMED = 40  # ticks before the measurement


def main(seconds: float, robots: int, *where: str) -> None:
    """Run the fleet and print what it costs."""
    first, *scen = map(Path, where)
    scenario = from_benchmark(first, scen[0], robots) if scen else load(found(first))
    simulation = Simulation.of(scenario, robots, 7)
    world, spoken = simulation.world, list[Broadcast]()
    for _ in range(WARMED):
        simulation.step()
    began = process_time()
    while world.time < seconds and not world.finished:
        spoken += simulation.step().spoken.values()
    cpu = process_time() - began
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
    }))  # fmt: skip


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:])
