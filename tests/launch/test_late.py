"""Tools that come late, to a real fleet: before `go`, during the run, in a pause, and at the end."""

import json
from pathlib import Path
from typing import Any

import pytest
import zenoh

from swarm.bus import Bus, settings
from swarm.cli import main
from swarm.messages import (
    ACTION,
    CLOCK,
    EVENT,
    EVENTS,
    MAP,
    PLAN,
    STATE,
    STATUS,
    TRUTH,
    Action,
    Clock,
    Do,
    Liveness,
    Phase,
    Status,
    Topic,
)
from tests.launch.actors import Fleet, await_clock, await_event, await_message, await_status

pytestmark = pytest.mark.processes
FETCHED: tuple[Topic[Any], ...] = (CLOCK, TRUTH, STATE, MAP, EVENTS, STATUS)


def fetched(bus: Bus) -> Status:
    """Return the status, after a look at everything else that the world keeps."""
    found = {topic.key: bus.fetch(topic) for topic in FETCHED}
    assert [len(messages) for messages in found.values()] == [1, 1, 2, 1, 1, 1]
    status: Status = found[STATUS.key][0]
    clock, truth = (found[topic.key][0] for topic in (CLOCK, TRUTH))
    assert clock.phase is status.phase
    assert [body.robot for body in truth.bodies] == [one.robot for one in status.robots] == ["r1", "r2"]
    assert {name: seen.liveness for name, seen in clock.presence.items()} == {
        one.robot: one.liveness for one in status.robots
    }
    if status.phase is not Phase.RUNNING:
        assert [(body.x, body.y, body.yaw) for body in truth.bodies] == [one.pose for one in status.robots]
    return status


def await_taken_in(bus: Bus) -> None:
    """Wait until the world has noticed that its robots are present: it may do so later than a watcher does."""
    await_status(bus, lambda status: all(one.liveness is Liveness.ALIVE for one in status.robots))


def await_standstill(bus: Bus) -> None:
    """Wait until the clock of a paused run shows one tick twice: the tick in which it was paused is over then."""
    shown: list[tuple[Phase, int]] = []

    def stands(clock: Clock) -> bool:
        shown.append((clock.phase, clock.tick))
        return shown[-2:] == [(Phase.PAUSED, clock.tick)] * 2

    await_clock(bus, stands)


@pytest.mark.long("a whole mission")
def test_who_comes_late_gets_everything_in_every_phase(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--pace", "4", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_taken_in(bus)
        before = fetched(bus)
        assert (before.phase, before.time) == (Phase.WAITING, 0.0)
        assert [one.liveness for one in before.robots] == [Liveness.ALIVE] * 2
        assert all(not any(one.state.reached) and one.state.reached for one in before.robots)
        bus.ask(ACTION, Action(do=Do.GO))
        bus.listen(EVENT)
        await_event(bus, lambda event: event.kind == "reached")
        running = fetched(bus)
        assert len(bus.fetch(PLAN)) == 2
        assert (running.phase, "reached" in {event.kind for event in running.events}) == (Phase.RUNNING, True)
        bus.ask(ACTION, Action(do=Do.PAUSE))
        await_standstill(bus)
        paused = fetched(bus)
        assert paused == fetched(bus), "while the clock stands, nothing changes"
        assert [one.pose for one in paused.robots] != [one.pose for one in before.robots]
        times = [event.time for event in paused.events]
        assert times == sorted(times)
        bus.listen(STATUS)
        bus.ask(ACTION, Action(do=Do.STOP))
        last = await_message(bus, Status, lambda status: status.phase is Phase.OVER, "the end is not told")
        assert (last.reason, last.complete) == ("stopped by command", False)
        assert last.events[-1].text == "the run is over"
        assert fleet.end() == 1, fleet.text


def test_status_is_json_for_any_zenoh_client_and_for_people(
    small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Fleet(small, "--pace", "4", "--wait", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_taken_in(bus)
        with zenoh.open(settings.client(fleet.endpoint)) as session:
            (reply,) = session.get(f"swarm/v1/{fleet.name}/{STATUS.key}")
            assert reply.ok is not None
            assert reply.ok.encoding == zenoh.Encoding.APPLICATION_JSON
            plain = json.loads(reply.ok.payload.to_string())
        assert (plain["v"], plain["phase"]) == (1, "waiting")
        assert main(["status", "--json"]) == 0
        assert json.loads(capsys.readouterr().out) == plain
        assert main(["status"]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert lines[0].startswith("small: waiting at 0.0 s")
        *rows, tape = lines[2:]
        assert [line.split()[:2] for line in rows] == [["r1", "alive"], ["r2", "alive"]]
        assert tape.startswith("tape: ")
        assert main(["stop"]) == 0
        assert fleet.end() == 1, fleet.text
