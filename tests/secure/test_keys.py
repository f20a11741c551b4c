"""`swarm keys`, and the commands that refuse to be insecure or to use keys in the wrong way."""

import ipaddress
import os
import stat
from pathlib import Path

import pytest
from cryptography import x509

from swarm.bus import Endpoint, router
from swarm.cli import main
from swarm.errors import ConfigError
from swarm.secure import Identity, keys
from tests.secure.shared import fleet_keys


def test_every_member_gets_keys_that_nobody_else_can_read(tmp_path: Path) -> None:
    before = os.umask(0)  # the files are private by themselves, not by the user's habit
    try:
        assert main(["keys", str(tmp_path / "new" / "keys"), "--robots", "10", "--days", "2"]) == 0
    finally:
        os.umask(before)
    folder = tmp_path / "new" / "keys"
    members = {"router", "world", "operator", "watcher", "bridge", *(f"r{number:02d}" for number in range(1, 11))}
    assert {path.name for path in folder.iterdir()} == members
    for path in (folder, *folder.rglob("*")):
        assert stat.S_IMODE(path.stat().st_mode) == (0o700 if path.is_dir() else 0o600), path
    for name in members:
        Identity(folder, name).check()
    assert {path.name for path in folder.parent.iterdir()} == {"keys"}, "something half made is left"


def test_the_routers_certificate_has_the_hosts(tmp_path: Path) -> None:
    assert main(["keys", str(tmp_path / "keys"), "--robots", "1", "--host", "router", "--host", "10.1.2.3"]) == 0
    certificate = x509.load_pem_x509_certificate((tmp_path / "keys" / "router" / "certificate.pem").read_bytes())
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost", "router"]
    assert ipaddress.ip_address("10.1.2.3") in names.get_values_for_type(x509.IPAddress)


def test_an_empty_folder_is_filled_and_a_full_one_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "keys").mkdir()
    assert main(["keys", str(tmp_path / "keys"), "--robots", "1"]) == 0
    before = {path: path.read_bytes() for path in (tmp_path / "keys").rglob("*.pem")}
    assert main(["keys", str(tmp_path / "keys"), "--robots", "1"]) == 2
    assert "expected a new or empty folder" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in (tmp_path / "keys").rglob("*.pem")} == before


def test_what_fails_halfway_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(robots: object, *, several: bool) -> dict[str, object]:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(keys, "access_list", full)
    with pytest.raises(ConfigError, match="No space left"):
        keys.make(tmp_path / "keys", ["r1"], [], 1.0)
    assert not list(tmp_path.iterdir())


KEYS = "KEYS"
# fmt: off
WRONG: dict[str, tuple[list[str], str]] = {
    "no robots":            (["keys", "new", "--robots", "0"],                                      "expected 1 to 1000"),
    "no days":              (["keys", "new", "--robots", "1", "--days", "0"],                       "expected more than 0"),
    "no host":              (["keys", "new", "--robots", "1", "--host", "ü"],                       "expected the name or address of a host"),
    "open to all":          (["router", "--listen", "tcp/0.0.0.0:7447"],                            "add --insecure"),
    "open to all, IPv6":    (["router", "--listen", "tcp/[::]:7447"],                               "add --insecure"),
    "open by a name":       (["router", "--listen", "tcp/router:7447"],                             "add --insecure"),
    "tls without keys":     (["router", "--listen", "tls/127.0.0.1:7447"],                          "add --secure DIR"),
    "keys without tls":     (["router", "--listen", "tcp/127.0.0.1:7447", "--secure", KEYS],        "begin it with tls/"),
    "router without keys":  (["router", "--listen", "tls/127.0.0.1:7999", "--secure", "nowhere"],   "expected the keys of router in nowhere/router"),
    "no name":              (["robot", "--secure", KEYS],                                           "expected one robot with --id"),
    "two names":            (["robot", "--secure", KEYS, "--count", "2"],                           "expected one robot with --id"),
    "robot unknown":        (["robot", "--secure", KEYS, "--id", "r3"],                             "expected the keys of r3"),
    "robots in a process":  (["run", "paper", "--secure", KEYS, "--robots-per-process", "2"],       "expected 1 with --secure, got 2"),
    "more robots than keys": (["run", "paper", "--secure", KEYS, "--robots", "3"],                  "expected the keys of r3"),
    "client without keys":  (["status", "--connect", "tls/127.0.0.1:7447"],                         "add --secure DIR"),
}
# fmt: on


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, expected = WRONG[case]
    monkeypatch.chdir(tmp_path)
    fleet_keys(tmp_path / KEYS)
    assert main([*arguments, *(["--dashboard", "off"] if arguments[0] == "run" else [])]) == 2
    assert expected in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [KEYS]


def test_a_router_that_is_open_to_others_warns(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(router, "serve", lambda place, others: 0)
    port = Endpoint("127.0.0.1", 0).claim().port
    assert main(["router", "--listen", f"tcp/0.0.0.0:{port}", "--insecure"]) == 0
    assert "anybody who reaches it can steer the robots" in capsys.readouterr().err
    assert main(["router", "--listen", f"tcp/127.0.0.1:{port}"]) == 0
    assert capsys.readouterr().err == ""
    joins = ("router", "--listen", f"tcp/127.0.0.1:{port}", "--join", "tcp/10.1.2.3:7447")
    assert main([*joins]) == 2
    assert (
        "--join: expected an address of this machine only, such as 127.0.0.1, got 10.1.2.3" in capsys.readouterr().err
    )
    assert main([*joins, "--insecure"]) == 0
    assert "tcp/10.1.2.3:7447 is open: anybody who reaches it can steer the robots" in capsys.readouterr().err


def test_routers_join_each_other_only_with_keys_for_several(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(router, "serve", lambda place, others: len(others))
    for name, more, status in (("one", (), 2), ("several", ("--several-routers",), 1)):
        keys = str(tmp_path / name)
        assert main(["keys", keys, "--robots", "1", *more]) == 0
        port = Endpoint("127.0.0.1", 0).claim().port
        words = ("--listen", f"tls/127.0.0.1:{port}", "--join", "tls/10.1.2.3:7447", "--secure", keys)
        assert main(["router", *words]) == status
    assert "--join: expected keys with which routers may join each other" in capsys.readouterr().err
