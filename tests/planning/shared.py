"""Maps for the tests of planning: public benchmark data, if it is present, and random grids."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st
from numpy.typing import NDArray

DATA = Path(__file__).parents[2].parent / "shared" / "data"

needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"the public benchmark data is not at {DATA}")


@st.composite
def grids(draw: st.DrawFn, most: int = 14) -> NDArray[np.bool_]:
    """Draw which cells of a small grid are free."""
    rows, columns = draw(st.integers(1, most)), draw(st.integers(1, most))
    solid_of_ten = draw(st.sampled_from((0, 1, 3, 4)))
    cells = draw(st.lists(st.integers(0, 9), min_size=rows * columns, max_size=rows * columns))
    return np.array(cells, dtype=np.int64).reshape(rows, columns) >= solid_of_ten
