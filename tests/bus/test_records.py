"""Records of others are opened once and passed on as the bytes they came in."""

import msgpack
import pytest
from msgspec import DecodeError, Raw
from msgspec.msgpack import encode as pack

from swarm.bus import codec, records
from swarm.bus.codec import decode, encode
from swarm.bus.records import OpenedRecords
from swarm.errors import PeerError
from swarm.messages import Activity, Broadcast, Record, Relayed, TrafficBroadcast

LARGE = 100_000  # bytes
OWN = Record(robot="r1", stamp=8, held=(3, 4), x=1.0, y=2.0, goal=9)
OTHER = Record(robot="r2", stamp=7, held=(5,), x=3.0, y=2.0, goal=-1)


def broadcast(*relayed: Relayed) -> Broadcast:
    # fmt: off
    return Broadcast(
        robot="r1", run=0, tick=8, x=1.0, y=2.0, yaw=0.0, activity=Activity.DRIVE, target=0, distance=1.0,
        reached=[False], traffic=TrafficBroadcast(own=OWN, others=relayed),
    )
    # fmt: on


def changed(payload: bytes, **record: object) -> bytes:
    """Return a broadcast's payload with fields of its first relayed record replaced."""
    fields = msgpack.unpackb(payload)
    hops, inner = fields["traffic"]["others"][0]
    fields["traffic"]["others"] = [[hops, inner | record]]
    packed: bytes = msgpack.packb(fields)
    return packed


def test_equal_bytes_are_opened_once() -> None:
    opened = OpenedRecords()
    first = opened.open(Raw(pack(OTHER)))
    assert first == OTHER
    assert opened.open(Raw(pack(OTHER))) is first


def test_a_record_that_came_in_bytes_goes_out_as_the_same_bytes() -> None:
    unusual = msgpack.packb({"future": 1} | msgpack.unpackb(pack(OTHER)))  # not as this project packs it
    opened = OpenedRecords()
    record = opened.open(Raw(unusual))
    assert record == OTHER
    assert bytes(opened.packed_record(record)) == unusual  # type: ignore[arg-type]


def test_a_record_that_did_not_come_in_bytes_is_passed_on_as_it_is() -> None:
    assert OpenedRecords().packed_record(OTHER) is OTHER


def test_old_records_make_room(monkeypatch: pytest.MonkeyPatch) -> None:
    packed = [pack(Record(robot="r2", stamp=stamp, x=0.0, y=0.0, goal=0)) for stamp in range(10)]
    monkeypatch.setattr(records, "ROOM", 3 * len(packed[0]))
    opened = OpenedRecords()
    first, *_, last = [opened.open(Raw(one)) for one in packed]
    assert opened.packed_record(first) is first, "its bytes were dropped"
    assert bytes(opened.packed_record(last)) == packed[-1]  # type: ignore[arg-type]
    assert opened.open(Raw(packed[0])) == first


def test_records_that_are_heard_again_and_again_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    packed = [pack(Record(robot="r2", stamp=stamp, x=0.0, y=0.0, goal=0)) for stamp in range(10)]
    monkeypatch.setattr(records, "ROOM", 3 * len(packed[0]))
    opened = OpenedRecords()
    first = opened.open(Raw(packed[0]))
    for one in packed[1:]:
        opened.open(Raw(one))
        assert opened.open(Raw(packed[0])) is first


def test_bytes_that_are_no_record_are_refused() -> None:
    with pytest.raises(DecodeError):
        OpenedRecords().open(Raw(b"\x80"))


def test_a_relayed_record_passes_through_a_robot_unchanged() -> None:
    payload = changed(encode(broadcast(Relayed(1, OTHER))), future=[1, 2])
    heard = decode(payload, Broadcast, LARGE)
    assert heard.traffic is not None
    (relayed,) = heard.traffic.others
    assert relayed == Relayed(1, OTHER)
    again = msgpack.unpackb(encode(broadcast(relayed._replace(hops=2))))
    assert again["traffic"]["others"] == [[2, msgpack.unpackb(pack(OTHER)) | {"future": [1, 2]}]]


@pytest.mark.parametrize("bad", [{"x": "1"}, {"stamp": -1}, {"held": [-5]}, {"robot": "r/2"}, {"x": float("nan")}])
def test_one_bad_record_makes_the_whole_broadcast_refused(bad: dict[str, object]) -> None:
    with pytest.raises(PeerError, match=r"^broadcast: "):
        decode(changed(encode(broadcast(Relayed(1, OTHER))), **bad), Broadcast, LARGE)


@pytest.mark.parametrize("hops", [0, 17, "1"])
def test_bad_hops_are_refused(hops: object) -> None:
    with pytest.raises(PeerError, match=r"^broadcast: "):
        decode(codec.ENCODER.encode(broadcast((hops, OTHER))), Broadcast, LARGE)  # type: ignore[arg-type]
