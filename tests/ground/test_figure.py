"""The paper's figure 5 in the docs shows all transitions of the mission's table."""

from xml.etree import ElementTree

from docs import figure5
from swarm.robot.mission import TRANSITIONS

SVG = "{http://www.w3.org/2000/svg}"


def test_every_stage_and_every_row_of_the_table_is_in_it() -> None:
    root = ElementTree.fromstring(figure5.svg())
    words = [text.text for text in root.iter(f"{SVG}text")]
    for stage, row in TRANSITIONS.items():
        assert words.count(stage.value) == 1
        for occasion in row:
            assert occasion.value in words
    arrows = [path for path in root.iter(f"{SVG}path") if path.get("marker-end")]
    assert len(arrows) == sum(map(len, TRANSITIONS.values()))
