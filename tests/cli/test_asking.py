"""`swarm why` and `swarm open`: they run a run again; one sentence for what is wrong."""

import json
from pathlib import Path

import pytest

from swarm.cli import main
from tests.storm.shared import plan_of
from tests.tape.made import made

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def plan(tmp_path: Path) -> str:
    """A plan of a storm in which r2 dies."""
    path = tmp_path / "plan.yaml"
    fault = [{"robot": "r2", "kind": "dead", "tick": 40}]
    path.write_text(plan_of(faults=fault).to_yaml(), encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def tape(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The tape of a run of two robots, two seconds long."""
    return str(made(tmp_path_factory.mktemp("asking") / "run.swarm", ticks=40))


def test_why_names_the_cause_in_a_plan_of_a_storm(plan: str, capsys: Capture) -> None:
    assert main(["why", "r2", plan, "--at", "3"]) == 0
    assert capsys.readouterr().out.startswith("r2 at 3.00 s:\nr2 has not answered since 1.95 s")
    assert main(["why", "r2", plan, "--at", "3", "--json"]) == 0
    (cause,) = json.loads(capsys.readouterr().out)
    assert (cause["robot"], cause["clause"], cause["depth"]) == ("r2", "gone", 0)


def test_why_names_the_cause_on_a_tape(tape: str, capsys: Capture) -> None:
    assert main(["why", "r1", tape, "--at", "0.5"]) == 0
    assert capsys.readouterr().out.startswith("r1 at 0.50 s:\nr1 only listens")


def test_why_proves_what_it_names(plan: str, tape: str, capsys: Capture) -> None:
    assert main(["why", "r1", tape, "--at", "0.5", "--prove"]) == 0
    assert capsys.readouterr().out.endswith(
        "Nothing to prove: the robot does not wait, or for nothing that can be changed.\n"
    )
    assert main(["why", "r2", plan, "--at", "3", "--prove"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("With r2 answering, r2 waits ")
    assert main(["why", "r2", plan, "--at", "3", "--prove", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [cause["clause"] for cause in found["causes"]] == ["gone"]
    assert [(proof["change"], proof["before"]) for proof in found["proofs"]] == [("r2 answering", None)]


def test_open_prints_the_state_in_a_shipped_scenario(capsys: Capture) -> None:
    assert main(["open", "corridor", "r1", "--at", "8", "--json"]) == 0
    state = json.loads(capsys.readouterr().out)
    assert (state["robot"], state["tick"], state["traffic"]["knows"].keys()) == ("r1", 160, {"r2"})


def test_open_prints_the_state_on_a_tape(tape: str, capsys: Capture) -> None:
    assert main(["open", tape, "r2", "--at", "1.9"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("robot: r2\ntick: 38\n")
    assert "\ntraffic:\n" in said


def test_the_robot_may_stand_before_and_behind_the_time(tape: str, capsys: Capture) -> None:
    orders = (
        ["open", tape, "--at", "1.9", "r2"],
        ["open", tape, "r2", "--at", "1.9"],
        ["open", "--at", "1.9", tape, "r2"],
    )
    said = set()
    for words in orders:
        assert main(words) == 0
        said.add(capsys.readouterr().out)
    assert len(said) == 1
    one_sentence(["open", tape, "--at", "1.9", "r1", "r2"], "unrecognized arguments: r2", capsys)


def test_the_shell_asks_a_moment_and_goes_on(tape: str, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    typed = iter(["print(moment.past.tick)", "why('r1')", "step(5)", "print(state('r2').tick)"])

    def read(prompt: str = "") -> str:
        try:
            return next(typed)
        except StopIteration:
            raise EOFError from None

    monkeypatch.setattr("builtins.input", read)
    assert main(["open", tape, "--at", "0.5", "--shell"]) == 0
    said = capsys.readouterr()
    assert said.out == "10\nr1 only listens" + said.out.split("r1 only listens", 1)[1]
    assert said.out.endswith("'at 0.75 s'\n15\n")
    assert " at 0.50 s: " in said.err


def test_open_without_a_robot_has_a_line_for_each(tape: str, capsys: Capture) -> None:
    assert main(["open", tape, "--at", "1.9"]) == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert head == "at 1.90 s:"
    assert [line.split(":")[0] for line in lines] == ["r1", "r2"]
    assert main(["open", tape, "--at", "1.9", "--json"]) == 0
    assert [state["robot"] for state in json.loads(capsys.readouterr().out)] == ["r1", "r2"]


def one_sentence(words: list[str], text: str, capsys: Capture) -> None:
    assert main(words) == 2
    said = capsys.readouterr()
    assert text in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""


@pytest.mark.parametrize(
    ("robot", "words", "text"),
    [
        ("r9", ["corridor", "--at", "2"], "robot: expected one of r1, r2, got 'r9'"),
        ("r1", ["corridor", "--at", "-1"], "--at: expected 0 to 1e6 s, got -1"),
        ("r1", ["corridor", "--at", "nan"], "--at: expected 0 to 1e6 s, got nan"),
        (
            "r1",
            ["corridor", "--at", "1", "--robots", "0"],
            "--robots: expected 1 to 1000, or how many of each kind, such as scout=6,cart=2, got '0'",
        ),
        ("r1", ["corridor", "--at", "1", "--robots", "3"], "own_targets: expected a list for each of 3 robots"),
        ("r1", ["corridor", "--at", "1", "--seed", "-1"], "--seed: expected 0 to 2**53, got -1"),
        ("r1", ["corridor", "--at", "1", "--run", "0"], "--run: expected a tape, got corridor"),
        ("r1", ["no_such.yaml", "--at", "1"], "no_such.yaml"),
        ("r1", ["no_such.swarm", "--at", "1"], "no_such.swarm: expected a tape, got No such file"),
    ],
)
def test_what_is_wrong_is_one_sentence(robot: str, words: list[str], text: str, capsys: Capture) -> None:
    one_sentence(["why", robot, *words], text, capsys)
    one_sentence(["open", words[0], robot, *words[1:]], text, capsys)


@pytest.mark.parametrize(
    ("robot", "words", "text"),
    [
        ("r9", ["--at", "1"], "robot: expected one of r1, r2, got 'r9'"),
        ("r1", ["--at", "2"], "--at: expected 0 to 1.95 s, got 2"),
        ("r1", ["--at", "1", "--run", "1"], "--run: expected 0, got 1"),
        ("r1", ["--at", "1", "--robots", "2"], "--robots: expected none with a tape, which has its own, got 2"),
        ("r1", ["--at", "1", "--seed", "1"], "--seed: expected none with a tape, which has its own, got 1"),
    ],
)
def test_what_is_wrong_with_a_tape_is_one_sentence(
    tape: str, robot: str, words: list[str], text: str, capsys: Capture
) -> None:
    one_sentence(["why", robot, tape, *words], text, capsys)


def test_a_time_after_the_end_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    calm = tmp_path / "calm.yaml"
    calm.write_text(plan_of().to_yaml(), encoding="utf-8")
    one_sentence(["why", "r1", str(calm), "--at", "1e6"], "got 1e+06; the run ends there", capsys)


def test_a_tape_that_is_cut_ends_at_its_last_whole_tick(tape: str, tmp_path: Path, capsys: Capture) -> None:
    cut = tmp_path / "cut.swarm"
    cut.write_bytes(Path(tape).read_bytes()[:-20])
    one_sentence(["why", "r1", str(cut), "--at", "1.95"], "the tape ends there", capsys)
    assert main(["why", "r1", str(cut), "--at", "1.5"]) == 0


def test_a_moment_after_an_answer_that_differs_is_told_with_status_1(tmp_path: Path, capsys: Capture) -> None:
    path = made(tmp_path / "run.swarm", ticks=40)
    content = bytearray(path.read_bytes())
    content[-20] ^= 1  # in the checks of the last rows
    path.write_bytes(content)
    assert main(["why", "r1", str(path), "--at", "1.95"]) == 1
    said = capsys.readouterr()
    assert said.err.startswith("swarm: the first answer that is not as it was is that of r")
    assert said.out.startswith("r1 at 1.95 s:")
    assert main(["open", str(path), "--at", "1.95"]) == 1
    assert main(["why", "r1", str(path), "--at", "1.5"]) == 0


def test_a_file_that_is_no_tape_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "odd.swarm"
    path.write_text("[1, 2", encoding="utf-8")
    one_sentence(["why", "r1", str(path), "--at", "1"], "expected the head of a tape", capsys)


def test_a_tape_whose_run_never_began_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    path = made(tmp_path / "none.swarm", ticks=0)
    one_sentence(["why", "r1", str(path), "--at", "0"], "expected ticks, got none", capsys)


def test_a_file_that_is_neither_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "odd.yaml"
    for text in ("[1, 2", "storm: 7\n", "name: x\n"):
        path.write_text(text, encoding="utf-8")
        one_sentence(["why", "r1", str(path), "--at", "1"], "swarm: ", capsys)
