"""What of a fleet is drawn of everybody, of a few and of one; contacts, names, the border, floors that are learned."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from dashboard.fold import palette
from dashboard.fold.collect import totals
from dashboard.fold.naming import Touch, touches
from dashboard.fold.overlays import detailed
from dashboard.fold.progress import Progress, fold
from dashboard.fold.scene import Scene, scene_of
from dashboard.rerun import Recordings
from dashboard.rerun.layout import blueprint
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, WALL
from swarm.messages import Activity, Broadcast, Event, Message
from tests.dashboard.drawn import drawn, floor, played
from tests.dashboard.recorded import Recording
from tests.dashboard.rehearsal import RATE, Rehearsal

MARKS = "/world/contacts"


def touch(tick: int, robot: str, text: str, at: tuple[float, float] | None) -> Event:
    return Event(run=0, tick=tick, time=tick / RATE, robot=robot, kind="contact", text=text, at=at)


PAIR = [touch(10, "r1", "touches robot r2", (2.0, 3.0)), touch(10, "r2", "touches robot r1", (2.0, 3.0))]
WALLED = touch(30, "r1", "touches wall", (1.0, 1.5))
UNKNOWN = touch(40, "r1", "touches wall", None)


def test_a_contact_of_two_robots_is_one_touch_and_one_without_a_place_none() -> None:
    other = replace(WALLED, kind="reached")
    assert touches([*PAIR, WALLED, UNKNOWN, other]) == [
        Touch(0.5, (2.0, 3.0), "0.5 s: r1 touches robot r2"),
        Touch(1.5, (1.0, 1.5), "1.5 s: r1 touches wall"),
    ]


@pytest.mark.parametrize("rarely", [False, True])
def test_contacts_are_marked_where_they_happened_from_then_on(tmp_path: Path, rarely: bool) -> None:
    rehearsal = Rehearsal(2)
    messages: list[Message | None] = []
    for message in (floor(rehearsal), rehearsal.clock(0), *PAIR, WALLED, UNKNOWN):
        messages += [message] if rarely else [message, None]
    recording = drawn(tmp_path / "run.rrd", messages)
    assert recording.rows(MARKS, "Points2D:positions") == [(0.5, [[2, 3]]), (1.5, [[2, 3], [1, 1.5]])]
    assert recording.rows(MARKS, "Points2D:labels")[-1][1] == ["0.5 s: r1 touches robot r2", "1.5 s: r1 touches wall"]


def test_sensors_and_held_cells_are_those_of_a_few_or_of_one(tmp_path: Path) -> None:
    rehearsal = Rehearsal(9)
    messages = [one for tick in range(0, 41, 2) for one in (rehearsal.clock(tick), rehearsal.truth(tick))]
    recording = drawn(tmp_path / "run.rrd", [floor(rehearsal), *messages], selected="r4")
    assert {len(fans) for _, fans in recording.rows("/world/sensors", "LineStrips2D:strips")} == {3}
    ((_, held), *_) = recording.rows("/world/held", "Boxes2D:colors")
    assert set(held) == {int("{:02x}{:02x}{:02x}ff".format(*palette.robot(3)), 16)}
    few = played(tmp_path / "few.rrd", Rehearsal(8), ticks=20)
    assert {len(fans) for _, fans in few.rows("/world/sensors", "LineStrips2D:strips")} == {3 * 8}


@pytest.mark.parametrize(
    ("robots", "selected", "expected"),
    [(8, "r1", 8), (9, "r3", ("r3",)), (9, None, ("r1",)), (9, "nobody", ("r1",)), (0, None, ())],
)
def test_whose_details_are_drawn(robots: int, selected: str | None, expected: int | tuple[str, ...]) -> None:
    names = tuple(f"r{number}" for number in range(1, robots + 1))
    assert detailed(names, selected) == (names if isinstance(expected, int) else expected)


def test_names_are_white_whatever_the_colour_of_their_robot(tmp_path: Path) -> None:
    recording = played(tmp_path / "run.rrd", Rehearsal(3), ticks=300)
    labels = [row for _, row in recording.rows("/world/heading", "LineStrips2D:labels")]
    assert all([label.split()[0] for label in row] == ["r1", "r2", "r3"] for row in labels)
    ((_, colours),) = recording.rows("/world/heading", "LineStrips2D:colors")
    assert colours == [0xFFFFFFFF]
    assert recording.rows("/world/robots", "Points2D:show_labels")[0][1] == [False]


@pytest.mark.parametrize("yaw", [0.0, 0.5])
def test_the_border_is_round_the_whole_map(tmp_path: Path, yaw: float) -> None:
    rehearsal = Rehearsal(1)
    scene = scene_of(floor(rehearsal))
    turned = dataclasses.replace(scene, map=dataclasses.replace(scene.map, origin=Pose(1.0, 2.0, yaw)))
    recorder = Recordings(serve=None, record=tmp_path / "run.rrd")
    recorder.begin("border", turned, rehearsal.names, ())
    recorder.close()
    ((_, [strip]),) = Recording(tmp_path / "run.rrd").rows("/world/border", "LineStrips2D:strips")
    sides = np.linalg.norm(np.diff(strip, axis=0), axis=1)
    np.testing.assert_allclose(sides, [14.0, 10.0, 14.0, 10.0], atol=1e-4)
    np.testing.assert_allclose(strip[0], strip[4])
    np.testing.assert_allclose(strip[1], (1.0 + 14.0 * np.cos(yaw), 2.0 + 14.0 * np.sin(yaw)), atol=1e-4)


def test_a_floor_that_is_learned_grows_beside_the_true_one(tmp_path: Path) -> None:
    rehearsal = Rehearsal(2)
    told = {20: [0, 1], 60: [1, 27], 100: [1, 10**6]}
    messages: list[Message] = [floor(rehearsal, known=False)]
    for tick in range(0, 141, 2):
        messages += [
            replace(message, walls=told.get(tick, [])) if isinstance(message, Broadcast) else message
            for _, message, _ in rehearsal.messages(tick)
        ]
    recording = drawn(tmp_path / "run.rrd", messages)
    rows = recording.rows("/learned/cells", "SegmentationImage:buffer")
    solid = [np.flatnonzero(np.array(image, dtype=np.uint8) == WALL).tolist() for _, [image] in rows]
    assert solid == [[], [0, 1], [0, 1, 27], [0, 1, 27]], "a cell outside the floor is left out"
    assert {image for _, [image] in rows for image in image} <= {FREE, WALL}
    assert "Floor as learned [m]" in str(view_names(scene_of(floor(rehearsal, known=False))))
    assert "Floor as learned [m]" not in str(view_names(scene_of(floor(rehearsal))))


def view_names(scene: Scene) -> list[str]:
    """Return the names of all views of a layout."""
    found, left = [], [blueprint(scene).root_container]
    while left:
        part = left.pop()
        found.append(str(getattr(part, "name", "")))
        left += getattr(part, "contents", []) if hasattr(part, "kind") else []
    return found


def test_wheels_are_in_tabs_behind_the_distance() -> None:
    names = view_names(scene_of(floor(Rehearsal(2))))
    assert {"Floor [m]", "Progress", "Fleet", "Distance to target [m]", "Left wheel [m/s]", "Events"} <= set(names)


def test_the_totals_come_first_and_count_everybody(tmp_path: Path) -> None:
    rehearsal = Rehearsal(3)
    progress = Progress()
    for tick in range(20 * RATE + 1):
        for _, message, _ in rehearsal.messages(tick):
            progress = fold(progress, message)
    for event in (*PAIR, WALLED):
        progress = fold(progress, event)
    reached = sum(progress.robot(name).reached for name in rehearsal.names)
    assert totals(progress).startswith(f"20 s, running: {reached} of 12 targets reached (")
    assert totals(progress).endswith("; 2 contacts")
    states = [progress.robot(name).activity for name in rehearsal.names]
    assert f"{states.count(Activity.DRIVE)} drives" in totals(progress)
    gone = replace(progress, present=frozenset({"r1"}))
    assert "2 not heard" in totals(gone)
    recording = played(tmp_path / "run.rrd", rehearsal, ticks=40)
    assert all(text.startswith("**") for _, [text] in recording.rows("/fleet", "TextDocument:text"))
