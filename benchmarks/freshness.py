"""At which commit each section of a page was measured, and whether the code it measures has changed since.

A section says ``Measured at commit abc1234 (2026-11-21).`` below its summary; one that says nothing is stale.
"""

import re
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Final

DRIVES: Final = (
    "swarm/fuzzy", "swarm/geometry.py", "swarm/maps", "swarm/messages", "swarm/motion", "swarm/planning",
    "swarm/robot", "swarm/scenario", "swarm/settings.py", "swarm/traffic", "world",
)  # fmt: skip
# fmt: off
MEASURES: Final[dict[str, tuple[str, ...]]] = {  # what each benchmark measures, beside its own file
    "dashboard":       ("dashboard", "swarm/bus", "swarm/messages", "tests/dashboard"),
    "fleet":           ("swarm", "world", "scenarios/paper.yaml"),
    "fuzzy":           ("swarm/fuzzy", "benchmarks/fuzzy_peer.py"),
    "ground":          (*DRIVES, "scenarios", "tests/ground/floors.py"),
    "missions":        (*DRIVES, "scenarios/paper.yaml"),
    "steering":        (*DRIVES, "scenarios", "benchmarks/traffic.py", "tests/shared.py"),
    "storm":           (*DRIVES, "swarm/storm"),
    "planner":         ("swarm/maps", "swarm/planning", "benchmarks/planner_peer.py"),
    "traffic":         (*DRIVES, "scenarios"),
    "traffic_planner": ("swarm/maps", "swarm/traffic"),
}
# fmt: on
STAMP: Final = re.compile(
    r"^Measured at commit (?P<commit>[0-9a-f]{7,40}) \(\d{4}-\d\d-\d\d\)(?P<dirty> \+ uncommitted changes)?\.$", re.M
)


class GitError(Exception):
    """Git cannot say: there is none, or no repository, or no such commit."""


def git(root: Path, *arguments: str) -> str:
    """Ask git in a folder.

    Raises:
        GitError: it cannot answer.
    """
    try:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as fault:
        raise GitError(f"git {' '.join(arguments)}: {fault}") from None
    return done.stdout.strip()


def measured(name: str) -> tuple[str, ...]:
    """List the files and folders that a benchmark's numbers depend on."""
    return (f"benchmarks/{name}.py", "benchmarks/measure.py", *MEASURES[name])


def stamp(root: Path, paths: tuple[str, ...]) -> str:
    """Return the line that says at which commit these paths are measured now; empty where git cannot say."""
    try:
        commit, date = git(root, "log", "-1", "--format=%h %cs").split()
        dirty = " + uncommitted changes" if git(root, "status", "--porcelain", "--", *paths) else ""
    except GitError:
        return ""
    return f"Measured at commit {commit} ({date}){dirty}."


def staleness(root: Path, section: str, paths: tuple[str, ...]) -> str | None:
    """Say in what way a section is older than the code it measures; None where it is not."""
    found = STAMP.search(section)
    if found is None:
        return "commit unknown"
    commit = found["commit"]
    if found["dirty"]:
        return f"measured with uncommitted changes on {commit}"
    try:
        git(root, "cat-file", "-e", f"{commit}^{{commit}}")
    except GitError:
        return f"commit {commit} is not in this repository"
    commits = git(root, "log", "--format=%h", f"{commit}..", "--", *paths).split()
    if commits and git(root, "diff", "--name-only", commit, "HEAD", "--", *paths):
        return f"{len(commits)} commits since {commit} changed what it measures, the last one {commits[0]}"
    if git(root, "status", "--porcelain", "--", *paths):
        return f"uncommitted changes since {commit}"
    return None


def stale(root: Path, sections: Mapping[str, str], paths: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Say of each benchmark whose section is missing or stale why; ``paths`` are what each measures."""
    found = {}
    for name, its_paths in sorted(paths.items()):
        why = staleness(root, sections[name], its_paths) if name in sections else "not on the page"
        if why is not None:
            found[name] = why
    return found
