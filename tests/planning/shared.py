"""Maps for the tests of planning: random grids."""

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray


@st.composite
def grids(draw: st.DrawFn, most: int = 14) -> NDArray[np.bool_]:
    """Draw which cells of a small grid are free."""
    rows, columns = draw(st.integers(1, most)), draw(st.integers(1, most))
    solid_of_ten = draw(st.sampled_from((0, 1, 3, 4)))
    cells = draw(st.lists(st.integers(0, 9), min_size=rows * columns, max_size=rows * columns))
    return np.array(cells, dtype=np.int64).reshape(rows, columns) >= solid_of_ten
