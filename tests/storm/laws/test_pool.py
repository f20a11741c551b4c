"""The law of the pool: a real run keeps it, and it speaks of each fault planted into that run."""

from collections.abc import Callable
from functools import cache

import pytest

from swarm.messages import Event
from swarm.storm.history.history import History, Moment, record
from swarm.storm.laws.judge import judge
from swarm.storm.plans.draw import draw
from tests.storm.shared import plan_of, with_moments, with_report

POOL = [[5.4, 1.8], [5.4, 3.0], [3.0, 3.0]]


@cache
def pool_run() -> History:
    return record(plan_of(pool=POOL))


@cache
def killed_run() -> History:
    """r1 dies on its way to an errand."""
    first = next(moment.tick for moment in pool_run().moments if of(moment, "errand", "r1"))
    return record(plan_of(pool=POOL, faults=[{"robot": "r1", "kind": "dead", "tick": first + 10}]))


def of(moment: Moment, kind: str, robot: str) -> list[Event]:
    return [
        event for event in moment.events if (event.kind, event.robot) == (kind, robot) and "pool target" in event.text
    ]


def with_events(history: History, change: Callable[[Event], list[Event]]) -> History:
    return with_moments(
        history, lambda moment: moment._replace(events=tuple(new for event in moment.events for new in change(event)))
    )


def without(history: History, kind: str) -> History:
    return with_events(history, lambda event: [] if event.kind == kind and "pool target" in event.text else [event])


def all_left(history: History) -> History:
    left = [{"errand": f"scenario/{number}"} for number in (1, 2, 3)]
    return with_report(without(history, "reached"), pool={"given": 3, "done": 0, "left": left})


def test_runs_keep_it() -> None:
    assert judge(pool_run()) == []
    assert pool_run().report["pool"]["done"] == len(POOL)
    assert judge(killed_run()) == []
    assert any(event.kind == "errand_back" for moment in killed_run().moments for event in moment.events)


# fmt: off
PLANTED: list[tuple[str, str, Callable[[], History]]] = [  # what, part of what the law says, the run
    ("done without being sent", "not sent there", lambda: without(pool_run(), "errand")),
    ("counted from afar", "m away", lambda: with_moments(
        pool_run(), lambda moment: moment._replace(poses=tuple(pose._replace(x=pose.x + 3.0) for pose in moment.poses)))),
    ("done twice", "was done before", lambda: with_events(
        pool_run(), lambda event: [event, event] if event.kind == "reached" and "pool target" in event.text else [event])),
    ("given to two", "which", lambda: with_events(
        pool_run(), lambda event: [event, event] if event.kind == "errand" else [event])),
    ("lost", "the report says", lambda: with_report(pool_run(), pool={"given": 3, "done": 2, "left": []})),
    ("left", "although r1, r2 could have visited it", lambda: all_left(pool_run())),
    ("left beside a dead one", "although r2 could have visited it", lambda: all_left(killed_run())),
    ("kept by the dead", "is gone and still has", lambda: with_events(
        without(killed_run(), "errand_back"),
        lambda event: [] if event.robot == "r2" and "scenario/1" in event.text else [event])),
]
# fmt: on


@pytest.mark.parametrize(("says", "plant"), [row[1:] for row in PLANTED], ids=[row[0] for row in PLANTED])
def test_it_speaks_of_a_planted_violation(says: str, plant: Callable[[], History]) -> None:
    found = [violation for violation in judge(plant()) if violation.law == "the pool is kept"]
    assert any(says in violation.text for violation in found), found


@pytest.mark.long("minutes of a simulated pool")
def test_a_robot_that_cannot_get_to_its_own_stop_past_a_dead_one_could_not_have_served_the_pool() -> None:
    there = [9.0, 1.8]
    poses, dead = [[1.8, 1.8, 0.0], [*there, 3.0]], {"robot": "r2", "kind": "dead", "tick": 20}
    plan = plan_of(pool=POOL, start={"poses": poses}, own_targets=[[there], [there]], reach=0.3, faults=[dead])
    busy = record(plan)
    assert busy.report["pool"]["done"] == 0
    assert judge(busy) == []
    free = with_report(busy, "r1", unreachable=[0])
    assert any("although r1 could have visited it" in violation.text for violation in judge(free))


def test_the_profile_draws_pools_and_others_draw_none() -> None:
    assert all(draw("pool", seed).scenario.pool for seed in range(3))
    assert not any(draw("orders", seed).scenario.pool for seed in range(3))


SEEDS = {  # what each has beside a pool: together, every feature that changes who has which errand
    4: {"away", "suspended", "orders", "short radio"},
    6: {"edits", "orders", "loss"},
    7: {"dead", "late"},
}


@pytest.mark.long("three storms, each of two runs and their judge")
@pytest.mark.parametrize("seed", SEEDS)
def test_seeds_with_a_pool_keep_every_law(seed: int) -> None:
    plan = draw("pool", seed)
    assert plan.features() == SEEDS[seed] | {"pool"}, "the seed draws another plan: choose one that has them"
    assert judge(record(plan)) == []
