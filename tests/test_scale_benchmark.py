"""The benchmark of large fleets: its rows come one by one, and what it computes can be worked out by hand."""

import signal
import subprocess
import sys
from math import ceil
from pathlib import Path

import psutil
import pytest

from benchmarks import scale
from benchmarks.measure import printed
from benchmarks.scaling import fleets, realtime, wire
from benchmarks.scaling.fleets import NotMeasured
from benchmarks.scaling.rows import ROWS
from swarm.scenario.benchmark import from_benchmark
from swarm.scenario.load import load

Capture = pytest.CaptureFixture[str]

MAP = "type octile\nheight 4\nwidth 5\nmap\n.....\n.@@..\n.....\n.....\n"
SCEN = "version 1\n0\tsmall.map\t5\t4\t0\t0\t4\t3\t5.0\n0\tsmall.map\t5\t4\t0\t3\t4\t0\t5.0\n"


def test_a_row_is_printed_before_the_next_is_measured_and_a_bad_one_says_why(capsys: Capture) -> None:
    seen = []

    def measure(cell: str) -> tuple[str, ...]:
        seen.append(capsys.readouterr().out)
        if not cell:
            raise ValueError("no\nfleet | at all")
        return cell, "2"

    cases = [("one", lambda: measure("10")), ("bad", lambda: measure("")), ("third", lambda: measure("30"))]
    printed(("row", "first", "second"), cases, ValueError)
    seen.append(capsys.readouterr().out)
    assert seen == [
        "| row   | first | second |\n| ----- | ----: | -----: |\n",
        "| one   |    10 |      2 |\n",
        "| bad   | ValueError: no fleet / at all |        |\n",
        "| third |    30 |      2 |\n\n",
    ]
    with pytest.raises(ValueError, match="no"):
        printed(("row", "first", "second"), [("bad", lambda: measure(""))])


MEASURED = wire.Measured(spoken=0.25, delivered=3.0, length=400.0, sense=200.0, command=100.0)


@pytest.mark.parametrize(
    ("robots", "said", "delivered", "into", "out_of"),
    [
        # 20 ticks a second: 5 broadcasts of 400 bytes, 20 senses and commands of 300 together
        (10, 50, 10 * 45, 10 * (5 * 400 + 20 * 300), 10 * (45 * 400 + 20 * 300)),  # each gets those of 9 others
        (1_000, 5_000, 60_000, 1_000 * (5 * 400 + 20 * 300), 1_000 * (60 * 400 + 20 * 300)),
        (100_000, 500_000, 6_000_000, 100_000 * (5 * 400 + 20 * 300), 100_000 * (60 * 400 + 20 * 300)),
    ],
)
def test_messages_grow_with_the_fleet_and_a_small_one_has_few_neighbours(
    robots: int, said: float, delivered: float, into: float, out_of: float
) -> None:
    assert wire.load(robots, MEASURED) == pytest.approx((said, delivered, 2 * 20 * robots, into, out_of))
    cells = wire.line(
        robots, lambda: (MEASURED, {"robots": 0.001, "world": 0.0001, "router": 0.0002, "launcher": 1.0}, 20.0)
    )
    assert len(cells) == len(wire.HEAD) - 1
    assert cells[-6:-3] == tuple(f"{robots * cores:,.1f}" for cores in (0.02, 0.002, 0.004))
    needed = robots * 20 / 1000, ceil(robots * 0.002 / 0.5), ceil(robots * 0.026 / 4)  # GB; worlds; hosts of 8 cores
    assert cells[-3:] == (f"{needed[0]:,.1f}", f"{needed[1]:,}", f"{needed[2]:,}")


@pytest.mark.parametrize(("rate", "every"), [(10.0, 2), (5.0, 1), (1.0, 1)])
def test_at_another_rate_a_fleet_is_the_same_and_speaks_as_often_in_a_second(
    tmp_path: Path, rate: float, every: int
) -> None:
    files = tmp_path / "small.map", tmp_path / "small.scen"
    for file, text in zip(files, (MAP, SCEN), strict=True):
        file.write_text(text)
    where = (str(files[0]), "--scen", str(files[1]))
    assert realtime.at_rate(where, 2, 20.0, tmp_path) == where
    (tmp_path / "made").mkdir()
    (name,) = realtime.at_rate(where, 2, rate, tmp_path / "made")
    made, given = load(Path(name)), from_benchmark(*files, 2)
    assert (made.settings.rate, made.settings.radio.every) == (rate, every)
    assert (made.settings.start, made.settings.own_targets) == (given.settings.start, given.settings.own_targets)
    assert (made.map.cells == given.map.cells).all()


def test_late_commands_are_a_share_of_all() -> None:
    times = {"p50": 0.01, "p99": 0.02, "p99.9": 0.03, "max": 0.04}
    report = {"late_commands": 6, "ticks": 100, "robots": 4, "tick_wall": times, "not_reproducible": ["in real time"]}
    assert realtime.punctual(report) == realtime.Punctual(6 / 400, 0.01, 0.02, 0.03, 0.04)


def test_a_fleet_that_lost_robots_is_not_called_punctual() -> None:
    lost = ["in real time", "r7 has lost its process at 1.20 s", "r9 has lost its process at 1.25 s"]
    with pytest.raises(NotMeasured, match="of at least 2 robots"):
        realtime.punctual({"not_reproducible": lost})


def test_real_time_goes_at_the_rates_of_the_bars() -> None:
    assert {row.robots: row.rate for row in ROWS if row.cost} == {8: 20, 16: 20, 32: 20, 64: 20, 128: 10, 256: 5}


@pytest.mark.parametrize("name", scale.TABLES)
def test_every_table_has_an_option(name: str, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    made: list[scale.Asked] = []
    for table in scale.TABLES:
        monkeypatch.setitem(scale.TABLES, table, made.append if table == name else None)
    monkeypatch.setattr(sys, "argv", ["scale", f"--{name}", "--only", "paper", "--seconds", "7"])
    scale.main()
    (asked,) = made
    assert ([row.title for row in asked.rows], asked.seconds) == (["paper 8"], 7.0)
    assert "cores, load" in capsys.readouterr().out


def test_a_run_that_was_interrupted_is_not_called_punctual() -> None:
    with pytest.raises(NotMeasured, match="ended early: interrupted"):
        realtime.punctual({"complete": False, "reason": "interrupted"})


def test_a_fleet_that_does_not_end_when_told_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleets, "LEAVING", 0.2)
    code = "import signal, subprocess, sys; signal.signal(15, signal.SIG_IGN); print(flush=True); subprocess.run([sys.executable, '-c', 'input()'], stdin=subprocess.PIPE)"
    stubborn = psutil.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    stubborn.stdout.readline()
    fleets.end(stubborn)
    assert not stubborn.is_running()
    stubborn.stdout.close()


def test_a_benchmark_that_is_told_to_end_ends_its_fleet(tmp_path: Path) -> None:
    """By default SIGTERM ends Python at once, and its fleet would run on for its whole limit."""
    launcher = tmp_path / "python"
    launcher.write_text("#!/bin/sh\nexec sleep 1000\n")
    launcher.chmod(0o700)
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(SystemExit) as ended, fleets.fleet(ROWS[0], 1.0, "max", python=str(launcher)) as (process, _):
        signal.raise_signal(signal.SIGTERM)
    assert ended.value.code == 128 + signal.SIGTERM
    assert not process.is_running()
    assert signal.getsignal(signal.SIGTERM) is before
