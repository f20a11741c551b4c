"""The book of errands: every change of stage and every refusal as a table, and laws for any sequence of events."""

from collections import Counter
from collections.abc import Sequence

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.errors import PeerError
from swarm.maps.occupancy import Point
from swarm.messages import PoolTargets
from world.tasks.orders import REMEMBERED
from world.tasks.task_pool import (
    MOST_OPEN,
    MOST_TARGETS,
    SCENARIO,
    TRANSITIONS,
    Errand,
    TaskChange,
    TaskPool,
    TaskStage,
)

WALL = (9.0, 9.0)
BACK = (TaskChange.GIVEN_UP, TaskChange.REPLACED, TaskChange.LOST, TaskChange.STUCK)


def check(targets: Sequence[Point]) -> None:
    if WALL in targets:
        raise PeerError("no way leads there")


def some(name: str = "a", *targets: Point) -> PoolTargets:
    return PoolTargets(id=name, targets=list(targets or [(2.0, 2.0)]))


def state(pool: TaskPool) -> bytes:
    return msgspec.msgpack.encode(pool)


def taken(pool: TaskPool, robot: int = 0, assignment: int = 1) -> Errand:
    errand = pool.waiting[0]
    pool.hand_to(errand, robot, assignment)
    return errand


# --- stages ---


@pytest.mark.parametrize("stage", TaskStage)
@pytest.mark.parametrize("occasion", TaskChange)
def test_the_table_is_all_there_is(stage: TaskStage, occasion: TaskChange) -> None:
    pool = TaskPool.pool_of([(1.0, 1.0)])
    errand = pool.waiting[0]
    errand.stage = stage
    if occasion in TRANSITIONS[stage]:
        pool.take(errand, occasion)
        assert errand.stage is TRANSITIONS[stage][occasion]
    else:
        with pytest.raises(ValueError, match=f"pool target scenario/1: .* while {stage}"):
            pool.take(errand, occasion)
        assert errand.stage is stage


def test_what_is_done_stays_done_and_what_is_taken_is_taken_once() -> None:
    assert TRANSITIONS[TaskStage.DONE] == {}
    assert [stage for stage, row in TRANSITIONS.items() if TaskChange.TAKEN in row] == [TaskStage.WAITING]


@pytest.mark.parametrize("why", BACK)
def test_an_errand_goes_back_as_it_was_but_is_not_offered_to_who_gave_it_up(why: TaskChange) -> None:
    pool = TaskPool.pool_of([(1.0, 1.0), (2.0, 2.0)])
    errand = taken(pool, robot=1)
    assert (pool.taken_errands, len(pool.waiting)) == ([errand], 1)
    pool.put_back(errand, why)
    assert pool.waiting[0] is errand, "the oldest is the first again"
    assert (errand.robot, errand.assignment) == (None, 0)
    assert errand.refused == ([1] if why is TaskChange.GIVEN_UP else [])
    assert errand.last == ([1] if why is TaskChange.STUCK else [])
    pool.offer_all_again()
    assert errand.refused == errand.last == []


# --- requests ---

REFUSED = [
    ([], PoolTargets(id="a", targets=[]), "expected 1 to 100 targets, got 0"),
    ([], some("a", *[(1.0, 1.0)] * (MOST_TARGETS + 1)), "expected 1 to 100 targets, got 101"),
    ([], some("a", (1.0, 1.0), WALL), "no way leads there"),
    ([some()], some("a", (3.0, 3.0)), "pool a: expected the targets that were accepted with it, got others"),
    ([some()], some("a", (2.0, 2.0), (3.0, 3.0)), "use a new id"),
    ([], some(SCENARIO, (3.0, 3.0)), "pool scenario: expected the targets that were accepted with it"),
]


@pytest.mark.parametrize(("before", "request_", "text"), REFUSED)
def test_what_is_refused_changes_nothing(before: list[PoolTargets], request_: PoolTargets, text: str) -> None:
    pool = TaskPool.pool_of([(1.0, 1.0)])
    for one in before:
        assert pool.add(one, 1.0, check).changed
    was = state(pool)
    with pytest.raises(PeerError, match=text):
        pool.add(request_, 2.0, check)
    assert state(pool) == was


