"""Each section of docs/benchmarks.md states the commit at which it was measured; stale sections are listed."""

import ast
from pathlib import Path

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import mutation, survival
from benchmarks.freshness import MEASURES, STAMP, GitError, git, measured, stale, staleness, stamp
from benchmarks.harmless import HARMLESS
from benchmarks.mutants import missing
from benchmarks.plantable import mutations
from swarm.scenario.check import check
from swarm.scenario.load import load
from world.snapshot_file import read

ROOT = Path(__file__).parents[1]
PATHS = ("code", "case.yaml")


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a repository with measured code, a case and a page, all committed."""
    for name in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{name}_NAME", "somebody")
        monkeypatch.setenv(f"GIT_{name}_EMAIL", "somebody@example.org")
        monkeypatch.setenv(f"GIT_{name}_DATE", "2026-11-21T12:00:00Z")
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", "/dev/null")
    git(tmp_path, "init", "--quiet")
    for file in ("code/a.py", "code/b.py", "case.yaml", "page.md"):
        commit(tmp_path, file, "first")
    return tmp_path


def commit(root: Path, file: str, text: str) -> str:
    """Change a file and commit it."""
    (root / file).parent.mkdir(exist_ok=True)
    (root / file).write_text(text)
    git(root, "add", file)
    git(root, "commit", "--quiet", "--message", f"{file}: {text}")
    return git(root, "log", "-1", "--format=%h")


def written(root: Path) -> str:
    return f"A summary.\n\n{stamp(root, PATHS)}\n\n| a table |\n"


def test_a_section_is_stamped_with_the_commit_it_is_measured_at(repository: Path) -> None:
    here = git(repository, "log", "-1", "--format=%h")
    assert stamp(repository, PATHS) == f"Measured at commit {here} (2026-11-21)."
    (repository / "page.md").write_text("the page itself is not measured")
    assert stamp(repository, PATHS) == f"Measured at commit {here} (2026-11-21)."
    (repository / "code" / "new.py").write_text("")
    assert stamp(repository, PATHS) == f"Measured at commit {here} (2026-11-21) + uncommitted changes."


def test_a_section_is_stale_once_what_it_measures_has_changed(repository: Path) -> None:
    section = written(repository)
    here = git(repository, "log", "-1", "--format=%h")
    assert staleness(repository, section, PATHS) is None
    commit(repository, "page.md", "second")
    assert staleness(repository, section, PATHS) is None, "nothing measured has changed"
    (repository / "code" / "a.py").write_text("second")
    assert staleness(repository, section, PATHS) == f"uncommitted changes since {here}"
    first = commit(repository, "code/a.py", "second")
    why = staleness(repository, section, PATHS)
    assert why == f"1 commits since {here} changed what it measures, the last one {first}"
    last = commit(repository, "case.yaml", "second")
    why = staleness(repository, section, PATHS)
    assert why == f"2 commits since {here} changed what it measures, the last one {last}"
    assert staleness(repository, section, ("code/b.py",)) is None
    assert staleness(repository, written(repository), PATHS) is None, "measured anew"


def test_a_change_taken_back_makes_nothing_stale(repository: Path) -> None:
    section = written(repository)
    commit(repository, "code/a.py", "second")
    assert staleness(repository, section, PATHS) is not None
    commit(repository, "code/a.py", "first")
    assert staleness(repository, section, PATHS) is None


# fmt: off
EDITS = {  # of a file that says PLAIN: whether the section is stale then
    "a comment":           ("def f():\n    return 1  # one\n", False),
    "a docstring":         ('"""A file."""\n\n\ndef f():\n    """Return one."""\n    return 1\n', False),
    "a number":            ("def f():\n    return 2\n", True),
    "a text that is used": ("def f():\n    return '1'\n", True),
    "no Python any more":  ("def f(:\n", True),
}
# fmt: on
PLAIN = "def f():\n    return 1\n"


@pytest.mark.parametrize("name", EDITS)
def test_words_make_nothing_stale(name: str, repository: Path) -> None:
    text, expected = EDITS[name]
    commit(repository, "code/a.py", PLAIN)
    section = written(repository)
    commit(repository, "code/a.py", text)
    assert (staleness(repository, section, PATHS) is not None) is expected


def test_what_cannot_be_known_is_stale(repository: Path) -> None:
    (repository / "case.yaml").write_text("in the middle of a change")
    dirty = written(repository)
    here = commit(repository, "case.yaml", "second")
    assert "measured with uncommitted changes" in (staleness(repository, dirty, PATHS) or "")
    assert staleness(repository, "A summary.\n\n| a table |\n", PATHS) == "commit unknown"
    gone = "Measured at commit 0123456 (2026-11-21)."
    assert staleness(repository, gone, PATHS) == "commit 0123456 is not in this repository"
    sections = {"old": "no stamp", "new": f"Measured at commit {here} (2026-11-21)."}
    assert stale(repository, sections, dict.fromkeys(["old", "new", "never"], PATHS)) == {
        "never": "not on the page",
        "old": "commit unknown",
    }


def test_without_a_repository_nothing_is_stamped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert stamp(tmp_path, PATHS) == ""
    with pytest.raises(GitError, match="git log"):
        git(tmp_path, "log")


# fmt: off
LINES = {
    "Measured at commit abc1234 (2026-11-21).":                       ("abc1234", False),
    "Measured at commit abc1234 (2026-11-21) + uncommitted changes.": ("abc1234", True),
    "text\n\nMeasured at commit 0123456789 (2026-11-21).\n\ntext":    ("0123456789", False),
    "It was Measured at commit abc1234 (2026-11-21).":                None,
    "Measured at commit xyz (2026-11-21).":                           None,
    "Measured at commit abc1234.":                                    None,
    "":                                                               None,
}
# fmt: on


@pytest.mark.parametrize("line", LINES)
def test_stamps_are_read_as_they_are_written(line: str) -> None:
    found = STAMP.search(line)
    assert (None if found is None else (found["commit"], found["dirty"] is not None)) == LINES[line]


def test_every_benchmark_says_what_it_measures() -> None:
    assert set(MEASURES) == set(benchmarks.names())
    for name in MEASURES:
        assert [path for path in measured(name) if not (ROOT / path).exists()] == [], name


def test_the_page_keeps_the_stamp_of_each_section(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmarks, "PAGE", tmp_path / "benchmarks.md")
    stamps = {
        name: f"Measured at commit {digit * 7} (2026-11-21)." for name, digit in (("fuzzy", "a"), ("ground", "b"))
    }
    for name, stamped in stamps.items():  # one after the other: the second leaves the first as it was
        page = benchmarks.page({name: benchmarks.section(name, stamped, "\n| a table |\n\n")})
        (tmp_path / "benchmarks.md").write_text(page)
    kept = benchmarks.kept()
    assert kept == {name: f"{benchmarks.summary(name)}\n\n{stamps[name]}\n\n| a table |" for name in stamps}
    assert benchmarks.section("fuzzy", "", "text") == f"{benchmarks.summary('fuzzy')}\n\ntext"


# --- planted faults ---

# fmt: off
PLANTED: dict[str, list[str]] = {  # a line of code: what it becomes
    "a = b < c":                          ["a = (b >= c)"],
    "a = b not in c":                     ["a = (b in c)"],
    "a = b is c":                         ["a = (b is not c)"],
    "a = b and c":                        ["a = (b or c)"],
    "a = not b":                          ["a = (b)"],
    "a = b - c":                          ["a = (b + c)"],
    "a += b":                             ["a -= b"],
    "a = min(b, c)":                      ["a = max(b, c)"],
    "a = b * c":                          ["a = (b / c)"],
    "a = b / c":                          ["a = (b * c)"],
    "a = -b":                             ["a = (b)"],
    "a = f(True)":                        ["a = f(False)"],
    "return f(3)":                        ["return f(300)", "return f(4)", "return f(6)"],
    "return f(0.0)":                      ["return f(1.0)"],
    "return f(1)":                        ["return f(100)", "return f(2)"],
    "f(a)":                               ["None"],
    "f(a).b":                             [],
    "a = b.reshape(-1, 2)":               [],
    "A = 3":                              ["A = 300"],
    "if a: b = c":                         ["if (False): b = c"],
    "def f() -> bool: return a":          ["def f() -> bool: return (not (a))"],
    "def f() -> int: return a":           [],
    "def f(a: Tag[3]) -> Tag[4]: ...":    [],
    "a: Tag[3] = b":                      [],
    "T = Annotated[int, Meta(ge=3)]":     [],
    "@cached(3)\ndef f(): ...":           [],
    "class A(B, frozen=True): ...":       [],
    "a = f(b, strict=True)":              [],
    "raise E(a + b)":                     [],
    "assert a < b":                       [],
    "a = f'{b + c}'":                     [],
    "'3 < 4'":                            [],
}
# fmt: on


@pytest.mark.parametrize("line", PLANTED)
def test_faults_are_planted_in_code_and_nowhere_else(line: str) -> None:
    made = []
    for one in mutations("a.py", line):
        planted = line.encode()[: one.start] + one.new.encode() + line.encode()[one.end :]
        ast.parse(planted)
        made.append(planted.decode())
    assert sorted(made) == sorted(PLANTED[line])


FAILED = "FAILED tests/a.py::test_b[1] - assert 1 == 2\n1 failed, 3 passed in 0.5s"
UNREADABLE = "ERROR tests/a.py - NameError: name 'b' is not defined\n1 error in 0.5s"


@pytest.mark.parametrize(
    ("code", "said", "caught_by"),
    [
        (0, "4 passed in 0.5s", None),
        (1, FAILED, "tests/a.py::test_b[1]"),
        (1, "ERROR tests/a.py::test_b - ValueError\n1 error in 0.5s", "tests/a.py::test_b"),
        (1, UNREADABLE, "import of tests/a.py"),
        (2, UNREADABLE, "import of tests/a.py"),
        (None, "", "no end"),
        (-11, "", "signal 11"),
    ],
)
def test_what_caught_a_planted_fault_is_named(code: int | None, said: str, caught_by: str | None) -> None:
    assert mutation.verdict(code, said) == caught_by


@pytest.mark.parametrize("code", [1, 2, 3, 4, 5])
def test_a_run_of_pytest_that_went_wrong_by_itself_catches_nothing(code: int) -> None:
    with pytest.raises(RuntimeError, match=f"pytest ended with {code}"):
        mutation.verdict(code, "no tests ran in 0.01s")


def test_the_same_seed_draws_the_same_faults_each_in_a_file_of_its_room_with_tests() -> None:
    for room in mutation.ROOMS:
        drawn = mutation.drawn(room, 10, 3)
        assert drawn == mutation.drawn(room, 10, 3) != mutation.drawn(room, 10, 4)
        assert len({(one.file, one.start, one.end) for one in drawn}) == 10
        for one in drawn:
            assert mutation.room_of(one.file) == room
            assert (ROOT / one.file).read_text(encoding="utf-8").splitlines()[one.line - 1].strip() == one.code
    for tests in mutation.TESTS.values():
        assert [path for path in tests if not (ROOT / path.split("::")[0]).exists()] == []


def test_what_does_no_harm_can_still_be_planted() -> None:
    for file, line, what in HARMLESS:
        planted = mutations(file, (ROOT / file).read_text(encoding="utf-8"))
        assert any(one.code == line and one.what.startswith(what) for one in planted), (file, line, what)


def test_every_planted_fault_is_a_text_of_the_code() -> None:
    assert missing() == []


def test_the_snapshots_that_are_timed_are_those_of_a_world(tmp_path: Path) -> None:
    scenario = tmp_path / "hall.yaml"
    scenario.write_text(survival.hall(), encoding="utf-8")
    seconds, size = survival.snapshots(scenario, 2, 2)
    file = scenario.with_suffix(".snapshot")
    found = read(file, check(load(scenario), 2, 1).scenario, 2, 1)
    assert seconds > 0.0
    assert size == file.stat().st_size
    assert found.state.world.tick == 2 * survival.TICKS
    assert set(found.host.states) == set(found.host.plans) == {"r1", "r2"}
