"""Takes a picture of a recording with Rerun's own viewer, without a screen.

    python -m docs.pictures.make paper.rrd 30 docs/pictures/paper.png
    python -m docs.pictures.make paper.rrd 0 docs/pictures/paper.webp --until 90

The first draws the simulated second 30, the other one is a moving picture of all the way to second 90. Both need a
Vulkan driver in software (Debian: ``apt-get install mesa-vulkan-drivers``). What a view complains of is said, and makes
the exit status 1.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from time import monotonic, sleep
from typing import Final

from PIL import Image
from rerun.experimental import ViewerClient

from dashboard.mode import viewer_program
from swarm.bus import Endpoint

PATIENCE: Final = 30.0  # s, wall time for the viewer to come up, and for the file to be loaded
SETTLE: Final = 2.5  # s, wall time for the viewer to draw what it was told

COLOURS: Final = 128  # of a still picture
QUALITY: Final = 50  # per cent, of a moving one
FRAME: Final = 150  # ms that a moving picture shows each of its frames
TRIES: Final = 4  # of 15 s
BAR: Final = 36  # pixels; the window's own bar at the top is left out


@contextmanager
def viewer(size: str = "1600x1000") -> Iterator[ViewerClient]:
    """Run a viewer without a screen as long as the block lasts.

    Raises:
        RuntimeError: it ended at once, or never answered; a machine without a graphics driver looks like that.
    """
    program = viewer_program()
    if program is None:
        raise RuntimeError("expected Rerun's native viewer, found none; pip install rerun-sdk")
    port = Endpoint("127.0.0.1", 0).claim().port
    arguments = [str(program), "--headless", "--port", str(port), "--window-size", size, "--hide-welcome-screen"]
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield _connected(port, process)
    finally:
        process.terminate()
        process.wait(10)


def _connected(port: int, process: "subprocess.Popen[bytes]") -> ViewerClient:
    end = monotonic() + PATIENCE
    while monotonic() < end and process.poll() is None:
        try:
            client = ViewerClient(f"rerun+http://127.0.0.1:{port}/proxy")
            client.get_state()
        except (ConnectionError, RuntimeError):
            sleep(0.2)
        else:
            return client
    raise RuntimeError("rerun --headless: expected a viewer, got none; install a graphics driver (mesa-vulkan-drivers)")


def show(client: ViewerClient, recording: Path, time: float) -> list[str]:
    """Open a recording, stand at a simulated time [s], and give what the views complain of."""
    client.open(str(recording.resolve()))
    end = monotonic() + PATIENCE
    while client.get_state().loading and monotonic() < end:
        sleep(0.2)
    sleep(SETTLE)
    client.set_time("sim_time", duration=time, play_state="paused")
    sleep(SETTLE)
    return [f"{view.name}: {report.summary}" for view in client.get_state().views for report in view.reports]


def shot(client: ViewerClient) -> Image.Image:
    """Take what the window shows, without its bar; a busy machine may need another try."""
    for tries_left in reversed(range(TRIES)):
        try:
            taken = client.take_screenshot()
            break
        except TimeoutError:
            if not tries_left:
                raise
    picture = Image.open(BytesIO(taken)).convert("RGB")
    return picture.crop((0, BAR, *picture.size))


def film(client: ViewerClient, times: Iterator[float], width: int) -> list[Image.Image]:
    """Take one picture at each time, ``width`` pixels wide."""
    pictures = []
    for time in times:
        client.set_time("sim_time", duration=time, play_state="paused")
        picture = shot(client)
        size = (width, round(picture.height * width / picture.width))
        pictures.append(picture.resize(size, Image.Resampling.LANCZOS))
    return pictures


def main() -> int:
    """Take one picture, or several as a moving one."""
    parser = argparse.ArgumentParser(description="A picture of a recording.")
    parser.add_argument("recording", type=Path)
    parser.add_argument("time", type=float, help="simulated second")
    parser.add_argument("picture", type=Path, help="a .png, or with --until a .webp")
    parser.add_argument("--until", type=float, help="last simulated second of a moving picture")
    parser.add_argument("--step", type=float, default=2.0, help="simulated seconds between two of its frames")
    parser.add_argument("--width", type=int, default=860, help="of the moving picture")
    parser.add_argument("--size", default="1600x1000", help="of the window")
    given = parser.parse_args()
    with viewer(given.size) as client:
        complaints = show(client, given.recording, given.time)
        if given.until is None:
            shot(client).quantize(COLOURS, dither=Image.Dither.NONE).save(given.picture, optimize=True)
        else:
            count = int((given.until - given.time) / given.step) + 1
            first, *others = film(client, (given.time + k * given.step for k in range(count)), given.width)
            first.save(given.picture, save_all=True, append_images=others, duration=FRAME, loop=0, quality=QUALITY)
    for complaint in complaints:
        print(complaint, file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
