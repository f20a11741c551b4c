"""The dashboard as a process of its own, across a real router."""

import os
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import psutil
import pytest

from dashboard import process, viewers
from swarm.bus import Bus, Endpoint, Presence
from swarm.errors import ConfigError
from tests.dashboard.actors import World, router
from tests.dashboard.recorded import Recording
from tests.dashboard.rehearsal import Rehearsal
from tests.launch.actors import LONGEST

pytestmark = pytest.mark.processes


@pytest.fixture
def endpoint() -> Iterator[Endpoint]:
    with router() as listening:
        yield listening


@contextmanager
def dashboard(endpoint: Endpoint, *arguments: str) -> Iterator["subprocess.Popen[str]"]:
    """Run the command; whatever happens, it is gone after the block."""
    command = [sys.executable, "-m", "dashboard", "--connect", str(endpoint), "--fleet", "test", *arguments]
    environ = os.environ | {"RERUN_STRICT": "1", "PYTHONUNBUFFERED": "1"}
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environ)
    try:
        yield running
    finally:
        running.kill()
        running.communicate()


def wait_for_dashboard(bus: Bus) -> None:
    bus.watch_presence()
    while True:
        arrived = bus.receive(timeout=LONGEST)
        assert arrived is not None, "the dashboard did not come"
        if isinstance(arrived, Presence) and arrived.role == "dashboard":
            return


def ended(running: "subprocess.Popen[str]") -> tuple[int, str]:
    said, _ = running.communicate(timeout=LONGEST)
    return running.returncode, said


def test_it_shows_a_run_and_ends_with_it(endpoint: Endpoint, tmp_path: Path) -> None:
    rehearsal = Rehearsal(2)
    with Bus(endpoint, "test") as bus:
        world = World(bus, rehearsal)
        world.serve()
        with dashboard(endpoint, "--off-screen", "--record", str(tmp_path / "run.rrd")) as running:
            wait_for_dashboard(bus)
            for tick in range(rehearsal.ticks + 1):
                world.send(rehearsal, tick)
            assert ended(running) == (0, "")
    recording = Recording(tmp_path / "run.rrd")
    assert [word for _, [word] in recording.rows("/progress/r2", "StateChange:state")][-1] == "done"
    assert len(recording.rows("/events", "TextLog:text")) == 2 * 4


def test_told_to_stop_it_finishes_the_file(endpoint: Endpoint, tmp_path: Path) -> None:
    rehearsal = Rehearsal(2)
    with Bus(endpoint, "test") as bus:
        world = World(bus, rehearsal)
        world.serve()
        with dashboard(endpoint, "--web", "--record", str(tmp_path / "run.rrd")) as running:
            wait_for_dashboard(bus)
            assert running.stdout is not None
            address = running.stdout.readline().split()[-1]
            with urllib.request.urlopen(address, timeout=LONGEST) as page:
                assert b"rerun" in page.read().lower()
            family = [psutil.Process(running.pid), *psutil.Process(running.pid).children(recursive=True)]
            listening = {
                one.laddr.ip for process in family for one in process.net_connections() if one.status == "LISTEN"
            }
            assert listening == {"127.0.0.1"}
            for tick in range(201):
                world.send(rehearsal, tick)
            running.send_signal(signal.SIGTERM)
            assert ended(running)[0] == 0
            assert not [process for process in family if process.is_running()], "the page's server is left"
            arrived = bus.receive(timeout=LONGEST)
            while not (isinstance(arrived, Presence) and arrived.role == "dashboard" and not arrived.alive):
                assert arrived is not None, "the dashboard's token stayed"
                arrived = bus.receive(timeout=LONGEST)
    assert {"/world/map", "/world/robots"} <= Recording(tmp_path / "run.rrd").entities


def test_it_finds_out_what_it_missed(endpoint: Endpoint, tmp_path: Path) -> None:
    """The run is half over when it comes; a restart follows; then it ends."""
    rehearsal, again = Rehearsal(2, run=1), Rehearsal(2, run=2)
    with Bus(endpoint, "test") as bus:
        world = World(bus, rehearsal)
        world.send(rehearsal, 800)
        world.serve()
        with dashboard(endpoint, "--off-screen", "--record", str(tmp_path / "run.rrd")) as running:
            wait_for_dashboard(bus)
            for sent, ticks in ((rehearsal, range(801, 900)), (again, range(again.ticks + 1))):
                for tick in ticks:
                    world.send(sent, tick)
            assert ended(running) == (0, "")
    late, whole = Recording(tmp_path / "run.rrd"), Recording(tmp_path / "run-run2.rrd")
    lanes = [(time, word) for time, [word] in late.rows("/progress/r1", "StateChange:state")]
    assert lanes[:2] == [(0.0, "to 1"), (40.0, "to 3")], "the first as the world has recorded it"
    assert len(late.rows("/world/paths", "LineStrips2D:strips")) >= 1
    assert [word for _, [word] in whole.rows("/progress/r1", "StateChange:state")][-1] == "done"


def test_a_port_in_use_is_said(endpoint: Endpoint) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        with dashboard(endpoint, "--web", "--port", port) as running:
            status, said = ended(running)
    assert status == 2
    assert f"port {port}" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [(["--off-screen"], "--record"), (["--web", "--record", "/nowhere/at/all.rrd"], "expected a folder /nowhere/at")],
)
def test_what_cannot_be_done_is_said(endpoint: Endpoint, arguments: list[str], expected: str) -> None:
    with dashboard(endpoint, *arguments) as running:
        status, said = ended(running)
    assert status == 2
    assert expected in said
    assert "Traceback" not in said


def test_no_viewer_program_is_said(endpoint: Endpoint, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewers, "viewer_program", lambda: None)
    with pytest.raises(ConfigError, match="expected the program `rerun`"):
        process.run(endpoint, "test", "viewer")


@pytest.mark.filterwarnings("ignore:subprocess")  # it outlives the dashboard
@pytest.mark.parametrize("stopped", [False, True])
def test_a_window_stays_after_the_run_and_closes_when_the_dashboard_is_stopped(
    endpoint: Endpoint, stopped: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (program := tmp_path / "rerun").write_text(f"#!{sys.executable}\nimport signal\nsignal.pause()\n")
    program.chmod(0o755)
    monkeypatch.setattr(viewers, "viewer_program", lambda: program)
    stop = threading.Event()
    if stopped:
        stop.set()
    monkeypatch.setattr(process, "stop_flag", lambda: nullcontext(stop))
    rehearsal = Rehearsal(2)
    with Bus(endpoint, "test") as bus:
        world = World(bus, rehearsal)
        world.send(rehearsal, rehearsal.ticks)
        world.serve()
        assert process.run(endpoint, "test", "viewer") == 0
    windows = [one for one in psutil.Process().children() if str(program) in one.cmdline()]
    assert len(windows) == (not stopped)
    for window in windows:
        assert "--hide-welcome-screen" in window.cmdline()
        window.kill()
        window.wait()


def test_a_killed_dashboard_leaves_no_page_behind(endpoint: Endpoint) -> None:
    with Bus(endpoint, "test") as bus:
        World(bus, Rehearsal(2)).serve()
        with dashboard(endpoint, "--web") as running:
            wait_for_dashboard(bus)
            page = psutil.Process(running.pid).children()
            assert page
            running.kill()
            gone, alive = psutil.wait_procs(page, timeout=LONGEST)
        assert gone
        assert not alive
