"""Maps drawn with characters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.errors import ConfigError
from swarm.maps.occupancy import FREE, OBSTACLE, WALL
from swarm.maps.text import from_text

SYMBOLS = {FREE: ".", WALL: "#", OBSTACLE: "o"}


def test_the_first_line_is_the_top() -> None:
    drawn = from_text("#..\n..o\n", 0.5)
    assert drawn.cells.tolist() == [[FREE, FREE, OBSTACLE], [WALL, FREE, FREE]]
    assert drawn.at(0.1, 0.9) == WALL
    assert drawn.at(1.4, 0.1) == OBSTACLE
    assert drawn.resolution == 0.5


@pytest.mark.parametrize("text", ["#.\n o", "#.\n o\n", "#.\r\n o\r\n"])
def test_line_ends_do_not_matter(text: str) -> None:
    assert from_text(text, 1).cells.tolist() == [[FREE, OBSTACLE], [WALL, FREE]]


@given(st.integers(1, 8), st.integers(1, 8), st.data())
def test_what_is_drawn_is_read(rows: int, columns: int, data: st.DataObject) -> None:
    kinds = data.draw(st.lists(st.sampled_from(sorted(SYMBOLS)), min_size=rows * columns, max_size=rows * columns))
    cells = np.array(kinds, np.uint8).reshape(rows, columns)
    text = "\n".join("".join(SYMBOLS[kind] for kind in line) for line in cells[::-1].tolist())
    np.testing.assert_array_equal(from_text(text, 0.5).cells, cells)


BAD = {
    "nothing": ("", "expected 1 to"),
    "an empty line": ("..\n\n..", "line 2: expected 2 characters as in line 1, got 0"),
    "ragged": ("....\n...\n....", "line 2: expected 4 characters as in line 1, got 3"),
    "unknown character": ("...\n.x.", "line 2, column 2: expected '#'.*got 'x'"),
    "a tab": ("..\t", "line 1, column 3"),
    "a line break of its own kind": ("..\x0b", "column 3"),
}


@pytest.mark.parametrize(("text", "sentence"), BAD.values(), ids=BAD)
def test_what_is_wrong_is_said_with_its_place(text: str, sentence: str) -> None:
    with pytest.raises(ConfigError, match=f"^paper.yaml: map: .*{sentence}|^paper.yaml: map: {sentence}"):
        from_text(text, 0.5, "paper.yaml: map")


@pytest.mark.parametrize("cell", [0, -1, float("nan"), float("inf"), 10**400, True, "0.5", None])
def test_a_side_that_is_no_length_is_refused(cell: float) -> None:
    with pytest.raises(ConfigError, match="cell's side"):
        from_text("..", cell)
