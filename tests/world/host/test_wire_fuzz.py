"""Requests of anybody: each one is answered or counted, the world goes on, and its state stays as it was."""

from collections.abc import Callable
from random import Random
from threading import Event as Flag
from threading import Thread
from typing import Any

import msgpack
import msgspec
import pytest

from swarm.bus import Bus, Request
from swarm.bus.codec import encode
from swarm.messages import (
    ACTION,
    EDIT,
    JOIN,
    LEAVE,
    ORDER,
    PLACES,
    POOL,
    ROBOT_ACTION,
    STATUS,
    TOPICS,
    Accepted,
    Action,
    Do,
    Edit,
    Join,
    Kind,
    Leave,
    Message,
    Order,
    Places,
    PoolTargets,
    RobotAction,
    RobotDo,
)
from tests.conftest import MakeBus
from tests.shared import scenario_of
from tests.world.shared import run_of
from world.host.process import Host
from world.host.request_answers import answer
from world.host.run import Run
from world.saving.snapshot_file import ENCODER

# requests that are right and refused while the run waits without robots, and what is wrong in one way each
RIGHT: dict[str, Message] = {
    ACTION.key: Action(do=Do.RESUME),
    EDIT.key: Edit(kind=Kind.WALL, low=(-9.0, -9.0), high=(-8.0, -8.0)),
    JOIN.key: Join(robot="r99", session="somebody", world=None),
    LEAVE.key: Leave(robot="r1", session="somebody"),
    ORDER.key.format(robot="r1"): Order(id="far", targets=[(-9.0, -9.0)]),
    ROBOT_ACTION.key.format(robot="r99"): RobotAction(do=RobotDo.STOP),
    POOL.key: PoolTargets(id="far", targets=[(-9.0, -9.0)]),
    PLACES.key: Places(id="far", count=1, at=[(-9.0, -9.0, 0.0)]),
}
ODD: tuple[Any, ...] = (
    None, True, -1, 2**63, 1e308, float("nan"), float("inf"), "", "r1", "x" * 3000, b"\xff", [], [[]], {},
)  # fmt: skip


def spoiled(payload: bytes, chance: Random) -> bytes:
    """Return a request with one thing wrong: bytes, a field's value, a field less, or another length."""
    match chance.randrange(5):
        case 0:
            return chance.randbytes(chance.randrange(64))
        case 1:
            return payload[: chance.randrange(len(payload))]
        case 2:
            place = chance.randrange(len(payload))
            return payload[:place] + chance.randbytes(1) + payload[place + 1 :]
        case 3:
            fields = msgpack.unpackb(payload)
            fields[chance.choice(sorted(fields))] = chance.choice(ODD)
            return bytes(msgpack.packb(fields))
        case _:
            fields = msgpack.unpackb(payload)
            del fields[chance.choice(sorted(fields))]
            return bytes(msgpack.packb(fields))


def harmless(payload: bytes, key: str) -> bool:
    """Return True unless the payload, by luck, is a request that the world may carry out."""
    try:
        return bool(msgspec.msgpack.decode(payload, type=type(RIGHT[key])) == RIGHT[key])
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return True


def key_of(chance: Random) -> str:
    """Return a key: one of the world's, of a robot, or one that nobody has."""
    names = [topic.key.format(robot="r1", zx=0, zy=0) for topic in TOPICS]
    own = chance.choice([*names, "world/nothing", "robot/r1", "robot/r99/state", "somewhere/else/at/all"])
    return own if chance.random() < 0.9 else own + "/" + "x" * chance.randrange(1, 40)


def attacked(make_bus: MakeBus, number: int, *, serve: bool = False, patience: float = 30.0) -> list[str]:
    """Send a world that waits for its robots this many requests and keys; return what is wrong, if anything is."""
    bus, asker, stop = make_bus(), make_bus(), Flag()
    run = run_of(scenario_of(serve=serve), bus=bus, wait=True)
    host = Host(bus, run, lambda line: None)
    host.open()
    thread = Thread(target=host.serve, args=(stop,))
    thread.start()
    chance, session, prefix = Random(number), asker._session, bus._prefix
    wrong: list[str] = []
    try:
        while not asker.fetch(STATUS):
            assert thread.is_alive(), "the world has ended"
        before = ENCODER.encode(run.world.save()), asker.fetch(STATUS)
        answered = 0
        for _ in range(number):
            if chance.random() < 0.5:
                key = chance.choice(list(RIGHT))
                good = encode(RIGHT[key])
                payload = good if chance.random() < 0.1 else spoiled(good, chance)
                if not harmless(payload, key):
                    continue
                replies = list(session.get(prefix + key, payload=payload, timeout=patience))
                if [reply.err is not None for reply in replies] != [True]:
                    wrong.append(f"{key}: expected one refusal of {payload!r}, got {len(replies)} answers")
                answered += 1
            else:
                payload = chance.randbytes(chance.randrange(200))
                list(session.get(prefix + key_of(chance), payload=payload, timeout=patience))
        if answered <= number // 4:
            wrong.append(f"expected more than {number // 4} requests that are answered, got {answered}")
        if bus.refused_counts.total() == 0:
            wrong.append("expected bad requests to be counted")
        if (ENCODER.encode(run.world.save()), asker.fetch(STATUS)) != before:
            wrong.append("the state has changed")
    finally:
        stop.set()
        thread.join()
    if run.report()["reason"] != "interrupted":
        wrong.append(f"expected a world that runs until it is told to stop, got {run.report()['reason']!r}")
    return wrong


@pytest.mark.parametrize("serve", [False, True], ids=["ends", "stays"])
@pytest.mark.parametrize(
    "number", [2_000, pytest.param(20_000, marks=pytest.mark.long("20,000 requests; make test sends 2,000"))]
)
def test_no_request_changes_anything_and_every_request_is_answered_or_counted(
    make_bus: MakeBus, number: int, serve: bool
) -> None:
    assert attacked(make_bus, number, serve=serve) == []


def swallows(request: Request, run: Run, bus: Bus) -> None:
    """Answer no edit."""
    if not isinstance(request.message, Edit):
        answer(request, run, bus)


def accepts(request: Request, run: Run, bus: Bus) -> None:
    """Accept whatever comes."""
    request.accept(Accepted(text="yes"))


def changes(request: Request, run: Run, bus: Bus) -> None:
    """Refuse, and change the state all the same."""
    run.world.bodies.edits += isinstance(request.message, Edit)
    answer(request, run, bus)


@pytest.mark.parametrize(
    ("fault", "says"),
    [(swallows, "got 0 answers"), (accepts, "expected one refusal"), (changes, "the state has changed")],
)
def test_the_judge_speaks_of_a_planted_fault(
    make_bus: MakeBus, monkeypatch: pytest.MonkeyPatch, fault: Callable[..., None], says: str
) -> None:
    monkeypatch.setattr("world.host.process.answer", fault)
    found = attacked(make_bus, 400, patience=0.5)
    assert any(says in one for one in found), found
