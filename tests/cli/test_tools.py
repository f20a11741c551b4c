"""`swarm hz`, `topics`, `echo` and `ls` on a tap that is a table of samples: what they print, and when."""

import json
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest

import swarm.bus
from swarm.bus import Endpoint, Sample
from swarm.bus.codec import encode
from swarm.cli import fleet_lookup, main
from swarm.cli.columns import align_rows
from swarm.cli.fleet_lookup import FleetPlace
from swarm.cli.look import echo as echo_room
from swarm.cli.look import hz as hz_room
from swarm.cli.look import ls as ls_room
from swarm.cli.look import topics as topics_room
from swarm.errors import ConfigError, PeerError
from swarm.launch import fleet_registry
from swarm.launch.fleet_registry import Card
from tests.messages.made import state

Capture = pytest.CaptureFixture[str]
PLACE = FleetPlace(Endpoint("127.0.0.1", 7447), "fleet")


class Heard:
    """A tap on which samples come at given times [s]; the time goes on only while somebody waits for one."""

    def __init__(self, times: Sequence[float], dropped: int, *, keeps: bool) -> None:
        self.now, self.dropped, self.keeps = 0.0, dropped, keeps
        self._times = list(times)

    def __enter__(self) -> "Heard":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def clock(self) -> float:
        return self.now

    def last(self) -> list[Sample]:
        """Return what somebody keeps."""
        return [Sample("robot/r1/state", bytes(20), self.now)] if self.keeps else []

    def receive(self, timeout: float) -> Sample | None:
        """Return the next sample, or None at the end of the timeout [s]."""
        if self._times and self._times[0] <= self.now + timeout:
            self.now = max(self.now, self._times.pop(0))
            return Sample("robot/r1/cmd", bytes(10), self.now)
        self.now += timeout
        return None


@pytest.fixture
def hear(monkeypatch: pytest.MonkeyPatch) -> "Hear":
    return Hear(monkeypatch)


