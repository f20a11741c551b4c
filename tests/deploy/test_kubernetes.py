"""The manifests of a cluster: their schema, and what they have in common with compose.yaml and the command line."""

import subprocess
import sys
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from swarm.heartbeat import NAMED_BY
from tests.deploy.test_compose import entrypoint
from tests.shared import ROOT

FOLDER: Final = ROOT / "deploy" / "kubernetes"
FILES: Final = sorted(path for path in FOLDER.glob("*.yaml") if path.name != "kustomization.yaml")
MANIFESTS: Final[list[dict[str, Any]]] = [
    one for path in FILES for one in yaml.safe_load_all(path.read_text(encoding="utf-8"))
]
WORKLOADS: Final = {one["metadata"]["name"]: one for one in MANIFESTS if one["kind"] in {"Deployment", "StatefulSet"}}


def container(name: str) -> dict[str, Any]:
    (found,) = WORKLOADS[name]["spec"]["template"]["spec"]["containers"]
    return dict(found)


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.name)
def test_a_manifest_is_valid(file: Path) -> None:
    judge = Path(sys.executable).with_name("kubernetes-validate")
    done = subprocess.run([judge, "--strict", file], capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert "WARN" not in said
    assert said.count("passed") == len(list(yaml.safe_load_all(file.read_text(encoding="utf-8"))))


def test_the_judge_of_manifests_finds_a_planted_fault(tmp_path: Path) -> None:
    judge = Path(sys.executable).with_name("kubernetes-validate")
    text = (FOLDER / "world.yaml").read_text(encoding="utf-8")
    for number, (right, wrong) in enumerate((("replicas: 1", "replicas: one"), ("mountPath", "mountpath"))):
        assert right in text
        (bad := tmp_path / f"{number}.yaml").write_text(text.replace(right, wrong), encoding="utf-8")
        assert subprocess.run([judge, "--strict", bad], capture_output=True, check=False).returncode != 0


def test_the_list_has_every_manifest_and_every_image() -> None:
    listed = yaml.safe_load((FOLDER / "kustomization.yaml").read_text(encoding="utf-8"))
    assert sorted(listed["resources"]) == [path.name for path in FILES]
    assert {one["name"] for one in listed["images"]} == {container(name)["image"] for name in WORKLOADS}


def test_every_pod_is_confined_and_watched() -> None:
    for name, workload in WORKLOADS.items():
        spec, one = workload["spec"]["template"]["spec"], container(name)
        assert (spec["securityContext"]["runAsNonRoot"], spec["automountServiceAccountToken"]) == (True, False)
        assert one["securityContext"] == {
            "allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]},
        }  # fmt: skip
        assert set(one["resources"]) == {"requests", "limits"}
        assert f"${NAMED_BY}" in one["livenessProbe"]["exec"]["command"][2]
        assert {"name": "tmp", "mountPath": "/tmp"} in one["volumeMounts"]


def test_there_is_one_world_with_its_run_on_a_volume_and_robots_for_its_places() -> None:
    world, robot = WORKLOADS["world"], WORKLOADS["robot"]
    assert world["spec"]["replicas"] == 1
    (claim,) = world["spec"]["volumeClaimTemplates"]
    assert {"name": claim["metadata"]["name"], "mountPath": "/state"} in container("world")["volumeMounts"]
    words = container("world")["args"]
    assert "--snapshot=/state/run.snapshot" in words
    assert f"--robots={robot['spec']['replicas']}" in words
    assert robot["spec"]["podManagementPolicy"] == "Parallel", "a robot waits for no other one"


@pytest.mark.parametrize("name", WORKLOADS)
def test_the_command_line_knows_the_words(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    import argparse

    from dashboard.__main__ import main as dashboard
    from swarm.cli import main as swarm

    class Parsed(Exception):  # noqa: N818, no error
        """The command line is right."""

    parse = argparse.ArgumentParser.parse_args

    def only_parse(*given: object, **named: object) -> None:
        parse(*given, **named)  # type: ignore[call-overload]
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", only_parse)
    one = container(name)
    command = one.get("command") or entrypoint(one["image"].removeprefix("zenoh-swarm-"))
    words = [*command, *one["args"]]
    with pytest.raises(Parsed):
        swarm(words[1:]) if words[0] == "swarm" else dashboard(words[3:])
