"""Without the extra `ros2`, the files of this folder are skipped before they are imported."""

from pathlib import Path
from typing import NoReturn

import pytest

from swarm.installed import without

LACKS = without("ros2")


class Skipped(pytest.Module):
    """A file of tests that cannot be imported here."""

    def collect(self) -> NoReturn:
        pytest.skip(f"{LACKS}", allow_module_level=True)


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    return None if LACKS is None else Skipped.from_parent(parent, path=module_path)
