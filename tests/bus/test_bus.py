"""Real Zenoh sessions through a router in this process: what one bus sends, the other receives, checked."""

import ctypes
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from time import monotonic

import msgpack
import pytest
import zenoh

from swarm.bus import Arrival, Bus, Endpoint, Link, Presence, Request, Tap
from swarm.bus import session as module
from swarm.bus import tap as tap_module
from swarm.bus.codec import encode
from swarm.bus.settings import LEASE, client
from swarm.errors import ConfigError, PeerError
from swarm.messages import (
    ACTION,
    CLOCK,
    COMMAND,
    EVENT,
    JOIN,
    PLAN,
    RADIO,
    SENSE,
    STATE,
    Accepted,
    Action,
    Do,
    Event,
    Join,
    Message,
    Plan,
)  # fmt: skip
from tests.conftest import MakeBus
from tests.messages.made import broadcast, clock, state

pytestmark = pytest.mark.processes
PATIENCE = 20.0  # s, before a test fails
QUIET = 0.2  # s in which nothing may come


def event(tick: int, text: str = "hello") -> Event:
    return Event(run=0, tick=tick, time=0.0, robot=None, kind="test", text=text)


def plan(robot: str, tick: int = 0) -> Plan:
    return Plan(robot=robot, run=0, tick=tick, points=[(0.0, 1.0)])


def next_of(bus: Bus, kind: type) -> object:
    """Take the next arrival of a kind; what else comes is passed over."""
    while True:
        arrived = bus.receive(PATIENCE)
        assert arrived is not None, f"no {kind.__name__} came"
        if isinstance(arrived, kind):
            return arrived


def next_message(bus: Bus) -> Message:
    arrival = next_of(bus, Arrival)
    assert isinstance(arrival, Arrival)
    message: Message = arrival.message
    return message


def settle(bus: Bus, other: Bus) -> None:
    """Send and receive once each way, so that everything declared before this is known to the router and beyond."""
    for a, b in ((bus, other), (other, bus)):
        b.listen(EVENT)
        mark = event(0, f"settle {a.id} {b.id}")
        for _ in range(200):
            a.send(EVENT, mark)
            arrived = b.receive(0.1)
            if isinstance(arrived, Arrival) and arrived.message == mark:
                break
        else:
            raise AssertionError("the two do not hear each other")
        b.unlisten(EVENT)
        while b.receive(QUIET) is not None:
            pass


def test_what_is_sent_arrives_in_order_with_the_ids_of_its_key(make_bus: MakeBus) -> None:
    here, there = make_bus(), make_bus()
    there.listen(PLAN, robot="r2")
    settle(here, there)
    for tick in range(50):
        here.send(PLAN, plan("r2", tick), robot="r2")
    for tick in range(50):
        arrival = next_of(there, Arrival)
        assert arrival == Arrival(PLAN, {"robot": "r2"}, plan("r2", tick))
        assert arrival.sender == here.sender != there.sender


def test_a_session_hears_itself_once(make_bus: MakeBus) -> None:
    """Robots of one process hear each other in this way."""
    one = make_bus()
    one.listen(RADIO, quiet=True, zx=0, zy=0)
    one.listen(EVENT)
    one.send(RADIO, broadcast(0, "r1"), zx=0, zy=0, robot="r1")
    one.send(EVENT, event(1))
    assert [one.receive(PATIENCE) for _ in range(2)] == [
        Arrival(RADIO, {"zx": "0", "zy": "0", "robot": "r1"}, broadcast(0, "r1")), Arrival(EVENT, {}, event(1)),
    ]  # fmt: skip
    assert one.receive(QUIET) is None


def test_a_part_of_the_key_left_out_matches_all_and_only_that(make_bus: MakeBus) -> None:
    here, there = make_bus(), make_bus()
    there.listen(RADIO, zx=1)
    settle(here, there)
    for zx, zy, robot in ((0, 0, "r1"), (1, 0, "r2"), (-1, 5, "r3"), (1, -7, "r4")):
        here.send(RADIO, broadcast(0, robot), sure=True, zx=zx, zy=zy, robot=robot)
    heard = [next_of(there, Arrival) for _ in range(2)]
    assert [arrival.ids for arrival in heard] == [  # type: ignore[attr-defined]
        {"zx": "1", "zy": "0", "robot": "r2"},
        {"zx": "1", "zy": "-7", "robot": "r4"},
    ]
    assert there.receive(QUIET) is None


