"""The box's tab with Rerun's viewer, and a floor of ten thousand walls: a real browser on a real fleet."""

from contextlib import closing
from pathlib import Path

import msgspec
import pytest

from benchmarks.box import CELL, WALLS, floor
from swarm.bus import Endpoint
from swarm.errors import PeerError
from tests.dashboard.browsing import LACKS, PROGRAM, Box, browser
from tests.launch.actors import Fleet

seen = pytest.mark.skipif(PROGRAM is None, reason=LACKS)
pytestmark = pytest.mark.processes


@pytest.mark.long("a browser, and Rerun in it")
@seen
def test_rerun_is_in_a_tab_that_starts_it_and_ends_with_the_fleet(small: Path, tmp_runtime: Path) -> None:
    flags = ("--dashboard", "box", "--wait", "--serve")
    with Fleet(small, *flags, runtime=tmp_runtime) as fleet, fleet.bus() as bus, browser() as running:
        address = fleet.await_line("box: http").split()[-1]
        fleet.await_all(bus)
        box = Box(running, address, (12.0, 8.0))
        assert box.page.locator("iframe").count() == 0
        before = len(fleet.family)

        box.page.click("#tab_rerun")
        viewer = box.page.frame_locator("iframe")
        viewer.locator("canvas").first.wait_for()
        first = box.page.locator("iframe").get_attribute("src")
        fleet.remember_family()
        assert len(fleet.family) > before, "its process starts only when the tab is opened"

        box.page.click("#tab_floor")
        assert not box.page.locator("iframe").is_visible()
        box.click(9.5, 2.0)
        box.page.click("#tab_rerun")
        viewer.locator("canvas").first.wait_for()
        assert box.page.locator("iframe").get_attribute("src") == first, "it goes on behind the box"

        (dashboard,) = [one for one in fleet.family if "--ends-with" in one.cmdline()]
        dashboard.kill()
        dashboard.wait(10)
        box.page.click("#tab_rerun")
        box.page.wait_for_function("before => document.querySelector('iframe').src !== before", arg=first)
        viewer.locator("canvas").first.wait_for()
        fleet.remember_family()

        box.page.click("#tab_floor")
        box.page.click("#stop")
        box.page.click("#stop")
        assert fleet.end() == 1, fleet.text
        fleet.assert_nobody_is_left()
        assert {host.split(":")[0] for host in box.hosts} == {"127.0.0.1", "localhost"}, "no other host is asked"


def test_a_viewer_that_does_not_start_is_a_sentence(tmp_path: Path) -> None:
    from dashboard.box.viewer import RerunPage

    nobody = Endpoint("127.0.0.1", 0).claim()
    with closing(RerunPage(nobody, "no fleet")) as page, pytest.raises(PeerError, match="ended and said"):
        page.address()


RACKS = {
    "name": "racks",
    "map": {"text": floor(), "cell": CELL},
    "start": {"poses": [[2.0, 2.0, 0.0], [2.0, 5.0, 0.0]]},
    "own_targets": [[[6.0, 2.0]], [[2.0, 9.0]]],
}


@pytest.mark.long("a browser draws 10,000 walls")
@seen
def test_ten_thousand_walls_are_drawn_and_one_is_taken_away(tmp_runtime: Path) -> None:
    lines = floor().split()
    assert floor().count("#") > WALLS
    (file := tmp_runtime / "racks.yaml").write_bytes(msgspec.yaml.encode(RACKS))
    size = (CELL * len(lines[0]), CELL * len(lines))
    flags = ("--dashboard", "box", "--wait", "--serve")
    with Fleet(file, *flags, runtime=tmp_runtime) as fleet, fleet.bus() as bus, browser() as running:
        address = fleet.await_line("box: http").split()[-1]
        fleet.await_all(bus)
        box = Box(running, address, size)

        def middle(character: str, number: int) -> tuple[float, float]:
            """Return the middle of a cell with eight like it around, so that no edge is near."""
            around = [(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1)]
            found = [
                (column, row)
                for row in range(1, len(lines) - 1)
                for column in range(1, len(lines[0]) - 1)
                if all(lines[row + r][column + c] == character for r, c in around)
            ]
            column, row = found[number * len(found) // 5]
            return CELL * (column + 0.5), size[1] - CELL * (row + 0.5)

        walls = [box.colour(*middle("#", number)) for number in range(5)]
        free = [box.colour(*middle(".", number)) for number in range(1, 5)]
        assert walls == [walls[0]] * 5, "every rack has the colour of a wall"
        assert walls[0] not in free

        taken = middle("#", 2)
        box.use("erase")
        box.drag((taken[0] - 1.0, taken[1] - 0.5), (taken[0] + 1.0, taken[1] + 0.5))
        box.await_text("#events", "the floor was cleared")
        box.await_other_colour(*taken, walls[0])
        box.page.click("#go")
        box.await_text("#phase", "all done")
        assert box.complaints == []
