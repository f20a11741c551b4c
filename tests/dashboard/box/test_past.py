"""The past of a run on its tape: what the box's child answers, that it is replaced and ended, and a real fleet's past."""

import os
import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, Final

import msgspec
import psutil
import pytest

from dashboard.box.answer_process import answer_line
from dashboard.box.frames import JOINT, LEARNED, OVERVIEW, RULES
from dashboard.box.questions import TRAILS, MomentAnswer, Question, QuestionRefusal
from dashboard.box.tape_moments import Moments
from dashboard.box.tape_process import TapeProcess
from dashboard.fold.state import RunState
from swarm.blackbox.explain.clauses import as_text
from swarm.blackbox.explain.source import open_moment_at
from swarm.blackbox.replay.replay import Replay
from swarm.blackbox.replay.wire import Wire
from swarm.bus import Arrival
from swarm.cli import main
from swarm.errors import PeerError
from swarm.messages import CLOCK, EVENTS, MAP, PLAN, STATE, TRUTH, Phase, State, Truth
from swarm.tape.reader import TapeFile
from tests.blackbox.explain.recorded import Recorded
from tests.dashboard.box.test_server import said
from tests.launch.actors import Fleet, await_clock, await_phase
from tests.storm.shared import plan_of

TICKS: Final = 120  # of the first run on the tape
MORE: Final = 40  # of the second


