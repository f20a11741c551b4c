"""The images as they are delivered: built, and run as compose.yaml says, where the machine has the tools."""

import json
import os
import re
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, Final
from urllib.request import urlopen

import pytest

from dashboard.mode import answers
from swarm.secure.names import ROUTER, WORLD
from tests.deploy.engine import CONFINED, Engine, lacking

REASON: Final = lacking()  # what it takes is only looked for here
PATIENCE: Final = 120.0  # s for what one waits for
LARGEST: Final = {"robot": 450, "world": 600}  # MB
COMPILES: Final = re.compile(r"\[cache\] data (loaded|saved)")  # what numba says of a kernel with NUMBA_DEBUG_CACHE=1

pytestmark = [
    pytest.mark.processes,
    pytest.mark.long("builds a base and three images, and runs missions in containers"),
    pytest.mark.timeout(1500),
    pytest.mark.skipif(REASON is not None, reason=str(REASON)),
]


def await_that(true: Callable[[], Any], what: Callable[[], str]) -> None:
    """Wait until something of a container is true; the question itself takes a while."""
    deadline = monotonic() + PATIENCE
    while not true():
        assert monotonic() < deadline, what()


def await_log(engine: Engine, container: str, words: str) -> None:
    await_that(lambda: words in engine.logs(container), lambda: f"{words!r}: {engine.logs(container)}")


def await_success(engine: Engine, container: str) -> None:
    """Wait until a container ends well; one that fails is started again."""
    await_that(lambda: engine.podman("wait", container) == "0", lambda: engine.logs(container))


def kill(engine: Engine, container: str) -> None:
    """Kill what runs in a container, as a crash would: an engine does not start again what it was told to kill."""
    os.kill(engine.state(container)["Pid"], signal.SIGKILL)


def report_of(engine: Engine, volume: str) -> dict[str, Any]:
    """Return the report that a world has left on its volume."""
    (found,) = json.loads(engine.podman("volume", "inspect", volume))
    folder = Path(found["Mountpoint"])
    assert not (folder / "run.snapshot").exists(), "a run that is complete leaves nothing to go on with"
    assert (folder / "run.swarm").is_file()
    report: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return report


def assert_passed(report: dict[str, Any], robots: int) -> None:
    assert (report["passed"], report["complete"], report["robots"]) == (True, True, robots), report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


def images_are_small_and_say_what_they_are(engine: Engine) -> None:
    for role, most in LARGEST.items():
        image = engine.image(f"zenoh-swarm-{role}")
        assert image["Size"] < most * 10**6, f"{role}: {image['Size'] / 10**6:.0f} MB"
        labels = image["Config"]["Labels"]
        assert labels["org.opencontainers.image.title"] == "zenoh-swarm"
        assert re.fullmatch(r"\d+\.\d+\.\d+\S*", labels["org.opencontainers.image.version"])
        assert image["Config"]["User"] == "10001"


def no_kernel_is_compiled_at_start(engine: Engine) -> None:
    for role in LARGEST:
        said = engine.podman(
            "run", "--rm", "--network", "none", *CONFINED, "--env", "NUMBA_DEBUG_CACHE=1", "--entrypoint", "python",
            f"zenoh-swarm-{role}", "-m", "swarm.kernels",
        )  # fmt: skip
        words = COMPILES.findall(said)
        assert len(words) > 10
        assert set(words) == {"loaded"}


def compose_runs_a_mission_and_what_is_killed_goes_on(engine: Engine, robots: int) -> None:
    variables = {"ROBOTS": str(robots), "PACE": "8"}
    engine.compose("up", "--no-build", "--detach", "router", "world", "robot", **variables)
    names = [f"zenoh-swarm_{name}_1" for name in ("world", "router", "robot")]
    world, router, robot = names
    await_log(engine, world, "r1 is at target 1")
    for name in names:
        assert engine.podman("healthcheck", "run", name) == "", f"{name} is healthy"
    kill(engine, world)
    await_log(engine, world, "the run goes on at")
    await_log(engine, world, "is at target 2")
    if robots > 3:  # as much again for the others
        before = engine.state(router)["Pid"]
        kill(engine, router)
        await_that(lambda: engine.state(router)["Pid"] not in {0, before}, lambda: "the router is not started again")
        kill(engine, robot)
    await_success(engine, world)
    assert_passed(report_of(engine, "zenoh-swarm_state"), robots)
    for number in range(1, robots + 1):
        engine.podman("stop", f"zenoh-swarm_robot_{number}")
        assert engine.state(f"zenoh-swarm_robot_{number}")["ExitCode"] == 0, "a robot leaves in order"


