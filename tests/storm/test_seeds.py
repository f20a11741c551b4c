"""Fixed seeds, and plans that failed once: they keep every law."""

from pathlib import Path
from typing import Final

import pytest

from swarm.storm.plans.plan import read
from swarm.storm.results import Job, perform

pytestmark = pytest.mark.long("a storm for each seed and plan")

FILES: Final = sorted(Path(__file__).parent.glob("*.yaml"))  # most made by `swarm storm --shrink`; they stay
SEEDS: Final = {  # how many, from 0 on
    "all": 2,
    "late": 1,
    "kinds": 1,
    "claims": 2,
    "unsolvable": 1,
}
JOBS: Final = [
    *[(profile, seed) for profile, number in SEEDS.items() for seed in range(number)],
    *[(path.name, 0) for path in FILES],  # read when they run: every worker collects them all
]


@pytest.mark.parametrize(("name", "seed"), JOBS)
def test_a_storm_keeps_every_law(name: str, seed: int) -> None:
    path = Path(__file__).with_name(name)
    job = Job(path.stem, seed, read(path)) if path in FILES else Job(name, seed)
    assert perform(job).violations == (), "replay one: swarm storm --profile PROFILE --seeds 1 --start SEED"


def test_the_plans_are_found() -> None:
    assert FILES
