"""The page with Rerun's web viewer, from a real dashboard: what it may ask, and what a browser in fact asks."""

import http.client
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest

from dashboard.viewers import policy
from swarm.bus import Bus
from tests.dashboard.actors import World, router
from tests.dashboard.browsing import LACKS, PATIENCE, PROGRAM, browser
from tests.dashboard.rehearsal import Rehearsal
from tests.dashboard.test_process import dashboard, wait_for_dashboard

processes = pytest.mark.processes


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Yield the address of the page of a dashboard that shows a fleet which stands."""
    rehearsal = Rehearsal(2)
    with router() as endpoint, Bus(endpoint, "test") as bus:
        world = World(bus, rehearsal)
        world.serve()
        with dashboard(endpoint, "--web") as running:
            wait_for_dashboard(bus)
            world.send(rehearsal, 0)
            assert running.stdout is not None
            yield running.stdout.readline().split()[-1]


def asked(address: str, path: str, host: str = "") -> http.client.HTTPResponse:
    parts = urlsplit(address)
    assert parts.hostname is not None
    connection = http.client.HTTPConnection(parts.hostname, parts.port or 0, timeout=30)
    connection.request("GET", path, headers={"Host": host} if host else {})
    return connection.getresponse()


def test_a_policy_names_the_hosts_of_the_data_and_no_other() -> None:
    named = dict(part.split(" ", 1) for part in policy(["127.0.0.1", "robots.local"], 9876).split("; "))
    assert named["default-src"] == "'self'"
    assert named["connect-src"] == "'self' http://127.0.0.1:9876 http://robots.local:9876"
    assert "http" not in named["script-src"] + named["img-src"] + named["worker-src"] + named["style-src"]


@processes
@pytest.mark.parametrize("path", ["/?url=x", "/re_viewer.js", "/re_viewer_bg.wasm"])
def test_the_viewers_files_are_handed_on_with_the_policy(address: str, path: str) -> None:
    answer = asked(address, path)
    assert answer.status == 200
    assert len(answer.read()) > 1000
    assert answer.headers["Content-Security-Policy"].startswith("default-src 'self'; connect-src 'self' http://")


@processes
@pytest.mark.parametrize(
    ("host", "named"), [("robots.local:1", "robots.local"), ("x\ty:1", "127.0.0.1"), ("", "127.0.0.1")]
)
def test_the_bare_address_leads_to_the_fleet(address: str, host: str, named: str) -> None:
    """What somebody types who has published the page's port, as compose.yaml does."""
    answer = asked(address, "/", host)
    assert answer.status == 302
    path, query = urlsplit(address)[2:4]
    assert answer.headers["Location"] == f"{path}?{query}".replace("127.0.0.1", named)


@processes
@pytest.mark.parametrize("path", ["/etc/passwd", "/../re_viewer.js", "/proxy", "/re_viewer.js/x"])
def test_nothing_else_is_handed_on(address: str, path: str) -> None:
    assert asked(address, path).status == 404


@processes
@pytest.mark.parametrize(
    ("host", "named"), [("robots.local:1", True), ("x; script-src *:1", False), ("a b:1", False), ("*:1", False)]
)
def test_a_name_of_the_host_is_taken_only_if_it_is_one(address: str, host: str, named: bool) -> None:
    told = asked(address, "/?url=x", host).headers["Content-Security-Policy"]
    assert (f"http://{host.rpartition(':')[0]}:" in told) is named
    assert told.count("script-src") == 1


@pytest.mark.long("starts Rerun's own server")
@processes
@pytest.mark.skipif(PROGRAM is None, reason=LACKS)
def test_a_browser_is_answered_by_this_host_only(address: str) -> None:
    answered: set[str] = set()
    refused: set[str] = set()
    with browser() as running:
        page = running.new_page()
        page.set_default_timeout(PATIENCE)
        page.on("response", lambda answer: answered.add(urlsplit(answer.url).hostname or "data"))
        page.on("requestfailed", lambda failed: refused.add(f"{urlsplit(failed.url).hostname} {failed.failure}"))
        page.goto(address)
        page.wait_for_function("window._handle !== undefined")
        page.wait_for_selector("canvas")
    assert answered <= {"127.0.0.1", "data"}
    assert all("csp" in one or one.startswith("127.0.0.1") for one in refused), refused
