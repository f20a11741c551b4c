"""Rerun's viewer for the page's tab: a dashboard in mode ``web``, which starts when somebody first opens the tab."""

import os
import subprocess
import sys
from threading import Lock, Thread
from typing import Final

from swarm.bus import Endpoint
from swarm.errors import PeerError
from swarm.installation import hint_for_extra
from swarm.secure.names import WATCHER

ENDS: Final = 3.0  # s, wall time for a dashboard that was told to stop
SAYS: Final = "dashboard: http://"  # how the line with its address begins


class RerunPage:
    """The page with Rerun's viewer of one fleet. It ends with ``close``."""

    def __init__(self, endpoint: Endpoint, fleet: str) -> None:
        self._endpoint, self._fleet = endpoint.endpoint_for_member(WATCHER), fleet
        self._lock = Lock()  # several browsers may open the tab at once
        self._process: subprocess.Popen[str] | None = None
        self._address = ""

    def close(self) -> None:
        """End the dashboard if it runs."""
        process = self._process
        if process is None or process.poll() is not None:
            return
        process.terminate()
        try:
            process.wait(ENDS)
        except subprocess.TimeoutExpired:
            process.kill()

    def address(self) -> str:
        """Return where the viewer is; the first call starts it, and so does one after it has died.

        Raises:
            PeerError: it is not installed, or it did not start.
        """
        if (lacks := hint_for_extra("rerun")) is not None:
            raise PeerError(f"viewer: {lacks}")
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self._process = self._start_viewer()
            return self._address

    def _start_viewer(self) -> subprocess.Popen[str]:
        endpoint = self._endpoint
        command = [sys.executable, "-P", "-m", "dashboard", "--web", "--connect", str(endpoint), "--fleet", self._fleet]
        if endpoint.identity is not None:
            command += ["--secure", str(endpoint.identity.folder)]
        process = subprocess.Popen(
            [*command, "--ends-with", str(os.getpid())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        )
        assert process.stdout is not None
        said = "nothing"
        for line in process.stdout:
            if line.startswith(SAYS):
                self._address = line.split()[-1]
                Thread(target=self._hand_on, args=(process,), daemon=True).start()
                return process
            said = line.strip() or said
        process.stdout.close()
        process.wait()
        raise PeerError(f"viewer: expected Rerun's viewer to start, it ended and said: {said[:300]}")

    def _hand_on(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        with process.stdout as lines:
            for line in lines:
                print(line.rstrip())
        process.wait()  # it has ended; nothing of it is left
