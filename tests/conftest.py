"""Shared fixtures: a router in a thread, buses on it, the paper's scenario and its planning grid."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from swarm.bus import Bus, Endpoint
from swarm.bus.router import run as route
from swarm.planning.grid import Grid
from swarm.scenario.load import Scenario, load
from swarm.scenario.prepare import planning_grid, settle_lattice
from tests.launch.actors import SMALL
from tests.shared import PAPER

# Cases that take long are no fault on a loaded machine; a failure prints how to replay it.
settings.register_profile(
    "all",
    max_examples=50,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    print_blob=True,
    derandomize=True,
)
settings.register_profile("quick", settings.get_profile("all"), max_examples=25)  # `make test-all` takes "all" instead
settings.load_profile("quick")

pytest_plugins = ["tests.again", "tests.costs", "tests.skips", "pytester"]

MakeBus = Callable[..., Bus]


@pytest.fixture(autouse=True, scope="session")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Have keyframes in a folder of the tests, not in the user's."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def paper() -> Scenario:
    return settle_lattice(load(PAPER))


@pytest.fixture(scope="session")
def paper_grid(paper: Scenario) -> Grid:
    return planning_grid(paper)


@pytest.fixture(scope="module")
def endpoint() -> Iterator[Endpoint]:
    """Run a router in a thread of this process; give where it listens."""
    place = Endpoint("127.0.0.1", 0).claim()
    over = threading.Event()
    thread = threading.Thread(target=route, args=(place, over.wait))
    thread.start()
    try:
        yield place
    finally:
        over.set()
        thread.join()


@pytest.fixture
def make_bus(endpoint: Endpoint, request: pytest.FixtureRequest) -> Iterator[MakeBus]:
    """Open buses of a fleet that belongs to this one test; all are closed at its end."""
    fleet = f"fleet-{abs(hash(request.node.nodeid)) % 10**9}"
    with ExitStack() as stack:

        def make(log: Callable[[str], None] = lambda line: None, fleet: str = fleet) -> Bus:
            return stack.enter_context(Bus(endpoint, fleet, log))

        yield make


@pytest.fixture
def tmp_runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return fleets a folder of their own for their cards, so that nobody else's fleet is found."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def small(tmp_runtime: Path) -> Path:
    """Return the file of a small scenario."""
    path = tmp_runtime / "small.yaml"
    path.write_text(SMALL)
    return path
