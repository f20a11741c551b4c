"""The examples in the docstrings of planning and maps."""

import doctest
import importlib

import pytest


@pytest.mark.parametrize("name", ["planning.astar", "planning.path", "maps.text", "maps.movingai"])
def test_examples_hold(name: str) -> None:
    result = doctest.testmod(importlib.import_module(f"swarm.{name}"))
    assert result.attempted > 0
    assert result.failed == 0
