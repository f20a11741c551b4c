"""A broker of MQTT under test: Debian's mosquitto if it is installed, else amqtt; it can be killed and started again."""

import shutil
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from threading import Event as Flag
from typing import Final, Self

import pytest

from swarm.bus import Endpoint
from tests.launch.actors import PATIENCE

MOSQUITTO: Final = shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin")
needs_mosquitto = pytest.mark.skipif(MOSQUITTO is None, reason="mosquitto is not installed: apt-get install mosquitto")
OPEN: Final = ("allow_anonymous true",)
AMQTT: Final = """\
listeners: {{default: {{type: tcp, bind: "127.0.0.1:{port}"}}}}
plugins: {{amqtt.plugins.authentication.AnonymousAuthPlugin: {{allow_anonymous: true}}}}
"""


class Broker:
    """A process that listens on loopback. ``settings`` are lines of mosquitto's; amqtt takes none."""

    def __init__(self, folder: Path, *settings: str) -> None:
        self.port = Endpoint("127.0.0.1", 0).claim().port
        self._file = folder / f"broker-{self.port}.conf"
        if MOSQUITTO is not None:
            lines = (f"listener {self.port} 127.0.0.1", f"user {_me()}", *(settings or OPEN))
            self._file.write_text("".join(f"{line}\n" for line in lines))
            self._command = [MOSQUITTO, "-c", str(self._file)]
        else:
            pytest.importorskip("amqtt", reason="no broker: apt-get install mosquitto, or pip install amqtt")
            assert not settings, "amqtt takes none"
            self._file.write_text(AMQTT.format(port=self.port))
            run = "import sys; from amqtt.scripts.broker_script import main; main()"
            self._command = [sys.executable, "-c", run, "-c", str(self._file)]
        self._log = (folder / f"broker-{self.port}.log").open("ab")

    @property
    def place(self) -> str:
        return f"127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start it, and wait until it listens."""
        self.process = subprocess.Popen(self._command, stdout=self._log, stderr=self._log)
        for _ in range(round(PATIENCE / 0.05)):
            with suppress(OSError), socket.create_connection(("127.0.0.1", self.port), timeout=1.0):
                return
            assert self.process.poll() is None, Path(self._log.name).read_text()
            Flag().wait(0.05)
        raise AssertionError("the broker does not listen")

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
        self._log.close()


def _me() -> str:
    """Return who runs the tests: started by root, mosquitto would become another user, who may not read its files."""
    import getpass

    return getpass.getuser()
