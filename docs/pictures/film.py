"""Films the box for the docs: ``python -m docs.pictures.film [box|past]`` runs the paper's mission, and writes a .webp.

``box`` shows the mission, ``past`` the slider that goes back in time. It needs Chromium; a minute or two pass.
"""

import io
import re
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep
from typing import Final

from PIL import Image
from playwright.sync_api import Page

from tests.dashboard.browsing import LACKS, PROGRAM, browser

FOLDER: Final = Path(__file__).parent
COMMAND: Final = ("run", "paper", "--dashboard", "box", "--wait", "--pace", "2", "--limit", "300")
ROBOTS: Final = {"box": "4", "past": "8"}
SEEN: Final = {"width": 1240, "height": 720}  # px
SIZE: Final = (930, 540)  # px, of the film
EVERY: Final = 0.4  # s between two pictures
SHOWN: Final = 80  # ms for each
SLOWLY: Final = 260  # ms for each of the past, to be read
LAST: Final = 2000  # ms for the last
LONGEST: Final = 150.0  # s
QUALITY: Final = 42  # of 100
SELECTS: Final = ((4.0, "r2"), (14.0, None))  # s after go, and who is selected then
BEGUN: Final = 15.0  # s after go, when the slider is taken
BACK: Final = (0.9, 0.8, 0.7, 0.6, 0.5, 0.42, 0.36, 0.3, 0.27, 0.25)  # of the slider's length
WAITS: Final = "#rows li.give_way .row"


def main() -> int:
    """Make the film; return 2 if there is no Chromium."""
    if PROGRAM is None:
        print(LACKS, file=sys.stderr)
        return 2
    what = sys.argv[1] if len(sys.argv) > 1 else "box"
    file, command = FOLDER / f"{what}.webp", (*COMMAND, "--robots", ROBOTS[what])
    fleet = subprocess.Popen([sys.executable, "-m", "swarm.cli", *command], stdout=subprocess.PIPE, text=True)
    try:
        assert fleet.stdout is not None
        address = next(found[0] for line in fleet.stdout if (found := re.findall(r"http://\S+", line)))
        with browser() as chromium:
            page = chromium.new_page(viewport={"width": SEEN["width"], "height": SEEN["height"]})
            _opened(page, address)
            pictures = _filmed(page) if what == "box" else _filmed_back(page)
    finally:
        fleet.terminate()
        fleet.wait()
    first, *others = pictures
    shown = [SHOWN if what == "box" else SLOWLY] * len(others) + [LAST]
    first.save(file, save_all=True, append_images=others, duration=shown, loop=0, quality=QUALITY, method=6)
    print(f"{file}: {len(pictures)} pictures, {file.stat().st_size / 1e6:.1f} MB")
    return 0


def _opened(page: Page, address: str) -> None:
    """Open the page as soon as the box serves it, and wait for the robots."""
    for _ in range(100):
        if page.request.get(address, fail_on_status_code=False, max_retries=20).ok:
            break
        sleep(0.1)
    page.goto(address)
    page.wait_for_selector("#rows li:nth-child(4)")
    page.wait_for_selector("html[data-phase=waiting]")


def _filmed(page: Page) -> list[Image.Image]:
    """Press go, and take pictures until all are done."""
    page.click("#go")
    pictures, selects, start = list[Image.Image](), list(SELECTS), monotonic()
    while (now := monotonic() - start) < LONGEST:
        if selects and now >= selects[0][0]:
            who = selects.pop(0)[1]
            page.click("#one .close" if who is None else f"#rows [data-robot={who}] .row")
        pictures.append(_picture(page))
        if page.inner_text("#phase").startswith(("all done", "the run is over")):
            break
        sleep(max(0.0, len(pictures) * EVERY - (monotonic() - start)))
    return pictures


def _picture(page: Page) -> Image.Image:
    picture = Image.open(io.BytesIO(page.screenshot()))
    return picture.convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)


def _filmed_back(page: Page) -> list[Image.Image]:
    """Press go, take the slider back to where robots wait, click one, go on a little, and come back to live."""
    page.click("#go")
    sleep(BEGUN)
    pictures = list[Image.Image]()

    def take(number: int, wait: float = EVERY) -> None:
        for _ in range(number):
            pictures.append(_picture(page))
            sleep(wait)

    take(5)
    slider = page.locator("#when").bounding_box()
    assert slider is not None
    height = slider["y"] + slider["height"] / 2
    page.mouse.move(slider["x"] + slider["width"] - 8, height)
    page.mouse.down()
    for part in BACK:
        page.mouse.move(slider["x"] + slider["width"] * part, height, steps=4)
        take(2)
    page.mouse.up()
    take(3)
    page.locator(WAITS).first.click()
    page.locator("#one .causes li").nth(1).wait_for()
    take(10)
    for _ in range(12):
        page.keyboard.press("Shift+ArrowRight")
        take(2)
    page.keyboard.press("l")
    take(6)
    return pictures


if __name__ == "__main__":
    sys.exit(main())
