"""What tests cost: the marker of the long suite has a reason, and so does a test that computes for long.

`make test` runs what is not marked `long`, `make test-all` everything. `make check-costs` runs `make test` and lists what
costs most (`--costs`); it fails if a test costs far too much without a reason. The cost of a test is the processor time of its
process and of the processes that it has waited for, which does not grow while others use the machine as wall time does.
"""

import os
import sys
from collections.abc import Generator, Iterable
from typing import Final

import pytest

REASONED: Final = ("long", "costs")  # markers that take a reason
DEAR: Final = 5.0  # s of processor time; a test of `make test` that takes more says why
TOO_DEAR: Final = 3 * DEAR  # s; without a reason the run fails. Shared caches and cores cost a factor of 2 at most
LONG_TIMEOUT: Final = 1200  # s; the end of a test of the long suite that hangs


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--costs``: list what costs most."""
    parser.addoption("--costs", action="store_true", help="list the tests that take most processor time")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Refuse markers without a reason; let long tests run longer, and those marked ``first=True`` begin first."""
    items.sort(key=lambda item: not any(marker.kwargs.get("first") for marker in item.iter_markers("long")))
    wrong = sorted(
        {f'{item.nodeid}: expected a reason, as in @pytest.mark.{name}("...")' for item, name in _bare(items)}
    )
    if wrong:
        raise pytest.UsageError("\n".join(wrong))
    for item in items:
        if item.get_closest_marker("long") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(LONG_TIMEOUT))


def _bare(items: Iterable[pytest.Item]) -> Iterable[tuple[pytest.Item, str]]:
    for item in items:
        for name in REASONED:
            for marker in item.iter_markers(name):
                if len(marker.args) != 1 or not isinstance(marker.args[0], str) or " " not in marker.args[0]:
                    yield item, name


def _spent() -> float:
    """Return the processor time [s] of this process and of its children that have ended."""
    return sum(os.times()[:4])


def _end_fork_server() -> None:
    """End the fork server that a test has left: what it and its children cost would count for the test that ends it."""
    if "multiprocessing.forkserver" in sys.modules:
        from swarm.launch.supervise.fleet import call_off

        call_off()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Note what the test costs."""
    before = _spent()
    try:
        return (yield)
    finally:
        _end_fork_server()
        item.user_properties.append(("cost", _spent() - before))


def costs_of(reports: Iterable[pytest.TestReport]) -> list[tuple[float, bool, str]]:
    """Return cost [s], whether a reason is given, and name of the tests that cost more than ``DEAR``, dearest first."""
    costs = [
        (cost, bool(set(REASONED) & set(report.keywords)), report.nodeid)
        for report in reports
        for name, cost in report.user_properties
        if name == "cost" and isinstance(cost, float) and cost > DEAR
    ]
    return sorted(costs, reverse=True)


def _all_reports(config: pytest.Config) -> Iterable[pytest.TestReport]:
    terminal = config.pluginmanager.get_plugin("terminalreporter")
    if terminal is None:  # a worker of xdist
        return []
    return [one for group in ("passed", "failed") for one in terminal.stats.get(group, []) if one.when == "call"]


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """With ``--costs``, fail the run if a test without a reason costs far too much."""
    if not session.config.getoption("--costs") or session.exitstatus != pytest.ExitCode.OK:
        return
    if any(cost > TOO_DEAR and not reason for cost, reason, _ in costs_of(_all_reports(session.config))):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """With ``--costs``, list the tests that cost much."""
    if not terminalreporter.config.getoption("--costs"):
        return
    terminalreporter.section(f"more than {DEAR:g} s of processor time")
    for cost, reason, name in costs_of(_all_reports(terminalreporter.config)):
        terminalreporter.line(f"{cost:6.1f} s {name}{'' if reason else '  (gives no reason)'}")
    terminalreporter.line(
        f'mark it @pytest.mark.costs("why"), or @pytest.mark.long("why") for `make test-all`; above {TOO_DEAR:g} s without a reason the run fails'
    )
