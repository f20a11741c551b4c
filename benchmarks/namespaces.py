"""Hosts on one machine: network namespaces on one switch, each with an address of its own."""

import json
import os
import subprocess
import sys
from shutil import which
from typing import Final, NamedTuple

NETWORK: Final = "10.213.0"  # of the switch; nothing outside these namespaces sees it
PARTING: Final = 20.0  # s for a process to end that was told to


def lacking() -> str | None:
    """Return why this machine cannot make hosts, or None if it can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if which("ip") is None:
        return "iproute2 is not installed: apt-get install iproute2"
    probe = f"swarm-{os.getpid()}-probe"
    made = subprocess.run(["ip", "netns", "add", probe], capture_output=True, text=True, check=False)
    if made.returncode:
        return f"no network namespace can be made here: {made.stderr.strip()}"
    _ip("netns", "del", probe)
    return None


def _ip(*words: str) -> str:
    return subprocess.run(["ip", *words], check=True, capture_output=True, text=True).stdout


class Traffic(NamedTuple):
    """What a host has sent and received since it was made."""

    sent: int  # bytes, with all headers
    received: int
    packets_sent: int
    packets_received: int

    def since(self, before: "Traffic") -> "Traffic":
        """Return what has come on top."""
        return Traffic(*(now - then for now, then in zip(self, before, strict=True)))


class Hosts:
    """So many hosts on one switch. Use them in a ``with``: its end kills all their processes."""

    def __init__(self, count: int) -> None:
        self.names = [f"swarm-{os.getpid()}-{number}" for number in range(count)]
        self._switch = f"swarm-{os.getpid()}-switch"
        self.processes: list[subprocess.Popen[str]] = []

    def __enter__(self) -> "Hosts":
        try:
            self._make()
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *fault: object) -> None:
        self._end()

    def _make(self) -> None:
        _ip("netns", "add", self._switch)
        _ip("-n", self._switch, "link", "add", "switch", "type", "bridge")
        _ip("-n", self._switch, "link", "set", "switch", "up")
        for number, name in enumerate(self.names):
            _ip("netns", "add", name)
            _ip("link", "add", "eth0", "netns", name, "type", "veth", "peer", "name", f"p{number}",
                "netns", self._switch)  # fmt: skip
            _ip("-n", self._switch, "link", "set", f"p{number}", "master", "switch", "up")
            _ip("-n", name, "address", "add", f"{self.address(number)}/24", "dev", "eth0")
            for device in ("eth0", "lo"):
                _ip("-n", name, "link", "set", device, "up")

    def _end(self) -> None:
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.wait()
        made = {line.split()[0] for line in _ip("netns", "list").splitlines()}
        for name in made.intersection((*self.names, self._switch)):
            _ip("netns", "del", name)

    def address(self, host: int) -> str:
        """Return the address of a host."""
        return f"{NETWORK}.{host + 1}"

    def start(self, host: int, *words: str, **streams: int) -> subprocess.Popen[str]:
        """Start this Python on a host."""
        command = ["ip", "netns", "exec", self.names[host], sys.executable, *words]
        process = subprocess.Popen(command, text=True, **({"stdout": subprocess.DEVNULL} | streams))  # type: ignore[call-overload]
        self.processes.append(process)
        return process  # type: ignore[no-any-return]

    def traffic(self, host: int) -> Traffic:
        """Return what has crossed a host's own link; what its processes say to each other does not."""
        (link,) = json.loads(_ip("-n", self.names[host], "-s", "-j", "link", "show", "dev", "eth0"))
        sent, received = link["stats64"]["tx"], link["stats64"]["rx"]
        return Traffic(sent["bytes"], received["bytes"], sent["packets"], received["packets"])


def end(process: subprocess.Popen[str]) -> int:
    """End a process with SIGTERM, and return its exit status."""
    process.terminate()
    status = process.wait(PARTING)
    if process.stdout is not None:
        process.stdout.close()
    return status