class Hear:
    """Puts a tap that is a table in the place of the real one."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._monkeypatch = monkeypatch

    def __call__(self, times: Sequence[float], dropped: int = 0, *, keeps: bool = False) -> None:
        """Let samples come at times [s]."""
        heard = Heard(times, dropped, keeps=keeps)
        self._monkeypatch.setattr(swarm.bus, "Tap", lambda *_: heard)
        for room in (hz_room, topics_room):
            self._monkeypatch.setattr(room, "monotonic", heard.clock)
            self._monkeypatch.setattr(room, "find_fleet", lambda *_: PLACE)


TENTHS = [0.05 + 0.1 * number for number in range(100)]
# fmt: off
LASTING = {  # --seconds: the messages told of in each line
    0.3: [3],
    1.0: [10],
    2.6: [10, 20, 26],
    3.0: [10, 20, 30],
}
# fmt: on


@pytest.mark.parametrize("seconds", LASTING)
def test_the_rate_is_told_each_second_and_at_the_end(hear: Hear, capsys: Capture, seconds: float) -> None:
    hear(TENTHS)
    assert hz_room.hz(Namespace(key="robot/r1/cmd", seconds=seconds, json=True)) == 0
    said = [json.loads(line)["messages"] for line in capsys.readouterr().out.splitlines()]
    assert said == LASTING[seconds]


def test_who_hears_too_little_is_told_where_the_keys_are(hear: Hear, capsys: Capture) -> None:
    hear([0.1])
    assert hz_room.hz(Namespace(key="x", seconds=0.5, json=False)) == 1
    assert capsys.readouterr().err == "x: fewer than two messages so far; `swarm topics` lists the keys in use\n"
    hear([])
    assert topics_room.topics(Namespace(seconds=2.0, json=False)) == 1
    assert capsys.readouterr().out == "nothing was heard for 2 s; `swarm ls` tells whether the fleet runs\n"


def test_a_key_on_which_nothing_came_is_listed_if_its_last_message_is_kept(hear: Hear, capsys: Capture) -> None:
    hear([], keeps=True)
    assert topics_room.topics(Namespace(seconds=2.0, json=True)) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert (row["key"], row["rate"], row["usual"], row["size"], row["age"], row["who"]) == (
        "robot/r1/state", 0.0, 1.0, 20.0, None, "r1",
    )  # fmt: skip
    hear(TENTHS, keeps=True)
    assert topics_room.topics(Namespace(seconds=2.0, json=False)) == 0
    _, cmd, state, _, total = capsys.readouterr().out.splitlines()
    assert (cmd.split()[0], state.split()[:2], state.split()[5]) == ("robot/r1/cmd", ["robot/r1/state", "0.0"], "kept")
    assert total.startswith("2 keys, 10 messages/s")


@pytest.mark.parametrize("dropped", [0, 7])
def test_rates_that_are_too_low_are_told_to_be(hear: Hear, capsys: Capture, dropped: int) -> None:
    expected = "7 messages came faster than this tool takes them: all rates are too low; " if dropped else ""
    for tool in (hz_room.hz, topics_room.topics):
        hear(TENTHS, dropped)
        assert tool(Namespace(key="robot/r1/cmd", seconds=1.0, json=True)) == 0
        said = capsys.readouterr().err
        assert said.startswith(expected)
        assert bool(said) == bool(dropped)


def test_a_good_message_is_read() -> None:
    assert echo_room.read(Sample("robot/r1/state", encode(state(0, "r1")), 0.0)).robot == "r1"  # type: ignore[attr-defined]


# fmt: off
REFUSED = {  # key, payload: what the sentence says
    "of another robot": ("robot/r1/state", encode(state(0, "r2")), "expected a message of 'r1', got one of 'r2'"),
    "of no robot":      ("robot/r 1/state", encode(state(0, "r1")), "expected an id of letters"),
    "nonsense":         ("robot/r1/state", b"nonsense", "expected a MessagePack map"),
    "of no topic":      ("elsewhere",      b"12345678", "got 8 bytes on this one; `swarm schema` lists the messages"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_receiver_would_refuse_is_refused(name: str) -> None:
    key, payload, said = REFUSED[name]
    with pytest.raises(PeerError, match=said):
        echo_room.read(Sample(key, payload, 0.0))


def test_nothing_in_a_column_is_cut() -> None:
    rows = [("key", "Hz", ""), ("k" * 200, "1.0", "x"), ("k", "100.0", "")]
    lines = align_rows(rows, right=[1]).splitlines()
    assert lines == [f"{'key':200}     Hz", f"{'k' * 200}    1.0  x", f"{'k':200}  100.0"]


def test_only_the_fleet_that_is_named_is_asked(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    asked: list[str] = []

    def answer(_: Namespace, router: str, fleet: str) -> dict[str, object]:
        asked.append(fleet)
        return dict.fromkeys(("time", "robots", "present")) | {"fleet": fleet, "router": router, "phase": "running"}

    cards = [Card(name, f"tcp/{name}:7447", 12, box=f"http://{name}") for name in ("a", "b", "c")]
    monkeypatch.setattr(fleet_registry, "cards", lambda: cards)
    monkeypatch.setattr(swarm.bus, "fleets", lambda _: ["a", "b", "c"])
    monkeypatch.setattr(ls_room, "query_world", answer)
    assert main(["ls", "--fleet", "b"]) == 0
    assert capsys.readouterr().out.splitlines()[1].split() == ["b", "tcp/b:7447", "running", "12"]
    assert main(["ls", "--fleet", "b", "--connect", "tcp/127.0.0.1:7447"]) == 0
    capsys.readouterr()
    assert main(["ls", "--fleet", "b", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["box"] == "http://b"
    assert asked == ["b", "b", "b"]
    assert main(["ls", "--fleet", "nope"]) == 1
    assert capsys.readouterr().out == "no fleet nope runs on this machine; start one with `swarm run`\n"
    cards.clear()
    assert main(["ls"]) == 1
    assert capsys.readouterr().out == "no fleet runs on this machine; start one with `swarm run`\n"


# fmt: off
NAMED = {  # arguments: the name of the process
    "robot --id r7":               "r7",
    "robot":                       "robot",
    "order r1 1,1 --id r7":        "order",
    "pool 1,1 --id r7":            "pool",
}
# fmt: on


@pytest.mark.parametrize("arguments", NAMED)
def test_only_a_robot_names_its_process_by_its_id(arguments: str, monkeypatch: pytest.MonkeyPatch) -> None:
    named: list[str] = []

    def nowhere(*_: object) -> None:
        raise ConfigError("expected a fleet, found none")

    monkeypatch.setattr("swarm.launch.process_name.name_process", named.append)
    monkeypatch.setattr("swarm.cli.fleet_lookup.await_fleet", nowhere)
    monkeypatch.setattr("swarm.cli.fleet_lookup.find_fleet", nowhere)
    assert main(arguments.split()) == 2
    assert named == [NAMED[arguments]]


def test_a_sentence_that_begins_with_the_programs_name_is_kept(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    def wrong(*_: object) -> None:
        raise ConfigError("swarm fleets are many")

    monkeypatch.setattr("swarm.cli.fleet_lookup.await_fleet", wrong)
    assert main(["robot"]) == 2
    assert capsys.readouterr().err == "swarm: swarm fleets are many\n"


def test_a_robot_that_waits_for_a_world_asks_in_one_session(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    opened: list[object] = []
    answers: list[list[str]] = [[], [], ["one"]]

    @contextmanager
    def connect(router: object) -> Iterator[str]:
        opened.append(router)
        yield "session"

    monkeypatch.setattr(fleet_lookup, "LOOK_EVERY", 0.0)
    monkeypatch.setattr(swarm.bus, "connect", connect)
    monkeypatch.setattr(swarm.bus, "names_on", lambda session, role: answers.pop(0))
    assert fleet_lookup.await_fleet(PLACE.endpoint) == "one"
    assert (len(opened), answers) == (1, [])
    assert capsys.readouterr().out == "fleet one\n"
