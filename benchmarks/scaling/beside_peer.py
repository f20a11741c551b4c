"""ir-sim, run by `benchmarks.scaling.beside` in its own environment: this imports nothing of the project.

    python beside_peer.py WORLD.yaml SECONDS

It prints as JSON the CPU time of a simulated second and the version.
"""

import json
import sys
from importlib.metadata import version
from time import process_time

import irsim

WARMED = 2.0  # simulated s before the measurement


def main(file: str, seconds: float) -> None:
    """Step the world and print what that costs."""
    env = irsim.make(file, display=False, log_level="ERROR")
    while env.time < WARMED:
        env.step()
    began, at = process_time(), env.time
    while env.time < seconds:
        env.step()
    print(json.dumps({"cpu": (process_time() - began) / (env.time - at), "version": version("ir-sim")}))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
