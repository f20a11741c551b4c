"""The project's own scenarios are found by name, from any folder."""

from pathlib import Path

import pytest

from swarm.cli import main
from swarm.scenario.shipped_scenarios import FOLDER, find_scenario, shipped_scenarios


def test_every_scenario_says_what_it_is() -> None:
    assert set(shipped_scenarios()) == {path.stem for path in FOLDER.glob("*.yaml")}
    assert all(len(about) > 20 for about in shipped_scenarios().values())


# fmt: off
NAMES = {  # what is asked for: what is found
    "paper":          FOLDER / "paper.yaml",
    "paper.yaml":     FOLDER / "paper.yaml",
    "no_such":        Path("no_such"),
    "there/paper":    Path("there/paper"),
    "paper.map":      Path("paper.map"),
}
# fmt: on


@pytest.mark.parametrize("name", NAMES)
def test_a_bare_name_is_a_shipped_scenario(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_scenario(Path(name)) == NAMES[name]


def test_a_file_of_that_name_goes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("paper.yaml").write_text("name: mine\n", encoding="utf-8")
    assert find_scenario(Path("paper.yaml")) == Path("paper.yaml")


def test_run_alone_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in shipped_scenarios())