def test_listening_twice_is_listening_once_and_unlistening_ends_it(make_bus: MakeBus) -> None:
    here, there = make_bus(), make_bus()
    there.listen(CLOCK)
    there.listen(CLOCK)
    settle(here, there)
    here.send(CLOCK, clock(1))
    here.send(CLOCK, clock(2))
    assert [next_message(there), next_message(there)] == [clock(1), clock(2)]
    there.unlisten(CLOCK)
    settle(here, there)
    here.send(CLOCK, clock(3))
    assert there.receive(QUIET) is None
    there.listen(CLOCK)
    settle(here, there)
    here.send(CLOCK, clock(4))
    assert next_message(there) == clock(4)


def test_a_fleet_does_not_hear_another_one(make_bus: MakeBus) -> None:
    here, there, elsewhere = make_bus(), make_bus(), make_bus(fleet="elsewhere")
    there.listen(CLOCK)
    elsewhere.listen(CLOCK)
    settle(here, there)
    here.send(CLOCK, clock(1))
    assert next_message(there) == clock(1)
    assert elsewhere.receive(QUIET) is None


def ask(bus: Bus, question: Action, answers: list[object]) -> None:
    try:
        answers.append(bus.ask(ACTION, question, PATIENCE))
    except PeerError as fault:
        answers.append(fault)


def test_a_question_is_accepted_or_refused_with_the_reason(make_bus: MakeBus) -> None:
    import threading

    asker, answerer = make_bus(), make_bus()
    answerer.serve(ACTION)
    settle(asker, answerer)
    answers: list[object] = []
    for reply in ("accept", "refuse"):
        thread = threading.Thread(target=ask, args=(asker, Action(do=Do.GO), answers))
        thread.start()
        request = next_of(answerer, Request)
        assert isinstance(request, Request)
        assert request.message == Action(do=Do.GO)
        if reply == "accept":
            request.accept(Accepted(text="so be it"))
        else:
            request.refuse("not today")
        thread.join()
    assert answers[0] == Accepted(text="so be it")
    assert isinstance(answers[1], PeerError)
    assert str(answers[1]) == "action: not today"


def test_a_question_that_nobody_answers_says_so(make_bus: MakeBus) -> None:
    with pytest.raises(PeerError, match=r"^join: expected an answer, got none; is the fleet's world running"):
        make_bus().ask(JOIN, Join(robot=None, session="s", world=None), timeout=2.0)


def test_a_malformed_question_is_refused_and_never_seen(make_bus: MakeBus, endpoint: Endpoint) -> None:
    answerer = make_bus(fleet="asked")
    answerer.serve(ACTION)
    settle(make_bus(fleet="asked"), answerer)
    with zenoh.open(client(endpoint)) as stranger:
        for payload in (b"\xff", None):
            replies = stranger.get("swarm/v1/asked/world/action", payload=payload, timeout=PATIENCE)
            assert answerer.receive(QUIET) is None
            assert answerer.receive(QUIET) is None
            errors = [reply.err.payload.to_string() for reply in replies if reply.err is not None]
            assert len(errors) == 1
            assert "expected" in errors[0]
    assert answerer.refused_counts[ACTION.key] == 2


def test_a_question_on_a_key_with_wildcards_is_refused_and_never_seen(make_bus: MakeBus, endpoint: Endpoint) -> None:
    answerer = make_bus(fleet="exact")
    answerer.serve(ACTION)
    answerer.keep(CLOCK, lambda: {CLOCK.key: clock(1)})
    settle(make_bus(fleet="exact"), answerer)
    with zenoh.open(client(endpoint)) as stranger:
        for key in ("swarm/v1/exact/world/*", "swarm/v1/exact/**", "swarm/*/exact/world/action"):
            asked = stranger.get(key, payload=encode(Action(do=Do.GO)), timeout=PATIENCE)
            assert answerer.receive(QUIET) is None
            errors = [reply.err.payload.to_string() for reply in asked if reply.err is not None]
            assert len(errors) == 1
            assert "expected the exact key swarm/v1/exact/world/action of a request" in errors[0]
        assert answerer.refused_counts[ACTION.key] == 3
        replies = list(stranger.get("swarm/v1/exact/world/*", timeout=PATIENCE))
        assert [reply.ok and encode(clock(1)) == reply.ok.payload.to_bytes() for reply in replies] == [True]
    assert answerer.receive(QUIET) is None
    assert answerer.refused_counts[ACTION.key] == 3, "who only looks for what is kept asks nothing"


