"""The rule of `tests/again.py`: a long test of processes has a second try, another one has none, and both are told."""

import pytest

ONCE = """
import pytest
from pathlib import Path

{marks}
def test_it():
    tried = Path("tried")
    tries = len(tried.read_text()) if tried.exists() else 0
    tried.write_text("x" * (tries + 1))
    assert tries == {fails}, "too late"
"""
LONG = '@pytest.mark.long("it takes minutes")\n'
PROCESSES = "@pytest.mark.processes\n"


@pytest.mark.parametrize(
    ("marks", "fails", "status", "told"),
    [
        (LONG + PROCESSES, 1, pytest.ExitCode.OK, True),
        (LONG + PROCESSES, 2, pytest.ExitCode.TESTS_FAILED, True),
        (LONG + PROCESSES, 0, pytest.ExitCode.OK, False),
        (LONG, 1, pytest.ExitCode.TESTS_FAILED, False),
        (PROCESSES, 1, pytest.ExitCode.TESTS_FAILED, False),
    ],
    ids=["late once", "late twice", "in time", "long only", "processes only"],
)
def test_a_long_test_of_processes_has_a_second_try(
    marks: str, fails: int, status: pytest.ExitCode, told: bool, pytester: pytest.Pytester
) -> None:
    pytester.makepyfile(ONCE.format(marks=marks, fails=fails))
    done = pytester.runpytest_inprocess("-p", "tests.again", "-p", "no:cacheprovider")
    assert done.ret == status
    assert any("test_it: AssertionError: too late" in line for line in done.outlines) == told
