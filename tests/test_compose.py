"""compose.yaml without containers: the same commands as plain processes, an embedded router in the router image's place."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarm.bus import Endpoint

ROOT = Path(__file__).parents[1]
MODULES = {"swarm": ["-m", "swarm.cli"], "python": []}
SETTINGS = {"PACE": "max", "ROBOTS": "2"}


@pytest.fixture(scope="module")
def services() -> dict[str, Any]:
    text = (ROOT / "compose.yaml").read_text(encoding="utf-8")
    filled = re.sub(r"\$\{(\w+):-([^}]*)\}", lambda match: SETTINGS.get(match[1], match[2]), text)
    found: dict[str, Any] = yaml.safe_load(filled)["services"]
    return found


def entrypoint(stage: str) -> list[str]:
    """Read what a stage of the Dockerfile runs, as this Python runs it."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8").split(f" AS {stage}\n")[1]
    match = re.search(r"^ENTRYPOINT (\[.*\])$", text, re.MULTILINE)
    assert match is not None
    first, *rest = yaml.safe_load(match[1])
    return [sys.executable, *MODULES[first], *rest]


def command(services: dict[str, Any], service: str, endpoint: Endpoint) -> list[str]:
    said = [str(part) for part in services[service]["command"]]
    return entrypoint(services[service]["build"]["target"]) + [
        part.replace("tcp/router:7447", str(endpoint)) for part in said
    ]


def test_the_router_is_of_the_version_of_the_wheel(services: dict[str, Any]) -> None:
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    wheel = re.search(r"^eclipse-zenoh==(.*)$", lock, re.MULTILINE)
    assert wheel is not None
    assert services["router"]["image"] == f"eclipse/zenoh:{wheel[1]}"


def test_only_loopback_is_published(services: dict[str, Any]) -> None:
    ports = [port for service in services.values() for port in service.get("ports", [])]
    assert ports
    assert all(port.startswith("127.0.0.1:") for port in ports)


def test_the_image_copies_only_what_there_is() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    copied = [line.split()[1:-1] for line in text.splitlines() if line.startswith("COPY ") and "--from" not in line]
    assert all((ROOT / name).exists() for names in copied for name in names)
    allowed = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert all(f"!{name}" in allowed for names in copied for name in names)
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    assert all([name.split(".")[0]] in copied for name in packages)


@pytest.mark.processes
def test_the_same_commands_as_plain_processes_complete_the_mission(
    services: dict[str, Any], endpoint: Endpoint
) -> None:
    robots = [subprocess.Popen(command(services, "robot", endpoint), cwd=ROOT) for _ in range(int(SETTINGS["ROBOTS"]))]
    try:
        world = subprocess.run(
            command(services, "world", endpoint), cwd=ROOT, timeout=200, check=False, capture_output=True, text=True
        )
        assert world.returncode == 0, world.stdout + world.stderr
        assert all(robot.poll() is None for robot in robots), "a robot waits for the next world"
    finally:
        for robot in robots:
            robot.terminate()
        ended = [robot.wait(20) for robot in robots]
    assert ended == [0] * len(robots)
