"""Jobs of worker processes in tests; they are module functions, since the workers import them."""

import json
import os
import signal
from pathlib import Path
from typing import Any

from swarm.storm.laws.judge import Violation
from swarm.storm.results import Job, RunResult


def doubled(number: int) -> int:
    return 2 * number


def dies_on_odd(number: int) -> int:
    if number % 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * number


def marks_and_dies(mark: Path) -> None:
    mark.touch()
    os.kill(os.getpid(), signal.SIGKILL)


def leaves_on_odd(number: int) -> int:
    if number % 2:
        os._exit(3)
    return 2 * number


def hangs_on_odd(number: int) -> int:
    if number % 2:
        signal.pause()
    return 2 * number


def passes(job: Job) -> RunResult:
    return RunResult(profile=job.profile, seed=job.seed, complete=True)


def fails_on_odd(job: Job) -> RunResult:
    breach = Violation("no contact", 7, ("r1",), "r1 touched wall")
    return RunResult(profile=job.profile, seed=job.seed, violations=(breach,) * (job.seed % 2))


def dies_on_three(job: Job) -> RunResult:
    if job.seed == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return passes(job)


def lines_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]
