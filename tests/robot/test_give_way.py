"""The simple rule of who goes first: a total order, so that nobody waits for somebody who waits for him."""

from hypothesis import given
from hypothesis import strategies as st

from swarm.messages import Activity, Broadcast
from swarm.traffic.give_way import STILL, Rank, decide

RADIUS = 0.2
PATH = [(0.25 * k, 0.0) for k in range(12)]
near = st.tuples(st.floats(-1.0, 3.0), st.floats(-1.0, 1.0))


def broadcast(robot: str, place: tuple[float, float], target: int, left: float, activity: Activity) -> Broadcast:
    return Broadcast(
        robot=robot, run=0, tick=0, x=place[0], y=place[1], yaw=0.0, activity=activity, target=target, distance=left,
        reached=[], ahead=[place, (place[0] + 0.25, place[1])],
    )  # fmt: skip


fleets = st.lists(
    st.tuples(near, st.integers(0, 3), st.sampled_from([0.0, 1.0, 1.5, 7.0]), st.booleans()), min_size=2, max_size=6
)


def verdicts(fleet: list[tuple[tuple[float, float], int, float, bool]]) -> dict[str, tuple[str, ...]]:
    said = [
        broadcast(f"r{number}", place, target, left, Activity.GIVE_WAY if waits else Activity.DRIVE)
        for number, (place, target, left, waits) in enumerate(fleet)
    ]
    return {
        own.robot: decide(
            Rank(-own.target, own.distance, own.robot), own.ahead,
            [other for other in said if other is not own], RADIUS, own.activity is Activity.GIVE_WAY,
        ).yield_to
        for own in said
    }  # fmt: skip


@given(fleets)
def test_no_ring_of_robots_ever_waits_for_itself(
    fleet: list[tuple[tuple[float, float], int, float, bool]],
) -> None:
    waits_for = verdicts(fleet)
    going = {name for name, yields in waits_for.items() if not yields}
    while True:
        more = {name for name, yields in waits_for.items() if name not in going and set(yields) <= going}
        if not more:
            break
        going |= more
    assert going == set(waits_for)


@given(fleets)
def test_no_two_robots_yield_to_each_other(fleet: list[tuple[tuple[float, float], int, float, bool]]) -> None:
    waits_for = verdicts(fleet)
    for name, yields in waits_for.items():
        for other in yields:
            assert name not in waits_for[other]


@given(near, st.sampled_from(sorted(STILL)), st.integers(0, 3), st.floats(0.0, 9.0))
def test_who_stands_is_never_waited_for_but_gone_around(
    place: tuple[float, float], activity: Activity, target: int, left: float
) -> None:
    verdict = decide(Rank(0, 5.0, "r9"), PATH, [broadcast("r1", place, target, left, activity)], RADIUS, False)
    assert verdict.yield_to == ()
    on_the_way = min(((x - place[0]) ** 2 + (y - place[1]) ** 2) ** 0.5 for x, y in PATH) < 2 * RADIUS + 0.1
    assert verdict.standing == ((place,) if on_the_way else ())


def test_more_stops_done_goes_first_then_the_shorter_way_then_the_id() -> None:
    own = Rank(-1, 5.0, "r2")
    for other, yields in (((2, 9.0, "r3"), True), ((1, 4.0, "r3"), True), ((1, 5.0, "r1"), True),
                          ((0, 0.1, "r1"), False), ((1, 6.0, "r1"), False), ((1, 5.0, "r3"), False)):  # fmt: skip
        target, left, name = other
        heard = broadcast(name, (0.5, 0.0), target, left, Activity.DRIVE)
        assert bool(decide(own, PATH, [heard], RADIUS, False).yield_to) is yields, other


def test_who_is_far_from_the_way_is_let_be() -> None:
    heard = broadcast("r1", (0.5, 5.0), 3, 0.0, Activity.DRIVE)
    assert decide(Rank(0, 5.0, "r2"), PATH, [heard], RADIUS, False) == ((), ())