def the_page_and_the_box_are_served_on_this_machine(engine: Engine) -> None:
    names = ("router", "world", "robot", "dashboard", "box")
    engine.compose("--profile", "box", "up", "--no-build", "--detach", *names, ROBOTS="2")
    page, box = "zenoh-swarm_dashboard_1", "zenoh-swarm_box_1"
    await_log(engine, page, "dashboard: http://")
    with urlopen("http://127.0.0.1:9090", timeout=PATIENCE) as answer:
        assert "?url=rerun%2Bhttp://127.0.0.1:9876/proxy" in answer.url
        assert b"Rerun" in answer.read()
    assert answers(9876), "the data of the page"
    await_log(engine, box, "box: http://")
    (address,) = re.findall(r"box: (http://127\S+)", engine.logs(box))
    with urlopen(address, timeout=PATIENCE) as answer:
        assert b"<title>" in answer.read()
    for name in (page, box):
        assert engine.podman("healthcheck", "run", name) == "", f"{name} is healthy"
        engine.podman("stop", name)
        assert engine.state(name)["ExitCode"] == 0


def a_process_that_hangs_is_unhealthy(engine: Engine) -> None:
    engine.podman("run", "--detach", "--name", "router", *CONFINED, "--entrypoint", "swarm", "zenoh-swarm-world",
                 "router", "--listen", "tcp/0.0.0.0:7447", "--insecure")  # fmt: skip
    check = (
        "exec",
        "router",
        "sh",
        "-c",
        'test -n "$(find $SWARM_ALIVE -newermt "-2 seconds")" && echo alive || echo not',
    )
    await_that(lambda: engine.podman(*check) == "alive", lambda: "the router touches no file")
    os.kill(engine.state("router")["Pid"], signal.SIGSTOP)
    await_that(lambda: engine.podman(*check) == "not", lambda: "a stopped process touches its file")


def a_fleet_with_keys_completes_its_mission(engine: Engine) -> None:
    robots = ("r1", "r2", "r3")
    engine.podman("network", "create", "secure")
    engine.podman("volume", "create", "keys")
    engine.podman(
        "run", "--rm", *CONFINED, "--network", "none", "--volume", "keys:/keys", "--entrypoint", "swarm",
        "zenoh-swarm-world", "keys", "/keys/fleet", f"--robots={len(robots)}", "--host=secure-router",
    )  # fmt: skip
    (found,) = json.loads(engine.podman("volume", "inspect", "keys"))
    folder = Path(found["Mountpoint"]) / "fleet"
    joins = ("--connect=tls/secure-router:7447", "--fleet=compose", "--secure=/keys")

    def start(name: str, member: str, role: str, *words: str, entry: tuple[str, ...] = (), state: bool = False) -> None:
        volumes = ["--volume", f"{folder / member}:/keys/{member}:ro", *(["--volume", "state:/state"] * state)]
        engine.podman("run", "--detach", "--name", name, *CONFINED, "--network", "secure", *volumes, *entry,
                     f"zenoh-swarm-{role}", *words)  # fmt: skip

    start("secure-router", ROUTER, "world", "router", "--listen=tls/0.0.0.0:7447", "--secure=/keys",
          entry=("--entrypoint", "swarm"))  # fmt: skip
    start("world", WORLD, "world", "paper", f"--robots={len(robots)}", "--pace=max", *joins, "--report=/state/report.json",
          "--snapshot=/state/run.snapshot", "--record=/state/run.swarm", state=True)  # fmt: skip
    for name in robots:
        start(name, name, "robot", f"--id={name}", *joins)
    await_success(engine, "world")
    assert_passed(report_of(engine, "state"), len(robots))


CHECKS: Final[tuple[Callable[[Engine], None], ...]] = (
    images_are_small_and_say_what_they_are,
    no_kernel_is_compiled_at_start,
    partial(compose_runs_a_mission_and_what_is_killed_goes_on, robots=3),
    partial(compose_runs_a_mission_and_what_is_killed_goes_on, robots=8),
    the_page_and_the_box_are_served_on_this_machine,
    a_process_that_hangs_is_unhealthy,
    a_fleet_with_keys_completes_its_mission,
)


def test_what_is_delivered_is_built_and_runs() -> None:
    """One test, since the images are built once: tests of a module may run in several processes."""
    # podman starts nothing again in a folder whose path is long
    with TemporaryDirectory(dir="/var/tmp") as folder, Engine(Path(folder)) as engine:
        engine.build("robot", "world", "dashboard")
        for check in CHECKS:
            check(engine)
            engine.clear()
