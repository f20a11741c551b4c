"""Shared fixtures: the file of a small scenario."""

from pathlib import Path

import pytest

from tests.launch.actors import SMALL


@pytest.fixture
def small(tmp_runtime: Path) -> Path:
    path = tmp_runtime / "small.yaml"
    path.write_text(SMALL)
    return path
