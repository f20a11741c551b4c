"""Films the box for the README: ``python -m docs.pictures.film`` runs the paper's mission, and writes box.webp.

It needs Chromium; about a minute and a half passes.
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

FILM: Final = Path(__file__).parent / "box.webp"
COMMAND: Final = ("run", "paper", "--robots", "4", "--dashboard", "box", "--wait", "--pace", "2", "--limit", "300")
SEEN: Final = {"width": 1240, "height": 720}  # px
SIZE: Final = (930, 540)  # px, of the film
EVERY: Final = 0.4  # s between two pictures
SHOWN: Final = 80  # ms for each
LAST: Final = 2000  # ms for the last
LONGEST: Final = 150.0  # s
QUALITY: Final = 42  # of 100
SELECTS: Final = ((4.0, "r2"), (14.0, None))  # s after go, and who is selected then


def main() -> int:
    """Make the film; return 2 if there is no Chromium."""
    if PROGRAM is None:
        print(LACKS, file=sys.stderr)
        return 2
    fleet = subprocess.Popen([sys.executable, "-m", "swarm.cli", *COMMAND], stdout=subprocess.PIPE, text=True)
    try:
        assert fleet.stdout is not None
        address = next(found[0] for line in fleet.stdout if (found := re.findall(r"http://\S+", line)))
        with browser() as chromium:
            page = chromium.new_page(viewport={"width": SEEN["width"], "height": SEEN["height"]})
            _opened(page, address)
            pictures = _filmed(page)
    finally:
        fleet.terminate()
        fleet.wait()
    first, *others = pictures
    shown = [SHOWN] * len(others) + [LAST]
    first.save(FILM, save_all=True, append_images=others, duration=shown, loop=0, quality=QUALITY, method=6)
    print(f"{FILM}: {len(pictures)} pictures, {FILM.stat().st_size / 1e6:.1f} MB")
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
        picture = Image.open(io.BytesIO(page.screenshot()))
        pictures.append(picture.convert("RGB").resize(SIZE, Image.Resampling.LANCZOS))
        if page.inner_text("#phase").startswith(("all done", "the run is over")):
            break
        sleep(max(0.0, len(pictures) * EVERY - (monotonic() - start)))
    return pictures


if __name__ == "__main__":
    sys.exit(main())