@pytest.fixture(scope="module")
def tape(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the tape of two robots that change sides, and are put back to their starts once."""
    recorded = Recorded(tmp_path_factory.mktemp("tape") / "run.swarm", plan_of().to_scenario(), 2).run(TICKS)
    recorded.restart()
    return recorded.run(MORE).done()


def plain(message: object) -> object:
    return msgspec.json.decode(msgspec.json.encode(message))


def frames_of(answer: MomentAnswer) -> dict[str, Any]:
    found = [msgspec.json.decode(frame) for frame in answer.frames]
    return {frame["key"]: frame["message"] for frame in found}


# fmt: off
LINES: Final[dict[str, tuple[bytes, Any]]] = {  # line -> what is told of it: run, tick, a part of the text; or a part of the refusal
    "why":                  (b'["why","r1",{"at":3.0,"run":0}]', (0, 60, "r1 ")),
    "why now":              (b'["why","r2",{}]', (1, MORE - 6, "r2 ")),
    "why at the beginning": (b'["why","r1",{"at":0,"run":0}]', (0, 0, "r1 only listens")),
    "why in the last run":  (b'["why","r1",{"at":1}]', (1, 20, "r1 ")),
    "the past":             (b'["past",null,{"at":3.0,"run":0}]', (0, 60, None)),
    "the past of a robot":  (b'["past","r2",{"at":0.05,"run":1}]', (1, 1, None)),
    "the end of a run":     (b'["past",null,{"run":0}]', (0, TICKS - 6, None)),
    "between two ticks":    (b'["past",null,{"at":3.01,"run":0}]', (0, 60, None)),
    "why nobody":           (b'["why",null,{"at":3.0,"run":0}]', "expected ?robot=NAME"),
    "an unknown robot":     (b'["why","r9",{"at":3.0,"run":0}]', "expected one of r1, r2, got 'r9'"),
    "an unknown selected":  (b'["past","r9",{"at":3.0,"run":0}]', "expected one of r1, r2, got 'r9'"),
    "beyond the end":       (b'["past",null,{"at":2.0,"run":1}]', "expected 0 to 1.95 s, got 2"),
    "no such run":          (b'["past",null,{"at":2.0,"run":7}]', "expected 0 to 1, got 7"),
    "no such time":         (b'["past",null,{"at":-1}]', "expected a question about the tape as JSON"),
    "no such question":     (b'["where","r1",{}]', "expected a question about the tape as JSON"),
    "garbage":              (b"\xff{]", "expected a question about the tape as JSON"),
    "deep garbage":         (b"[" * 20_000, "expected a question about the tape as JSON"),
    "nothing":              (b"", "expected a question about the tape as JSON"),
}
# fmt: on


@pytest.mark.parametrize("name", LINES)
def test_each_line_is_answered_or_refused_with_a_sentence(name: str, tape: Path) -> None:
    line, expected = LINES[name]
    answer = answer_line(Moments(tape), line)
    if isinstance(answer, QuestionRefusal):
        assert isinstance(expected, str), answer.refused
        assert expected in answer.refused
        return
    run, tick, text = expected
    assert (answer.run, round(answer.at * 20, 6), answer.doubt) == (run, tick, None)
    assert (answer.text or "").startswith(str(text or ""))
    assert bool(answer.frames) is (text is None)


@pytest.mark.long("a tape that is run again many times")
def test_the_moment_goes_forward_and_back_and_the_answer_is_always_the_same(tape: Path) -> None:
    moments = Moments(tape)
    for run, tick in ((0, 60), (0, 61), (0, 61), (0, 100), (1, 30), (1, 10), (0, 30)):
        line = msgspec.json.encode(("past", "r1", Question(run=run, at=tick / 20)))
        assert answer_line(moments, line) == answer_line(Moments(tape), line), f"tick {tick} of run {run}"
        assert answer_line(moments, b'["why","r9",{}]') != answer_line(moments, line), "a refusal harms no later answer"


def test_a_past_moment_has_the_frames_that_a_page_got_then(tape: Path) -> None:
    """All messages up to that tick, taken in one after the other, make what the last of each kind make."""
    replay, live = Replay(TapeFile(tape)), RunState()
    wire, moments = Wire(replay), Moments(tape)
    while replay.world.tick <= 100 and (tick := replay.step()) is not None:
        for message in wire.take(tick):
            live.take(message)
    answer = answer_line(moments, b'["past","r1",{"at":5.0,"run":0}]')
    assert isinstance(answer, MomentAnswer)
    frames = frames_of(answer)
    assert set(frames) == {MAP.key, CLOCK.key, TRUTH.key, PLAN.key, EVENTS.key, OVERVIEW, JOINT, LEARNED, RULES, TRAILS}
    assert msgspec.convert(frames[TRUTH.key], Truth) == live.truth
    assert frames[MAP.key] == plain(live.floor)
    assert frames[PLAN.key] == plain(list(live.paths.values()))
    assert list(frames[RULES]) == ["r1"]
    rows = {row["robot"]: row for row in frames[OVERVIEW]["robots"]}
    for name in ("r1", "r2"):
        known = live.progress.robot(name)
        assert rows[name]["activity"] == known.activity.value
        assert (rows[name]["heard"], rows[name]["reached"], rows[name]["stops"]) == ("alive", known.reached_count, 1)
        assert rows[name]["left"] == pytest.approx(known.distance, abs=0.5)
        last, now = frames[TRAILS][name][-1], next(one for one in frames[TRUTH.key]["bodies"] if one["robot"] == name)
        assert last == pytest.approx([now["x"], now["y"]], abs=0.04)


def test_a_robot_that_does_not_answer_is_shown_as_gone(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2)
    tape = recorded.run(40).run(40, away=["r2"]).done()
    for tick, heard in ((39, ["alive", "alive"]), (79, ["alive", "gone"])):
        answer = answer_line(Moments(tape), msgspec.json.encode(("past", None, Question(at=tick / 20))))
        assert isinstance(answer, MomentAnswer)
        assert [row["heard"] for row in frames_of(answer)[OVERVIEW]["robots"]] == heard


def test_a_tape_that_grows_is_opened_again_and_a_cut_one_ends_where_it_is_cut(tape: Path, tmp_path: Path) -> None:
    whole, file, head = tape.read_bytes(), tmp_path / "grows.swarm", TapeFile(tape).size
    file.write_bytes(whole[: head + (len(whole) - head) // 2])
    moments = Moments(file)
    cut = answer_line(moments, b'["past",null,{}]')
    assert isinstance(cut, MomentAnswer)
    assert 0 < cut.at < (TICKS - 1) / 20
    later = msgspec.json.encode(("past", None, Question(run=0, at=cut.at + 0.5)))
    refusal = answer_line(moments, later)
    assert isinstance(refusal, QuestionRefusal)
    assert "the tape ends there" in refusal.refused
    file.write_bytes(whole)
    assert answer_line(moments, later) == answer_line(Moments(tape), later)


@pytest.mark.parametrize(
    ("content", "part"),
    [(b"", "expected the head of a tape"), (b"\xc1 no tape", "expected the head of a tape"), (None, "No such file")],
)
def test_what_is_no_tape_is_a_sentence(content: bytes | None, part: str, tmp_path: Path) -> None:
    file = tmp_path / "no.swarm"
    if content is not None:
        file.write_bytes(content)
    answer = answer_line(Moments(file), b'["past",null,{"at":1}]')
    assert isinstance(answer, QuestionRefusal)
    assert part in answer.refused


# --- the process ---

NOW: Final = Question()


@pytest.fixture
def past(tape: Path) -> Iterator[TapeProcess]:
    with closing(TapeProcess(tape)) as one:
        yield one


def children() -> list[psutil.Process]:
    return [one for one in psutil.Process().children() if "dashboard.box.answer_process" in one.cmdline()]


def test_the_process_starts_with_the_first_question_and_ends_with_the_box(past: TapeProcess) -> None:
    assert children() == []
    answer = msgspec.json.decode(past.ask("why", "r1", NOW), type=MomentAnswer)
    assert (answer.run, round(answer.at * 20, 6)) == (1, MORE - 6)
    with pytest.raises(PeerError, match="expected one of r1, r2, got 'r9'"):
        past.ask("why", "r9", NOW)
    (child,) = children()
    past.close()
    assert not child.is_running()
    with pytest.raises(PeerError, match="the box has ended"):
        past.ask("why", "r1", NOW)


@pytest.mark.long("starts a process of the past twice")
def test_a_process_that_has_died_is_replaced(past: TapeProcess) -> None:
    past.ask("why", "r1", NOW)
    (first,) = children()
    first.kill()
    first.wait()
    assert past.ask("why", "r1", NOW)
    (second,) = children()
    assert second.pid != first.pid


@pytest.mark.long("waits until a process counts as hung")
def test_a_process_that_hangs_is_ended_and_replaced(past: TapeProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    past.ask("why", "r1", NOW)
    (first,) = children()
    os.kill(first.pid, signal.SIGSTOP)
    with monkeypatch.context() as hasty:
        hasty.setattr("dashboard.box.tape_process.ANSWER", 0.1)
        with pytest.raises(PeerError, match=r"expected an answer within 0\.1 s, got none"):
            past.ask("why", "r1", NOW)
    assert not first.is_running()
    assert past.ask("why", "r1", NOW)


@pytest.mark.long("a fleet is replayed")
@pytest.mark.processes
def test_the_past_of_a_fleet_over_http_is_what_was_told_then(
    small: Path, tmp_runtime: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tape = tmp_runtime / "run.swarm"
    flags = ("--dashboard", "box", "--wait", "--serve", "--record", str(tape))
    with Fleet(small, *flags, robots=3, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        address = fleet.await_line("box: http").split()[-1]
        port, bearer = int(address.split(":")[2].split("/")[0]), {"Authorization": f"Bearer {address.split('=')[1]}"}

        def asked(path: str, **body: object) -> tuple[int, Any]:
            return said(port, "POST", path, msgspec.json.encode(body), bearer)

        fleet.await_all(bus)
        status, answer = asked("/past", at=0)
        assert (status, "the run has not begun" in answer["refused"]) == (409, True)
        for topic in (TRUTH, STATE):
            bus.listen(topic)
        assert asked("/action", do="go")[0] == 200
        await_phase(bus, Phase.RUNNING)
        heard: list[Any] = []
        while not heard or heard[-1].tick < 90:
            if isinstance(arrived := bus.receive(1.0), Arrival) and isinstance(arrived.message, Truth | State):
                heard.append(arrived.message)
        truths = [one for one in heard if isinstance(one, Truth) and 50 <= one.tick <= 80]
        assert len(truths) > 3
        for truth in truths[:: len(truths) // 3]:
            status, answer = asked("/past?robot=r2", at=truth.time, run=truth.run)
            assert status == 200, answer
            frames = {frame["key"]: frame["message"] for frame in answer["frames"]}
            assert msgspec.convert(frames[TRUTH.key], Truth) == truth
            assert list(frames[RULES]) == ["r2"]
            status, answer = asked("/why?robot=r2", at=truth.time, run=truth.run)
            assert status == 200, answer
            capsys.readouterr()
            assert main(["why", "r2", str(tape), "--at", f"{truth.time:.2f}"]) == 0
            assert capsys.readouterr().out == f"r2 at {truth.time:.2f} s:\n{answer['text']}\n"
            assert answer["text"] == as_text(open_moment_at(tape, truth.time).why("r2"))
        status, answer = asked("/why?robot=r1")
        assert (status, answer["at"] > 80 / 20) == (200, True), "now: as far as the tape has come"
        status, answer = asked("/past", at=1e5)
        assert (status, "the tape ends there" in answer["refused"]) == (409, True)
        asked("/action", do="restart")
        await_clock(bus, lambda clock: clock.run == 1 and clock.tick >= 20)
        assert [asked("/past", at=0.5)[1]["run"], asked("/past", at=4, run=0)[1]["run"]] == [1, 0]
        fleet.remember_family()
        asked("/action", do="stop")
        fleet.end()
        fleet.assert_nobody_is_left()
