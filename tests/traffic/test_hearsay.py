"""What robots tell each other is merged, passed on, and not believed blindly."""

from msgspec.structs import replace

from swarm.traffic.hearsay import Hearsay
from swarm.traffic.record import Claim, Record, Relayed, TrafficBroadcast
from swarm.traffic.settings import TrafficSettings
from tests.traffic.maps import DOOR

CELLS = DOOR.cells
A, B = DOOR.at("ab")
SETTINGS = TrafficSettings()


def record(stamp: int, robot: str = "r1", cell: int = A, held: tuple[int, ...] | None = None) -> Record:
    x, y = CELLS.centre(cell)
    return Record(robot=robot, stamp=stamp, x=x, y=y, goal=B, held=(cell,) if held is None else held)


def told(*records: Record, hops: int = 1) -> TrafficBroadcast:
    return TrafficBroadcast(own=records[0], others=tuple(Relayed(hops, other) for other in records[1:]))


def kinds(hearsay: Hearsay, tick: int, *broadcasts: TrafficBroadcast) -> list[str]:
    return [event.text for event in hearsay.hear(tick, broadcasts)]


def test_the_newest_record_wins_whichever_way_it_came() -> None:
    hearsay = Hearsay("r0", CELLS, SETTINGS)
    assert kinds(hearsay, 10, told(record(8, "r2"), record(9))) == []
    assert hearsay.others["r1"].stamp == 9
    assert kinds(hearsay, 11, told(record(8))) == []
    assert hearsay.others["r1"].stamp == 9
    assert list(hearsay.others) == ["r1", "r2"]


def test_records_travel_so_many_hops_and_no_farther() -> None:
    hearsay = Hearsay("r0", CELLS, SETTINGS)
    hearsay.hear(10, [told(record(9, "r2"), record(9), hops=SETTINGS.hops)])
    assert "r1" in hearsay.others
    assert [relayed.record.robot for relayed in hearsay.passed_on(10, 0.0, 0.0)] == ["r2"]
    hearsay = Hearsay("r0", CELLS, SETTINGS)
    hearsay.hear(10, [told(record(9, "r2"), record(9), hops=SETTINGS.hops + 1)])
    assert "r1" not in hearsay.others


def test_a_silent_robot_is_remembered_but_not_fresh() -> None:
    hearsay = Hearsay("r0", CELLS, SETTINGS)
    hearsay.hear(10, [told(record(9))])
    assert list(hearsay.fresh(40)) == ["r1"]
    assert list(hearsay.fresh(60)) == []
    assert hearsay.others["r1"].held == (A,)


def test_lies_are_named_and_dropped() -> None:
    def refusal(lie: Record) -> str:
        hearsay = Hearsay("r0", CELLS, SETTINGS)
        assert kinds(hearsay, 100, told(record(90))) == []
        texts = kinds(hearsay, 101, told(lie))
        assert hearsay.others["r1"].stamp == 90
        return " ".join(texts)

    assert "far from where it is" in refusal(record(95, held=(A, B)))
    assert "far from where it is" in refusal(replace(record(95), claims=(Claim(B, 1, 90),)))
    assert "jumped" in refusal(record(95, cell=B))
    assert "does not hold" in refusal(record(95, held=(A + 1,)))
    assert "not there" in refusal(record(95, held=(A, 10_000)))
    assert "from the future" in refusal(record(200))
    assert "again" in refusal(record(90))


def test_two_robots_of_one_id_are_noticed() -> None:
    hearsay = Hearsay("r0", CELLS, SETTINGS)
    assert "by my id" in kinds(hearsay, 10, told(record(9, "r0")))[0]
    assert kinds(hearsay, 10, told(record(9, "r2"), record(9))) == []
    texts = kinds(hearsay, 11, told(replace(record(9), goal=A)))
    assert "two different records" in texts[0]


def test_the_same_fault_is_told_once_in_a_while() -> None:
    hearsay = Hearsay("r0", CELLS, SETTINGS)
    texts = [text for tick in range(10, 60) for text in kinds(hearsay, tick, told(record(tick, "r0")))]
    assert len(texts) == 1


def test_after_sleep_a_silent_robot_may_have_got_on() -> None:
    hearsay = Hearsay("r0", CELLS, SETTINGS)
    hearsay.hear(10, [told(replace(record(9), ahead=(A + 1, A + 2)))])
    hearsay.wake(110)
    hearsay.hear(110, [])
    assert set(hearsay.others["r1"].held) == {A, A + 1, A + 2}
    hearsay.hear(120, [told(record(119))])
    assert hearsay.others["r1"].held == (A,)
