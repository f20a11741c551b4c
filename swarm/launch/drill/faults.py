"""The faults of processes, of the disk and of the clock: what a row of the table does to a live fleet."""

import os
import signal
from collections.abc import Callable, Iterable
from functools import partial
from math import dist
from pathlib import Path
from shutil import rmtree
from typing import Final

from swarm.installation import hint_for_extra
from swarm.launch.drill.fleet_under_drill import LiveFleet
from swarm.launch.drill.floor import AT_DOOR, DOOR
from swarm.messages import Truth

Fault = Callable[[LiveFleet], None]
FROZEN: Final = 5.0  # s
LATE: Final = 0.05  # s, 0.2 s of the mission at pace 4
GAP: Final = 0.2  # s between two robots that are held up
SHORT: Final = 0.02  # s between two times that one robot is: it then answers 0 to 4 ticks late, at pace 4
HOUR: Final = 3600  # s
FAKETIME: Final = tuple(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"))


def kill(*names: str) -> Fault:
    """Return the fault that kills processes at once, one after the other."""

    def inject(live: LiveFleet) -> None:
        for name in names:
            os.kill(live.member(name), signal.SIGKILL)

    return inject


def kill_in_turn(*names: str) -> Fault:
    """Return the fault that kills processes one after the other, each once the fleet drives on after the one before."""

    def another(live: LiveFleet, name: str, before: int) -> bool:
        return live.find(name) not in {None, before}

    def inject(live: LiveFleet) -> None:
        for name in names:
            tick, pid = live.wait_for_truth(lambda truth: True, "the world").tick, live.member(name)
            os.kill(pid, signal.SIGKILL)
            live.await_that(partial(another, live, name, pid), f"another process of {name}")
            live.wait_for_truth(partial(is_later, tick), f"ticks with another process of {name}")

    return inject


def is_later(tick: int, truth: Truth) -> bool:
    """Return True if a truth is of a later tick."""
    return truth.tick > tick


def kill_until(name: str, said: str) -> Fault:
    """Return the fault that kills a process as often as it is started, until the launcher has said something."""

    def inject(live: LiveFleet) -> None:
        before: int | None = 0

        def another() -> bool:
            return said in live.text or live.find(name) not in {None, before}

        while True:
            live.await_that(another, f"a process of {name}, or {said!r}")
            if said in live.text:
                return
            before = live.find(name)
            if before is not None:
                os.kill(before, signal.SIGKILL)
            live.take()

    return inject


def kill_in_door(live: LiveFleet) -> None:
    """Kill a robot that holds the door."""

    def there(bodies: Iterable[tuple[str, float, float]]) -> list[str]:
        return [name for name, x, y in bodies if dist((x, y), DOOR) < AT_DOOR]

    truth = live.wait_for_truth(
        lambda truth: bool(there((body.robot, body.x, body.y) for body in truth.bodies)), "a robot in the door"
    )
    kill(there((body.robot, body.x, body.y) for body in truth.bodies)[0])(live)


def freeze(name: str) -> Fault:
    """Return the fault that stops a process for ``FROZEN``."""

    def inject(live: LiveFleet) -> None:
        pid = live.member(name)
        os.kill(pid, signal.SIGSTOP)
        live.over.wait(FROZEN)
        os.kill(pid, signal.SIGCONT)

    return inject


def hold_up(*robots: str, gap: float) -> Fault:
    """Return the fault that holds up robots in turn, again and again, ``gap`` [s] apart: their answers are late."""

    def inject(live: LiveFleet) -> None:
        def work() -> None:
            pids = [live.find(robot) for robot in robots]
            while True:
                for pid in pids:
                    if live.over.wait(gap):
                        return
                    if pid is not None:
                        try:
                            os.kill(pid, signal.SIGSTOP)
                            live.over.wait(LATE)
                            os.kill(pid, signal.SIGCONT)
                        except ProcessLookupError:
                            return

        live.run_in_background(work)

    return inject


def spoil_snapshot(live: LiveFleet) -> None:
    """Spoil the snapshot and kill the world before it writes the next one."""
    pid, file = live.member("world"), live.home / "world.snapshot"
    os.kill(pid, signal.SIGSTOP)
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    os.kill(pid, signal.SIGKILL)


def remove_folder(live: LiveFleet) -> None:
    """Remove the folder of the fleet; first out of the way, since the world may be writing into it."""
    rmtree(live.home.rename(live.home.parent.with_name("removed")))


def hang_up_launcher(live: LiveFleet) -> None:
    """Send SIGHUP to the launcher, as a terminal does that goes away."""
    os.kill(live.launcher, signal.SIGHUP)


def do_nothing(live: LiveFleet) -> None:
    """Do nothing: the fault is in how the fleet was started."""


def run_beside(*arguments: str) -> Fault:
    """Return the fault that starts another `swarm` command in the same fleet; SCENARIO stands for the fleet's own."""
    return lambda live: live.start_beside(*(str(live.scenario) if word == "SCENARIO" else word for word in arguments))


def _offset(folder: Path) -> Path:
    return folder / "faketime"


def clock_of(folder: Path) -> dict[str, str]:
    """Return the environment in which a file says how wrong the machine's clock is."""
    _offset(folder).write_text("+0\n", encoding="utf-8")
    return {
        "LD_PRELOAD": str(FAKETIME[0]),
        "FAKETIME_TIMESTAMP_FILE": str(_offset(folder)),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
        "DONT_FAKE_MONOTONIC": "1",
    }


def shift_clock(live: LiveFleet) -> None:
    """Set the machine's clock an hour forth, then an hour back."""
    for shift in (f"+{HOUR}", f"-{HOUR}"):
        _offset(live.folder).write_text(f"{shift}\n", encoding="utf-8")
        tick = live.truth.tick if live.truth is not None else 0
        live.wait_for_truth(lambda truth, tick=tick: truth.tick > tick + 40, "40 ticks after the clock was set")  # type: ignore[misc]


def lacks_faketime() -> str:
    """Return what is missing to shift the clock, "" for nothing."""
    return "" if FAKETIME else "libfaketime is not installed (apt install libfaketime)"


def lacks_rerun() -> str:
    """Return what is missing for a dashboard, "" for nothing."""
    return hint_for_extra("rerun") or ""
