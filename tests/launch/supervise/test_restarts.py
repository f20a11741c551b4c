"""How often the launcher starts a process again: crashes count within a minute, not over the whole run."""

from pathlib import Path

import pytest

from swarm.launch.supervise import fleet as module
from swarm.launch.supervise.fleet import Fleet
from swarm.launch.supervise.table import DASHBOARD, RESTARTS, ROBOT, ROUTER, WITHIN, WORLD, EarlyEnd

TIMES: dict[str, tuple[list[float], int | None]] = {  # s, ends of a process; the first one that is too often
    "three at once": ([0.0, 0.0, 0.0], None),
    "four at once": ([0.0, 0.0, 0.0, 0.0], 3),
    "four within a minute": ([0.0, 10.0, 30.0, 59.0], 3),
    "four in more than a minute": ([0.0, 10.0, 30.0, 61.0], None),
    "one a minute for an hour": ([60.0 * minute for minute in range(60)], None),
    "calm, then a burst": ([0.0, 100.0, 200.0, 300.0, 301.0, 302.0, 303.0], 6),
}


@pytest.mark.parametrize("name", TIMES)
def test_ends_count_for_a_minute(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times, expected = TIMES[name]
    fleet = Fleet(tmp_path, print)
    found = []
    for number, time in enumerate(times):
        monkeypatch.setattr(module, "monotonic", lambda time=time: time)
        if fleet.note_end("r1"):
            found.append(number)
        assert not fleet.note_end(f"another {number}"), "each process has a count of its own"
    assert found[:1] == ([] if expected is None else [expected])


def test_the_table_gives_up_no_robot_for_another() -> None:
    assert (RESTARTS, WITHIN) == (3, 60.0)
    assert [role.too_often for role in (ROUTER, WORLD, ROBOT, DASHBOARD)] == [
        EarlyEnd.FINISH, EarlyEnd.FINISH, EarlyEnd.LOSE, EarlyEnd.REPORT,
    ]  # fmt: skip


def test_a_dashboard_that_is_started_again_records_in_another_file(tmp_path: Path) -> None:
    first = {"record": tmp_path / "run.rrd", "mode": "web"}
    names = [DASHBOARD.again(first, number)["record"].name for number in (1, 2, 3)]
    assert names == ["run.rrd", "run.2.rrd", "run.3.rrd"]
    assert DASHBOARD.again({"record": None, "mode": "web"}, 2) == {"record": None, "mode": "web"}
