"""Each section of docs/benchmarks.md states the commit at which it was measured; stale sections are listed."""

from pathlib import Path

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import survival
from benchmarks.freshness import MEASURES, STAMP, GitError, git, measured, stale, staleness, stamp
from benchmarks.mutants import missing
from swarm.scenario.check import check
from swarm.scenario.load import load
from world.saving.snapshot_file import read

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
    assert found.state.tick == 2 * survival.TICKS
    assert set(found.host.states) == set(found.host.plans) == {"r1", "r2"}
