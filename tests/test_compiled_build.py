"""The package that mypyc compiles gives the same runs as plain Python, bit for bit."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Final

import pytest

from tests.shared import ROOT

COMPILER: Final = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()[0]
PARTS: Final = ("swarm", "world", "dashboard", "scenarios")
FILES: Final = ("pyproject.toml", "setup.py", "README.md")
RUNS: Final = """
from pathlib import Path
from swarm import compiled
from swarm.scenario.load import load
from world.simulate import Simulation
from world.storm.workers import answers
from world.storm.results import Job, perform

if __name__ == "__main__":
    print(compiled.by_mypyc())
    for name, robots, limit in (("paper", 4, 40.0), ("doorway", 4, 40.0), ("movers", 2, 20.0), ("unknown", 2, 20.0)):
        run = Simulation.of(load(Path("scenarios") / f"{name}.yaml"), robots, seed=1).run(limit)
        print(name, run["digest"])
    jobs = [Job("all", seed) for seed in range(4)] + [Job("unknown", 0), Job("dead", 0)]
    for job, result in answers(perform, jobs, workers=1):
        print(job.name, result.digest, result.violations)
"""
# pip builds where the package cannot be imported
BUILD = "import runpy, sys; sys.modules['swarm'] = None; runpy.run_path('setup.py')"

pytestmark = [
    pytest.mark.long("compiles the whole package with a C compiler: minutes", first=True),
    pytest.mark.timeout(1500),
    pytest.mark.skipif(shutil.which(COMPILER) is None, reason=f"there is no C compiler: {COMPILER} is not found"),
]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compile a copy of the package, without network. Numba's caches are copied too."""
    folder = tmp_path_factory.mktemp("compiled")
    for part in PARTS:
        shutil.copytree(ROOT / part, folder / part)
    for file in FILES:
        shutil.copy(ROOT / file, folder)
    done = subprocess.run(
        [sys.executable, "-c", BUILD, "build_ext", "--inplace"],
        cwd=folder, env=os.environ | {"SWARM_COMPILE": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def printed(folder: Path, root: Path) -> list[str]:
    """Return what the runs print with the package in ``root``."""
    done = subprocess.run(
        [sys.executable, str(folder / "runs.py")],
        cwd=root, env=os.environ | {"PYTHONPATH": str(root)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_compiled_and_plain_code_give_the_same_runs(built: Path) -> None:
    (built.parent / "runs.py").write_text(RUNS)  # not beside the package: a script's own folder comes first in the path
    compiled, *fast = printed(built.parent, built)
    plain, *slow = printed(built.parent, ROOT)
    assert (compiled, plain) == ("True", "False")
    assert fast == slow
    assert len(fast) == 10
