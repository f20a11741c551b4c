"""Several routers, each on a host of its own with its robots: network namespaces on one switch."""

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from benchmarks.hosts import FLEET, PORT, Layout, run, scenario
from benchmarks.namespaces import Hosts, end, lacking
from swarm.cli import main
from tests.deploy.reading import await_line
from tests.launch.actors import SMALL

ROUTER: Final = ("-m", "swarm.cli", "router", "--insecure", "--listen")
PATIENCE: Final = 200.0  # s for a run

pytestmark = [
    pytest.mark.processes,
    pytest.mark.long("missions over several hosts"),
    pytest.mark.timeout(400),
]


@pytest.fixture(autouse=True)
def hosts_can_be_made() -> None:
    if (why := lacking()) is not None:
        pytest.skip(why)


def assert_passed(report: dict[str, Any]) -> None:
    assert (report["passed"], report["complete"]) == (True, True), report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["overlaps"] == 0


@pytest.mark.parametrize("hosts", [2, 3])
def test_the_run_is_the_same_over_several_routers_as_over_one(hosts: int) -> None:
    floor = yaml.safe_load(SMALL)
    one, each = (run(Layout(hosts, routers, pace="max", robots=1), floor).report for routers in ("one", "each its own"))
    assert_passed(each)
    assert each["digest"] == one["digest"]


def test_robots_near_each_other_keep_their_broadcasts_on_their_host() -> None:
    near, mixed = (run(Layout(2, "each its own", mixed, pace="max", robots=2)) for mixed in (False, True))
    assert_passed(near.report)
    assert mixed.report["digest"] == near.report["digest"]
    assert near.crossed / near.report["sim_time"] < mixed.crossed / mixed.report["sim_time"]


class Fleet:
    """A world and robots on hosts, each of which connects to its host's router."""

    def __init__(self, hosts: Hosts, folder: Path, keys: Sequence[str] = (), scheme: str = "tcp") -> None:
        self.hosts, self._keys, self._scheme = hosts, keys, scheme
        self.report = folder / "report.json"
        self.scenario = folder / "halls.yaml"
        self.scenario.write_text(yaml.safe_dump(scenario(2, 2)), encoding="utf-8")

    def router(self, host: int) -> "subprocess.Popen[str]":
        """Start the router of a host; all but the first one's join that."""
        joins = ("--join", self.place(0)) if host else ()
        free = () if self._keys else ("--insecure",)
        return self.hosts.start(
            host, "-m", "swarm.cli", "router", *free, "--listen", self.place(host), *joins, *self._keys,
            stdout=subprocess.PIPE,
        )  # fmt: skip

    def place(self, host: int) -> str:
        return f"{self._scheme}/{self.hosts.address(host)}:{PORT}"

    def robots(self) -> list["subprocess.Popen[str]"]:
        return [
            self.hosts.start(host, "-m", "swarm.cli", "robot", "--id", name, "--connect", self.place(host),
                             "--fleet", FLEET, *self._keys)
            for host, name in ((0, "r1"), (0, "r2"), (1, "r3"), (1, "r4"))
        ]  # fmt: skip

    def world(self, pace: str) -> "subprocess.Popen[str]":
        return self.hosts.start(
            0, "-m", "swarm.cli", "world", str(self.scenario), "--robots", "4", "--pace", pace, "--fleet", FLEET,
            "--report", str(self.report), "--record", str(self.report.with_suffix(".swarm")),
            "--connect", self.place(0), *self._keys, stdout=subprocess.PIPE,
        )  # fmt: skip


def test_a_router_that_is_killed_takes_only_its_own_robots_and_they_come_back(tmp_path: Path) -> None:
    with Hosts(2) as hosts:
        fleet = Fleet(hosts, tmp_path)
        first, second = fleet.router(0), fleet.router(1)
        world, robots = fleet.world("4"), fleet.robots()
        await_line(world, "is at target 1")
        await_line(second, "linked with 1 other router")
        second.kill()
        second.communicate()
        await_line(first, "linked with 0 other routers")
        gone = {await_line(world, "has lost its process").split()[2] for _ in range(2)}
        assert gone == {"r3", "r4"}
        await_line(world, "is at target")
        second = fleet.router(1)
        said, _ = world.communicate(timeout=PATIENCE)
        assert world.returncode == 0, said
        assert_passed(json.loads(fleet.report.read_text(encoding="utf-8")))
        assert [end(process) for process in (*robots, second, first)] == [0] * 6


def test_routers_of_a_fleet_with_keys_join_each_other(tmp_path: Path) -> None:
    with Hosts(2) as hosts:
        known = [word for host in (0, 1) for word in ("--host", hosts.address(host))]
        keys = tmp_path / "keys"
        assert main(["keys", str(keys), "--robots", "4", "--several-routers", *known]) == 0
        fleet = Fleet(hosts, tmp_path, ("--secure", str(keys)), "tls")
        first, second = fleet.router(0), fleet.router(1)
        world, robots = fleet.world("max"), fleet.robots()
        said, _ = world.communicate(timeout=PATIENCE)
        assert world.returncode == 0, said
        assert_passed(json.loads(fleet.report.read_text(encoding="utf-8")))
        assert [end(process) for process in (*robots, second, first)] == [0] * 6
