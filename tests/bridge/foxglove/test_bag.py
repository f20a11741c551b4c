"""Bags: what others read in them, and that a file is whole at every moment."""

import os
import shutil
from pathlib import Path
from typing import Final

import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag2, QosDurability, QosReliability

from swarm.bridge.cdr import layouts
from swarm.bridge.foxglove import bag
from swarm.bridge.foxglove.bag import END, EVERY, Bag
from swarm.bridge.ros2.topics import CLOCK, MAP, OF_FLEET, OF_ROBOT, SCAN
from swarm.bridge.ros2.types import Types
from swarm.errors import ConfigError
from tests.bridge.foxglove.read import is_closed, lines, lines_of_both

ROS: Final = Types("jazzy")
SECOND: Final = 10**9  # ns


def tick(one: Bag, *seconds: int) -> None:
    for number in seconds:
        one.send_payload("/clock", layouts.write_clock(number * SECOND), number * SECOND)


def clocks(path: Path) -> list[int]:
    return [line.message.clock.sec for line in lines(path)]


def test_a_bag_has_what_was_said_with_its_type_and_time(tmp_path: Path) -> None:
    with Bag(tmp_path / "a.mcap", ROS) as one:
        one.offer_topic("/clock", CLOCK)
        tick(one, 1, 2, 5)
    assert [(line.topic, line.at, line.type) for line in lines_of_both(tmp_path / "a.mcap")] == [
        ("/clock", number * SECOND, "rosgraph_msgs/msg/Clock") for number in (1, 2, 5)
    ]  # fmt: skip
    assert is_closed(tmp_path / "a.mcap")


def test_a_message_that_comes_late_is_logged_when_it_comes(tmp_path: Path) -> None:
    with Bag(tmp_path / "a.mcap", ROS) as one:
        one.offer_topic("/clock", CLOCK)
        tick(one, 3, 2)
    assert [(line.at, line.message.clock.sec) for line in lines(tmp_path / "a.mcap")] == [
        (3 * SECOND, 3),
        (3 * SECOND, 2),
    ]


def test_at_every_moment_readers_find_the_chunks_that_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A copy of the file after every write is what a kill leaves; long writes come in two pieces, as a system may."""
    path, copies = tmp_path / "a.mcap", list[tuple[Path, list[int]]]()
    written: list[int] = []
    write = os.pwrite

    def watched(file: int, data: bytes, at: int) -> int:
        size = write(file, data if len(data) <= len(END) else data[: len(data) // 2], at)
        copies.append((tmp_path / f"{len(copies)}.mcap", list(written)))
        shutil.copy(path, copies[-1][0])
        return size

    with Bag(path, ROS) as one:
        one.offer_topic("/clock", CLOCK)
        monkeypatch.setattr(os, "pwrite", watched)
        for chunk in range(3):
            fresh = list(range(10 * chunk, 10 * chunk + 10))
            tick(one, *fresh)
            one.flush()
            written += fresh
        tick(one, 99)
        assert [line.message.clock.sec for line in lines_of_both(path)] == written, "what waits is not there yet"
    assert len(copies) > 3 * 3
    for copy, expected in copies:
        assert clocks(copy)[: len(expected)] == expected
    assert [line.message.clock.sec for line in lines_of_both(path)] == [*written, 99]


def test_a_chunk_is_written_every_few_seconds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr(bag, "monotonic", lambda: now[0])
    with Bag(tmp_path / "a.mcap", ROS) as one:
        one.offer_topic("/clock", CLOCK)
        tick(one, 1, 2)
        assert clocks(tmp_path / "a.mcap") == []
        now[0] += EVERY
        tick(one, 3)
        assert clocks(tmp_path / "a.mcap") == [1, 2, 3]
        assert not is_closed(tmp_path / "a.mcap")


def test_another_run_is_in_another_file_with_the_same_topics(tmp_path: Path) -> None:
    with Bag(tmp_path / "a.mcap", ROS) as one:
        one.offer_topic("/clock", CLOCK)
        one.offer_topic("/map", MAP)
        one.withdraw_topic("/map")
        tick(one, 7)
        one.begin_run()
        tick(one, 1)
    assert clocks(tmp_path / "a.mcap") == [7]
    assert [(line.at, line.message.clock.sec) for line in lines(tmp_path / "a-run2.mcap")] == [(SECOND, 1)]


def test_latched_topics_are_offered_as_that_when_a_bag_is_played(tmp_path: Path) -> None:
    shown = {topic.name: topic for topic in (*OF_FLEET, *OF_ROBOT)}
    with Bag(tmp_path / "a.mcap", ROS) as one:
        for name, topic in shown.items():
            one.offer_topic(f"/{name}", topic)
            one.send_payload(f"/{name}", layouts.write_transforms(0, []), 0)
    with AnyReader([tmp_path / "a.mcap"]) as reader:
        found = [*reader.connections]
    assert {one.topic for one in found} == {f"/{name}" for name in shown}
    for connection in found:
        assert isinstance(connection.ext, ConnectionExtRosbag2)
        (quality,) = connection.ext.offered_qos_profiles
        topic = shown[connection.topic.removeprefix("/")]
        assert (quality.durability is QosDurability.TRANSIENT_LOCAL) == topic.qos.is_latched
        assert (quality.reliability is QosReliability.BEST_EFFORT) == (topic is SCAN)
        assert quality.depth == int(topic.qos.split(":")[2].split(",")[1])


@pytest.mark.parametrize(
    ("name", "said"),
    [("none/a.mcap", "No such file or directory"), (".", "Is a directory"), ("/dev/full", "No space left on device")],
)
def test_a_file_that_cannot_be_written_is_an_error(tmp_path: Path, name: str, said: str) -> None:
    path = tmp_path / name
    with pytest.raises(ConfigError) as refused, Bag(path, ROS):
        pass
    assert str(refused.value) == f"--record {path}: expected to write it, got: {said}; name another file"
