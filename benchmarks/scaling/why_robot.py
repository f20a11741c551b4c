"""One robot process whose steps are timed, run by `benchmarks.scaling.why`: ``... ENDPOINT FLEET FILE``.

At its end it writes the CPU time of its thread in each step [s] to the file, as JSON.
"""

import json
import sys
from pathlib import Path

from benchmarks.scaling.why import timed
from swarm.bus import Endpoint
from swarm.robot.process import run

if __name__ == "__main__":
    with timed(lambda: None) as seconds:
        run(Endpoint.parse(sys.argv[1]), sys.argv[2])
    Path(sys.argv[3]).write_text(json.dumps(seconds), encoding="utf-8")
