"""`swarm run` ends well whatever happens to it: one sentence, the summary first, nobody and nothing left behind."""

import os
import resource
import signal
import subprocess
from itertools import product
from pathlib import Path
from threading import Event as Flag

import psutil
import pytest

from dashboard.frames import is_whole
from swarm.messages import ACTION, EVENT, Action, Do
from tests.launch.actors import PATIENCE, Command, Fleet, await_clock, await_event, await_presence
from tests.shared import mostly_long

pytestmark = pytest.mark.processes

STARTING = list(product([signal.SIGINT, signal.SIGHUP, signal.SIGTERM], range(4)))  # a signal, and after how much


def assert_clean(runtime: Path) -> None:
    assert not list(runtime.glob("zenoh-swarm-*/*/")), "the fleet's folder is left"
    assert not list(runtime.glob(".*.part")), "half a report is left"


def descendants(command: Command) -> list[psutil.Process]:
    try:
        return psutil.Process(command.process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


@pytest.mark.parametrize(("number", "after"), mostly_long("the start of a fleet", STARTING, *STARTING[::5]))
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
        if number == signal.SIGINT:  # Python still ends with the signal if it came while a library's import ran code
            assert "interrupted" in said
        assert not psutil.wait_procs(seen, PATIENCE)[1]
    assert_clean(tmp_runtime)


def test_a_terminal_that_goes_away_ends_the_run_in_order(small: Path, tmp_runtime: Path) -> None:
    """All processes of the terminal get the signal, and nobody can write to it any more."""
    with Fleet(small, "--pace", "2", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        await_clock(bus, lambda clock: clock.tick > 0)
        fleet.read_no_more()
        os.killpg(fleet.process.pid, signal.SIGHUP)  # the group that this test made, with start_new_session
        assert fleet.end() == 1
        assert fleet.report()["reason"] == "interrupted"
        assert fleet.report()["ticks"] > 0
        fleet.assert_nobody_is_left()
    assert_clean(tmp_runtime)


def test_a_reader_that_goes_away_ends_the_run_in_order(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--pace", "2", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        fleet.read_no_more()
        assert fleet.end() == 1
        assert fleet.report()["reason"] == "interrupted"
        fleet.assert_nobody_is_left()
    assert_clean(tmp_runtime)


def test_a_report_that_cannot_be_written_does_not_hide_the_result(small: Path, tmp_runtime: Path) -> None:
    arguments = ("--robots", "1", "--dashboard", "off", "--pace", "max", "--report", "/dev/full")
    with Command("run", str(small), *arguments, runtime=tmp_runtime) as command:
        assert command.end() == 2, command.text
        command.reader.join()
        lines = command.text.splitlines()
        assert lines.index("complete") < len(lines) - 1
        assert lines[-1] == (
            "swarm: --report /dev/full: expected to write the report, got: No space left on device; make room or "
            "choose another file"
        )
        assert "Traceback" not in command.text
    assert_clean(tmp_runtime)


@pytest.mark.parametrize("most", mostly_long("the start of a fleet", [24, 90, 100], 24))
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


@pytest.mark.long("a whole mission with a killed dashboard")
def test_a_killed_dashboard_comes_back_with_all_progress_and_a_second_file(small: Path, tmp_runtime: Path) -> None:
    pytest.importorskip("rerun")
    record = tmp_runtime / "run.rrd"
    with (
        Fleet(small, "--pace", "4", "--record", str(record), robots=2, runtime=tmp_runtime) as fleet,
        fleet.bus() as bus,
    ):
        bus.listen(EVENT)
        fleet.await_all(bus)
        await_event(bus, lambda event: event.kind == "reached")
        bus.ask(ACTION, Action(do=Do.PAUSE))  # or the run would be over before a slow machine has started it again
        fleet.member("dashboard").kill()
        await_presence(bus, "dashboard", alive=False)
        await_presence(bus, "dashboard", alive=True)
        bus.ask(ACTION, Action(do=Do.RESUME))
        assert fleet.end() == 0, fleet.text
        fleet.reader.join()
        assert "dashboard was ended by signal 9; started again" in fleet.text
        assert f"recorded in part: {record} is cut" in fleet.text
        second = tmp_runtime / "run.2.rrd"
        assert f"recorded: {second}  (open it with: rerun {second})" in fleet.text
        assert record.stat().st_size > 1000, "what the first one recorded is kept"
        assert is_whole(second)
        assert not is_whole(record)
        fleet.assert_nobody_is_left()
    assert_clean(tmp_runtime)


@pytest.mark.long("a whole mission with a recording")
def test_a_recording_on_a_full_disk_says_that_it_is_cut(small: Path, tmp_runtime: Path) -> None:
    pytest.importorskip("rerun")
    record = tmp_runtime / "run.rrd"
    arguments = ("--pace", "max", "--record", str(record))
    with Fleet(small, *arguments, runtime=tmp_runtime, file_size=60_000) as fleet:
        assert fleet.end() == 0, fleet.text
        fleet.reader.join()
        assert f"recorded in part: {record} is cut" in fleet.text
        assert "open it with" not in fleet.text


@pytest.mark.long("a whole mission with a dashboard")
def test_a_recording_that_cannot_begin_is_said_and_the_run_goes_on(small: Path, tmp_runtime: Path) -> None:
    pytest.importorskip("rerun")
    with Fleet(small, "--pace", "max", "--record", "/dev/full", runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0, fleet.text
        fleet.reader.join()
        assert "dashboard ended with status 2; the run goes on" in fleet.text
        assert "record: expected to write /dev/full" in fleet.text
        assert "recorded in part: /dev/full is cut" in fleet.text or "not recorded" in fleet.text


@pytest.mark.long("a whole mission")
def test_a_folder_that_vanishes_under_the_fleet_is_no_traceback(small: Path, tmp_runtime: Path) -> None:
    from shutil import rmtree

    with Fleet(small, "--pace", "8", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        victim = fleet.member("r1")
        (home,) = tmp_runtime.glob("zenoh-swarm-*/*/")
        rmtree(home.rename(tmp_runtime / "removed"))  # the world may be writing into it
        victim.kill()
        assert fleet.end() == 0, fleet.text
        fleet.reader.join()
        assert "Traceback" not in fleet.text
        assert "r1 was ended by signal 9; started again" in fleet.text
        assert "was removed; it was made again, and the run goes on" in fleet.text
        fleet.assert_nobody_is_left()
    assert_clean(tmp_runtime)
