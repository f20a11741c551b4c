"""The wheel in an empty environment, with its declared dependencies only, used from another folder."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterator
from contextlib import contextmanager
from fcntl import LOCK_EX, flock
from importlib.metadata import distributions, files, requires
from pathlib import Path
from typing import Final
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import pytest
from packaging.requirements import Requirement

from swarm.installation import EXTRAS
from tests.shared import ROOT

PARTS: Final = ("swarm", "world", "dashboard", "scenarios")
FILES: Final = ("pyproject.toml", "README.md", "LICENSE")
MISSION: Final = ("run", "paper", "--robots=2", "--pace=max", "--dashboard=off", "--report=report.json", "--quiet")
LOADED: Final = re.compile(r"\[cache\] data (loaded|saved)")  # what numba says of a kernel with NUMBA_DEBUG_CACHE=1
ALL: Final = """
import dashboard, importlib, json, swarm, world
from pathlib import Path
lacking, count = {}, 0
for room in (swarm, world, dashboard):
    top = Path(room.__file__).parent
    for file in sorted(top.rglob("*.py")):
        name = ".".join(file.relative_to(top.parent).with_suffix("").parts).removesuffix(".__init__")
        if not name.endswith("__main__"):
            count += 1
            try:
                importlib.import_module(name)
            except ModuleNotFoundError as fault:
                lacking[name] = fault.name
