"""The recording is read back from the file and compared with the messages that were sent."""

import dataclasses
import socket
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from dashboard.fold import palette
from dashboard.fold.collect import Batch
from dashboard.fold.overlays import Joint, Overlay, TurnOrder
from dashboard.fold.scene import Scene, scene_of
from dashboard.rerun import Recordings
from dashboard.rerun.layout import blueprint
from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, WALL
from swarm.messages import Broadcast, Event, Events, Message, Mover, Phase, Truth
from tests.cli.test_analyze import NOTHING, status_of
from tests.dashboard.drawn import drawn, floor, played, sent
from tests.dashboard.fold.test_collect import PAIR, UNKNOWN, WALLED
from tests.dashboard.recorded import Recording
from tests.dashboard.rehearsal import TARGETS, Rehearsal

PLANS = "LineStrips2D:strips"
MOVING = ("robots", "heading", "sensors", "trails", "paths", "movers")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Rehearsal, Recording]:
    rehearsal = Rehearsal(3)
    return rehearsal, played(tmp_path_factory.mktemp("whole") / "run.rrd", rehearsal)


def test_everything_is_there_and_on_one_timeline(whole: tuple[Rehearsal, Recording]) -> None:
    recording = whole[1]
    assert recording.entities == (
        {"/world", "/world/map", "/world/targets", "/world/targets/names", "/world/homes", "/world/border"}
        | {f"/world/{name}" for name in MOVING}
        | {"/world/contacts", "/world/held", "/world/waits", "/world/plans", "/world/plans/ends", "/world/plans/order"}
        | {"/rules", "/distance", "/wheels/left", "/wheels/right", "/fleet", "/events"}
        | {f"/progress/r{number}" for number in (1, 2, 3)}
    )
    assert recording.timelines == {"sim_time"}


