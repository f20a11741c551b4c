"""Fixed seeds, and plans that failed once: they keep every law."""

from pathlib import Path
from typing import Final

import pytest

from swarm.storm.plans.plan import read
from swarm.storm.results import Job, perform

pytestmark = pytest.mark.long("a storm for each seed and plan")

FILES: Final = sorted(Path(__file__).parent.glob("*.yaml"))  # most made by `swarm storm --shrink`; they stay
SEEDS: Final = {  # how many, from 0 on
    "all": 4,
    "late": 1,
    "claims": 4,
    "unsolvable": 2,
}
JOBS: Final = [
    *[Job(profile, seed) for profile, number in SEEDS.items() for seed in range(number)],
    *[Job(path.stem, 0, read(path)) for path in FILES],
]


@pytest.mark.parametrize("job", JOBS, ids=lambda job: job.name)
def test_a_storm_keeps_every_law(job: Job) -> None:
    assert FILES
    assert perform(job).violations == (), "replay one: swarm storm --profile PROFILE --seeds 1 --start SEED"
