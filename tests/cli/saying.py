"""What a `swarm` command says: its output if it is right, its sentence if it is wrong."""

import re
from pathlib import Path

import pytest

from swarm.cli import main

Capture = pytest.CaptureFixture[str]


def said(capsys: Capture, *arguments: str) -> str:
    """Run a command that is right, and return what it prints."""
    capsys.readouterr()
    assert main(list(arguments)) == 0, capsys.readouterr().err
    return capsys.readouterr().out


def refused(capsys: Capture, *arguments: str | Path) -> str:
    """Run a command that is wrong; it says so in one line, prints nothing else, and ends with 2. Return the line."""
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert re.fullmatch(r"swarm: (?!swarm\b).*\n", told.err), told.err
    return told.err