def test_what_travels_beside_a_payload(make_bus: MakeBus, endpoint: Endpoint) -> None:
    sender, keeper = make_bus(fleet="beside"), make_bus(fleet="beside")
    keeper.keep(CLOCK, lambda: {CLOCK.key: clock(1)})
    with zenoh.open(client(endpoint)) as stranger:
        came = stranger.declare_subscriber("swarm/v1/beside/robot/*/plan", zenoh.handlers.FifoChannel(9))
        settle(sender, keeper)
        for robot in ("r1", "r2", "r1"):
            sender.send(PLAN, plan(robot), robot=robot)
        samples = [came.recv() for _ in range(3)]
        assert {str(sample.encoding) for sample in samples} == {"application/msgpack;swarm.v1.Plan"}
        numbers = [msgpack.unpackb(sample.attachment.to_bytes()) for sample in samples if sample.attachment is not None]
        assert [number for _, number in numbers] == [0, 0, 1]
        assert len({session for session, _ in numbers}) == 1
        (reply,) = stranger.get("swarm/v1/beside/world/clock", timeout=PATIENCE)
        assert reply.ok is not None
        assert str(reply.ok.encoding) == "application/msgpack;swarm.v1.Clock"


def until_heard(tap: Tap, put: Callable[[], None]) -> None:
    """Put messages until the router knows of the tap, and take those that it heard."""
    deadline = monotonic() + PATIENCE
    put()
    while tap.receive(QUIET) is None:
        assert monotonic() < deadline, "the tap hears nothing"
        put()
    while tap.receive(QUIET) is not None:
        pass


