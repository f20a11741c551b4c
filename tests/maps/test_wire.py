"""Maps as they cross the network."""

import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.errors import PeerError
from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.wire import pack, unpack
from tests.maps.drawings import SMALL


@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**32), st.floats(-9, 9), st.floats(0.01, 5))
def test_there_and_back(rows: int, columns: int, seed: int, x: float, resolution: float) -> None:
    cells = np.random.default_rng(seed).integers(0, 4, (rows, columns)).astype(np.uint8)
    sent = OccupancyMap(cells, resolution, Pose(x, -x, x / 4))
    come = unpack(pack(sent))
    np.testing.assert_array_equal(come.cells, sent.cells)
    assert (come.resolution, come.origin) == (sent.resolution, sent.origin)
    assert come.cells.flags.writeable


def test_big_maps_are_small_on_the_wire() -> None:
    assert len(bytes(pack(OccupancyMap(np.zeros((1000, 1000), np.uint8), 1.0))["cells"])) < 2000  # type: ignore[call-overload]


GOOD = pack(SMALL)
BAD: dict[str, object] = {
    "no map": None,
    "a list": [],
    "nothing": {},
    "a key more": GOOD | {"extra": 1},
    "a key less": {key: GOOD[key] for key in GOOD if key != "origin"},
    "rows as text": GOOD | {"rows": "2"},
    "rows as truth": GOOD | {"rows": True},
    "no rows": GOOD | {"rows": 0},
    "negative": GOOD | {"columns": -3},
    "swapped to another size": GOOD | {"rows": 4},
    "a thousand million cells": GOOD | {"rows": 100_000, "columns": 100_000},
    "no resolution": GOOD | {"resolution": float("nan")},
    "a resolution as text": GOOD | {"resolution": "0.5"},
    "a whole number too large for a float": GOOD | {"resolution": 10**400},
    "origin of two": GOOD | {"origin": [0.0, 0.0]},
    "origin of text": GOOD | {"origin": "abc"},
    "origin infinite": GOOD | {"origin": [0.0, float("inf"), 0.0]},
    "origin too large for a float": GOOD | {"origin": [0, 10**400, 0]},
    "cells as text": GOOD | {"cells": "abc"},
    "cells that are not packed": GOOD | {"cells": b"\0\1\2\3\0\0"},
    "cells cut short": GOOD | {"cells": bytes(GOOD["cells"])[:-3]},  # type: ignore[call-overload]
    "cells with more behind": GOOD | {"cells": bytes(GOOD["cells"]) + b"x"},  # type: ignore[call-overload]
    "too few cells": GOOD | {"cells": zlib.compress(b"\0" * 5)},
    "a bomb": GOOD | {"cells": zlib.compress(b"\0" * 50_000_000)},
    "a kind that is none": GOOD | {"cells": zlib.compress(b"\0\1\2\3\4\0")},
}


@pytest.mark.parametrize("packed", BAD.values(), ids=BAD)
def test_what_is_wrong_is_refused(packed: object) -> None:
    with pytest.raises(PeerError, match=r"^map: .*expected"):
        unpack(packed)
