"""The router as a process: it ends when it is told to, whichever of its threads gets the signal."""

import ctypes
import os
import signal
import subprocess
import sys

import psutil
import pytest

from swarm.bus import Endpoint
from swarm.bus.router import RouterLinks
from tests.launch.actors import FAREWELL

pytestmark = pytest.mark.processes


@pytest.mark.parametrize("thread", ["main", "newest"])
def test_it_ends_when_any_of_its_threads_gets_the_signal(thread: str) -> None:
    endpoint = Endpoint("127.0.0.1", 0).claim()
    command = [sys.executable, "-m", "swarm.cli", "router", f"--listen={endpoint}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as router:
        assert router.stdout is not None
        assert router.stdout.readline() == f"router: listening on {endpoint}\n"
        while len(threads := psutil.Process(router.pid).threads()) < 3:  # Zenoh's threads start after that line
            os.sched_yield()
        who = router.pid if thread == "main" else max(one.id for one in threads)
        try:
            assert ctypes.CDLL(None).tgkill(router.pid, who, int(signal.SIGTERM)) == 0
            assert router.wait(FAREWELL) == 0
        finally:
            router.kill()


def test_links_that_do_not_come_are_said_once() -> None:
    others = [Endpoint("10.0.0.1", 7447), Endpoint("10.0.0.2", 7447)]
    links = RouterLinks(others, 0.0)
    late = ("for 5 s, expected 2 at tcp/10.0.0.1:7447, tcp/10.0.0.2:7447; is each of them running, "
            "reachable from here, and of the same keys? This one goes on trying")  # fmt: skip
    told = [
        (0, 4.9, None),
        (0, 5.0, f"linked with 0 other routers {late}"),
        (0, 99.0, None),
        (1, 100.0, "linked with 1 other router"),
        (1, 104.9, None),
        (1, 105.0, f"linked with 1 other router {late}"),
        (2, 106.0, "linked with 2 other routers"),
        (2, 999.0, None),
        (3, 999.5, "linked with 3 other routers"),
        (1, 1000.0, "linked with 1 other router"),
        (1, 1005.0, f"linked with 1 other router {late}"),
    ]
    for linked, now, expected in told:
        assert links.describe_links(linked, now) == expected, now
    alone = RouterLinks((), 0.0)
    assert [alone.describe_links(linked, now) for linked, now in ((0, 9.0), (1, 10.0), (0, 11.0), (0, 99.0))] == [
        None, "linked with 1 other router", "linked with 0 other routers", None,
    ]  # fmt: skip
