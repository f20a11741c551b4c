"""Files of tests that need an extra: without it they are skipped before they are imported."""

from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from swarm.installation import hint_for_extra

Make = Callable[[Path, pytest.Collector], pytest.Module | None]


def skipped_without(extra: str) -> Make:
    """Return the hook ``pytest_pycollect_makemodule`` of a folder whose files need an extra."""
    lacks = hint_for_extra(extra)

    class Skipped(pytest.Module):
        """A file of tests that cannot be imported here."""

        def collect(self) -> NoReturn:
            pytest.skip(f"{lacks}", allow_module_level=True)

    def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
        return None if lacks is None else Skipped.from_parent(parent, path=module_path)

    return pytest_pycollect_makemodule
