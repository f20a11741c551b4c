"""compose.yaml without containers: the same commands as plain processes, with an embedded router."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarm.bus import Endpoint
from tests.launch.actors import FAREWELL

ROOT = Path(__file__).parents[2]
MODULES = {"swarm": ["-m", "swarm.cli"], "python": []}
SETTINGS = {"PACE": "max", "ROBOTS": "2"}


@pytest.fixture(scope="module")
def services() -> dict[str, Any]:
    text = (ROOT / "compose.yaml").read_text(encoding="utf-8")
    filled = re.sub(r"\$\{(\w+):-([^}]*)\}", lambda match: SETTINGS.get(match[1], match[2]), text)
    found: dict[str, Any] = yaml.safe_load(filled)["services"]
    return found


def here(entrypoint: list[str]) -> list[str]:
    """Return an entry point as this Python runs it."""
    first, *rest = entrypoint
    return [sys.executable, *MODULES[first], *rest]


def entrypoint(stage: str) -> list[str]:
    """Read what a stage of the Dockerfile runs."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8").split(f" AS {stage}\n")[1]
    match = re.search(r"^ENTRYPOINT (\[.*\])$", text, re.MULTILINE)
    assert match is not None
    found: list[str] = yaml.safe_load(match[1])
    return found


def command(services: dict[str, Any], service: str, places: dict[str, str]) -> list[str]:
    """Return what a service runs, with this machine's places instead of those of the containers."""
    said = [str(part) for part in services[service]["command"]]
    for place, local in places.items():
        said = [part.replace(place, local) for part in said]
    role = services[service]["image"].removeprefix("zenoh-swarm-").split(":")[0]
    return here(services[service].get("entrypoint") or entrypoint(role)) + said


def test_zenohs_own_router_is_of_the_version_of_the_wheel(services: dict[str, Any]) -> None:
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    wheel = re.search(r"^eclipse-zenoh==(.*)$", lock, re.MULTILINE)
    assert wheel is not None
    text = (ROOT / "deploy/zenohd.yaml").read_text(encoding="utf-8")
    ((name, router),) = yaml.safe_load(text)["services"].items()
    assert (router["image"], name in services) == (f"eclipse/zenoh:{wheel[1]}", True)


def test_every_container_is_confined_and_none_can_write_outside_its_volumes(services: dict[str, Any]) -> None:
    for service in services.values():
        assert (service["read_only"], service["cap_drop"], service["tmpfs"]) == (True, ["ALL"], ["/tmp"])
        assert service["security_opt"] == ["no-new-privileges:true"]
        assert {"mem_limit", "cpus", "pids_limit"} <= set(service)


def test_only_worlds_have_their_run_on_a_volume_and_are_started_again(services: dict[str, Any]) -> None:
    for name, volume in (("world", "state"), ("secure-world", "secure-state")):
        world = services[name]
        assert world["restart"] == "on-failure:5"
        assert f"{volume}:/state" in world["volumes"]
        written = [word.split("=")[1] for word in world["command"] if word.startswith(("--snap", "--rec", "--rep"))]
        assert written == ["/state/run.snapshot", "/state/run.swarm", "/state/report.json"]


