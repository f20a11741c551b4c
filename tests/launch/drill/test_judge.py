"""Each law of the drill names what is wrong, and nothing else."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from swarm.launch.drill.judge import ALWAYS, LAWS, WHOLE, Observed, broken, only_lost_lack
from swarm.launch.drill.table import LOCKSTEP, TABLE


def robots(**reached: list[float | None]) -> dict[str, Any]:
    return {name: {"reached": times} for name, times in reached.items()}


GOOD = Observed(
    status=0,
    text="fleet drill: 2 robots, router tcp/127.0.0.1:1\ncomplete\n",
    report={
        "complete": True, "reason": "", "ticks": 400, "digest": "abc", "per_robot": robots(r1=[5.0, 9.0], r2=[4.0, 8.0]),
        "contacts": {"robot": 0, "wall": 0, "obstacle": 0}, "traffic": {"overlaps": 0, "outside": 0},
    },
    told=(("r1", "is at target 1"), ("r1", "is at target 2"), ("r2", "is at target 1"), ("r2", "is at target 2")),
    digest="abc",
    expected=("complete\n",),
)  # fmt: skip
IN_ORDER = replace(GOOD, status=1, report=GOOD.report | {"complete": False, "reason": "interrupted"})
LOST = replace(IN_ORDER, report=IN_ORDER.report | {"lost": ["r1"], "per_robot": robots(r1=[5.0, None], r2=[4.0, 8.0])})


def reporting(**fields: object) -> Callable[[Observed], Observed]:
    return lambda seen: replace(seen, report=seen.report | fields)


def seeing(**fields: object) -> Callable[[Observed], Observed]:
    return lambda seen: replace(seen, **fields)  # type: ignore[arg-type]


# fmt: off
PLANTED: dict[str, tuple[Observed, Callable[[Observed], Observed], list[str]]] = {
    "a run without an end":      (GOOD, seeing(status=None), ["ends by itself: it did not end in time", "complete: exit status None, not complete: fleet drill: 2 robots, router tcp/127.0.0.1:1; complete"]),
    "a mission not complete":    (GOOD, reporting(complete=False, reason="r1 stands"), ["complete: exit status 0, not complete: r1 stands"]),
    "an exit status":            (GOOD, seeing(status=1), ["complete: exit status 1, not complete: fleet drill: 2 robots, router tcp/127.0.0.1:1; complete"]),
    "no report":                 (GOOD, seeing(report={"complete": True, "digest": "abc"}), ["nothing lost: the report has no robots"]),
    "a lost stop":               (GOOD, reporting(per_robot=robots(r1=[5.0, 9.0], r2=[4.0, None])), ["nothing lost: r2 lacks 1 target"]),
    "stops out of order":        (GOOD, reporting(per_robot=robots(r1=[9.0, 5.0], r2=[4.0, 8.0])), ["nothing lost: r1's targets are out of order"]),
    "a stop told twice":         (GOOD, seeing(told=(("r1", "is at home"), ("r2", "is at home"), ("r1", "is at home"))), ["nothing doubled: told twice: r1 is at home"]),
    "a contact":                 (GOOD, reporting(contacts={"robot": 1, "wall": 0, "obstacle": 2}), ["no contact: contacts: 1 robot, 2 obstacle"]),
    "a cell held twice":         (GOOD, reporting(traffic={"overlaps": 2, "outside": 0}), ["no overlap: overlaps: 2"]),
    "a body outside its cells":  (GOOD, reporting(traffic={"overlaps": 0, "outside": 1}), ["no overlap: outside: 1"]),
    "another run":               (GOOD, seeing(digest="0123456789"), ["same run: digest abc instead of 01234567"]),
    "a process left":            (GOOD, seeing(processes=("process 17 (sleep 100)",)), ["nothing left: left: process 17 (sleep 100)"]),
    "a folder left":             (GOOD, seeing(files=("drill", ".r.json.part")), ["nothing left: left: drill; left: .r.json.part"]),
    "a traceback":               (GOOD, seeing(text="complete\nTraceback (most recent call last):\n  File\nOSError: [Errno 28]"), ["no traceback: a traceback: OSError: [Errno 28]"]),
    "a sentence that is missing": (GOOD, seeing(expected=("complete\n", "No space")), ["output complete: not said: No space"]),
    "an end out of order":       (IN_ORDER, seeing(status=-1), ["in order: exit status -1 instead of 1"]),
    "an end without a report":   (IN_ORDER, seeing(report={}), ["in order: the report's reason: no report"]),
    "nobody named as lost":      (LOST, seeing(report=IN_ORDER.report), ["only lost lack: no robot is named as lost"]),
    "another one not finished":  (LOST, reporting(per_robot=robots(r1=[None, None], r2=[4.0, None])), ["only lost lack: r2 did not finish either"]),
}
# fmt: on


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_fault_is_named_by_the_law_of_its_kind(name: str) -> None:
    good, plant, expected = PLANTED[name]
    (law,) = {text.split(": ")[0] for text in expected} - ({"complete"} if len(expected) > 1 else set())
    laws = [one for one in LAWS if one in {*ALWAYS, *WHOLE} or one.__name__.replace("_", " ") == law]
    if good is not GOOD:
        laws = [one for one in laws if one not in WHOLE]
    assert broken(laws, good) == []
    assert broken(laws, plant(good)) == expected


def test_every_law_is_broken_by_a_planted_fault() -> None:
    named = {text.split(":")[0] for _, _, expected in PLANTED.values() for text in expected}
    assert named == {law.__name__.replace("_", " ") for law in LAWS}


def test_a_good_run_breaks_no_law() -> None:
    assert broken([*ALWAYS, *WHOLE], GOOD) == []
    assert broken([*ALWAYS, only_lost_lack], LOST) == []


def test_every_row_has_a_name_of_its_own_and_is_judged_at_each_pace() -> None:
    assert len({row.name for row in TABLE}) == len(TABLE)
    for row in TABLE:
        for pace in row.paces:
            laws = row.laws_at(pace)
            assert set(ALWAYS) < set(laws), row.name
            assert ("same_run" in {law.__name__ for law in laws}) <= (pace == LOCKSTEP), row.name
            assert bool(row.expected) == ("output_complete" in {law.__name__ for law in laws}), row.name
    both = {row.name for row in TABLE if len(row.paces) == 2}
    assert {"robot-killed", "world-killed", "router-killed"} <= both