def test_a_message_lost_on_the_way_is_counted_and_the_others_come(make_bus: MakeBus, endpoint: Endpoint) -> None:
    said: list[str] = []
    there = make_bus(said.append, fleet="loss")
    there.listen(PLAN)
    settle(make_bus(fleet="loss"), there)
    tapped = []
    with zenoh.open(client(endpoint)) as sender, Tap(endpoint, "loss", "robot/*/plan") as tap:
        until_heard(tap, lambda: sender.put("swarm/v1/loss/robot/r0/plan", encode(plan("r0"))))
        while there.receive(QUIET) is not None:
            pass
        for number in (0, 1, 5, None, 6):
            sender.put(
                "swarm/v1/loss/robot/r1/plan",
                encode(plan("r1", 9)),
                attachment=None if number is None else msgpack.packb([77, number]),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
            assert next_message(there) == plan("r1", 9)
            tapped.append(tap.receive(PATIENCE))
        sender.put("swarm/v1/loss/robot/r1/plan", encode(plan("r1")), attachment=b"no numbers")
        tapped.append(tap.receive(PATIENCE))
        assert there.receive(QUIET) is None
    assert [sample.lost for sample in tapped if sample is not None] == [0, 0, 3, 0, 0, 0]
    assert there.lost_counts == {PLAN.key: 3}
    assert there.refused_counts == {PLAN.key: 1}
    assert said[0].startswith("3 messages lost on the way; the last gap: 3 messages on swarm/v1/loss/robot/r1/plan; ")


def test_what_was_lost_before_a_dropped_sample_is_told_with_the_next(
    endpoint: Endpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tap_module, "WAITING", 1)
    with zenoh.open(client(endpoint)) as sender, Tap(endpoint, "full", "robot/*/plan") as tap:

        def put(number: int, robot: str = "r1") -> None:
            sender.put(
                f"swarm/v1/full/robot/{robot}/plan",
                b"",
                attachment=msgpack.packb([77, number]),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )

        until_heard(tap, lambda: put(0, "r0"))
        before = tap.dropped
        for number in (0, 2, 5):  # the first fills the queue; the gaps are before those that are dropped
            put(number)
        deadline = monotonic() + PATIENCE
        while tap.dropped < before + 2:
            assert monotonic() < deadline, "they were not dropped"
        held = tap.receive(PATIENCE)
        put(7)
        told = tap.receive(PATIENCE)
    assert held is not None
    assert told is not None
    assert (held.lost, told.lost) == (0, 1 + 2 + 1)


@pytest.mark.parametrize("quiet", [False, True])
def test_who_stops_to_listen_and_listens_again_has_lost_nothing(make_bus: MakeBus, quiet: bool) -> None:
    here, there = make_bus(), make_bus()
    for heard in (True, False, True):
        if heard:
            there.listen(RADIO, quiet=quiet, zx=0, zy=0)
        settle(here, there)
        here.send(RADIO, broadcast(0, "r1"), sure=True, zx=0, zy=0, robot="r1")
        here.send(RADIO, broadcast(0, "r1"), sure=True, zx=0, zy=0, robot="r1")
        settle(here, there)
        there.unlisten(RADIO, zx=0, zy=0) if heard else None
    assert there.lost_counts[RADIO.key] == 0


def test_what_is_kept_is_fetched_all_or_one(make_bus: MakeBus) -> None:
    keeper, other = make_bus(), make_bus()
    kept = {STATE.key.format(robot=name): state(0, name) for name in ("r1", "r2", "r3")}
    keeper.keep(STATE, lambda: kept)
    settle(keeper, other)
    assert sorted(message.robot for message in other.fetch(STATE)) == ["r1", "r2", "r3"]
    assert other.fetch(STATE, robot="r2") == [state(0, "r2")]
    assert other.fetch(STATE, robot="r9") == []
    assert other.fetch(CLOCK) == []


def test_who_is_there_is_answered_each_time_also_to_who_watches(make_bus: MakeBus) -> None:
    """Zenoh answers some of these questions with nothing at once, if sessions that watch ask side by side."""
    keeper, *askers = (make_bus(fleet="asked-often") for _ in range(3))
    keeper.announce("world", "world")
    for asker in askers:
        asker.watch_presence("world")
        assert next_of(asker, Presence) == Presence("world", "world", keeper.id, alive=True)
    with ThreadPoolExecutor(len(askers)) as pool:
        found = list(pool.map(lambda number: askers[number % 2].sessions("world"), range(1000)))
    assert found == [{keeper.id}] * 1000
    assert askers[0].sessions("robot") == set()


def test_presence_comes_goes_is_told_to_latecomers_and_tells_twins_apart(make_bus: MakeBus, endpoint: Endpoint) -> None:
    watcher = make_bus(fleet="present")
    watcher.watch_presence()
    with Bus(endpoint, "present", print) as one, Bus(endpoint, "present", print) as twin:
        one.announce("robot", "r1")
        assert next_of(watcher, Presence) == Presence("robot", "r1", one.id, True)
        twin.announce("robot", "r1")
        assert next_of(watcher, Presence) == Presence("robot", "r1", twin.id, True)
        late = make_bus(fleet="present")
        late.watch_presence("robot")
        seen = {next_of(late, Presence), next_of(late, Presence)}
        assert seen == {Presence("robot", "r1", bus.id, True) for bus in (one, twin)}
        twin.withdraw("robot", "r1")
        assert next_of(watcher, Presence) == Presence("robot", "r1", twin.id, False)
        twin.withdraw("robot", "r1")  # a robot that joins again may have withdrawn already
        twin.announce("world", "world")
        assert next_of(watcher, Presence) == Presence("world", "world", twin.id, True)
        first, second = one.id, twin.id
    gone = {next_of(watcher, Presence), next_of(watcher, Presence)}
    assert gone == {Presence("robot", "r1", first, False), Presence("world", "world", second, False)}


# --- strangers ---

# fmt: off
BAD = {  # tests/bus/test_opening.py has more of them, without a wire
    "noise":              ("robot/r1/plan", b"\xff\x00"),
    "nothing":            ("robot/r1/plan", b""),
    "oversized":          ("robot/r1/plan", bytes(PLAN.limit + 1)),
    "another's message":  ("robot/r2/plan", encode(plan("r1"))),
    "every key":          ("**", encode(plan("r1"))),
}
# fmt: on


@pytest.mark.parametrize("name", BAD)
def test_rubbish_is_counted_and_skipped_and_the_next_message_comes(
    name: str, make_bus: MakeBus, endpoint: Endpoint
) -> None:
    key, payload = BAD[name]
    said: list[str] = []
    fleet = f"rubbish-{name.replace(' ', '-')}".replace("'", "")
    there, here = make_bus(said.append, fleet=fleet), make_bus(fleet=fleet)
    there.listen(PLAN)
    settle(here, there)
    with zenoh.open(client(endpoint)) as stranger:
        stranger.put(f"swarm/v1/{fleet}/{key}", payload, congestion_control=zenoh.CongestionControl.BLOCK)
        stranger.put(
            f"swarm/v1/{fleet}/robot/r1/plan",
            encode(plan("r1", 7)),
            congestion_control=zenoh.CongestionControl.BLOCK,
        )
        assert next_message(there) == plan("r1", 7)
    assert there.refused_counts == {PLAN.key: 1}
    assert len(said) == 1
    assert said[0].startswith("dropped 1 bad message; the last one: ")


def test_an_inbox_nobody_empties_is_bounded(make_bus: MakeBus, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "INBOX_LIMIT", 10)
    there, here = make_bus(), make_bus()
    there.listen(CLOCK)
    there.listen(EVENT)
    settle(here, there)
    there.listen(EVENT)
    for tick in range(100):
        here.send(CLOCK, clock(tick))
    here.send(CLOCK, clock(100))
    got = 0
    while there.receive(QUIET) is not None:
        got += 1
    assert got + there.overflowed >= 101 - 1
    assert got <= 100


def test_requests_that_nobody_takes_are_bounded_too_and_told(
    make_bus: MakeBus, endpoint: Endpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    answerer = make_bus(fleet="busy")
    answerer.serve(ACTION)
    settle(make_bus(fleet="busy"), answerer)
    monkeypatch.setattr(module, "INBOX_LIMIT", 0)
    with (
        Bus(endpoint, "busy") as asker,
        pytest.raises(PeerError, match="expected room in the inbox of this process, found it full; ask again"),
    ):
        asker.ask(ACTION, Action(do=Do.GO), timeout=PATIENCE)
    assert answerer.overflowed == 1
    assert answerer.receive(0.0) is None


def test_a_bus_without_a_router_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    from swarm.bus import settings

    monkeypatch.setitem(settings.CLIENT, "connect/timeout_ms", 300)
    free = Endpoint("127.0.0.1", 0).claim()
    with (
        pytest.raises(ConfigError, match=r"expected a running router, got: .*; start one with `swarm router`"),
        Bus(free, "fleet"),
    ):
        pass


@pytest.mark.parametrize("fleet", ["", "a/b", "*", "a b", "x" * 65, "line\n"])
def test_a_fleet_name_that_is_no_chunk_of_a_key_is_refused(fleet: str) -> None:
    with pytest.raises(ConfigError, match="fleet: expected letters, digits"):
        Bus(Endpoint("127.0.0.1", 1), fleet)


def test_the_link_is_told_when_the_router_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    import threading

    from swarm.bus.router import run as route

    place = Endpoint("127.0.0.1", 0).claim()
    over = threading.Event()
    thread = threading.Thread(target=route, args=(place, over.wait))
    thread.start()
    with Bus(place, "fleet", print) as bus:
        bus.listen(SENSE)
        bus.listen(COMMAND)
        over.set()
        thread.join()
        assert next_of(bus, Link) == Link(up=False)


def held(seconds: float) -> None:
    """Keep Python's lock for a time, as compiled code does that computes for long."""
    ctypes.PyDLL(None).usleep(round(1e6 * seconds))


@pytest.mark.parametrize("quiet", [False, True])
def test_a_computation_longer_than_the_lease_ends_no_session(make_bus: MakeBus, quiet: bool) -> None:
    """The thread of Zenoh's that reads from the network must not wait for Python: the others would call us gone."""
    here, there = make_bus(), make_bus()
    there.listen(RADIO, quiet=quiet)
    settle(here, there)
    here.watch_presence("robot")
    there.announce("robot", "r1")
    assert next_of(here, Presence) == Presence("robot", "r1", there.id, alive=True)
    for tick in range(1000):
        here.send(RADIO, broadcast(tick, "r1"), sure=True, zx=0, zy=0, robot="r1")
    held(1.8 * LEASE)
    assert here.receive(QUIET) is None
    assert not isinstance(there.receive(QUIET), Link)


def test_a_topic_is_wanted_while_somebody_listens(make_bus: MakeBus) -> None:
    world, watcher = make_bus(), make_bus()
    assert not world.has_listener(STATE, robot="r1")
    watcher.listen(STATE, robot="r1")
    while not world.has_listener(STATE, robot="r1"):
        watcher.fetch(CLOCK, timeout=PATIENCE)  # the router has answered
    watcher.unlisten(STATE, robot="r1")
    while world.has_listener(STATE, robot="r1"):
        watcher.fetch(CLOCK, timeout=PATIENCE)
