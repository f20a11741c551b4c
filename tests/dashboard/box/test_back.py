"""Why, and back in time, as a person uses it: a real browser on a real fleet, and its tape beside it."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from dashboard.box.tape_moments import Moments
from swarm.blackbox.explain.clauses import as_text
from swarm.blackbox.explain.source import open_moment_at
from swarm.messages import ACTION, Action, Do, Truth
from tests.dashboard.browsing import LACKS, PROGRAM, Box, browser
from tests.launch.actors import Fleet

FLOOR = (24.0, 24.0)  # m, of scenarios/crossing.yaml
SHOWN = """async () => {
  const { state } = await import("/page/state.js");
  return { truth: state.truth, past: state.past, selected: state.selected };
}"""
SETTLED = """() => {
  const [reading, when] = ["reading", "when"].map((id) => document.getElementById(id));
  return Math.round(20 * parseFloat(reading.textContent)) === Number(when.value);
}"""
pytestmark = [pytest.mark.processes, pytest.mark.skipif(PROGRAM is None, reason=LACKS)]


def shown(box: Box) -> dict[str, Any]:
    """Return the true poses that are drawn, the moment, and the selected robot."""
    found: dict[str, Any] = box.page.evaluate(SHOWN)
    return found


def press(box: Box, key: str, reading: str) -> None:
    box.page.keyboard.press(key)
    box.await_text("#reading", reading)


def paused_where_one_waits(box: Box) -> str:
    """Pause the run while a robot gives way; return that robot."""
    while True:
        box.page.locator("#rows li.give_way").first.wait_for()
        box.page.click("#pause")
        box.page.wait_for_selector("html[data-phase=paused]")
        waiting = [one["robot"] for one in shown(box)["truth"]["bodies"] if one["activity"] == "give_way"]
        if waiting:
            return str(waiting[0])
        box.page.click("#pause")
        box.page.wait_for_selector("html[data-phase=running]")


@pytest.mark.long("a fleet and a browser")
def test_click_a_robot_that_waits_go_back_in_time_and_to_live_again(tmp_runtime: Path) -> None:
    tape = tmp_runtime / "the tape.swarm"
    flags = ("--dashboard", "box", "--wait", "--serve", "--record", str(tape))
    with (
        Fleet(Path("crossing"), *flags, robots=8, runtime=tmp_runtime) as fleet,
        fleet.bus() as bus,
        browser() as running,
    ):
        address = fleet.await_line("box: http").split()[-1]
        fleet.await_all(bus)
        box = Box(running, address, FLOOR)
        assert box.page.locator("#when").is_disabled()
        box.await_text("#reading", "nothing is past")
        box.page.click("#tape summary")
        box.await_text("#tape p code", str(tape))
        box.await_text("#tape code", f"swarm replay '{tape}'")

        box.page.click("#go")
        waits = paused_where_one_waits(box)
        for _ in range(3):  # it is looked at, not looked at, and looked at again
            box.page.click(f"#rows li[data-robot={waits}] .row")
        box.await_text("#one .causes .note", "at ")
        box.await_text("#one .causes li", f"{waits} ")

        slider = box.page.locator("#when").bounding_box()
        assert slider is not None
        middle = slider["y"] + slider["height"] / 2
        box.page.mouse.move(slider["x"] + slider["width"] - 8, middle)
        box.page.mouse.down()
        for part in (0.9, 0.5, 0.7, 0.6):
            box.page.mouse.move(slider["x"] + slider["width"] * part, middle)
        box.page.mouse.up()
        box.page.wait_for_selector("html.past[data-phase=past]")
        box.page.wait_for_function(SETTLED)
        there = shown(box)
        tick = there["past"]["tick"]
        assert msgspec.convert(there["truth"], Truth) == Moments(tape).moment_at(tick / 20, 0).truth
        for button in ("#go", "#pause", "#restart", "#stop", "#save", "[data-tool=wall]", "#one .halt"):
            assert box.page.locator(button).is_disabled(), button
        box.page.keyboard.press("r")
        box.await_text("#said", "go back to live first")

        press(box, "ArrowLeft", f"{(tick - 1) / 20:.2f} s, past")
        press(box, "Shift+ArrowRight", f"{(tick + 19) / 20:.2f} s, past")
        press(box, "Shift+ArrowLeft", f"{(tick - 1) / 20:.2f} s, past")
        (clicked,) = [one for one in shown(box)["truth"]["bodies"] if one["robot"] == "r5"]
        box.click(clicked["x"], clicked["y"])
        box.await_text("#one h2", "r5")
        box.page.click("#one .ask")
        box.await_text("#one .causes .note", f"at {(tick - 1) / 20:.2f} s:")
        told = [line.strip() for line in as_text(open_moment_at(tape, (tick - 1) / 20).why("r5")).splitlines()]
        assert box.page.locator("#one .causes li:not(.note)").all_text_contents() == told
        box.await_text("#tape code", f"swarm why r5 '{tape}' --at {(tick - 1) / 20:.2f} --run 0")

        box.page.keyboard.press("l")
        box.page.wait_for_selector("html:not(.past)[data-phase=paused]")
        box.await_text("#reading", "live")
        assert shown(box)["truth"]["tick"] > tick
        box.page.click("#pause")
        box.page.wait_for_selector("html[data-phase=running]")

        box.page.click("#earlier", modifiers=["Shift"])
        box.page.wait_for_selector("html.past")
        bus.ask(ACTION, Action(do=Do.RESTART))
        box.page.wait_for_selector("html:not(.past)")
        box.page.wait_for_function("""() => document.getElementById("reading").textContent === "live" """)
        assert shown(box)["truth"]["run"] == 1, "a new run leads back to live"
        box.page.click("#earlier")
        box.page.click("#live")
        box.page.wait_for_selector("html:not(.past)")
        assert box.complaints == []
