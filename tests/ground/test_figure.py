"""The paper's figure 5 in the docs: always the one that the mission's table gives."""

import importlib.util
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

from swarm.robot.mission import TRANSITIONS
from tests.shared import ROOT

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def figure() -> ModuleType:
    spec = importlib.util.spec_from_file_location("figure5", ROOT / "docs" / "figure5.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_picture_is_up_to_date(figure: ModuleType) -> None:
    drawn = Path(figure.PICTURE).read_text(encoding="utf-8")
    assert drawn == figure.svg(), "run `python docs/figure5.py`"


def test_every_stage_and_every_row_of_the_table_is_in_it(figure: ModuleType) -> None:
    root = ElementTree.fromstring(figure.svg())
    words = [text.text for text in root.iter(f"{SVG}text")]
    for stage, row in TRANSITIONS.items():
        assert words.count(stage.value) == 1
        for occasion in row:
            assert occasion.value in words
    arrows = [path for path in root.iter(f"{SVG}path") if path.get("marker-end")]
    assert len(arrows) == sum(map(len, TRANSITIONS.values()))