print(json.dumps([count, lacking]))
"""

pytestmark = [
    pytest.mark.processes,
    pytest.mark.long("installs 30 packages into an empty environment and compiles every kernel there, twice"),
    pytest.mark.timeout(900),
]


def called(command: list[str], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a program of an installation: nothing of this environment or checkout may help it."""
    kept = {name: text for name, text in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    return subprocess.run(command, cwd=folder, env=kept | environment, capture_output=True, text=True, check=False)


def done(command: list[str], folder: Path, **environment: str) -> str:
    """Run a program that must succeed; return what it prints."""
    ended = called(command, folder, **environment)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the sources, since a build writes beside them."""
    folder = tmp_path_factory.mktemp("source")
    for part in PARTS:
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    for file in FILES:
        shutil.copy(ROOT / file, folder)
    return folder


@contextmanager
def made_once(name: str, factory: pytest.TempPathFactory) -> Iterator[tuple[Path, bool]]:
    """Give a folder that all workers of a run share, and whether it is made already; one worker makes it, the others wait."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    folder = (factory.getbasetemp().parent if worker else factory.getbasetemp()) / name
    with folder.with_suffix(".lock").open("w") as lock:
        flock(lock, LOCK_EX)
        made = folder.with_suffix(".made")
        yield folder, made.exists()
        made.touch()


@pytest.fixture(scope="module")
def installed(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of programs of an empty environment in which the wheel was installed."""
    with made_once("wheel", tmp_path_factory) as (folder, made):
        if not made:
            install(source, folder)
    return folder / "env" / "bin"


def install(source: Path, folder: Path) -> None:
    """Make the wheel and an empty environment in a folder, and install the wheel in it."""
    folder.mkdir(exist_ok=True)
    wheels = folder / "wheels"
    pip = [sys.executable, "-m", "pip"]
    done([*pip, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(wheels), str(source)], folder)
    (wheel,) = wheels.glob("*.whl")
    venv.create(folder / "env", with_pip=True)
    programs = folder / "env" / "bin"
    pip = [str(programs / "python"), "-m", "pip"]
    reached = called([*pip, "download", "--no-deps", "--dest", str(folder), "msgspec"], folder)
    if reached.returncode:
        pytest.skip(f"no package registry is reached: {reached.stderr.strip().splitlines()[-1]}")
    # the versions of the checkout's environment: another numpy or numba may round differently
    lock = ["--constraint", str(ROOT / "requirements.lock")]
    done([*pip, "install", "--no-cache-dir", *lock, str(wheel)], folder)


@pytest.fixture(scope="module")
def compiled(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Compile the kernels with the Dockerfile's own words; return the environment in which they are found."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    before, compiling = text.split("WORKDIR /\nRUN ")
    assert "pip --python /opt/swarm/bin/python install --no-deps ." in before, "compiled once it is installed"
    command = compiling.splitlines()[0].replace("/opt/swarm/bin", str(installed))
    with made_once("kernels", tmp_path_factory) as (folder, made):
        cache = {"NUMBA_CACHE_DIR": str(folder)}
        if not made:
            done(["sh", "-c", command], Path("/"), **cache)
    return cache


def test_what_it_needs_is_there_and_what_it_weighs_is_told(installed: Path, tmp_path: Path) -> None:
    assert done([str(installed / "python"), "-m", "pip", "check"], tmp_path) == "No broken requirements found.\n"
    site = next((installed.parent / "lib").glob("python*/site-packages"))
    weighs = {entry.name: size_of(entry) for entry in site.iterdir() if entry.name not in {"pip", "setuptools"}}
    print(f"\nan installation without extras: {sum(weighs.values()) / 1e6:.0f} MB")
    for name in sorted(weighs, key=lambda name: weighs[name], reverse=True):
        if weighs[name] > 1e6:
            print(f"  {name:20}{weighs[name] / 1e6:6.0f} MB")
    for extra, libraries in EXTRAS.items():
        needed = {part for library in libraries for part in (library, *needs(library))}
        more = sum(size_of(Path(str(file.locate()))) for part in needed - names_in(site) for file in files(part) or ())
        print(f"with the extra {extra}: {more / 1e6:.0f} MB more")
    assert not list(site.glob("rerun*"))


def needs(library: str) -> set[str]:
    """Return the libraries that one needs here, without those of its own extras."""
    wanted = map(Requirement, requires(library) or ())
    return {one.name for one in wanted if one.marker is None or one.marker.evaluate({"extra": ""})}


def names_in(site: Path) -> set[str]:
    """Return the names of what is installed in a folder."""
    return {one.metadata["Name"] for one in distributions(path=[str(site)])}


def size_of(place: Path) -> int:
    """Return how many bytes the files of a place have."""
    files = [place] if place.is_file() else [file for file in place.rglob("*") if file.is_file()]
    return sum(file.stat().st_size for file in files)


def test_every_module_is_imported_but_those_of_an_extra(
    installed: Path, compiled: dict[str, str], tmp_path: Path
) -> None:
    count, lacking = json.loads(done([str(installed / "python"), "-c", ALL], tmp_path, **compiled))
    extras = {name for of in EXTRAS.values() for name in of.values()}
    assert set(lacking.values()) == extras, lacking
    assert count == len([file for part in PARTS for file in (ROOT / part).rglob("*.py") if "__main__" not in file.name])


def test_a_strict_type_check_of_ones_own_tool_finds_what_packages_offer(installed: Path, tmp_path: Path) -> None:
    """With `mypy --strict`, a package offers only the names that it lists in `__all__`."""
    offered = []
    for top in PARTS[:3]:
        for file in sorted((ROOT / top).rglob("__init__.py")):
            package = ".".join(file.parent.relative_to(ROOT).parts)
            for node in ast.parse(file.read_text()).body:
                if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] in PARTS:
                    offered += [f"from {package} import {name.name}" for name in node.names]
    assert "from swarm.bus import Bus" in offered
    (tmp_path / "mine.py").write_text("\n".join(offered))
    check = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "mine.py"]
    done([*check, "--python-executable", str(installed / "python")], tmp_path)


def test_a_mission_from_another_folder_has_the_digest_of_the_checkout(installed: Path, tmp_path: Path) -> None:
    """The installed one compiles first, beside its modules, as a user's does."""
    digests = []
    for program, folder in ((str(installed / "swarm"), tmp_path / "there"), (checkout(), tmp_path / "here")):
        folder.mkdir()
        done([program, *MISSION], folder)
        digests.append(json.loads((folder / "report.json").read_text(encoding="utf-8"))["digest"])
    assert digests[0] == digests[1]


def checkout() -> str:
    """Return the program `swarm` of this environment."""
    return str(Path(sys.executable).with_name("swarm"))


def test_the_box_opens(installed: Path, compiled: dict[str, str], tmp_path: Path) -> None:
    command = [str(installed / "swarm"), "box", "--quiet"]
    environment = os.environ | compiled | {"PYTHONUNBUFFERED": "1", "DISPLAY": "", "WAYLAND_DISPLAY": ""}  # no browser
    with subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True) as box:
        try:
            assert box.stdout is not None
            page = urlsplit(next(line.split()[-1] for line in box.stdout if line.startswith("box: ")))
            assert "<title>" in answer(box, page.netloc, "/", page.query)
            assert json.loads(answer(box, page.netloc, "/status", page.query))["scenario"] == "box"
        finally:
            box.terminate()
            box.wait(60)


def answer(box: subprocess.Popen[str], place: str, path: str, query: str) -> str:
    """Return what the box answers with status 200, once it listens and has a world."""
    request = Request(f"http://{place}{path}?{query}", headers={"Authorization": f"Bearer {query.split('=')[1]}"})
    while box.poll() is None:
        try:
            with urlopen(request, timeout=30) as answered:
                assert answered.status == 200
                text: str = answered.read().decode()
                return text
        except HTTPError as fault:
            if fault.code != 409:  # its world does not answer yet
                raise
        except URLError as fault:
            if not isinstance(fault.reason, ConnectionRefusedError):  # it does not listen yet
                raise
    raise AssertionError(f"the box ended with status {box.returncode}")


def test_the_images_load_the_kernels_that_their_build_has_compiled(installed: Path, compiled: dict[str, str]) -> None:
    """The class that the Dockerfile names loads what was compiled with its words, and writes nothing."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    locator = re.findall(r"NUMBA_CACHE_LOCATOR_CLASSES=(\S+)", text)[0]
    folder = Path(compiled["NUMBA_CACHE_DIR"])
    there = sorted(folder.rglob("*"))
    load = [str(installed / "python"), "-c", "from swarm import kernels; kernels.load()"]
    words = LOADED.findall(
        done(load, Path("/"), NUMBA_DEBUG_CACHE="1", NUMBA_CACHE_LOCATOR_CLASSES=locator, **compiled)
    )
    assert sorted(folder.rglob("*")) == there
    assert words
    assert set(words) == {"loaded"}
