"""The box in front of a fleet of two kinds: each robot is as large as it is, and a mix is asked for and saved."""

from pathlib import Path
from typing import Final

import pytest

from swarm.messages import MAP
from swarm.scenario.load import load
from tests.dashboard.browsing import LACKS, PROGRAM, Box, browser
from tests.dashboard.mixed import STARTS
from tests.launch.actors import Fleet, await_clock

FLOOR: Final = (20.4, 10.8)  # m
BESIDE: Final = 0.45  # m from a robot's middle: 0.1 m beside a cart, and 0.25 m beside a scout
pytestmark = [pytest.mark.processes, pytest.mark.skipif(PROGRAM is None, reason=LACKS)]


def test_a_fleet_of_two_kinds_is_told_apart_changed_and_saved(tmp_runtime: Path) -> None:
    flags = ("--robots", "cart=1,scout=3", "--dashboard", "box", "--wait", "--serve")
    with Fleet(Path("mixed"), *flags, robots=4, runtime=tmp_runtime) as fleet, fleet.bus() as bus, browser() as running:
        address = fleet.await_line("box: http").split()[-1]
        fleet.await_all(bus)
        box = Box(running, address, FLOOR)
        cart, scout = STARTS["r1"], STARTS["r3"]

        assert not box.page.locator("#robots").is_visible()
        fields = {kind: box.page.locator(f"#mix input[data-kind={kind}]") for kind in ("cart", "scout")}
        assert {kind: field.input_value() for kind, field in fields.items()} == {"cart": "1", "scout": "3"}
        titles = [row.get_attribute("title") or "" for row in box.page.locator("#rows .row").all()]
        assert [title.split(" is ")[0] for title in titles] == ["r1 (cart)", "r2 (scout)", "r3 (scout)", "r4 (scout)"]

        plain = box.colour(10.2, 5.4)
        inside = [box.colour(x - 0.27, y) for x, y, _ in (cart, scout)]
        assert [colour == plain for colour in inside] == [False, True], "a cart covers what a scout leaves free"
        box.click(scout[0] - BESIDE, scout[1])
        assert not box.page.locator("#one").is_visible()
        box.click(cart[0] - BESIDE, cart[1])
        box.await_text("#one .kind", "is of the kind cart: 0.35 m in radius; it drives at most 0.60 m/s")
        box.page.keyboard.press("Escape")

        fields["scout"].fill("0.5")
        fields["scout"].press("Enter")
        box.await_text("#said", "scout: expected a number of robots, 0 or more, got 0.5")
        fields["cart"].fill("2")
        fields["cart"].press("Enter")
        box.await_text("#hint", "drawn, not driven yet")
        box.page.click("#go")
        clock = await_clock(bus, lambda told: told.run == 1)
        assert clock.robots == [f"r{number}" for number in range(1, 6)]
        kinds = {"r1": "cart", "r2": "cart", "r3": "scout", "r4": "scout", "r5": "scout"}
        assert bus.fetch(MAP)[0].scenario.kinds == kinds
        box.page.locator("#rows li").nth(4).wait_for()

        with box.page.expect_download() as saved:
            box.page.click("#save")
        saved.value.save_as(file := tmp_runtime / "saved.yaml")
        settings = load(file).settings
        assert (settings.robots, list(settings.kinds)) == ({"cart": 2, "scout": 3}, ["cart", "scout"])
        assert settings.start.poses == [STARTS[name] for name in ("r1", "r2", "r3", "r4", "r5")]
        assert box.complaints == []
