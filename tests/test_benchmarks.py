"""Each section of docs/benchmarks.md states the commit at which it was measured."""

from pathlib import Path

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import survival
from swarm.scenario.check import check
from swarm.scenario.load import load
from world.saving.snapshot_file import read


def test_the_page_keeps_the_stamp_of_each_section(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmarks, "PAGE", tmp_path / "benchmarks.md")
    stamps = {
        name: f"Measured at commit {digit * 7} (2026-11-21)." for name, digit in (("fuzzy", "a"), ("ground", "b"))
    }
    for name, stamped in stamps.items():  # one after the other: the second leaves the first as it was
        page = benchmarks.page({name: benchmarks.section(name, stamped, "\n| a table |\n\n")})
        (tmp_path / "benchmarks.md").write_text(page)
    kept = benchmarks.kept()
    assert kept == {name: f"{benchmarks.summary(name)}\n\n{stamps[name]}\n\n| a table |" for name in stamps}
    assert benchmarks.section("fuzzy", "", "text") == f"{benchmarks.summary('fuzzy')}\n\ntext"


def test_the_snapshots_that_are_timed_are_those_of_a_world(tmp_path: Path) -> None:
    scenario = tmp_path / "hall.yaml"
    scenario.write_text(survival.hall(), encoding="utf-8")
    seconds, size = survival.snapshots(scenario, 2, 2)
    file = scenario.with_suffix(".snapshot")
    found = read(file, check(load(scenario), 2, 1).scenario, 2, 1)
    assert seconds > 0.0
    assert size == file.stat().st_size
    assert found.state.tick == 2 * survival.TICKS
    assert set(found.host.states) == set(found.host.plans) == {"r1", "r2"}
