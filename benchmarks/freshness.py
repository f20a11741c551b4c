"""Checks at which commit each section of a page was measured, and whether the measured code has changed since.

A section states ``Measured at commit abc1234 (2026-11-21).`` below its summary; a section without this line is stale.
"""

import ast
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
MEASURES: Final[dict[str, tuple[str, ...]]] = {  # what each benchmark measures, in addition to its own file
    "box":             ("dashboard", "swarm/bus", "swarm/messages", "benchmarks/dashboard.py"),
    "dashboard":       ("dashboard", "swarm/bus", "swarm/messages", "tests/dashboard"),
    "fleet":           (*DRIVES, "swarm/bus", "scenarios/paper.yaml"),
    "fuzzy":           ("swarm/fuzzy", "benchmarks/fuzzy_peer.py"),
    "ground":          (*DRIVES, "scenarios", "tests/ground/floors.py"),
    "missions":        (*DRIVES, "scenarios/paper.yaml"),
    "secure":          ("swarm", "world", "scenarios/paper.yaml"),
    "scale":           ("swarm", "world", "scenarios/paper.yaml", "benchmarks/scale_peer.py", "benchmarks/scaling"),
    "lifelong":        (*DRIVES,),
    "lease":           ("swarm/bus/settings.py",),
    "slow_network":    (*DRIVES, "swarm/bus", "swarm/launch/proxy.py", "scenarios"),
    "soak":            ("swarm", "world", "scenarios/depot.yaml", "benchmarks/scaling/fleets.py"),
    "steering":        (*DRIVES, "scenarios", "benchmarks/traffic.py", "tests/shared.py"),
    "storm":           (*DRIVES, "world/storm"),
    "other_worlds":    (*DRIVES, "world/storm/history/drawing.py"),
    "survival":        (*DRIVES, "swarm/bus"),
    "wire":            ("swarm/bus", "swarm/messages", "world"),
    "planner":         ("swarm/maps", "swarm/planning", "benchmarks/planner_peer.py"),
    "traffic":         (*DRIVES, "scenarios"),
    "traffic_planner": ("swarm/maps", "swarm/traffic"),
}
# fmt: on
STAMP: Final = re.compile(
    r"^Measured at commit (?P<commit>[0-9a-f]{7,40}) \(\d{4}-\d\d-\d\d\)(?P<dirty> \+ uncommitted changes)?\.$", re.M
)


class GitError(Exception):
    """Git cannot answer: it is not installed, or there is no repository or no such commit."""


def git(root: Path, *arguments: str) -> str:
    """Run git in a folder and return its output.

    Raises:
        GitError: git is not there, or fails.
    """
    try:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as fault:
        raise GitError(f"git {' '.join(arguments)}: {fault}") from None
    return done.stdout.strip()


def measured(name: str) -> tuple[str, ...]:
    """Return the files and folders that a benchmark's numbers depend on."""
    return (f"benchmarks/{name}.py", "benchmarks/measure.py", *MEASURES[name])


def stamp(root: Path, paths: tuple[str, ...]) -> str:
    """Return the line that states the present commit of these paths; empty if git cannot answer."""
    try:
        commit, date = git(root, "log", "-1", "--format=%h %cs").split()
        dirty = " + uncommitted changes" if git(root, "status", "--porcelain", "--", *paths) else ""
    except GitError:
        return ""
    return f"Measured at commit {commit} ({date}){dirty}."


def staleness(root: Path, section: str, paths: tuple[str, ...]) -> str | None:
    """Return why a section is older than the code that it measures; None if it is not."""
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
    changed = git(root, "diff", "--name-only", "--no-renames", commit, "HEAD", "--", *paths).splitlines()
    changed = [file for file in changed if not only_words_changed(root, commit, file)]
    if changed:
        commits = git(root, "log", "--format=%h", f"{commit}..", "--", *changed).split()
        return f"{len(commits)} commits since {commit} changed what it measures, the last one {commits[0]}"
    if git(root, "status", "--porcelain", "--", *paths):
        return f"uncommitted changes since {commit}"
    return None


def only_words_changed(root: Path, commit: str, file: str) -> bool:
    """Return True if a Python file differs from its version at a commit by comments and docstrings only."""
    if not file.endswith(".py"):
        return False
    try:
        before, now = (ast.parse(git(root, "show", f"{version}:{file}")) for version in (commit, "HEAD"))
    except (GitError, SyntaxError):  # it is new, or gone
        return False
    return ast.dump(without_docstrings(before)) == ast.dump(without_docstrings(now))


def without_docstrings(tree: ast.Module) -> ast.Module:
    """Return the tree without the docstrings of the module, its classes and its functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:]
    return tree


def stale(root: Path, sections: Mapping[str, str], paths: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Return for each benchmark whose section is missing or stale the reason; ``paths`` are what each measures."""
    found = {}
    for name, its_paths in sorted(paths.items()):
        why = staleness(root, sections[name], its_paths) if name in sections else "not on the page"
        if why is not None:
            found[name] = why
    return found