def test_the_images_lint_says_nothing() -> None:
    lint = Path(sys.executable).with_name("hadolint")
    done = subprocess.run([lint, ROOT / "Dockerfile"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "")
    planted = (ROOT / "Dockerfile").read_text(encoding="utf-8").replace("WORKDIR /\n", "RUN cd /tmp\n")
    done = subprocess.run([lint, "-"], input=planted, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "DL3003" in done.stdout


@pytest.mark.parametrize("more", [(), ("-f", "compose.yaml", "-f", "deploy/zenohd.yaml")])
def test_another_engine_reads_the_file(more: tuple[str, ...], tmp_path: Path) -> None:
    (podman := tmp_path / "podman").write_text("#!/bin/sh\necho podman version 5.0.0\n", encoding="utf-8")
    podman.chmod(0o755)
    reader = Path(sys.executable).with_name("podman-compose")
    command = [sys.executable, str(reader), *more, "--podman-path", str(podman), "config"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    read = yaml.safe_load(done.stdout)["services"]
    assert read["router"]["image"].startswith("eclipse/zenoh:" if more else "zenoh-swarm-world:")
    assert read["robot"]["scale"] == "4"


def test_only_loopback_is_published(services: dict[str, Any]) -> None:
    ports = [port for service in services.values() for port in service.get("ports", [])]
    assert ports
    assert all(port.startswith("127.0.0.1:") for port in ports)


def test_the_image_copies_only_what_there_is() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    copied = [line.split()[1:-1] for line in text.splitlines() if line.startswith("COPY ") and "--from" not in line]
    assert all((ROOT / name).exists() for names in copied for name in names)
    allowed = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert all(f"!{name.split('/')[0]}" in allowed for names in copied for name in names)
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    assert all([name.split(".")[0]] in copied for name in packages)


@pytest.mark.long("a whole mission")
@pytest.mark.processes
def test_the_same_commands_as_plain_processes_complete_the_mission(
    services: dict[str, Any], endpoint: Endpoint, tmp_path: Path
) -> None:
    places = {"tcp/router:7447": str(endpoint), "/state": str(tmp_path)}
    robots = [subprocess.Popen(command(services, "robot", places), cwd=ROOT) for _ in range(int(SETTINGS["ROBOTS"]))]
    try:
        world = subprocess.run(
            command(services, "world", places), cwd=ROOT, timeout=200, check=False, capture_output=True, text=True
        )
        assert world.returncode == 0, world.stdout + world.stderr
        assert all(robot.poll() is None for robot in robots), "a robot waits for the next world"
    finally:
        for robot in robots:
            robot.terminate()
        ended = [robot.wait(FAREWELL) for robot in robots]
    assert ended == [0] * len(robots)


SECURE = ("secure-router", "secure-world", "secure-r1", "secure-r2", "secure-r3", "secure-r4", "secure-dashboard")
MEMBER = {"secure-dashboard": "watcher"}


def test_each_member_with_keys_mounts_only_its_own(services: dict[str, Any]) -> None:
    assert {name for name, service in services.items() if "secure" in service.get("profiles", [])} == {*SECURE, "keys"}
    for name in SECURE:
        member = MEMBER.get(name, name.removeprefix("secure-"))
        (mount,) = [one for one in services[name]["volumes"] if isinstance(one, dict)]
        assert (mount["target"], mount["volume"]) == (f"/keys/{member}", {"subpath": f"fleet/{member}"})
        assert mount["read_only"]
        assert services[name]["networks"] == ["secure"]
    assert set(services["secure-world"]["depends_on"]) == set(SECURE) - {"secure-world"}
    assert services["keys"]["network_mode"] == "none"


@pytest.mark.long("a whole mission of commands with keys; make test has those without")
@pytest.mark.processes
def test_the_secure_commands_as_plain_processes_complete_the_mission(services: dict[str, Any], tmp_path: Path) -> None:
    port = str(Endpoint("127.0.0.1", 0).claim().port)
    places = {"/keys/fleet": str(tmp_path / "fleet"), "/keys": str(tmp_path / "fleet")}
    places |= {
        "/state": str(tmp_path),
        "tls/secure-router:7447": f"tls/127.0.0.1:{port}",
        "tls/0.0.0.0:7447": f"tls/127.0.0.1:{port}",
    }
    subprocess.run(command(services, "keys", {"/keys": str(tmp_path)}), cwd=ROOT, check=True)
    others = [subprocess.Popen(command(services, name, places), cwd=ROOT) for name in SECURE[:1] + SECURE[2:6]]
    try:
        world = subprocess.run(
            command(services, "secure-world", places),
            cwd=ROOT,
            timeout=200,
            check=False,
            capture_output=True,
            text=True,
        )
        assert world.returncode == 0, world.stdout + world.stderr
    finally:
        for one in others:
            one.terminate()
        ended = [one.wait(FAREWELL) for one in others]
    assert ended == [0] * len(others)
