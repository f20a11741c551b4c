"""How a launcher counts its fleet: the lease of sessions, newcomers, and what another set-up ends."""

from dataclasses import replace
from math import isclose
from pathlib import Path
from threading import Event as Flag
from typing import Any, cast

import pytest

from swarm.bus import Endpoint
from swarm.bus.settings import LEASE, LEASE_OF_EACH
from swarm.errors import ConfigError
from swarm.launch import processes as module
from swarm.launch.processes import Processes
from swarm.launch.supervise.fleet import Fleet
from swarm.launch.supervise.table import Role
from swarm.scenario.load import load
from swarm.settings import MOST_ROBOTS
from tests.launch.actors import SMALL
from tests.launch.test_changed import options_of


class Recorded(Fleet):
    """A fleet that notes what it is asked for and starts no process."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, print)
        self.asked: list[str] = []
        self.stop_at = ""
        self.flag = Flag()

    def _launch(self, role: Role, name: str) -> None:
        self.asked.append(f"start {name}")

    def stop(self, roles: Any = ()) -> None:  # noqa: ANN401
        self.asked += [f"stop {role.name}" for role in roles]
        if self.stop_at in [role.name for role in roles]:
            self.flag.set()

    def lease(self, name: str) -> float:
        """The lease with which a process is started next."""
        return cast("float", self._arguments[name]["endpoint"].lease)


def fleet_of(tmp_path: Path, serve: bool = True, **given: Any) -> tuple[Recorded, Processes]:  # noqa: ANN401
    (path := tmp_path / "small.yaml").write_text(SMALL)
    options = options_of(load(path, serve=serve), **({"robots": 3} | given))
    fleet = Recorded(tmp_path)
    processes = Processes(fleet, options, Endpoint("127.0.0.1", 7447), "small", None, tmp_path / "report.json")
    processes.start()
    fleet.asked.clear()
    return fleet, processes


def named(first: int, last: int) -> list[str]:
    return [f"r{number}" for number in range(first, last + 1)]


def test_the_lease_counts_robots_that_come_later(tmp_path: Path) -> None:
    fleet, processes = fleet_of(tmp_path)
    assert {fleet.lease(name) for name in ("router", "world", "r1")} == {LEASE}
    processes.add(named(1, 96), print)
    grown = LEASE_OF_EACH * 100  # with the world, the router, the dashboard and the box
    assert grown > LEASE
    assert all(isclose(fleet.lease(name), grown) for name in ("router", "world", "r1", "r4", "r96"))
    assert processes.added == 93


def test_robots_that_share_a_process_share_its_lease(tmp_path: Path) -> None:
    fleet, processes = fleet_of(tmp_path, robots_per_process=4)
    processes.add(named(1, 7), print)
    assert fleet.asked == ["start r4-r7"]
    assert fleet.lease("r4-r7") == LEASE


def test_newcomers_need_a_fleet_that_stays_and_room_in_it(tmp_path: Path) -> None:
    _, processes = fleet_of(tmp_path, serve=False)
    assert not processes.has_new_robots(["r1", "r9"])
    fleet, processes = fleet_of(tmp_path)
    assert processes.has_new_robots(["r1", "r9"])
    assert not processes.has_new_robots(["r1", "r2", "r3", "../r4", "world"])
    processes.add([*named(1, MOST_ROBOTS + 5), "r4", "../r4"], print)
    assert fleet.asked == [f"start {name}" for name in named(4, MOST_ROBOTS)]
    assert not processes.has_new_robots(["r2000"]), f"a fleet has at most {MOST_ROBOTS} robots"


def test_newcomers_without_room_are_said_once_and_not_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(sessions: int) -> None:
        raise ConfigError(f"no room for {sessions}")

    fleet, processes = fleet_of(tmp_path)
    monkeypatch.setattr(module, "check_open_files", refuses)
    said: list[str] = []
    processes.add(named(1, 5), said.append)
    assert said == ["r4, r5: not started, the place waits for another process: no room for 9"]
    assert fleet.asked == []
    assert not processes.has_new_robots(named(1, 5))


STOPPED = ["stop world", "stop dashboard", "stop recorder", "stop ros2", "stop robot"]
ALL_AGAIN = [*STOPPED, "start world", "start r1"]


def test_another_set_up_starts_the_router_again_only_if_its_lease_is_too_short(tmp_path: Path) -> None:
    fleet, processes = fleet_of(tmp_path)
    processes.start_again(replace(processes.options, robots=1), 5, Flag())
    assert fleet.asked == ALL_AGAIN
    assert processes.first_run == 5
    fleet.asked.clear()
    processes.start_again(replace(processes.options, robots=96), 6, Flag())
    assert fleet.asked[:7] == [*STOPPED, "stop router", "start router"]
    assert isclose(fleet.lease("router"), 100 * LEASE_OF_EACH)


def test_a_set_up_that_is_told_to_stop_starts_nothing_and_keeps_the_report(tmp_path: Path) -> None:
    fleet, processes = fleet_of(tmp_path)
    processes.summary_file.write_text("{}")
    fleet.stop_at = "world"
    processes.start_again(replace(processes.options, robots=1), 5, fleet.flag)
    assert fleet.asked == ["stop world"]
    assert (processes.first_run, processes.options.robots) == (0, 3)
    assert processes.summary_file.exists()
