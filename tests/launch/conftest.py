"""Shared fixtures: the file of a scenario without targets."""

from pathlib import Path

import pytest

from tests.launch.actors import SMALL


@pytest.fixture
def waiting(tmp_runtime: Path) -> Path:
    """Return a scenario without any target."""
    path = tmp_runtime / "waiting.yaml"
    path.write_text(SMALL.replace("targets: [[9.5, 2.0], [9.5, 6.0]]\n", ""))
    return path
