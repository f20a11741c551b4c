"""The router as a process: it ends when it is told to, whichever of its threads gets the signal."""

import ctypes
import os
import signal
import subprocess
import sys

import psutil
import pytest

from swarm.bus import Endpoint
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
