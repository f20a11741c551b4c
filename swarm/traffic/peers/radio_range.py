"""Which robots are in radio range of which. Compiled: the world asks in each tick, a robot with each broadcast."""

from math import hypot

import numpy as np
from numba import njit
from numpy.typing import NDArray

Places = NDArray[np.float64]  # (robots, 2 or more): x, y [m]


@njit("i8[:, ::1](f8[:, ::1], i8[::1], f8)", cache=True)
def list_pairs_in_range(places: Places, senders: NDArray[np.int64], reach: float) -> NDArray[np.int64]:
    """List the pairs (listener, sender) of robots at most ``reach`` [m] apart, the first listener's first: (n, 2)."""
    found = np.empty((places.shape[0] * senders.size, 2), np.int64)
    count = 0
    for listener in range(places.shape[0]):
        for sender in senders:
            dx, dy = places[listener, 0] - places[sender, 0], places[listener, 1] - places[sender, 1]
            if listener != sender and abs(dx) <= reach and hypot(dx, dy) <= reach:
                found[count] = listener, sender
                count += 1
    return found[:count].copy()


@njit("b1[::1](f8[:, ::1], f8, f8, f8, f8)", cache=True)
def find_hidden_robots(places: Places, x: float, y: float, reach: float, heard: float) -> NDArray[np.bool_]:
    """Return for each robot True if one that is at most ``reach`` from (x, y) is more than ``heard`` from it [m]."""
    near = np.empty(places.shape[0], np.int64)
    count = 0
    for k in range(places.shape[0]):
        if hypot(places[k, 0] - x, places[k, 1] - y) <= reach:
            near[count] = k
            count += 1
    found = np.zeros(places.shape[0], np.bool_)
    for k in range(places.shape[0]):
        for other in near[:count]:
            if hypot(places[k, 0] - places[other, 0], places[k, 1] - places[other, 1]) > heard:
                found[k] = True
                break
    return found
