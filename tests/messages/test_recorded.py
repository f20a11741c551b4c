"""Messages recorded under this version of the wire: they are read, and written again as the same bytes, for good."""

from pathlib import Path
from typing import Any, Final

import msgpack
import pytest

from swarm.bus.codec import decode, encode
from swarm.errors import PeerError
from swarm.messages import VERSION
from tests.messages.examples import KINDS, example_of
from tests.messages.record import FOLDER, records

LARGE: Final = 10_000_000  # bytes
BROKEN: Final = (
    f"this change breaks the wire: others that speak swarm/v{VERSION} no longer understand us. Give what is new a "
    "default and keep what is old; or, if that cannot be, raise VERSION in swarm/messages/fields.py, and with it the "
    "prefix of all keys, and run python -m tests.messages.record"
)
NEW: Final = "this message has changed: if old software still understands it, run python -m tests.messages.record"


def recorded() -> list[Path]:
    return sorted(FOLDER.glob("*.msgpack"))


def kept(old: Any, new: Any) -> bool:  # noqa: ANN401
    """Return True if all that is in the old value is in the new one: fields may be added, with their defaults."""
    if isinstance(old, dict):
        return isinstance(new, dict) and all(name in new and kept(value, new[name]) for name, value in old.items())
    if isinstance(old, list):
        return isinstance(new, list) and len(old) == len(new) and all(map(kept, old, new))
    return type(old) is type(new) and bool(old == new)


@pytest.mark.parametrize("path", recorded(), ids=lambda path: path.name)
def test_what_was_recorded_is_still_understood(path: Path) -> None:
    payload = path.read_bytes()
    name = path.name.split(".")[0]
    assert name in KINDS, f"{name}: {BROKEN}"
    try:
        message = decode(payload, KINDS[name], LARGE)
    except PeerError as fault:
        pytest.fail(f"{fault}: {BROKEN}")
    assert kept(msgpack.unpackb(payload), msgpack.unpackb(encode(message))), BROKEN


@pytest.mark.parametrize("name", KINDS)
def test_the_newest_record_of_each_message_is_what_is_sent_today(name: str) -> None:
    files = records(name)
    assert files, f"{name} has no record: run python -m tests.messages.record"
    payload = files[-1].read_bytes()
    assert encode(decode(payload, KINDS[name], LARGE)) == payload, NEW
    assert encode(example_of(KINDS[name])) == payload, NEW


@pytest.mark.parametrize("name", KINDS)
def test_an_example_sets_every_field_to_something_else_than_its_default(name: str) -> None:
    example = example_of(KINDS[name])
    assert msgpack.unpackb(encode(example)).keys() == {"v", *type(example).__struct_fields__}


def test_a_field_less_or_another_value_is_no_keeping() -> None:
    assert kept({"a": [1, {"b": 2}]}, {"a": [1, {"b": 2, "c": 3}], "d": 4})
    for other in ({}, {"a": [1]}, {"a": [1, {}]}, {"a": [1, {"b": 2.0}]}, {"a": [2, {"b": 2}]}, [1]):
        assert not kept({"a": [1, {"b": 2}]}, other)
