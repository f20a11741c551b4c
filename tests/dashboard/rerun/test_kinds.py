"""The picture of a fleet whose robots are of several kinds: each is as wide as it is, and sees as far as it does."""

from pathlib import Path

import numpy as np
import pytest

from tests.dashboard.drawn import drawn
from tests.dashboard.mixed import KINDS, NAMES, RADII, STARTS, clock, floor, truth
from tests.dashboard.recorded import Recording

WIDTHS = [RADII[KINDS[name]] for name in NAMES]
STRIPS = "LineStrips2D:strips"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Return a recording in which r1 takes up a load and puts it down again."""
    path = tmp_path_factory.mktemp("mixed") / "run.rrd"
    frames = [truth(2), truth(4, r1=0.5), truth(6, r1=0.5), None, truth(8), truth(10), None, truth(12)]
    return drawn(path, [floor(), clock(), *frames])


def spans(strips: list[list[list[float]]]) -> list[float]:
    """Measure how wide each strip is along x [m]."""
    return [float(np.ptp(np.array(strip)[:, 0])) for strip in strips]


def test_each_robot_is_a_disc_of_its_own_size(recording: Recording) -> None:
    (_, radii), *_ = recording.rows("/world/robots", "Points2D:radii")
    np.testing.assert_allclose(radii, WIDTHS)
    for entity, share in (("/world/heading", 0.12), ("/world/trails", 0.2)):
        (_, widths), *_ = recording.rows(entity, "LineStrips2D:radii")
        np.testing.assert_allclose(widths, np.array(WIDTHS) * share)
    (_, labels), *_ = recording.rows("/world/robots", "Points2D:labels")
    assert labels == [f"{name} {KINDS[name]}" for name in NAMES]


def test_noses_and_homes_are_as_large_as_their_robots(recording: Recording) -> None:
    _, noses = recording.rows("/world/heading", STRIPS)[0]
    lengths = [float(np.hypot(*np.subtract(end, start))) for start, end in noses]
    np.testing.assert_allclose(lengths, np.array(WIDTHS) * 1.6, rtol=1e-5)
    (_, homes), *_ = recording.rows("/world/homes", STRIPS)
    np.testing.assert_allclose(spans(homes), np.array(WIDTHS) * 2.4, rtol=1e-5)


def test_sectors_begin_at_the_edge_of_their_robot(recording: Recording) -> None:
    rows = recording.rows("/world/sensors", STRIPS)
    for (_, fans), first in ((rows[0], 0.35), (rows[1], 0.5)):
        widths = [first, *WIDTHS[1:]]
        for number, (x, y, _) in enumerate(STARTS.values()):
            front = np.array(fans[3 * number + 1]) - (x, y)
            np.testing.assert_allclose(np.hypot(*front[0]), widths[number], rtol=1e-5)
            np.testing.assert_allclose(np.hypot(*front[1]), widths[number] + 0.5, rtol=1e-5)


def test_a_load_has_a_ring_as_long_as_it_is_carried(recording: Recording) -> None:
    rows = recording.rows("/world/loads", STRIPS)
    assert [(time, len(rings)) for time, rings in rows] == [
        (0.1, 0), (0.2, 1), (0.3, 1), (0.4, 0), (0.5, 0), (0.6, 0),
    ]  # fmt: skip
    np.testing.assert_allclose(spans(rows[1][1]), [1.0], rtol=1e-5)


def test_the_targets_of_a_kind_are_drawn_once_with_its_name(recording: Recording) -> None:
    (_, names), *_ = recording.rows("/world/targets/names", "Points2D:labels")
    assert names == ["cart: 1", "cart: 2", "scout: 1", "scout: 2", "scout: 3"]
    (_, values), *_ = recording.rows("/progress/r1", "StateConfiguration:values")
    assert values[:3] == ["to 1", "to 2", "home"]


def test_the_table_names_the_kinds(recording: Recording) -> None:
    text = recording.rows("/fleet", "TextDocument:text")[-1][1][0]
    assert "| r1 | cart |" in text
    assert "| r8 | scout |" in text


def test_kinds_that_are_told_later_are_drawn_from_then_on(tmp_path: Path) -> None:
    untold = drawn(tmp_path / "untold.rrd", [floor(told=False), clock(), truth(2)])
    (_, radii), *_ = untold.rows("/world/robots", "Points2D:radii")
    np.testing.assert_allclose(radii, [0.2])
    later = drawn(tmp_path / "later.rrd", [floor(told=False), clock(), truth(2), None, floor(), truth(4)])
    np.testing.assert_allclose(later.rows("/world/robots", "Points2D:radii")[-1][1], WIDTHS)


def test_a_fleet_without_loads_has_no_rings(tmp_path: Path) -> None:
    plain = drawn(tmp_path / "plain.rrd", [floor(), clock(), truth(2)])
    assert "/world/loads" not in plain.entities
