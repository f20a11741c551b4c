"""Keys that are missing, readable by others, expired, or not of one piece: each is named before anything is opened."""

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from shutil import copy, rmtree

import pytest

from swarm.errors import ConfigError
from swarm.secure import Identity
from swarm.secure.certificates import Authority
from tests.secure.shared import DAY, NOW, fleet_keys

Spoil = Callable[[Path], object]


def test_good_keys_pass_for_every_member(tmp_path: Path) -> None:
    fleet_keys(tmp_path / "keys")
    for name in ("router", "world", "operator", "watcher", "bridge", "r1", "r2"):
        Identity(tmp_path / "keys", name).check()


# fmt: off
SPOILT: dict[str, tuple[Spoil, str]] = {
    "no folder":      (rmtree,                                                        "found no such folder"),
    "no key":         (lambda r1: (r1 / "key.pem").unlink(),                          "key.pem: expected a file that can be read, got No such file"),
    "open key":       (lambda r1: (r1 / "key.pem").chmod(0o640),                      "key.pem: expected a file that only its owner may read, got mode 0640"),
    "open authority": (lambda r1: (r1 / "ca.pem").chmod(0o602),                       "ca.pem: expected a file that only its owner may read, got mode 0602"),
    "no PEM":         (lambda r1: (r1 / "certificate.pem").write_bytes(b"\x00"),      "certificate.pem: expected a certificate in PEM"),
    "empty":          (lambda r1: (r1 / "ca.pem").write_bytes(b""),                   "ca.pem: expected a certificate in PEM"),
    "half a key":     (lambda r1: (r1 / "key.pem").write_bytes((r1 / "key.pem").read_bytes()[:100]), "key.pem: expected a private key in PEM"),
    "another's key":  (lambda r1: copy(r1.parent / "r2" / "key.pem", r1),             "key.pem: expected the key of certificate.pem, got another one"),
    "another's name": (lambda r1: copy(r1.parent / "r2" / "certificate.pem", r1),     "expected the certificate of r1, got that of r2"),
    "other authority": (lambda r1: (r1 / "ca.pem").write_bytes(Authority(NOW, NOW + DAY).certificate), "expected one that ca.pem has issued"),
}
# fmt: on


@pytest.mark.parametrize("case", SPOILT)
def test_a_wrong_file_is_named(case: str, tmp_path: Path) -> None:
    fleet_keys(tmp_path / "keys")
    spoil, expected = SPOILT[case]
    spoil(tmp_path / "keys" / "r1")
    with pytest.raises(ConfigError) as refused:
        Identity(tmp_path / "keys", "r1").check()
    assert expected in str(refused.value)
    assert str(tmp_path / "keys" / "r1") in str(refused.value)
    Identity(tmp_path / "keys", "r2").check()


@pytest.mark.parametrize(
    ("later", "expected"),
    [
        (DAY - timedelta(seconds=1), None),
        (DAY, "got one that expired on"),
        (-DAY, None),
        (-DAY - timedelta(seconds=1), "correct this machine's clock"),
    ],
)
def test_the_dates_are_checked(later: timedelta, expected: str | None, tmp_path: Path) -> None:
    fleet_keys(tmp_path / "keys")
    now = (NOW + later).replace(microsecond=0)
    if expected is None:
        Identity(tmp_path / "keys", "r1").check(now)
    else:
        with pytest.raises(ConfigError, match=expected):
            Identity(tmp_path / "keys", "r1").check(now)