def test_what_is_said_twice_is_said_once_also_when_it_is_done() -> None:
    pool = TaskPool()
    first = pool.add(some("a", (1.0, 1.0), (2.0, 2.0)), 1.0, check)
    assert first.text == "pool a: 2 targets for any robot"
    assert first.events == (("pool", "a: 2 targets for any robot"),)
    for closed in range(3):
        again = pool.add(some("a", (1.0, 1.0), (2.0, 2.0)), 5.0, check)
        assert (again.text, again.changed, again.events) == (first.text, False, ())
        assert (pool.given, pool.done, len(pool.open)) == (2, closed, 2 - closed)
        if pool.open:
            pool.close(taken(pool), 3.0)


def test_a_full_pool_refuses_until_something_is_done() -> None:
    pool = TaskPool.pool_of([(1.0, 1.0)] * MOST_OPEN)
    with pytest.raises(PeerError, match=f"at most {MOST_OPEN} targets that are not done, got 1 beside the {MOST_OPEN}"):
        pool.add(some(), 1.0, check)
    pool.close(taken(pool), 2.0)
    assert pool.add(some(), 2.0, check).changed


def test_the_book_stays_small_and_forgets_no_request_that_is_open() -> None:
    pool = TaskPool()
    pool.add(some("open", (1.0, 1.0), (2.0, 2.0)), 0.0, check)
    pool.close(taken(pool), 0.0)
    for number in range(3 * REMEMBERED):
        pool.add(some(f"n{number}"), 0.0, check)
        errand = pool.waiting[-1]
        pool.hand_to(errand, 0, number)
        pool.close(errand, 1.0)
    assert len(pool.requests) == len(pool.closed) == REMEMBERED
    assert not pool.add(some("open", (1.0, 1.0), (2.0, 2.0)), 9.0, check).changed
    assert (pool.given, pool.done) == (3 * REMEMBERED + 2, 3 * REMEMBERED + 1)


# --- laws ---

ADD = st.tuples(st.just("add"), st.sampled_from("abcde"), st.integers(1, 3))
MOVE = st.tuples(st.sampled_from(("take", "arrive", *BACK)), st.integers(0, 3), st.integers(0, 9))


@given(st.lists(st.one_of(ADD, MOVE), max_size=60), st.integers(0, 3))
def test_every_target_is_done_at_most_once_and_none_vanishes(moves: list[tuple[str, object, int]], own: int) -> None:
    pool = TaskPool.pool_of([(float(number), 0.0) for number in range(own)])
    given_ = Counter((SCENARIO, number) for number in range(1, own + 1))
    done: Counter[tuple[str, int]] = Counter()
    holders: dict[int, Errand] = {}
    for what, who, number in moves:
        if what == "add":
            assert isinstance(who, str)
            targets = [(float(k), float(ord(who))) for k in range(number)]
            try:
                if pool.add(PoolTargets(id=who, targets=targets), 0.0, check).changed:
                    given_ += Counter((who, k) for k in range(1, number + 1))
            except PeerError:
                assert (who, number + 1) in given_ or (who, number) not in given_, "it was given with other targets"
        elif what == "take" and pool.waiting and who not in holders:
            assert isinstance(who, int)
            errand = pool.waiting[number % len(pool.waiting)]
            pool.hand_to(errand, who, number)
            holders[who] = errand
        elif what != "take" and isinstance(who, int) and (held := holders.pop(who, None)) is not None:
            if what == "arrive":
                pool.close(held, 1.0)
                done[held.request, held.number] += 1
            else:
                pool.put_back(held, TaskChange(what))
        open_ = Counter((errand.request, errand.number) for errand in pool.open.values())
        assert max(done.values(), default=0) <= 1
        assert open_ + done == given_
        assert (pool.given, pool.done) == (given_.total(), done.total())
        assert {errand.robot for errand in pool.taken_errands} == set(holders)
        assert len(pool.waiting) + len(pool.taken_errands) == len(pool.open)
