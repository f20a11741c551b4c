"""The box as a person uses it: a real browser on a real fleet."""

from pathlib import Path

import pytest

from swarm.messages import MAP, Phase
from swarm.scenario.check import check
from swarm.scenario.load import load
from tests.dashboard.browsing import LACKS, PROGRAM, Box, browser
from tests.launch.actors import Fleet, await_clock, await_phase
from tests.test_docs import blocks

TOUCH = """async (at) => {
  const { state } = await import("/page/state.js");
  state.events = [...state.events, { kind: "contact", run: state.truth.run, robot: "r1", text: "touches wall", at }];
}"""
pytestmark = [pytest.mark.processes, pytest.mark.skipif(PROGRAM is None, reason=LACKS)]


def test_draw_a_world_go_watch_restart_and_be_refused(tmp_runtime: Path) -> None:
    flags = ("--dashboard", "box", "--wait", "--serve", "--pace", "3")
    with Fleet(Path("box"), *flags, robots=1, runtime=tmp_runtime) as fleet, fleet.bus() as bus, browser() as running:
        address = fleet.await_line("box: http").split()[-1]
        fleet.await_all(bus)
        box, other = Box(running, address), Box(running, address)

        box.page.click("#go")
        box.await_text("#said", "there is no target yet")

        box.use("wall")
        box.drag((8.25, 0.75), (8.25, 5.25))
        box.await_text("#events", "a wall was put up, 0.5 x 5.0 m")
        box.drag((3.25, 6.75), (5.75, 6.75))
        box.await_text("#events", "a wall was put up, 3.0 x 0.5 m")

        box.use("target")
        box.click(8.25, 3.0)  # on the wall
        box.page.click("#go")
        box.await_text("#said", "expected free floor, got a wall or obstacle")
        box.use("erase")
        box.click(8.25, 3.0)
        box.use("start")
        box.click(6.0, 3.0)
        box.use("target")
        for target in ((6.0, 1.5), (4.5, 3.0), (6.0, 4.5)):
            box.click(*target)
        box.page.locator("#speed").fill("1")
        box.page.click("#go")
        clock = await_phase(bus, Phase.RUNNING)
        assert (clock.run, clock.robots) == (1, ["r1"])
        floor = bus.fetch(MAP)[0]
        settings = floor.scenario.settings
        assert (len(settings.targets), settings.robot.speed_scale, floor.edits) == (3, 1.0, 0), (
            "walls and all are set up"
        )

        box.use("wall")
        box.drag((10.25, 8.25), (12.25, 8.25))  # while it drives
        box.await_text("#events", "a wall was put up, 2.5 x 0.5 m")
        box.await_text("#phase", "all done")
        box.await_text("#rows li.done", "done")
        other.await_text("#phase", "all done")

        plain = box.colour(9.0, 7.5)
        box.page.evaluate(TOUCH, [9.0, 7.5])
        red, green, blue = box.colour(9.0, 7.5)
        assert [red, green, blue] != plain
        assert red > green + 60 and red > blue + 60, "a contact is marked where it happened"  # noqa: PT018

        with box.page.expect_download() as saved:
            box.page.click("#save")
        saved.value.save_as(file := tmp_runtime / "saved.yaml")
        scenario = load(file)
        assert check(scenario, 1, 1).scenario.map.at(10.25, 8.25) == 1, "the wall is in the file"
        assert len(scenario.settings.targets) == 3

        (example,) = blocks("box.md", "js")
        answer = box.page.evaluate(f"async (address) => {{ {example} return answer; }}", address)
        assert answer["number"] == 1, "the page's own example gives an order"

        fleet.member("box").kill()
        other.page.wait_for_selector("html[data-phase=away]")
        fleet.await_line("box was ended by signal 9; started again")
        other.page.wait_for_selector("html[data-phase=running]")

        other.page.click("#restart")
        await_clock(bus, lambda told: told.run == 2)
        box.page.locator("#rows li .row").click()
        box.await_text("#one .does", "of 4 targets")
        box.await_text("#one .rules", "left wheel")
        box.page.click(".halt")
        box.await_text("#one .does", "was told to stop")

        box.page.click("#stop")
        box.page.click("#stop")
        assert fleet.end() == 1, fleet.text
        box.await_text("#phase", "the run is over")
        expected = ("409", "ERR_CONNECTION_", "ERR_SOCKET_NOT_CONNECTED")  # a refusal; a server was killed, or ended
        refused = [line for line in box.complaints if not any(mark in line for mark in expected)]
        assert refused == [], "no script fails, nothing breaks the page's policy"
        assert box.hosts == {address.split("/")[2]}, "no other host is asked"
