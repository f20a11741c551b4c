"""`swarm run` ends well whatever happens to it: one sentence, the summary first, nobody and nothing left behind."""

import os
import resource
import signal
import subprocess
from itertools import product
from pathlib import Path
from threading import Event as Flag
from typing import Final

import psutil
import pytest

from tests.launch.actors import PATIENCE, Command, Fleet, await_clock
from tests.shared import mostly_long

pytestmark = pytest.mark.processes

STARTING = list(product([signal.SIGINT, signal.SIGHUP, signal.SIGTERM], (0, 3)))  # a signal, and after how much


def assert_clean(runtime: Path) -> None:
    assert not list(runtime.glob("zenoh-swarm-*/*/")), "the fleet's folder is left"
    assert not list(runtime.glob(".*.part")), "half a report is left"


def descendants(command: Command) -> list[psutil.Process]:
    try:
        return psutil.Process(command.process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


@pytest.mark.parametrize(
    ("number", "after"), mostly_long("the start of a fleet", STARTING, *STARTING[::5], (signal.SIGTERM, 3))
)
def test_a_signal_while_starting_is_at_most_one_sentence(
    small: Path, tmp_runtime: Path, number: signal.Signals, after: int
) -> None:
    """``after`` counts what a start does in turn: its imports, the fork server, the check, the first line."""
    arguments = ("run", str(small), "--robots", "2", "--dashboard", "off", "--report", str(tmp_runtime / "r.json"))
    seen: set[psutil.Process] = set()
    # an import that is interrupted leaves its file open, and a warning that is an error is a traceback
    with Command(*arguments, runtime=tmp_runtime, warnings="error,ignore::ResourceWarning") as command:
        for _ in range(round(PATIENCE / 0.01)):
            seen |= set(descendants(command))
            libraries = {Path(one.path).name for one in psutil.Process(command.process.pid).memory_maps()}
            done = (
                any(name.startswith("signal") or "msgspec" in name or "_struct" in name for name in libraries),
                bool(seen),
                any("pymunk" in name or "shapely" in name or "zenoh" in name for name in libraries),
                "fleet " in command.text,
            )
            if done[after]:
                break
            Flag().wait(0.01)
        seen |= set(descendants(command))
        command.process.send_signal(number)
        status = command.end()
        command.reader.join()
        said = command.text
        assert "Traceback" not in said, said
        assert status in {1, -number}, said
        if number == signal.SIGINT or after == 3:  # an import may also end with the signal itself
            assert "interrupted" in said
        assert not psutil.wait_procs(seen, PATIENCE)[1]
    assert_clean(tmp_runtime)


# fmt: off
ENDED: Final = {  # the signal, None: there is none; whether all processes get it; whether the output is closed
    "a signal to the launcher":    (signal.SIGTERM, False, False),
    "SIGINT to the launcher":      (signal.SIGINT,  False, False),
    "SIGHUP to the launcher":      (signal.SIGHUP,  False, False),
    "Ctrl-C in a terminal":        (signal.SIGINT,  True,  False),
    "a terminal that goes away":   (signal.SIGHUP,  True,  True),
    "a reader that goes away":     (None,           False, True),
}
# fmt: on
OFTEN: Final = ("Ctrl-C in a terminal", "a signal to the launcher")


@pytest.mark.parametrize("name", mostly_long("a fleet of its own", ENDED, *OFTEN))
def test_who_is_told_to_end_ends_in_order_and_reports(small: Path, tmp_runtime: Path, name: str) -> None:
    number, to_all, closes = ENDED[name]
    with Fleet(small, "--pace", "2", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_clock(bus, lambda clock: clock.tick > 0)
        if closes:
            fleet.read_no_more()
        if number is not None:
            send = os.killpg if to_all else os.kill  # the group is one that this test made, with start_new_session
            send(fleet.process.pid, number)
        assert fleet.end() == 1, fleet.text
        report = fleet.report()
        assert (report["reason"], report["complete"]) == ("interrupted", False)
        assert report["ticks"] > 0
        assert "Traceback" not in fleet.text
        fleet.assert_nobody_is_left()
    assert_clean(tmp_runtime)


@pytest.mark.parametrize("most", mostly_long("the start of a fleet", [24, 90], 24))
def test_too_few_open_files_are_a_sentence(small: Path, tmp_runtime: Path, most: int) -> None:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    command = Command("run", str(small), "--robots", "3", "--dashboard", "off", runtime=tmp_runtime, files=most)
    with command:
        assert command.end() == 2, command.text
        command.reader.join()
        (line,) = command.text.splitlines()
        assert line.startswith("swarm: open files: expected a limit of at least ")
        assert f", got {most}; raise it with `ulimit -n " in line
    assert resource.getrlimit(resource.RLIMIT_NOFILE) == limits
    assert_clean(tmp_runtime)


@pytest.mark.long("a whole mission")
def test_a_low_limit_of_open_files_is_raised_as_far_as_the_system_lets_it(small: Path, tmp_runtime: Path) -> None:
    shell = f"ulimit -Sn 60; exec {os.sys.executable} -m swarm.cli run {small} --robots 1 --pace max --dashboard off"  # type: ignore[attr-defined]
    done = subprocess.run(["sh", "-c", shell], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.long("a whole mission with a recording")
def test_a_recording_on_a_full_disk_says_that_it_is_cut(small: Path, tmp_runtime: Path) -> None:
    pytest.importorskip("rerun")
    record = tmp_runtime / "run.rrd"
    arguments = ("--pace", "max", "--record", str(record))
    with Fleet(small, *arguments, runtime=tmp_runtime, file_size=60_000) as fleet:
        assert fleet.end() == 0, fleet.text
        fleet.reader.join()
        assert f"recorded without index: {record}" in fleet.text
        assert "open it with" not in fleet.text