def test_every_frame_is_where_the_robots_were(whole: tuple[Rehearsal, Recording]) -> None:
    rehearsal, recording = whole
    rows = recording.rows("/world/robots", "Points2D:positions")
    assert [time for time, _ in rows] == pytest.approx([tick / 20 for tick in range(0, rehearsal.ticks + 1, 2)])
    for time, spots in rows[:: len(rows) // 20]:
        truth = rehearsal.truth(round(time * 20))
        np.testing.assert_allclose(spots, [(body.x, body.y) for body in truth.bodies], atol=1e-5)


def test_headings_point_where_the_robots_look(whole: tuple[Rehearsal, Recording]) -> None:
    rehearsal, recording = whole
    time, strips = recording.rows("/world/heading", "LineStrips2D:strips")[300]
    for (start, end), body in zip(strips, rehearsal.truth(round(time * 20)).bodies, strict=True):
        assert np.arctan2(end[1] - start[1], end[0] - start[0]) == pytest.approx(body.yaw, abs=1e-4)


def test_lanes_tell_the_mission(whole: tuple[Rehearsal, Recording]) -> None:
    words = [state for _, [state] in whole[1].rows("/progress/r1", "StateChange:state")]
    left = [word for word in words if word not in {"gives way", "ready"}]
    assert left == ["to 1", "to 2", "to 2", "to 3", "home", "done"]
    assert "gives way" in words
    (_, known), *_ = whole[1].rows("/progress/r1", "StateConfiguration:values")
    assert set(words) <= set(known)


def test_numbers_are_those_sent(whole: tuple[Rehearsal, Recording]) -> None:
    rehearsal, recording = whole
    time, speeds = recording.rows("/wheels/left", "Scalars:scalars")[200]
    sent = [body.left_v for body in rehearsal.truth(round(time * 20)).bodies]
    np.testing.assert_allclose(speeds, sent, atol=1e-5)
    assert recording.rows("/distance", "SeriesLines:names")[0][1] == ["r1", "r2", "r3"]
    distances = [row for _, row in recording.rows("/distance", "Scalars:scalars")]
    assert np.shape(distances) == (rehearsal.ticks // 2 + 1, 3)
    np.testing.assert_allclose(distances[-1], 0.0)


def test_targets_and_homes_stand_where_they_are(whole: tuple[Rehearsal, Recording]) -> None:
    rehearsal, recording = whole
    (_, spots), *_ = recording.rows("/world/targets/names", "Points2D:positions")
    np.testing.assert_allclose(spots, TARGETS, atol=1e-5)
    (_, squares), *_ = recording.rows("/world/homes", "LineStrips2D:strips")
    middles = [np.mean(square[:4], axis=0) for square in squares]
    np.testing.assert_allclose(middles, [(body.x, body.y) for body in rehearsal.truth(0).bodies], atol=1e-5)


def test_held_cells_are_those_sent(whole: tuple[Rehearsal, Recording]) -> None:
    rehearsal, recording = whole
    rows = recording.rows("/world/held", "Boxes2D:half_sizes")
    assert rows[-1][0] == pytest.approx(rehearsal.ticks / 20, abs=0.1)
    for time, sizes in rows[:: len(rows) // 10]:
        assert len(sizes) == sum(len(body.held) for body in rehearsal.truth(round(time * 20)).bodies)


def test_a_joint_plan_is_drawn_from_where_the_robots_are_until_it_is_done(whole: tuple[Rehearsal, Recording]) -> None:
    rehearsal, recording = whole
    rows = recording.rows("/world/plans", PLANS)
    ends = dict(recording.rows("/world/plans/ends", "Points2D:positions"))
    checked = 0
    for time, strips in rows:
        bodies = rehearsal.truth(round(time * 20)).bodies
        following = {(np.float32(body.x), np.float32(body.y)) for body in bodies if body.members}
        lines = [strip for strip in strips if len(strip) < 33]  # the others are rings
        starts = {(np.float32(line[0][0]), np.float32(line[0][1])) for line in lines}
        assert starts <= following
        assert sorted(map(tuple, ends[time])) == sorted(tuple(line[-1]) for line in lines)
        checked += len(starts)
    assert checked > 100
    assert rows[-1][1] == []
    orders = [labels for _, labels in recording.rows("/world/plans/order", "Points2D:labels")]
    assert ["r1 > r2 > r3"] in [labels[:1] for labels in orders]
    assert orders[-1] == []


def test_who_follows_a_joint_plan_has_no_path_of_its_own(whole: tuple[Rehearsal, Recording]) -> None:
    rehearsal, recording = whole
    rows = recording.rows("/world/paths", PLANS)
    for frame in range(0, rehearsal.ticks, 60):
        paths = next(strips for time, strips in reversed(rows) if time <= frame / 20)
        for path, body in zip(paths, rehearsal.truth(frame).bodies, strict=True):
            assert not (path and body.members)
    assert any(path for _, paths in rows for path in paths)


def test_what_lies_over_the_floor_is_not_left_out_when_drawings_are_rare(tmp_path: Path) -> None:
    """A fleet faster than real time: the lines of a joint plan vanish when it is done, not a drawing later."""
    rows = played(tmp_path / "run.rrd", Rehearsal(2), every=400).rows("/world/held", "Boxes2D:half_sizes")
    assert max(np.diff([time for time, _ in rows])) < 2.5, "of 20 s between two drawings"


def test_y_is_up(whole: tuple[Rehearsal, Recording]) -> None:
    (_, [matrix]), *_ = whole[1].rows("/world", "Transform3D:mat3x3")
    assert matrix == [1, 0, 0, 0, -1, 0, 0, 0, 1]


def test_a_robot_has_one_colour_everywhere(whole: tuple[Rehearsal, Recording]) -> None:
    expected = [(red << 24) | (green << 16) | (blue << 8) | 255 for red, green, blue in map(palette.robot, range(3))]
    for entity, kind in (("/world/robots", "Points2D"), ("/world/paths", "LineStrips2D"), ("/distance", "SeriesLines")):
        assert whole[1].rows(entity, f"{kind}:colors")[0][1] == expected


def test_all_text_is_ascii(whole: tuple[Rehearsal, Recording]) -> None:
    events = [text for _, [text] in whole[1].rows("/events", "TextLog:text")]
    assert len(events) == 3 * 4
    assert all(text.isascii() for text in events)
    totals = [text for _, [text] in whole[1].rows("/fleet", "TextDocument:text")]
    assert all(text.isascii() and text.startswith("**") for text in totals)


def test_few_drawings_leave_no_change_out(tmp_path: Path) -> None:
    """A dashboard that is slow draws rarely: the lanes, the events and the frames are all there."""
    rehearsal = Rehearsal(2)
    often, rarely = (played(tmp_path / f"{every}.rrd", rehearsal, ticks=360, every=every) for every in (2, 360))
    for entity, component in (
        ("/progress/r2", "StateChange:state"),
        ("/events", "TextLog:text"),
        ("/world/robots", "Points2D:positions"),
    ):
        assert often.rows(entity, component) == rarely.rows(entity, component)


def test_a_restart_is_a_recording_of_its_own(tmp_path: Path) -> None:
    runs = [Rehearsal(2, run=1), Rehearsal(2, run=2)]
    first = drawn(tmp_path / "run.rrd", [floor(runs[0]), *(part for run in runs for part in sent(run, range(201)))])
    for recording in (first, Recording(tmp_path / "run-run2.rrd")):
        assert len(recording.rows("/world/robots", "Points2D:positions")) == 101
        assert [word for _, [word] in recording.rows("/progress/r1", "StateChange:state")][-1] == "to 2"


def test_a_robot_that_came_later_is_drawn_from_then_on_in_a_recording_of_its_own(tmp_path: Path) -> None:
    few, more = Rehearsal(2), Rehearsal(3)
    messages: list[Message] = [floor(few), few.clock(0), few.truth(2), few.truth(4)]
    messages += [floor(more), more.clock(5), more.truth(6), *(more.state(n, 6) for n in range(3)), more.truth(8)]
    before, after = drawn(tmp_path / "run.rrd", messages), Recording(tmp_path / "run-run2.rrd")
    counts = [[len(places) for _, places in one.rows("/world/robots", "Points2D:positions")] for one in (before, after)]
    assert counts[0][-2:] == [2, 2]
    assert counts[1][-2:] == [3, 3]
    assert "/progress/r3" in after.entities


def test_a_changed_map_is_drawn_again(tmp_path: Path) -> None:
    rehearsal = Rehearsal(1)
    before = floor(rehearsal)
    rehearsal.scenario.map.cells[10, 20] = 1
    recording = drawn(tmp_path / "run.rrd", [before, rehearsal.clock(0), before, floor(rehearsal)])
    images = [
        np.array(row, dtype=np.uint8).reshape(20, 28, 3) for _, [row] in recording.rows("/world/map", "Image:buffer")
    ]
    assert len(images) == 2, "what has not changed is not drawn again"
    assert tuple(images[-1][10, 20]) == palette.WALL
    assert tuple(images[-1][10, 21]) == palette.FLOOR


def test_a_floor_that_is_none_is_said_and_skipped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = floor(rehearsal := Rehearsal(2))
    broken = replace(good, packed=replace(good.packed, cells=b""))
    recording = drawn(tmp_path / "run.rrd", [broken, rehearsal.clock(0), good, rehearsal.truth(0)])
    assert len(recording.rows("/world/map", "Image:buffer")) == 1
    (said,) = capsys.readouterr().out.splitlines()
    assert said.startswith("dashboard: ")


def test_a_late_dashboard_shows_what_it_missed(tmp_path: Path) -> None:
    """Clock, states, plans and map are fetched, in any order; then the run goes on."""
    rehearsal = Rehearsal(2)
    late: list[Message] = [rehearsal.clock(600), *(rehearsal.state(n, 600) for n in range(2))]
    late += [*(rehearsal.plan(n, 600) for n in range(2)), floor(rehearsal), rehearsal.truth(602)]
    recording = drawn(tmp_path / "run.rrd", late)
    assert [word for _, [word] in recording.rows("/progress/r1", "StateChange:state")] == ["to 2"]
    assert len(recording.rows("/world/paths", "LineStrips2D:strips")) == 1
    assert "/world/homes" not in recording.entities


def test_a_late_dashboard_shows_the_stops_before_and_the_totals_as_the_world_has_measured_them(tmp_path: Path) -> None:
    rehearsal = Rehearsal(2)
    row = replace(NOTHING, reached=[2.5, 9.0, None, None])
    told = replace(status_of(dict.fromkeys(rehearsal.names, row)), run=0, contacts={"wall": 3})
    late: list[Message | None] = [floor(rehearsal), rehearsal.clock(600)]
    late += [rehearsal.state(number, 600) for number in range(2)]
    for tick in range(600, 641):
        late += [message for _, message, _ in rehearsal.messages(tick)]
        late += [told, None] if tick % 20 == 0 else []
    recording = drawn(tmp_path / "run.rrd", late)
    lanes = [(time, word) for time, [word] in recording.rows("/progress/r1", "StateChange:state")]
    assert lanes[:3] == [(0.0, "to 1"), (2.5, "to 2"), (9.0, "to 3")]
    assert all(time >= 30.0 for time, _ in lanes[3:])
    labels = recording.rows("/world/heading", "LineStrips2D:labels")
    assert min(time for time, _ in labels) >= 30.0, "names are those of now"
    assert "; 3 contacts" in recording.rows("/fleet", "TextDocument:text")[-1][1][0]


def test_a_dashboard_that_comes_in_a_pause_shows_poses_and_each_event_once(tmp_path: Path) -> None:
    """All that is fetched comes once more, as after a restart; nothing is drawn twice."""
    rehearsal = Rehearsal(2)
    events = [Event(run=0, tick=n, time=n / 20, robot="r1", kind="note", text=f"number {n}") for n in range(5)]
    kept: list[Message] = [replace(rehearsal.clock(600), phase=Phase.PAUSED), floor(rehearsal), Events(events=events)]
    recording = drawn(tmp_path / "run.rrd", [*kept, rehearsal.truth(600), *kept, events[-1]])
    assert len(recording.rows("/world/robots", "Points2D:positions")) == 1
    texts = [text for _, [text] in recording.rows("/events", "TextLog:text")]
    assert [text.count(event.text) for text, event in zip(texts, events, strict=True)] == [1] * 5


def test_what_is_not_there_is_left_out(tmp_path: Path) -> None:
    """A robot that no frame shows, an event of nobody, frames of nobody: none of it stops the drawing."""
    rehearsal = Rehearsal(2)
    recording = drawn(
        tmp_path / "run.rrd",
        [
            floor(rehearsal),
            rehearsal.clock(0),
            Truth(run=0, tick=2, time=0.1, bodies=rehearsal.truth(2).bodies[:1]),
            Truth(run=0, tick=4, time=0.2, bodies=[]),
            Event(run=0, tick=4, time=0.2, robot="somebody", kind="odd", text="two\nlines"),
        ],
    )
    rows = recording.rows("/world/robots", "Points2D:positions")
    assert np.isnan(rows[0][1][1]).all()
    assert np.isnan(rows[1][1]).all()


def test_moving_obstacles_are_drawn_where_they_are(tmp_path: Path) -> None:
    rehearsal = Rehearsal(1)
    disc = Mover(x=2.0, y=3.0, yaw=0.0, radius=0.5, size=(0.0, 0.0))
    box = Mover(x=5.0, y=5.0, yaw=np.pi / 2, radius=0.0, size=(2.0, 1.0))
    frames = [
        Truth(run=0, tick=tick, time=tick / 20, bodies=[], movers=movers)
        for tick, movers in enumerate(([disc, box], [], [box]))
    ]
    recording = drawn(tmp_path / "run.rrd", [floor(rehearsal), rehearsal.clock(0), *frames])
    rows = [strips for _, strips in recording.rows("/world/movers", "LineStrips2D:strips")]
    assert [len(strips) for strips in rows] == [2, 0, 1]
    np.testing.assert_allclose(np.hypot(*(np.array(rows[0][0]) - (2.0, 3.0)).T), 0.5, atol=1e-5)
    np.testing.assert_allclose(np.ptp(rows[2][0], axis=0), (1.0, 2.0), atol=1e-5)


def test_what_lies_over_the_floor_is_drawn(tmp_path: Path) -> None:
    rehearsal, recorder = Rehearsal(2), Recordings(serve=None, record=tmp_path / "run.rrd")
    view = recorder.begin("layers", scene_of(floor(rehearsal)), rehearsal.names, rehearsal.names)
    view.draw(Batch())
    line = [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)]
    nothing = Overlay(time=2.0, spots={}, rules="", held={}, waits=[], joint=[])
    led = Joint(leader="r2", ways={"r2": line}, turns=[TurnOrder(at=(2.0, 1.0), robots="r2 > r1 \u2192")])
    first = nothing._replace(
        time=0.5,
        rules="| rule | strength |\n|---|---|\n| left is near \u2192 fast | 0.5 |",
        held={"r2": [(1.0, 1.0, 0.5, 0.5)], "nobody": [(0.0, 0.0, 1.0, 1.0)]},
        waits=[((1.0, 1.0), (2.0, 1.0))],
    )
    overlays = [
        first,
        nothing._replace(time=1.0, joint=[led], spots={"r2": (1.0, 1.0)}),
        nothing._replace(time=1.5, joint=[Joint(leader="nobody", ways={"nobody": line}, turns=[])]),
        nothing,
        nothing._replace(time=2.5),
    ]
    view.draw(Batch(overlays=overlays))
    recorder.close()
    recording = Recording(tmp_path / "run.rrd")
    assert {"/rules", "/world/held", "/world/waits"} <= recording.entities
    assert len(recording.rows("/world/held", "Boxes2D:half_sizes")[0][1]) == 1
    plans = recording.rows("/world/plans", PLANS)
    assert [(time, len(strips)) for time, strips in plans] == [(1.0, 2), (1.5, 1), (2.0, 0)], "the ring is about r2"
    assert recording.rows("/world/plans/order", "Points2D:labels")[0][1] == ["r2 > r1 ?"]


def test_a_file_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    recorder, rehearsal = Recordings(serve=None, record=tmp_path), Rehearsal(1)
    with pytest.raises(ConfigError, match="expected to write"):
        recorder.begin("no", scene_of(floor(rehearsal)), rehearsal.names, ())


def test_the_server_listens_on_loopback_only() -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    recorder, rehearsal = Recordings(serve=("127.0.0.1", port), record=None), Rehearsal(1)
    recorder.begin("served", scene_of(floor(rehearsal)), rehearsal.names, ())
    assert recorder.url == f"rerun+http://127.0.0.1:{port}/proxy"
    socket.create_connection(("127.0.0.1", port), timeout=5).close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", port), timeout=5)
    recorder.close()


@pytest.mark.parametrize("rarely", [False, True])
def test_contacts_are_marked_where_they_happened_from_then_on(tmp_path: Path, rarely: bool) -> None:
    rehearsal = Rehearsal(2)
    messages: list[Message | None] = []
    for message in (floor(rehearsal), rehearsal.clock(0), *PAIR, WALLED, UNKNOWN):
        messages += [message] if rarely else [message, None]
    recording = drawn(tmp_path / "run.rrd", messages)
    assert recording.rows("/world/contacts", "Points2D:positions") == [(0.5, [[2, 3]]), (1.5, [[2, 3], [1, 1.5]])]
    assert recording.rows("/world/contacts", "Points2D:labels")[-1][1] == [
        "0.5 s: r1 touches robot r2",
        "1.5 s: r1 touches wall",
    ]


def test_sensors_and_held_cells_are_those_of_a_few_or_of_one(tmp_path: Path) -> None:
    rehearsal = Rehearsal(9)
    messages = [one for tick in range(0, 41, 2) for one in (rehearsal.clock(tick), rehearsal.truth(tick))]
    recording = drawn(tmp_path / "run.rrd", [floor(rehearsal), *messages], selected="r4")
    assert {len(fans) for _, fans in recording.rows("/world/sensors", "LineStrips2D:strips")} == {3}
    ((_, held), *_) = recording.rows("/world/held", "Boxes2D:colors")
    assert set(held) == {int("{:02x}{:02x}{:02x}ff".format(*palette.robot(3)), 16)}
    few = played(tmp_path / "few.rrd", Rehearsal(8), ticks=20)
    assert {len(fans) for _, fans in few.rows("/world/sensors", "LineStrips2D:strips")} == {3 * 8}


def test_names_are_white_whatever_the_colour_of_their_robot(whole: tuple[Rehearsal, Recording]) -> None:
    recording = whole[1]
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
