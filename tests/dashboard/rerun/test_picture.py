"""Rerun's own viewer draws a recording without errors in any view."""

from ctypes.util import find_library
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

from tests.dashboard.drawn import played
from tests.dashboard.rehearsal import Rehearsal

pytestmark = [
    pytest.mark.processes,
    pytest.mark.skipif(
        not list(Path("/usr/share/vulkan/icd.d").glob("*.json")) or not find_library("vulkan"),
        reason="no Vulkan driver: Rerun's viewer cannot draw here; apt-get install mesa-vulkan-drivers",
    ),
    pytest.mark.filterwarnings("default"),  # the viewer's client is marked experimental
]


@pytest.mark.long("starts Rerun's own viewer")
def test_the_viewer_has_nothing_to_complain_of(tmp_path: Path) -> None:
    from docs.pictures.make import show, viewer

    played(tmp_path / "run.rrd", Rehearsal(4), ticks=400)
    with viewer() as client:
        assert show(client, tmp_path / "run.rrd", time=18.0) == []
        names = {view.name for view in client.get_state().views}
        assert {"Floor [m]", "Progress", "Fleet", "Distance to target [m]", "Events"} <= names
        picture = Image.open(BytesIO(client.take_screenshot())).convert("RGB")
    colours = {colour for _, colour in picture.getcolors(1 << 24) or []}
    assert len(colours) > 100
