"""Fixed seeds, and plans that failed once: they keep every law."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import pytest

from swarm.storm.plans.plan import read
from swarm.storm.results import Job, perform
from swarm.storm.workers import Lost, answers

pytestmark = pytest.mark.long("a hundred storms on all cores: two minutes")

FILES: Final = sorted(Path(__file__).parent.glob("*.yaml"))  # most made by `swarm storm --shrink`; they stay
SEEDS: Final = {  # how many, from 0 on
    "all": 30,
    "calm": 10,
    "late": 4,
    "claims": 36,
    "unsolvable": 20,
}


def broken(jobs: Iterable[Job]) -> list[str]:
    """Run jobs on all cores and list what broke."""
    found = []
    for job, result in answers(perform, jobs, workers=len(os.sched_getaffinity(0))):
        if isinstance(result, Lost):
            found.append(f"{job.name}: {result.why}")
        else:
            found += [f"{job.name}: {violation}" for violation in result.violations]
    return found


def test_a_hundred_seeds_keep_every_law() -> None:
    assert sum(SEEDS.values()) == 100
    jobs = [Job(profile, seed) for profile, number in SEEDS.items() for seed in range(number)]
    assert broken(jobs) == [], "replay one: swarm storm --profile PROFILE --seeds 1 --start SEED"


def test_plans_that_once_failed_keep_every_law() -> None:
    assert FILES
    assert broken(Job(path.stem, 0, read(path)) for path in FILES) == []
