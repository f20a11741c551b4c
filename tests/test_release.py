"""A release is one command: what it names, what it builds, and what it refuses."""

import subprocess
import sys
import tarfile
import zipfile
from email.parser import Parser
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from tests.shared import ROOT

COMMAND: Final = [sys.executable, "deploy/release.py"]
GIT: Final = ("git", "-c", "user.name=r1", "-c", "user.email=r1@localhost")
WORKFLOW: Final = ROOT / ".github" / "workflows" / "ci.yml"


def git(folder: Path, *words: str) -> str:
    done = subprocess.run([*GIT, *words], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a copy of what is in this folder, as the first commit of a repository of its own."""
    if not (ROOT / ".git").exists():
        pytest.skip("this is no checkout: git lists the files of the copy")
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout.split("\n")  # fmt: skip
    place = tmp_path / "project"
    for name in filter(None, listed):
        if (ROOT / name).is_file():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_bytes((ROOT / name).read_bytes())
    git(place, "init", "--quiet")
    git(place, "config", "user.name", "r1")
    git(place, "config", "user.email", "r1@localhost")
    git(place, "add", "--all")
    git(place, "commit", "--quiet", "--message", "All of it")
    return place


def released(project: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *words], cwd=project, capture_output=True, text=True, check=False)


@pytest.mark.long("builds the wheel and the site of a copy of the project")
def test_a_release_is_named_built_and_summed(project: Path) -> None:
    done = released(project, "7.1.0", "--home", "https://example.org/fleets/zenoh-swarm", "--no-images")
    assert done.returncode == 0, done.stderr
    assert git(project, "log", "--format=%s", "-1").strip() == "Release 7.1.0"
    assert git(project, "tag", "--points-at", "HEAD").strip() == "v7.1.0"
    assert "\n## 7.1.0 - " in (project / "CHANGELOG.md").read_text()
    out = project / "build" / "release"
    assert {path.name for path in out.iterdir()} == {
        "SHA256SUMS", "zenoh_swarm-7.1.0-py3-none-any.whl", "zenoh_swarm-7.1.0.tar.gz", "zenoh-swarm-7.1.0-site.tar.gz",
    }  # fmt: skip
    subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=out, check=True, capture_output=True)
    with zipfile.ZipFile(out / "zenoh_swarm-7.1.0-py3-none-any.whl") as wheel:
        metadata = Parser().parsestr(wheel.read("zenoh_swarm-7.1.0.dist-info/METADATA").decode())
    assert metadata["Version"] == "7.1.0"
    assert "Homepage, https://example.org/fleets/zenoh-swarm" in metadata.get_all("Project-URL", [])
    assert "Typing :: Typed" in metadata.get_all("Classifier", [])
    with tarfile.open(out / "zenoh-swarm-7.1.0-site.tar.gz") as site:
        page = site.extractfile("zenoh-swarm-7.1.0-site/wire.html")
        assert page is not None
        assert b"zenoh-swarm 7.1.0" in page.read()

    again = released(project, "7.1.0")
    assert (again.returncode, "which has a tag" in again.stderr) == (2, True)


# fmt: off
REFUSED: Final = {  # words: what is said
    ("one",):                        "expected a version such as 0.2.0 or 0.2.0rc1, got 'one'",
    ("7.1.0", "--home", "ftp://x"):  "--home: expected https://HOST/OWNER/PROJECT, got 'ftp://x'",
}
# fmt: on


@pytest.mark.parametrize("words", REFUSED)
def test_a_wrong_release_is_refused(words: tuple[str, ...], project: Path) -> None:
    done = released(project, *words)
    assert (done.returncode, done.stderr) == (2, f"release: {REFUSED[words]}\n")
    assert git(project, "status", "--porcelain") == "", "it can be tried again"


def test_a_release_of_what_is_not_committed_or_not_new_is_refused(project: Path) -> None:
    changes = project / "CHANGELOG.md"
    changes.write_text("# Changelog\n\n## Unreleased\n\n## 0.1.0 - 2026-01-01\n\n- All.\n")
    assert "changes that are not committed" in released(project, "7.1.0").stderr
    git(project, "commit", "--quiet", "--all", "--message", "Nothing new")
    assert "expected something under `## Unreleased`, got nothing" in released(project, "7.1.0").stderr


def test_the_workflow_runs_targets_of_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    jobs: dict[str, Any] = yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))["jobs"]
    runs = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    made = [run.removeprefix("make ") for run in runs if run.startswith("make ")]
    assert {"check", "test-all", "release"} == set(made)
    assert all(f"\n{target}:" in makefile for target in made)
    assert [run for run in runs if not run.startswith(("make ", "sudo apt-get install"))] == []


def test_each_python_that_is_classified_is_tried_by_the_workflow() -> None:
    tried = yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))["jobs"]["check"]["strategy"]["matrix"]["python"]
    listed = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert [version for version in tried if f'Python :: {version}"' not in listed] == ["3.14"], "3.14 is tried first"


@pytest.mark.parametrize("file", ["deploy/release.py", "docs/website.py"])
def test_the_examples_of_these_files_are_true(file: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "doctest", file], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "")
