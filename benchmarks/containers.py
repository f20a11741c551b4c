"""Images and containers: sizes, and the time until a robot drives: ``python -m benchmarks.containers``.

The images are built and run as `tests/deploy/test_containers.py` does it. A robot's time runs from the start of its
container to its first command, in a fleet that waits for it: the engine makes the container, Python starts, kernels are
loaded, the robot joins. Beside it, the same robot as a process of this machine.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Final

from benchmarks.measure import load, machine, printed
from benchmarks.namespaces import end
from swarm.bus import Arrival, Bus, Endpoint
from swarm.messages import COMMAND
from tests.deploy.engine import Engine, lacking

ROUNDS: Final = 5
BARS: Final = {"robot": 450, "world": 600}  # MB
START: Final = 3.0  # s, from the start of a robot's container to its first command
FLEET: Final = "containers"
PATIENCE: Final = 60.0  # s for a first command
CONFINED: Final = ("--cap-drop", "ALL", "--security-opt", "no-new-privileges", "--read-only", "--tmpfs", "/tmp")


def first_command(engine: Engine, start: Callable[[str], Callable[[], object]]) -> float:
    """Return how long a robot takes [s] from ``start``, which returns how to end it, to its first command."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    words = ("-m", "swarm.cli")
    router = subprocess.Popen([sys.executable, *words, "router", "--listen", str(endpoint)], stdout=subprocess.DEVNULL)
    world = subprocess.Popen(
        [sys.executable, *words, "world", "paper", "--robots", "1", "--serve", "--connect", str(endpoint),
         "--fleet", FLEET, "--record", str(engine.folder / "run.swarm")],
        stdout=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        with Bus(endpoint, FLEET) as bus:
            bus.watch_presence("world")
            bus.receive(PATIENCE)
            bus.listen(COMMAND)
            began = perf_counter()
            stop = start(str(endpoint))
            while not isinstance(bus.receive(PATIENCE), Arrival):
                pass
            took = perf_counter() - began
            stop()
        return took
    finally:
        for process in (world, router):
            process.terminate()
            process.wait()


def contained(engine: Engine, endpoint: str) -> Callable[[], object]:
    """Start a robot in a container on this machine's network."""
    name = "robot"
    engine.podman("run", "--detach", "--rm", "--name", name, "--network", "host", *CONFINED, "zenoh-swarm-robot",
                  "--connect", endpoint, "--fleet", FLEET)  # fmt: skip
    return lambda: engine.podman("stop", name)


def process(endpoint: str) -> Callable[[], object]:
    """Start a robot as a process of this machine."""
    words = [sys.executable, "-m", "swarm.cli", "robot", "--connect", endpoint, "--fleet", FLEET]
    robot = subprocess.Popen(words, stdout=subprocess.DEVNULL, text=True)
    return lambda: end(robot)


def main() -> int:
    """Print the tables; return 1 if an image is too large or a robot starts too late."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    if (why := lacking()) is not None:
        print(why, file=sys.stderr)
        return 1
    print(f"{machine()}\n")
    wrong: list[str] = []
    with TemporaryDirectory() as folder, Engine(Path(folder)) as engine:
        engine.build(*BARS)

        def size(role: str) -> Sequence[str]:
            (image,) = json.loads(engine.podman("image", "inspect", f"zenoh-swarm-{role}"))
            (base,) = json.loads(engine.podman("image", "inspect", "swarm-base"))
            found = image["Size"] / 1e6
            wrong.extend([role] * (found > BARS[role]))
            return f"{found:.0f}", f"{base['Size'] / 1e6:.0f}", str(BARS[role])

        printed(("image", "MB", "its base", "bar"), [(role, lambda role=role: size(role)) for role in BARS])  # type: ignore[misc]

        def starts(start: Callable[[str], Callable[[], object]]) -> Sequence[str]:
            times = sorted(first_command(engine, start) for _ in range(ROUNDS))
            if start is not process:
                wrong.extend(["start"] * (times[ROUNDS // 2] > START))
            return f"{times[ROUNDS // 2]:.1f}", f"{times[-1]:.1f}", f"{START:g}", load()

        ways = {"in a container": lambda endpoint: contained(engine, endpoint), "as a process": process}
        printed(("a robot", "first command after [s]", "longest", "bar", "load"),
                [(name, lambda start=start: starts(start)) for name, start in ways.items()])  # type: ignore[misc]  # fmt: skip
    if wrong:
        print(f"beyond a bar: {', '.join(wrong)}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
