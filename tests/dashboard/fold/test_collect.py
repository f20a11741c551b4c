"""What is gathered between two drawings: frames that are few enough, contacts, totals, and where robots drove before."""

import itertools

import pytest
from msgspec.structs import replace

from dashboard.fold.collect import BODIES, Batch, format_totals, summary, trip_starts
from dashboard.fold.phrases import Touch, select_contacts
from swarm.messages import Activity, Event, Truth
from tests.cli.test_analyze import HALF
from tests.dashboard.fold.test_progress import folded
from tests.dashboard.rehearsal import RATE, Rehearsal


def touch(tick: int, robot: str, text: str, at: tuple[float, float] | None) -> Event:
    return Event(run=0, tick=tick, time=tick / RATE, robot=robot, kind="contact", text=text, at=at)


PAIR = [touch(10, "r1", "touches robot r2", (2.0, 3.0)), touch(10, "r2", "touches robot r1", (2.0, 3.0))]
WALLED = touch(30, "r1", "touches wall", (1.0, 1.5))
UNKNOWN = touch(40, "r1", "touches wall", None)


def test_a_contact_of_two_robots_is_one_touch_and_one_without_a_place_none() -> None:
    other = replace(WALLED, kind="reached")
    assert select_contacts([*PAIR, WALLED, UNKNOWN, other]) == [
        Touch(0.5, (2.0, 3.0), "0.5 s: r1 touches robot r2"),
        Touch(1.5, (1.0, 1.5), "1.5 s: r1 touches wall"),
    ]


def test_the_totals_come_first_and_count_everybody() -> None:
    rehearsal = Rehearsal(3)
    sent = [message for tick in range(20 * RATE + 1) for _, message, _ in rehearsal.messages(tick)]
    progress = folded(*sent, *PAIR, WALLED)
    reached = sum(progress.robot(name).reached_count for name in rehearsal.names)
    assert format_totals(progress).startswith(f"20 s, running: {reached} of 12 targets reached (")
    assert format_totals(progress).endswith("; 2 contacts")
    states = [progress.robot(name).activity for name in rehearsal.names]
    assert f"{states.count(Activity.DRIVE)} drives" in format_totals(progress)
    gone = replace(progress, present=frozenset({"r1"}))
    assert "2 not heard" in format_totals(gone)


@pytest.mark.parametrize(
    ("kinds", "begins"),
    [
        ({}, ["| robot | reached |", "|---|---|---|---|---|---|", "| r1 | 0 of 4 |", "| r2 | 0 of 4 |"]),
        (
            {"r1": "cart"},
            [
                "| robot | kind | reached |",
                "|---|---|---|---|---|---|---|",
                "| r1 | cart | 0 of 4 |",
                "| r2 | - | 0 of 4 |",
            ],
        ),
    ],
)
def test_the_table_names_the_kind_of_a_robot_if_the_fleet_has_kinds(kinds: dict[str, str], begins: list[str]) -> None:
    progress = folded(*(message for _, message, _ in Rehearsal(2).messages(0)))
    lines = summary(progress, home=True, kinds=kinds).splitlines()[2:]
    assert [line[: len(begin)] for line, begin in zip(lines, begins, strict=True)] == begins
    assert {line.count("|") for line in lines} == {8 if kinds else 7}


@pytest.mark.parametrize("frames", [0, 1, 7, 499, 500, 501, 2500])
def test_thinning_keeps_the_last_frame_and_the_order(frames: int) -> None:
    bodies = Rehearsal(8).truth(0).bodies
    all_frames = [(Truth(run=0, tick=tick, time=tick / 20, bodies=bodies), [float(tick)]) for tick in range(frames)]
    kept = Batch(frames=all_frames).thin_frames().frames
    ticks = [frame.tick for frame, _ in kept]
    assert len(ticks) * 8 <= BODIES
    assert ticks == sorted(ticks)
    assert [[float(tick)] for tick in ticks] == [distances for _, distances in kept]
    if frames:
        assert ticks[-1] == frames - 1
        assert len({b - a for a, b in itertools.pairwise(ticks)}) <= 1


@pytest.mark.parametrize(
    ("reached", "expected"),
    [
        ([None, None], [(0.0, "to 1")]),
        ([4.0, None], [(0.0, "to 1"), (4.0, "home")]),
        ([4.0, 9.0], [(0.0, "to 1"), (4.0, "home"), (9.0, "done")]),
        ([9.0, 4.0, None], [(0.0, "to 1"), (4.0, "to 1"), (9.0, "home")]),
    ],
)
def test_where_a_robot_drove_follows_from_when_it_was_there(
    reached: list[float | None], expected: list[tuple[float, str]]
) -> None:
    assert trip_starts(replace(HALF, reached=reached), home=True) == expected
