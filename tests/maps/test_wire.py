"""Maps as they cross the network."""

import zlib

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import UNSET
from msgspec.structs import replace

from swarm.bus.codec import decode
from swarm.errors import PeerError
from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.wire import pack, unpack
from swarm.messages import MAP, Map
from swarm.scenario.load import Scenario
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
    assert len(pack(OccupancyMap(np.zeros((1000, 1000), np.uint8), 1.0)).cells) < 2000


GOOD = pack(SMALL)
# fmt: off
BAD: dict[str, dict[str, object]] = {
    "negative":                   {"columns": -3},
    "swapped to another size":    {"rows": 4},
    "a thousand million cells":   {"rows": 100_000, "columns": 100_000},
    "no resolution":              {"resolution": float("nan")},
    "an endless resolution":      {"resolution": float("inf")},
    "origin infinite":            {"origin": (0.0, float("inf"), 0.0)},
    "no origin":                  {"origin": (0.0, float("nan"), 0.0)},
    "cells that are not packed":  {"cells": b"\0\1\2\3\0\0"},
    "cells cut short":            {"cells": GOOD.cells[:-3]},
    "cells with more behind":     {"cells": GOOD.cells + b"x"},
    "too few cells":              {"cells": zlib.compress(b"\0" * 5)},
    "a bomb":                     {"cells": zlib.compress(b"\0" * 50_000_000)},
    "a kind that is none":        {"cells": zlib.compress(b"\0\1\2\3\4\0")},
}
MALFORMED: dict[str, dict[str, object]] = {
    "a key less":                             {"origin": UNSET},
    "rows as text":                           {"rows": "2"},
    "rows as truth":                          {"rows": True},
    "no rows":                                {"rows": 0},
    "a resolution as text":                   {"resolution": "0.5"},
    "a whole number too large for a float":   {"resolution": 2**64 - 1},
    "origin of two":                          {"origin": [0.0, 0.0]},
    "origin of text":                         {"origin": "abc"},
    "origin too far":                         {"origin": [0, 2**64 - 1, 0]},
    "cells as text":                          {"cells": "abc"},
}
# fmt: on


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_refused(name: str) -> None:
    with pytest.raises(PeerError, match=r"^map: .*expected"):
        unpack(replace(GOOD, **BAD[name]))


@pytest.mark.parametrize("name", MALFORMED)
def test_what_has_not_its_form_is_refused_on_arrival(name: str, paper: Scenario) -> None:
    fields = msgspec.to_builtins(GOOD) | {"cells": GOOD.cells} | MALFORMED[name]
    message = {"v": 1, "scenario": paper.to_wire()[0], "packed": fields}
    if MALFORMED[name] == {"origin": UNSET}:
        del fields["origin"]
    with pytest.raises(PeerError, match="packed"):
        decode(msgspec.msgpack.encode(message), Map, MAP.limit)
