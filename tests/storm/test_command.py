"""`swarm storm`: its output, the files of its findings, and one sentence per error."""

import json
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from swarm.cli import main
from swarm.storm.command import INTERRUPTED, StormOptions, run
from swarm.storm.output import Lines
from swarm.storm.plans.plan import read
from swarm.storm.results import Job, RunResult, perform
from tests.storm import works
from tests.storm.shared import plan_of

Capture = pytest.CaptureFixture[str]


def options(**fields: object) -> StormOptions:
    return StormOptions(**{"seeds": range(10), "jobs": 2, "as_json": True} | fields)  # type: ignore[arg-type]


def test_seeds_that_keep_the_laws_end_with_0(capsys: Capture) -> None:
    assert run(options(profiles=("all", "calm")), works.passes) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["runs"], told["failed"], told["failures"]) == (20, 0, [])


def test_failures_end_with_1_and_leave_their_plans(tmp_path: Path, capsys: Capture) -> None:
    assert run(options(plans=tmp_path / "new" / "plans"), works.fails_on_odd) == 1
    said = capsys.readouterr()
    assert [one["seed"] for one in json.loads(said.out)["failures"]] == [1, 3, 5, 7, 9]
    assert "all 3: no contact, tick 7: r1 touched wall" in said.err
    kept = sorted((tmp_path / "new" / "plans").iterdir())
    assert [path.name for path in kept] == [f"all-{seed}.yaml" for seed in (1, 3, 5, 7, 9)]
    assert [read(path).seed for path in kept] == [1, 3, 5, 7, 9]


def test_a_job_that_dies_breaks_the_law_of_no_exception(capsys: Capture) -> None:
    assert run(options(), works.dies_on_three) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["runs"] == 10
    (failure,) = told["failures"]
    assert (failure["seed"], failure["law"], failure["text"]) == (
        3,
        "no exception",
        "its process was ended by signal 9",
    )


def test_each_seed_leaves_a_line_and_lines_of_before_stay(tmp_path: Path) -> None:
    path = tmp_path / "lines.jsonl"
    run(options(results=path), works.fails_on_odd)
    run(options(results=path, seeds=range(10, 12)), works.passes)
    lines = works.lines_of(path)
    assert sorted(line["seed"] for line in lines) == list(range(12))
    assert {line["seed"] for line in lines if line["violations"]} == {1, 3, 5, 7, 9}


def test_a_full_disk_is_said_and_the_lines_are_printed(capsys: Capture) -> None:
    assert run(options(results=Path("/dev/full")), works.passes) == 2
    said = capsys.readouterr()
    first, *lines = said.err.splitlines()
    assert first == "--results /dev/full: No space left on device; the missing lines follow here"
    assert sorted(json.loads(line)["seed"] for line in lines) == list(range(10))
    assert json.loads(said.out)["runs"] == 10


def test_a_folder_for_plans_that_is_none_is_said_and_the_summary_printed(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "file").touch()
    assert run(options(plans=tmp_path / "file"), works.fails_on_odd) == 1
    said = capsys.readouterr()
    assert said.err.count("expected a file that can be written") == 5
    assert json.loads(said.out)["failed"] == 5


@pytest.mark.parametrize(("work", "status"), [(works.passes, INTERRUPTED), (works.fails_on_odd, 1)])
def test_ctrl_c_prints_what_has_been_found(
    work: Callable[[Job], RunResult], status: int, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    added: list[RunResult] = []

    def add(self: Lines, result: RunResult) -> None:
        added.append(result)
        if len(added) == 3:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Lines, "add", add)
    assert run(options(jobs=1), work) == status
    told = json.loads(capsys.readouterr().out)
    assert (told["runs"], told["interrupted"]) == (3, True)


def test_a_plan_shown_is_the_plan_that_runs(tmp_path: Path, capsys: Capture) -> None:
    assert main(["storm", "--show", "7", "--profile", "claims"]) == 0
    path = tmp_path / "plan.yaml"
    path.write_text(capsys.readouterr().out)
    assert path.read_text().startswith("# ")
    assert perform(Job("claims", 7, read(path))).digest == perform(Job("claims", 7)).digest != ""


def test_plan_files_run_instead_of_seeds_and_twice(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(plan_of().to_yaml())
    assert main(["storm", str(path), str(path), "--json", "--twice", "--jobs", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["runs"], told["failed"]) == (2, 0)


# fmt: off
REFUSED = [
    (["--seeds", "none"],                   "--seeds: expected a number from 1 on, or A:B, got 'none'"),
    (["--seeds", "0"],                      "--seeds: expected a number from 1 on, or A:B, got '0'"),
    (["--seeds", "5:5"],                    "--seeds: expected A:B with A below B, got '5:5'"),
    (["--seeds", "9:5"],                    "--seeds: expected A:B with A below B, got '9:5'"),
    (["--seeds", ":5"],                     "--seeds: expected A:B with A below B, got ':5'"),
    (["--seeds", "1:9007199254740993"],     "--seeds: expected A:B with A below B"),
    (["--seeds", "1:5", "--start", "2"],    "--seeds: expected either A:B or a number with --start, got both"),
    (["--start", "-1"],                     "--start: expected 0 to 2**53, got -1"),
    (["--start", "one"],                    "argument --start: invalid int value: 'one'"),
    (["--jobs", "0"],                       "--jobs: expected 1 to 256, got 0"),
    (["--profile", "weather"],              "--profile: expected the name of a profile, got 'weather'; known: all, asleep"),
    (["--profile", "all,"],                 "--profile: expected the name of a profile, got ''"),
    (["--over", "sea"],                     "argument --over: invalid choice: 'sea'"),
    (["--over", "processes", "--twice"],    "expected either --twice or --over processes, got both"),
    (["--shrink", "many"],                  "--shrink: expected a seed, 0 to 2**53, got 'many'"),
    (["--shrink", "none.yaml"],             "none.yaml: expected a file, found none"),
    (["--show", "many"],                    "--show: expected a seed, 0 to 2**53, got 'many'"),
    (["--show", "1", "--profile", "all,calm"], "--profile: expected one name, got all, calm"),
    (["none.yaml"],                         "none.yaml: expected a file, found none"),
    (["none.yaml", "--seeds", "3"],         "expected either plan files or --seeds and --profile, got both"),
    (["--results", "/none/lines.jsonl"],    "--results /none/lines.jsonl: expected a file that can be written"),
]
# fmt: on


@pytest.mark.parametrize(("arguments", "sentence"), REFUSED, ids=[" ".join(row[0]) for row in REFUSED])
def test_a_wrong_command_gets_one_sentence(arguments: list[str], sentence: str, capsys: Capture) -> None:
    assert main(["storm", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("swarm: ")
    assert said.err.count("\n") == 1
    assert sentence in said.err
