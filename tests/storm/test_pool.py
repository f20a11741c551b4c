"""Jobs on worker processes: each gets its answer; a worker that dies loses only its own job."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from swarm.storm.workers import Lost, answers
from tests.storm import works

JOBS = list(range(12))


@pytest.mark.parametrize("workers", [1, 3])
def test_every_job_is_answered_once(workers: int) -> None:
    assert sorted(answers(works.doubled, JOBS, workers=workers)) == [(job, 2 * job) for job in JOBS]


# fmt: off
ENDS = {
    "killed": (works.dies_on_odd,   "its process was ended by signal 9"),
    "left":   (works.leaves_on_odd, "its process ended with status 3"),
}
# fmt: on


@pytest.mark.parametrize("name", ENDS)
def test_a_job_that_dies_is_said_and_the_others_are_done(name: str) -> None:
    work, why = ENDS[name]
    assert dict(answers(work, JOBS, workers=2)) == {job: Lost(why) if job % 2 else 2 * job for job in JOBS}


def test_a_job_without_an_end_is_ended() -> None:
    found = dict(answers(works.hangs_on_odd, [0, 1, 2], workers=1, patience=0.5))
    assert found == {0: 0, 1: Lost("its run took more than 0.5 s and was ended"), 2: 4}


def test_it_stops_when_told_to() -> None:
    found: list[int] = []
    for job, _ in answers(works.doubled, JOBS, workers=1, stop=lambda: len(found) == 3):
        found.append(job)
    assert found == JOBS[:3]


def test_a_worker_that_ends_when_all_are_told_to_stop_is_not_at_fault(tmp_path: Path) -> None:
    """A signal to the whole group ends the workers too."""
    mark = tmp_path / "mark"
    assert list(answers(works.marks_and_dies, [mark], workers=1, stop=mark.exists)) == []


def test_jobs_are_taken_only_when_a_worker_is_free() -> None:
    taken: list[int] = []

    def jobs() -> Iterator[int]:
        for job in JOBS:
            taken.append(job)
            yield job

    first, _ = next(answers(works.doubled, jobs(), workers=2))
    assert first in taken
    assert len(taken) <= 3
