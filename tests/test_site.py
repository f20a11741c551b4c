"""The docs as a site: it is built without a warning, asks no other host, and says on each page which version it is of."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from docs.website import PROJECT, pages, rooms, turned
from tests.shared import ROOT

LOADS: Final = re.compile(r"""<(?:script|img|iframe|source|video)\b[^>]*\bsrc="([^"]+)"|<link\b[^>]*\bhref="([^"]+)""")
IMPORTS: Final = re.compile(r"(?:@import|url\()\s*[\"']?(https?:[^\"')]+)")

pytestmark = pytest.mark.long("builds all pages, those on every module too")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(place)],
        cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, "WARNING" in done.stderr) == (0, False), done.stderr
    return place


def test_every_page_is_there_and_says_its_version(site: Path) -> None:
    sources = [path.relative_to(ROOT / "docs") for path in (ROOT / "docs").rglob("*.md")]
    expected = {path.with_suffix(".html") for path in (*sources, *(Path(uri) for uri, _ in pages()))}
    built = {path.relative_to(site) for path in site.rglob("*.html")} - {Path("404.html")}
    assert built == expected
    version = f"zenoh-swarm {PROJECT['project']['version']}"
    assert [page for page in sorted(built) if version not in (site / page).read_text(encoding="utf-8")] == []


def test_no_page_asks_another_host(site: Path) -> None:
    asked = []
    for page in site.rglob("*.html"):
        loaded = [one or other for one, other in LOADS.findall(page.read_text(encoding="utf-8"))]
        asked += [link for link in loaded if "//" in link]
    for sheet in site.rglob("*.css"):
        asked += IMPORTS.findall(sheet.read_text(encoding="utf-8"))
    assert asked == []


def test_all_can_be_searched_and_every_room_has_its_page(site: Path) -> None:
    index = (site / "search" / "search_index.json").read_text(encoding="utf-8")
    assert [room for room in rooms() if f"api/{room}.html" not in index] == []
    assert "wheel_speeds_many" in index, "functions, too"


# fmt: off
LINKS: Final = {
    ("wire.md", "[a](../examples/watch.py)"):                 "[a](source/examples/watch.py)",
    ("decisions/0001-one-inbox.md", "[a](../wire.md#sense)"): "[a](../wire.md#sense)",
    ("index.md", "[a](docs/box.md)"):                         "[a](box.md)",
    ("index.md", "[a](docs/decisions/)"):                     "[a](decisions/index.md)",
    ("box.md", "[a](https://zenoh.io), [b](#here)"):          "[a](https://zenoh.io), [b](#here)",
    ("decisions/0001-one-inbox.md", "[a](../../README.md)"):  "[a](../index.md)",
}
# fmt: on


@pytest.mark.parametrize(("page", "text"), LINKS)
def test_a_link_leads_to_where_the_site_has_it(page: str, text: str) -> None:
    assert turned(page, text) == LINKS[page, text]
