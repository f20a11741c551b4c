"""A second try of the long tests of processes: on a machine that is too busy, something in real time comes too late.

Whoever fails twice fails the run. What failed once is told at the end, with its reason.
"""

from typing import Final

import pytest

REAL: Final = {"long", "processes"}  # markers of tests that have a second try


@pytest.hookimpl(trylast=True)  # modules have put their markers on by then
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let long tests of processes be run again."""
    for item in items:
        if {marker.name for marker in item.iter_markers()} >= REAL:
            item.add_marker(pytest.mark.flaky(reruns=1))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name each test that failed and was run again, with the reason."""
    reports = terminalreporter.stats.get("rerun", [])
    if reports:
        terminalreporter.section("failed, and run again")
    for report in reports:
        crash = getattr(report.longrepr, "reprcrash", None)
        reason = str(report.longrepr) if crash is None else crash.message
        terminalreporter.line(f"{report.nodeid}: {reason.splitlines()[0]}")
