"""A fleet in one process, with the package beside any interpreter."""

import json
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Final

PEER: Final = Path(__file__).parents[1] / "scale_peer.py"


@cache  # several tables show it
def in_one_process(where: tuple[str, ...], robots: int, seconds: float, python: str) -> dict[str, float]:
    """Run a fleet for ``seconds`` of simulated time; return what the peer measured."""
    command = [python, str(PEER), f"{seconds:g}", str(robots), *(part for part in where if part != "--scen")]
    with tempfile.TemporaryDirectory() as empty:  # in a checkout, Python would import the code there
        answer = subprocess.run(command, cwd=empty, stdout=subprocess.PIPE, text=True, check=True)
    told: dict[str, float] = json.loads(answer.stdout)
    return told
