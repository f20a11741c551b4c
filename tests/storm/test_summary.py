"""The summary's counts match the results; the interval is Wilson's."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from swarm.storm.laws.judge import Violation
from swarm.storm.results import CLASSES, RunResult
from swarm.storm.summary import as_json, as_text, tables, wilson

CONTACT = Violation("no contact", 7, ("r1",), "r1 touched wall")
OVERLAP = Violation("no overlap", 9, ("r1", "r2"), "r1 and r2 hold cell 4")
KNOWN, DEAD, UNKNOWN = CLASSES


def result(seed: int, *violations: Violation, profile: str = "all", **fields: object) -> RunResult:
    return RunResult(profile=profile, seed=seed, violations=violations, **{"category": KNOWN} | fields)  # type: ignore[arg-type]


RESULTS = [
    result(0, features=("late",), complete=True),
    result(1, CONTACT, OVERLAP, features=("late", "dead"), category=DEAD),
    result(2, CONTACT, silent=True),
    result(0, profile="calm", complete=True),
    result(1, profile="calm", left_out="it has what only the simulation has"),
]


@given(st.integers(1, 2000), st.floats(0, 1))
def test_the_interval_is_the_one_that_scipy_computes(runs: int, share: float) -> None:
    failed = round(share * runs)
    expected = binomtest(failed, runs).proportion_ci(0.95, "wilson")
    assert wilson(failed, runs) == pytest.approx((expected.low, expected.high), abs=1e-6)


def test_of_no_runs_nothing_is_known() -> None:
    assert wilson(0, 0) == (0.0, 1.0)


def test_results_are_counted_by_class_profile_feature_and_law() -> None:
    counted = {kind: {row.name: tuple(row[1:]) for row in rows} for kind, rows in tables(RESULTS).items()}
    assert counted == {  # runs, failed, silent
        "class": {KNOWN: (3, 1, 1), DEAD: (1, 1, 0)},
        "profile": {"all": (3, 2, 1), "calm": (1, 0, 0)},
        "feature": {"dead": (1, 1, 0), "late": (2, 1, 0)},
        "law": {"no contact": (4, 2, 1), "no overlap": (4, 1, 1)},
    }


def test_the_json_form_has_what_other_tools_read() -> None:
    told = json.loads(json.dumps(as_json(RESULTS, 36.0, interrupted=False)))
    assert (told["runs"], told["failed"], told["rate"], told["left_out"]) == (4, 2, 0.5, 1)
    assert told["interval"] == list(wilson(2, 4))
    assert told["seeds_per_hour"] == 400.0
    assert [(one["profile"], one["seed"], one["law"]) for one in told["failures"]] == [
        ("all", 1, "no contact"), ("all", 1, "no overlap"), ("all", 2, "no contact"),
    ]  # fmt: skip
    assert told["failures"][0] == {"profile": "all", "seed": 1} | CONTACT._asdict() | {"robots": ["r1"]}


def test_the_text_says_the_same() -> None:
    lines = as_text(RESULTS, 36.0, interrupted=True).splitlines()
    words = {tuple(line.split()) for line in lines}
    assert ("all", "4", "2", "50.0%", "15.0-85.0", "%", "1") in words
    assert ("no", "overlap", "4", "1", "25.0%", "4.6-69.9", "%", "1") in words
    assert "400 seeds an hour" in lines
    assert lines[-2].startswith("laws were broken in 2 of 4 runs; in 1 a living robot did not arrive")
    assert lines[-1] == "interrupted: only these seeds were run"
