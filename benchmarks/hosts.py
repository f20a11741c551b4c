"""Several hosts, each with a router and its robots, against one router for all: ``python -m benchmarks.hosts``.

A host is a network namespace of this machine, so all share its cores; what crosses between them is counted on their
links, with all headers. The floor has one hall a host, with four robots that stay in it, farther from each other than
the radio reaches. The world is on the first host. With ``mixed``, neighbours are on different hosts. A delay is that of
a proxy on the link, each way.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

import yaml

from benchmarks.measure import load, machine, printed
from benchmarks.namespaces import Hosts, lacking
from swarm.bus import Endpoint
from swarm.scenario.starts import robot_names

HALL: Final = 14.0  # m, each side of a hall
APART: Final = 22.0  # m between two halls: more than a zone of the radio and those around it
ROBOTS: Final = 4  # of each hall
STOPS: Final = 6  # of each robot
PORT, LATE_PORT, FLEET = 7447, 7448, "hosts"
PATIENCE: Final = 600.0  # s of the wall clock for a run
LIMIT: Final = 40.0  # s, simulated, of a run in real time
PROXY: Final = """
import sys
from swarm.bus import Endpoint
from swarm.launch.proxy import Delay, serve
serve(Endpoint("127.0.0.1", int(sys.argv[1])), Endpoint(sys.argv[2], int(sys.argv[3])), Delay.parse(sys.argv[4]))
"""


class Layout(NamedTuple):
    """Where the processes of a run are."""

    hosts: int
    routers: str  # "one", or "each its own"
    mixed: bool = False  # neighbours are on different hosts
    delay: str = "0"  # ms, each way, between the first host and the others
    pace: str = "realtime"
    robots: int = ROBOTS  # of each hall

    def __str__(self) -> str:
        words = [f"{self.hosts} hosts", f"{self.hosts * self.robots} robots", f"routers: {self.routers}"]
        words += ["mixed"] * self.mixed + [f"{self.delay} ms"] * (self.delay != "0") + [self.pace]
        return ", ".join(words)

    @property
    def each(self) -> bool:
        """True if each host has its own router."""
        return self.routers != "one"


class Measured(NamedTuple):
    """What came of a run."""

    report: dict[str, Any]
    crossed: int  # bytes that the hosts but the first sent and received
    packets: int


def scenario(halls: int, robots: int = ROBOTS) -> dict[str, Any]:
    """Return a floor with so many halls and robots in each, who stay in it."""
    wide = round(halls * HALL + (halls - 1) * APART)
    chance = Random(7)
    poses, targets = [], []
    for hall in range(halls):
        left = hall * (HALL + APART)
        spots = [(left + x, y) for x, y in product((2.0, 5.0, 8.0, 11.0), (2.0, 5.0, 8.0, 11.0))]
        for at in chance.sample(spots, robots):
            poses.append([*at, 0.0])
            targets.append([list(spot) for spot in chance.sample(spots, STOPS)])
    row = "." * wide
    return {
        "name": "halls", "map": {"cell": 1.0, "text": "\n".join([row] * round(HALL)) + "\n"},
        "start": {"poses": poses}, "own_targets": targets, "robots": len(poses), "return_home": True, "seed": 1,
        "robot": {"radius": 0.2, "track_width": 0.4, "speed_scale": 0.4}, "radio": {"range": 8.0},
    }  # fmt: skip


def run(layout: Layout, floor: dict[str, Any] | None = None) -> Measured:
    """Run a layout and return what came of it; ``floor`` is another scenario than that of the halls."""
    with TemporaryDirectory() as folder, Hosts(layout.hosts) as hosts:
        (file := Path(folder) / "halls.yaml").write_text(
            yaml.safe_dump(floor or scenario(layout.hosts, layout.robots)), encoding="utf-8"
        )
        report = Path(folder) / "report.json"
        places = routers(hosts, layout)
        robots = layout.hosts * layout.robots
        limit = ["--limit", f"{LIMIT:g}"] if layout.pace == "realtime" else []
        words = ["--connect", places[0], "--fleet", FLEET]
        world = hosts.start(
            0, "-m", "swarm.cli", "world", str(file), "--robots", str(robots), "--pace", layout.pace, *limit,
            "--report", str(report), "--record", str(report.with_suffix(".swarm")), *words,
        )  # fmt: skip
        for number, name in enumerate(robot_names(robots)):
            host = number % layout.hosts if layout.mixed else number // layout.robots
            words = ["--id", name, "--connect", places[host], "--fleet", FLEET, "--once"]
            hosts.start(host, "-m", "swarm.cli", "robot", *words)
        world.wait(PATIENCE)
        crossed = [hosts.traffic(host) for host in range(1, layout.hosts)]
        return Measured(
            json.loads(report.read_text(encoding="utf-8")),
            sum(one.sent + one.received for one in crossed),
            sum(one.packets_sent + one.packets_received for one in crossed),
        )


def routers(hosts: Hosts, layout: Layout) -> list[str]:
    """Start the routers, and proxies for a delay; return where the processes of each host connect."""
    first = f"tcp/{hosts.address(0)}:{PORT}"
    listens = "-m", "swarm.cli", "router", "--insecure", "--listen"
    hosts.start(0, *listens, first)
    places = [first]
    for host in range(1, layout.hosts):
        there = first
        if layout.delay != "0":
            hosts.start(host, "-c", PROXY, str(LATE_PORT), hosts.address(0), str(PORT), layout.delay)
            there = str(Endpoint("127.0.0.1", LATE_PORT))
        if layout.each:
            mine = f"tcp/{hosts.address(host)}:{PORT}"
            hosts.start(host, *listens, mine, "--join", there)
            there = mine
        places.append(there)
    return places


LAYOUTS: Final = (
    *(Layout(2, routers, mixed, pace=pace) for pace in ("max", "realtime")
      for mixed in (False, True) for routers in ("one", "each its own")),
    *(Layout(4, routers, pace="realtime") for routers in ("one", "each its own")),
    *(Layout(2, routers, delay="20", pace="realtime") for routers in ("one", "each its own")),
)  # fmt: skip
HEAD: Final = (
    "layout", "x real time", "late [%]", "between hosts [kB/s]", "of a robot elsewhere [kB/s]", "packets/s", "contacts",
    "digest", "load",
)  # fmt: skip


def main() -> int:
    """Print the table; return 1 if robots touched, or runs in lockstep with the same halls have different digests."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.parse_args()
    if (why := lacking()) is not None:
        print(why, file=sys.stderr)
        return 1
    print(f"{machine()}\n")
    digests: dict[int, set[str]] = {}
    wrong: list[str] = []

    def measured(layout: Layout) -> Sequence[str]:
        found = run(layout)
        report = found.report
        seconds, ticks = report["sim_time"], round(report["sim_time"] * 20)
        robots = layout.hosts * layout.robots
        contacts = sum(report["contacts"].values())
        if layout.pace == "max":
            digests.setdefault(layout.hosts, set()).add(report["digest"])
        wrong.extend([str(layout)] * bool(contacts or report["traffic"]["overlaps"]))
        elsewhere = robots - layout.robots
        return (
            f"{seconds / report['wall_time']:.1f}", f"{100 * report['late_commands'] / (ticks * robots):.2f}",
            f"{found.crossed / seconds / 1000:.0f}", f"{found.crossed / seconds / 1000 / elsewhere:.1f}",
            f"{found.packets / seconds:.0f}", str(contacts), report["digest"][:8] if layout.pace == "max" else "-",
            load(),
        )  # fmt: skip

    printed(HEAD, [(str(layout), lambda layout=layout: measured(layout)) for layout in LAYOUTS])  # type: ignore[misc]
    wrong += [f"{hosts} hosts: {len(found)} digests" for hosts, found in digests.items() if len(found) > 1]
    if wrong:
        print(f"wrong: {'; '.join(wrong)}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
