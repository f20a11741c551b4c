"""The units of systemd: what systemd says of them, and that the command line knows what they start."""

import argparse
import re
import subprocess
from pathlib import Path
from shutil import which
from typing import Final

import pytest

from swarm.cli import main
from tests.shared import ROOT

UNITS: Final = sorted((ROOT / "deploy" / "systemd").glob("*.service"))
SET: Final = {"ROUTER": "tls/fleet.example:7447", "FLEET": "hall", "SCENARIO": "office", "ROS": "tcp/127.0.0.1:7448"}


class Parsed(Exception):  # noqa: N818, no error
    """The command line is right."""


@pytest.mark.skipif(which("systemd-analyze") is None, reason="systemd is not installed")
@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.name)
@pytest.mark.parametrize(("right", "wrong", "said"), [("", "", ""), ("Restart=", "Restart=ever-", "ever-")])
def test_systemd_has_nothing_to_say(unit: Path, right: str, wrong: str, said: str, tmp_path: Path) -> None:
    text = unit.read_text(encoding="utf-8").replace("/opt/swarm/bin/swarm", "/bin/true").replace(right, wrong)
    (file := tmp_path / unit.name.replace("@.", "@r1.")).write_text(text, encoding="utf-8")
    done = subprocess.run(["systemd-analyze", "verify", file], capture_output=True, text=True, check=False)
    mine = [line for line in (done.stdout + done.stderr).splitlines() if file.name in line]
    assert bool(mine) == bool(said), mine
    assert said in "".join(mine)


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.name)
def test_the_command_line_knows_the_words(unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parse = argparse.ArgumentParser.parse_args

    def only_parse(*given: object, **named: object) -> None:
        parse(*given, **named)  # type: ignore[call-overload]
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", only_parse)
    (line,) = re.findall(r"^ExecStart=/opt/swarm/bin/swarm (.*)$", unit.read_text(encoding="utf-8"), re.MULTILINE)
    for name, value in SET.items():
        line = line.replace(f"${{{name}}}", value)
    line = line.replace("$WORLD_OPTIONS", "--body r1 --robots 4")
    assert "$" not in line
    with pytest.raises(Parsed):
        main(line.replace("%i", "r1").split())


def test_units_are_confined_and_come_back() -> None:
    for unit in UNITS:
        text = unit.read_text(encoding="utf-8")
        for words in ("NoNewPrivileges=yes", "ProtectSystem=strict", "User=swarm", "WantedBy=multi-user.target"):
            assert words in text
        assert re.search(r"^Restart=(always|on-failure)$", text, re.MULTILINE)
