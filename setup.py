"""The compiled build: with SWARM_COMPILE=1 in the environment, mypyc makes C extensions of the modules that pay.

`make compiled` calls it. Without the variable the package is plain Python, and pyproject.toml says all about it.
"""

import ast
import os
import sys
from pathlib import Path

from setuptools import setup

HOT = (  # what runs in each tick, and the laws that a storm holds against each tick
    "swarm/geometry.py",
    "swarm/fuzzy/controller.py",
    "swarm/planning/*.py",
    "swarm/traffic/**/*.py",
    "swarm/robot/**/*.py",
    "world/world.py",  # not simulate.py and in_process.py: the replay has a subclass of theirs
    "world/faults.py",
    "world/bodies/*.py",
    "world/fleet/*.py",
    "world/host/*.py",
    "world/measure/*.py",
    "world/saving/*.py",
    "world/tasks/*.py",
    "world/views/*.py",
    "world/storm/history/history.py",
    "world/storm/laws/*.py",
    "world/storm/uncooperative.py",
    "world/storm/history/seen.py",
    "world/storm/history/told.py",
    "world/storm/history/ways.py",
)
# `swarm/messages` and `swarm/settings` are msgspec's types, which are C already. Objects of `swarm/maps`, `swarm/fuzzy`
# and `swarm/scenario` are pickled for other processes, which a compiled frozen class does not allow.
LEFT_OUT = {  # of HOT, and why
    "swarm/planning/path_check.py": "the judge of paths: tests and benchmarks call it",
    "swarm/planning/solve.py": "only `swarm plan` calls it",
    "swarm/robot/host/process.py": "waits for messages; what it calls is compiled",
    "swarm/robot/host/seat.py": "part of the robot's process",
    "world/host/last_messages.py": "part of the world's process",
    "world/fleet/membership.py": "part of the world's process",
    "world/measure/state.py": "a compiled class loses the options of msgspec's types",
    "world/tasks/orders.py": "a compiled class loses the options of msgspec's types",
    "world/host/pace.py": "part of the world's process",
    "world/tasks/places.py": "a compiled class loses the options of msgspec's types",
    "world/tasks/task_pool.py": "a compiled class loses the options of msgspec's types",
    "world/host/process.py": "waits for messages; what it calls is compiled",
    "world/views/report.py": "runs once",
    "world/fleet/publisher.py": "part of the world's process",
}


def kernels() -> set[str]:
    """Read which files are left to numba; pip builds where this package cannot be imported."""
    for line in ast.parse(Path("swarm/compiled.py").read_text(encoding="utf-8")).body:
        if isinstance(line, ast.AnnAssign) and ast.unparse(line.target) == "KERNELS" and line.value is not None:
            return {f"{name.replace('.', '/')}.py" for name in ast.literal_eval(line.value)}
    raise SystemExit("swarm/compiled.py: expected a table KERNELS, found none")


def sources() -> list[str]:
    """List the files that mypyc compiles."""
    found = {file.as_posix() for pattern in HOT for file in Path().glob(pattern) if file.name != "__init__.py"}
    return sorted(found - kernels() - LEFT_OUT.keys())


if os.environ.get("SWARM_COMPILE") == "1" and "dist_info" not in sys.argv:  # pip asks for the name and version first
    from mypyc.build import mypycify

    # -O1 builds sooner; only a tenth of a run's time passes in this code
    setup(ext_modules=mypycify(["--config-file", "pyproject.toml", *sources()], opt_level="1", debug_level="0"))
else:
    setup()
