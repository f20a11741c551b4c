"""Containers without Docker: a base by mmdebstrap, images by buildah, containers by podman with runc."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from shutil import which
from typing import Any, Final

from tests.shared import ROOT

PROGRAMS: Final = ("mmdebstrap", "buildah", "podman", "runc", "iptables")
NETWORKS: Final = (Path("/usr/lib/podman/netavark"), Path("/usr/lib/podman/aardvark-dns"))
INSTALL: Final = "apt-get install --no-install-recommends mmdebstrap buildah podman runc netavark aardvark-dns iptables"
BASE: Final = "localhost/swarm-base"
NEEDED: Final = "python3,python3-venv,python-is-python3,ca-certificates"  # what the Dockerfile takes from its base
LEFT_OUT: Final = ("/usr/share/doc/*", "/usr/share/man/*", "/usr/share/locale/*")
PATIENCE: Final = 900  # s for a build
CONFINED: Final = (  # of every container of compose.yaml, as podman says them
    "--cap-drop", "ALL", "--security-opt", "no-new-privileges", "--read-only", "--tmpfs", "/tmp",
)  # fmt: skip


def lacking() -> str | None:
    """Return why this machine cannot run containers, or None if it can."""
    if os.geteuid() != 0:
        return "containers are built and run as root here"
    missing = [name for name in PROGRAMS if which(name) is None] + [str(at) for at in NETWORKS if not at.exists()]
    return f"{', '.join(missing)} not found: {INSTALL}" if missing else None


def pip_reads() -> list[str]:
    """Return the files and folders of this machine that pip's own settings name: a build needs the same ones."""
    told = subprocess.run(
        [sys.executable, "-m", "pip", "config", "debug"], capture_output=True, text=True, check=True
    ).stdout  # fmt: skip
    files = re.findall(r"^  (/\S+), exists: True$", told, re.MULTILINE)
    named = [Path(path) for file in files for path in re.findall(r"/[\w./-]+", Path(file).read_text(encoding="utf-8"))]
    named += [Path(text) for name, text in os.environ.items() if name.startswith("PIP_") and text.startswith("/")]
    folders = {path.parent if path.is_file() else path for path in named if path.exists()}
    tops = {str(path.parent if path.name == "simple" else path) for path in folders}  # an index points beside itself
    return sorted({*files, *tops})


class Engine:
    """An engine with a store of its own in a folder. Use it in a ``with``: its end removes all containers."""

    def __init__(self, folder: Path) -> None:
        (storage := folder / "storage.conf").write_text(
            f'[storage]\ndriver = "overlay"\ngraphroot = "{folder}/store"\nrunroot = "{folder}/run"\n', encoding="utf-8"
        )
        (settings := folder / "containers.conf").write_text(
            '[containers]\ndefault_ulimits = ["nofile=1024:1024", "nproc=4096:4096"]\n'
            '[engine]\nruntime = "runc"\ncgroup_manager = "cgroupfs"\nevents_logger = "file"\n',
            encoding="utf-8",
        )
        self.folder = folder
        self.environment = os.environ | {
            "CONTAINERS_STORAGE_CONF": str(storage), "CONTAINERS_CONF": str(settings), "BUILDAH_ISOLATION": "chroot",
        }  # fmt: skip

    def __enter__(self) -> "Engine":
        return self

    def __exit__(self, *fault: object) -> None:
        self.clear()
        self.podman("rmi", "--all", "--force")

    def clear(self) -> None:
        """Remove all containers, their volumes and networks."""
        removal = ("podman", "rm", "--all", "--force", "--time", "1")
        subprocess.run(
            removal, env=self.environment, capture_output=True, check=False
        )  # those that others depend on stay
        self.run(*removal)
        self.podman("volume", "rm", "--all", "--force")
        self.podman("network", "prune", "--force")

    def run(self, *command: str | Path, **more: str) -> str:
        """Run a program with this engine's settings, which must succeed; return what it prints."""
        done = subprocess.run(
            command, cwd=ROOT, env=self.environment | more, capture_output=True, text=True, check=False,
            timeout=PATIENCE,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
        return done.stdout

    def podman(self, *words: str) -> str:
        """Run podman."""
        return self.run("podman", *words).strip()

    def compose(self, *words: str, **variables: str) -> str:
        """Run compose.yaml."""
        program = Path(sys.executable).with_name("podman-compose")
        return self.run(sys.executable, program, "--in-pod", "false", *words, **variables)

    def build(self, *roles: str) -> None:
        """Make a base as small as that of Docker's library, and the project's images on it with `make images`."""
        base, mirror = self.folder / "base.tar", "bookworm"
        leaves = [f"--dpkgopt=path-exclude={path}" for path in LEFT_OUT]
        hook = '--customize-hook=rm -rf "$1"/usr/share/perl "$1"/usr/lib/*/perl'  # nothing here is written in it
        self.run("mmdebstrap", "--variant=minbase", "--mode=root", *leaves, hook, f"--include={NEEDED}", mirror, base)
        made = self.run("buildah", "from", "scratch").strip()
        self.run("buildah", "add", "--quiet", made, base, "/")
        self.run("buildah", "commit", "--quiet", made, BASE)
        self.run("buildah", "rm", made)
        base.unlink()
        flags = " ".join(["--pull-never", *(f"-v {path}:{path}:ro" for path in pip_reads())])
        self.run("make", "images", f"BASE={BASE}", f"ROLES={' '.join(roles)}", f"BUILD={flags}")

    def image(self, name: str) -> dict[str, Any]:
        """Return what podman says of an image."""
        (found,) = json.loads(self.podman("image", "inspect", name))
        facts: dict[str, Any] = found
        return facts

    def state(self, container: str) -> dict[str, Any]:
        """Return what podman says of a container."""
        (found,) = json.loads(self.podman("inspect", container))
        state: dict[str, Any] = found["State"]
        return state

    def logs(self, container: str) -> str:
        """Return what a container has printed, on both streams."""
        done = subprocess.run(
            ["podman", "logs", container], env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, check=False,
        )  # fmt: skip
        return done.stdout
