"""The rules of `tests/costs.py`: a marker of the long suite has a reason, and so has a test that computes for long."""

import pytest

from tests import costs


@pytest.mark.parametrize("marker", ["long", "long()", 'costs("")', "long(3)"])
def test_a_marker_without_a_reason_is_refused(marker: str, pytester: pytest.Pytester) -> None:
    pytester.makepyfile(f"import pytest\n@pytest.mark.{marker}\ndef test_it(): pass\n")
    done = pytester.runpytest_inprocess("-p", "tests.costs", "-p", "no:cacheprovider")
    assert done.ret == pytest.ExitCode.USAGE_ERROR
    done.stderr.fnmatch_lines(["*::test_it: expected a reason, as in @pytest.mark.*"])


def test_what_takes_minutes_begins_first(pytester: pytest.Pytester) -> None:
    marker = '@pytest.mark.long("it takes minutes", first=True)'
    pytester.makepyfile(f"import pytest\ndef test_a(): pass\ndef test_b(): pass\n{marker}\ndef test_c(): pass\n")
    done = pytester.runpytest_inprocess("-v", "-p", "tests.costs", "-p", "no:cacheprovider")
    done.stdout.fnmatch_lines(["*::test_c PASSED*", "*::test_a PASSED*", "*::test_b PASSED*"])


@pytest.mark.parametrize(
    ("reason", "limit", "told", "status"),
    [
        ("", 0.0, True, pytest.ExitCode.TESTS_FAILED),
        ("", 60.0, False, pytest.ExitCode.OK),
        ('@pytest.mark.costs("it counts far")', 0.0, True, pytest.ExitCode.OK),
    ],
)
def test_costs_are_listed_and_one_without_a_reason_fails_the_run(
    reason: str,
    limit: float,
    told: bool,
    status: pytest.ExitCode,
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(costs, "DEAR", limit)
    monkeypatch.setattr(costs, "TOO_DEAR", limit)
    pytester.makepyfile(f"import pytest\n{reason}\ndef test_it(): sum(range(1_000_000))\n")
    options = "-p", "tests.costs", "-p", "no:cacheprovider"
    done = pytester.runpytest_inprocess(*options, "--costs")
    assert done.ret == status
    assert any("test_it" in line for line in done.outlines) == told
    assert pytester.runpytest_inprocess(*options).ret == pytest.ExitCode.OK
