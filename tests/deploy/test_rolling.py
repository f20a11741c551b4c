"""A fleet that runs is given a new version, one process after the other."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from swarm.bus import Endpoint
from tests.deploy.reading import await_line
from tests.launch.actors import SMALL
from tests.shared import ROOT
from world.host.process import LEFT

ROBOTS: Final = ("r1", "r2", "r3")
PATIENCE: Final = 600.0  # s for a process to end on a busy machine

pytestmark = [pytest.mark.processes, pytest.mark.long("a mission with ten processes"), pytest.mark.timeout(1200)]


class Version:
    """A version of the package: the one here, or a copy with other code in it."""

    def __init__(self, folder: Path | None = None) -> None:
        self._path = {} if folder is None else {"PYTHONPATH": str(folder)}
        if folder is not None:
            for room in ("swarm", "world", "dashboard"):
                shutil.copytree(ROOT / room, folder / room)  # with its compiled kernels
            with (folder / "swarm" / "geometry.py").open("a", encoding="utf-8") as file:
                file.write("# a new version\n")

    def start(self, *words: str, module: str = "swarm.cli") -> "subprocess.Popen[str]":
        return subprocess.Popen(
            [sys.executable, "-m", module, *words], cwd="/", env=os.environ | self._path, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip

    def code(self) -> str:
        """Return the fingerprint of its code."""
        with self.start("--version") as process:
            said, _ = process.communicate(timeout=PATIENCE)
        return said.split("code ")[1].split(",")[0]


def test_router_world_and_robots_are_replaced_by_another_version(tmp_path: Path, tmp_runtime: Path) -> None:
    old, new = Version(), Version(tmp_path / "new")
    assert old.code() != new.code()
    endpoint = Endpoint("127.0.0.1", 0).claim()
    longer = SMALL.replace("targets: [", "targets: [[2.5, 6.0], [9.5, 4.0], [2.5, 2.0], [9.5, 6.0], [2.5, 4.0], ")
    assert longer != SMALL
    (scenario := tmp_path / "small.yaml").write_text(longer, encoding="utf-8")
    report, wire = tmp_path / "report.json", ("--connect", str(endpoint), "--fleet", "rolling")
    router = ("router", "--listen", str(endpoint))
    world = ("world", str(scenario), "--robots", "3", "--pace", "2", "--snapshot", str(tmp_path / "run.snapshot"),
             "--report", str(report), *wire)  # fmt: skip
    words = {"router": router, "world": world} | {name: ("robot", "--id", name, *wire) for name in ROBOTS}
    running: dict[str, subprocess.Popen[str]] = {}
    try:
        for name in words:
            running[name] = old.start(*words[name])
            if name == "router":
                await_line(running[name], "listening")
        await_line(running["world"], "the run is running")
        for name in words:
            if name == "world":
                await_line(running[name], "is at target 1")
            running[name].terminate()
            running[name].communicate(timeout=PATIENCE)
            assert running[name].returncode == (LEFT if name == "world" else 0), name
            running[name] = new.start(*words[name])
            if name in ROBOTS:
                await_line(running[name], f"joined as {name}")
        running["world"].communicate(timeout=PATIENCE)
        assert running["world"].returncode == 0
    finally:
        for process in running.values():
            process.kill()
            process.communicate()
    found = json.loads(report.read_text(encoding="utf-8"))
    assert (found["passed"], found["complete"], found["robots"]) == (True, True, 3), found["reason"]
    assert found["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert any("r1" in reason for reason in found["not_reproducible"])
