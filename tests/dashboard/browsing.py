"""A real browser in front of the box: Debian's Chromium without a window, steered by Playwright."""

from collections.abc import Iterator
from contextlib import contextmanager
from shutil import which
from time import monotonic
from typing import Final

from playwright.sync_api import Browser, Page, Request, sync_playwright

PROGRAM: Final = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := which(name))), None
)
LACKS: Final = "no Chromium on this machine: apt-get install chromium"
PATIENCE: Final = 60_000  # ms
WIDE: Final = (20.0, 14.0)  # m, the floor of scenarios/box.yaml
MARGIN: Final = 14  # px around the floor when all of it is shown


@contextmanager
def browser() -> Iterator[Browser]:
    """Run a browser as long as the block lasts."""
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=PROGRAM, args=["--no-sandbox"])
        try:
            yield running
        finally:
            running.close()


COLOUR = """async ([x, y]) => {
  for (const twice of [1, 2]) document.querySelector("#layers input").click();  // the page draws anew
  await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
  const context = document.getElementById("floor").getContext("2d");
  return [...context.getImageData(x * devicePixelRatio, y * devicePixelRatio, 1, 1).data].slice(0, 3);
}"""


class Box:
    """The page of a box, its mouse in metres of the floor; what the browser complains of is kept."""

    def __init__(self, browser: Browser, address: str, floor_size: tuple[float, float] = WIDE) -> None:
        self._size = floor_size  # m
        self.page: Page = browser.new_page(viewport={"width": 1280, "height": 800})
        self.page.set_default_timeout(PATIENCE)
        self.complaints: list[str] = []
        self.hosts: set[str] = set()
        self.page.on("console", lambda line: self.complaints.append(line.text) if line.type == "error" else None)
        self.page.on("pageerror", lambda fault: self.complaints.append(str(fault)))
        self.page.on("request", lambda request: self.hosts.add(request.url.split("/")[2]))
        self.page.on("requestfailed", self._failed)
        self.page.goto(address)
        self.page.wait_for_selector("#rows li")
        self.page.wait_for_selector("html[data-phase=waiting]")
        floor = self.page.locator("#floor").bounding_box()
        assert floor is not None
        self._floor = floor["x"], floor["y"], floor["width"], floor["height"]

    def _failed(self, request: Request) -> None:
        """Forget a host that the browser did not ask, because the page's policy forbids it."""
        if "csp" in (request.failure or ""):
            self.hosts.discard(request.url.split("/")[2])

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel of a point [m], as the page shows the whole floor."""
        left, top, width, height = self._floor
        wide, high = self._size
        scale = min((width - 2 * MARGIN) / wide, (height - 2 * MARGIN) / high)
        return left + width / 2 + (x - wide / 2) * scale, top + height / 2 - (y - high / 2) * scale

    def await_other_colour(self, x: float, y: float, colour: list[int]) -> None:
        """Wait until a point [m] of the floor has another colour: the page draws a change a moment after it hears of it."""
        deadline = monotonic() + PATIENCE / 1000
        while self.colour(x, y) == colour:
            assert monotonic() < deadline, f"({x:g}, {y:g}) keeps its colour"

    def use(self, tool: str) -> None:
        """Choose a tool."""
        self.page.click(f"[data-tool={tool}]")

    def click(self, x: float, y: float) -> None:
        """Click on the floor."""
        self.page.mouse.click(*self.at(x, y))

    def drag(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        """Drag over the floor."""
        self.page.mouse.move(*self.at(*low))
        self.page.mouse.down()
        self.page.mouse.move(*self.at(*high), steps=4)
        self.page.mouse.up()

    def colour(self, x: float, y: float) -> list[int]:
        """Return the colour at a point [m] of the floor, as it is drawn next: red, green, blue, 0 to 255."""
        left, top = self.at(x, y)
        drawn: list[int] = self.page.evaluate(COLOUR, [left - self._floor[0], top - self._floor[1]])
        return drawn

    def await_text(self, selector: str, text: str) -> None:
        """Wait until an element holds a text."""
        self.page.locator(selector, has_text=text).first.wait_for()
