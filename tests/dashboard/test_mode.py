import subprocess
import sys

import pytest

from dashboard import mode
from swarm.errors import ConfigError


@pytest.mark.parametrize(
    ("asked", "environ", "record", "expected"),
    [
        ("auto", {"DISPLAY": ":0"}, False, "viewer"),
        ("auto", {"WAYLAND_DISPLAY": "wayland-0"}, False, "viewer"),
        ("auto", {"DISPLAY": ""}, False, "web"),
        ("auto", {}, True, "web"),
        ("viewer", {}, False, "viewer"),
        ("web", {"DISPLAY": ":0"}, False, "web"),
        ("off", {"DISPLAY": ":0"}, False, None),
        ("off", {}, True, "off-screen"),
        ("box", {"DISPLAY": ":0"}, False, None),
        ("box", {}, True, "off-screen"),
    ],
)
def test_choose(
    monkeypatch: pytest.MonkeyPatch, asked: str, environ: dict[str, str], record: bool, expected: str | None
) -> None:
    monkeypatch.setattr(mode, "find_spec", lambda name: object())
    assert mode.choose(asked, environ, record=record) == expected


def test_a_display_without_the_viewer_program_gets_the_web_viewer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mode, "find_spec", lambda name: None)
    assert mode.choose("auto", {"DISPLAY": ":0"}) == "web"


@pytest.mark.parametrize(
    ("asked", "screen", "installed", "expected"),
    [
        ("auto", True, {"rerun", "rerun_cli"}, "viewer"),
        ("auto", False, {"rerun", "rerun_cli"}, "box"),
        ("auto", True, set(), "box"),
        ("auto", False, set(), "box"),
        ("web", True, set(), "web"),
        ("fly", True, set(), "fly"),
    ],
)
def test_auto_of_a_fleet_is_the_viewer_where_there_is_a_display_else_the_box(
    monkeypatch: pytest.MonkeyPatch, asked: str, screen: bool, installed: set[str], expected: str
) -> None:
    monkeypatch.setattr(mode, "find_spec", lambda name: object() if name in installed else None)
    assert mode.resolved(asked, {"DISPLAY": ":0"} if screen else {}) == expected


def test_the_page_is_on_loopback_unless_asked_otherwise() -> None:
    assert mode.page_address(9090, 9876).startswith("http://127.0.0.1:9090/?url=rerun%2Bhttp://127.0.0.1:9876/proxy&")
    assert "127.0.0.1" not in mode.page_address(9090, 9876, mode.ANY)


def test_an_unknown_word_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected one of auto, viewer, web, box, off, got 'of'"):
        mode.choose("of", {})


def test_a_host_without_rerun_can_import_all_but_the_view() -> None:
    code = (
        "import sys; sys.modules['rerun'] = None\n"
        "import dashboard.fold.progress, dashboard.terminal, dashboard.mode, dashboard.fold.collect, dashboard.box.process, dashboard.__main__\n"
        "assert not [name for name in sys.modules if name.startswith('rerun_')]"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_viewer_started_is_the_program_itself_not_a_script_around_it() -> None:
    program = mode.viewer_program()
    assert program is not None
    assert program.read_bytes()[:2] != b"#!", "ended, a script would leave the viewer behind"
