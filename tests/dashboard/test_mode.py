import subprocess
import sys

import pytest

from dashboard import mode
from swarm.errors import ConfigError

# fmt: off
CHOSEN = {  # asked for, a display, Rerun is installed, a file is recorded -> the word beside a fleet, the mode of Rerun
    "a display":              ("auto",   True,  True,  False, "viewer", "viewer"),
    "no display":             ("auto",   False, True,  True,  "box",    "web"),
    "no Rerun":               ("auto",   True,  False, False, "box",    "web"),
    "neither":                ("auto",   False, False, False, "box",    "web"),
    "a window":               ("viewer", False, True,  False, "viewer", "viewer"),
    "a page":                 ("web",    True,  True,  False, "web",    "web"),
    "nothing":                ("off",    True,  True,  False, "off",    None),
    "nothing but a file":     ("off",    False, True,  True,  "off",    "off-screen"),
    "the box":                ("box",    True,  True,  False, "box",    None),
    "the box and a file":     ("box",    False, True,  True,  "box",    "off-screen"),
}
# fmt: on


@pytest.mark.parametrize("variable", mode.SCREENS)
@pytest.mark.parametrize("name", CHOSEN)
def test_where_the_dashboard_is_shown(monkeypatch: pytest.MonkeyPatch, name: str, variable: str) -> None:
    asked, screen, installed, record, beside_a_fleet, expected = CHOSEN[name]
    monkeypatch.setattr(mode, "find_spec", lambda package: object() if installed else None)
    environ = {variable: ":0" if screen else ""}
    assert mode.resolve_auto(asked, environ) == beside_a_fleet
    assert mode.choose(asked, environ, record=record) == expected


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
