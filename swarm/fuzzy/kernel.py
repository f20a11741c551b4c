"""The compiled inference: Mamdani min-max with the exact centroid, over the flat arrays of `tables`.

Compiled at import from explicit signatures and cached on disk; no fast-math, so that the same inputs give the same bits
in every process, and in plain Python too.
"""

from collections.abc import Callable
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

_F = TypeVar("_F", bound=Callable[..., Any])

if TYPE_CHECKING:

    def njit(signature: str, *, cache: bool) -> Callable[[_F], _F]:
        """Compile, as numba does; typed here because numba is not."""
        ...

else:
    from numba import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

TERMS = 9  # most of one variable: a bit a term and input must fit the rules' masks of 63
TABLES = "f8[:,::1], f8[:,:,::1], i8[:,::1], i8[::1], i8[:,::1], f8[:,::1], f8[::1]"


@njit("f8(f8, f8, f8, f8, f8)", cache=True)
def membership(x: float, a: float, b: float, c: float, d: float) -> float:
    """Evaluate the trapezoid (a, b, c, d) at x, as `Term.membership` does."""
    if x < b:
        return (x - a) / (b - a) if x > a else 0.0
    if x > c:
        return (d - x) / (d - c) if x < d else 0.0
    return 1.0


@njit("f8(f8)", cache=True)
def within_half_turn(heading: float) -> float:
    """Return the same direction within -180..180 [degrees]."""
    if abs(heading) <= 180.0:
        return heading
    heading %= 360.0
    return heading - 360.0 if heading > 180.0 else heading


@njit("f8(i8, i8, i8, i8[:,::1], f8[:,::1], f8[::1])", cache=True)
def centroid(output: int, levels: int, heights: int, pieces: Integers, areas: Floats, scratch: Floats) -> float:
    """Defuzzify: the centroid of an output's clipped and joined consequents, by the closed form of `tables.pieces_of`.

    ``scratch`` holds the heights the terms are clipped at from ``levels`` on, and room to work from ``heights`` on.
    """
    area, moment = 0.0, 0.0
    for k in range(pieces.shape[0]):
        if pieces[k, 0] != output:
            continue
        height = scratch[levels + pieces[k, 2]]
        if pieces[k, 1] >= 0:
            height = min(height, scratch[heights + pieces[k, 1]])
        scratch[heights + k] = height
        u = min(height, areas[k, 1]) - areas[k, 0]
        if u > 0.0:
            area += u * (areas[k, 2] + u * areas[k, 3])
            moment += u * (areas[k, 4] + u * (areas[k, 5] + u * areas[k, 6]))
    return moment / area if area > 0.0 else 0.0


@njit("f8(f8, f8, f8, f8)", cache=True)
def slowing_factor(nearest: float, near: float, far: float, least: float) -> float:
    """Return what both speeds are multiplied by: ``least`` up to ``near`` [m], 1 from ``far`` [m] on, linear between.

    `infer_into` ends with it, so whoever asks the tables gets the same speeds.
    """
    if nearest >= far:
        return 1.0
    if nearest <= near:
        return least
    return least + (1.0 - least) * ((nearest - near) / (far - near))


@njit(f"UniTuple(f8, 3)(f8, f8, f8, f8, {TABLES}, f8[::1])", cache=True)
def infer_into(
    left: float,
    front: float,
    right: float,
    heading: float,
    universes: Floats,
    terms: Floats,
    rules: Integers,
    yields: Integers,
    pieces: Integers,
    areas: Floats,
    slowing: Floats,
    scratch: Floats,
) -> tuple[float, float, float]:
    """Infer as `infer` does, with room to work in given by the caller: see `scratch_size`."""
    if not (isfinite(left) and isfinite(front) and isfinite(right) and isfinite(heading)):
        return nan, nan, nan
    if left < 0.0 or front < 0.0 or right < 0.0:
        return nan, nan, nan
    heading = within_half_turn(heading)

    # Fuzzify. Slot i * per_variable + j is the membership of input i in its term j; the last slot is `any`.
    per_variable = terms.shape[1]
    always = 4 * per_variable
    active = 0
    for i in range(4):
        x = left if i == 0 else front if i == 1 else right if i == 2 else heading
        x = min(max(x, universes[i, 0]), universes[i, 1])
        for j in range(per_variable):
            slot = i * per_variable + j
            value = membership(x, terms[i, j, 0], terms[i, j, 1], terms[i, j, 2], terms[i, j, 3])
            scratch[slot] = value
            if value > 0.0:
                active |= 1 << slot
    scratch[always] = 1.0

    # Weigh the behaviours: 0 weighs w, 1 the rest.
    w = 1.0
    for k in range(yields.shape[0]):
        w = min(w, 1.0 - scratch[yields[k]])

    # Fire: a rule whose every antecedent is active lifts its two consequents to its strength, joined by maximum.
    # Level (behaviour * 2 + output) * TERMS + term is the height at which that consequent is clipped.
    levels = always + 1
    heights = levels + 4 * TERMS
    for k in range(levels, heights):
        scratch[k] = 0.0
    for k in range(rules.shape[0]):
        behaviour = rules[k, 0]
        if (rules[k, 1] & ~active) != 0 or (w if behaviour == 0 else 1.0 - w) <= 0.0:
            continue
        strength = min(min(scratch[rules[k, 2]], scratch[rules[k, 3]]), min(scratch[rules[k, 4]], scratch[rules[k, 5]]))
        for output in range(2):
            level = levels + (behaviour * 2 + output) * TERMS + rules[k, 6 + output]
            scratch[level] = max(scratch[level], strength)

    left_v, right_v = 0.0, 0.0
    for behaviour in range(2):
        weight = w if behaviour == 0 else 1.0 - w
        if weight > 0.0:
            left_level = levels + behaviour * 2 * TERMS
            left_v += weight * centroid(0, left_level, heights, pieces, areas, scratch)
            right_v += weight * centroid(1, left_level + TERMS, heights, pieces, areas, scratch)
    left_v = min(max(left_v, universes[4, 0]), universes[4, 1])
    right_v = min(max(right_v, universes[5, 0]), universes[5, 1])
    factor = slowing_factor(min(left, front, right), slowing[0], slowing[1], slowing[2])
    return factor * left_v, factor * right_v, w


@njit("i8(f8[:,:,::1], i8[:,::1])", cache=True)
def scratch_size(terms: Floats, pieces: Integers) -> int:
    """Count the numbers `infer_into` works with: memberships, levels, and one height a piece."""
    return int(4 * terms.shape[1] + 1 + 4 * TERMS + pieces.shape[0])


@njit(f"UniTuple(f8, 3)(f8, f8, f8, f8, {TABLES})", cache=True)
def infer(
    left: float,
    front: float,
    right: float,
    heading: float,
    universes: Floats,
    terms: Floats,
    rules: Integers,
    yields: Integers,
    pieces: Integers,
    areas: Floats,
    slowing: Floats,
) -> tuple[float, float, float]:
    """Infer left_v, right_v [m/s] and w from three distances [m] and the target's bearing [degrees, right positive].

    NaN three times over when an input is not finite or a distance is negative.
    """
    scratch = np.empty(scratch_size(terms, pieces))
    return infer_into(left, front, right, heading, universes, terms, rules, yields, pieces, areas, slowing, scratch)


@njit(f"void(f8[:,::1], f8[:,::1], {TABLES})", cache=True)
def infer_rows(
    rows: Floats,
    speeds: Floats,
    universes: Floats,
    terms: Floats,
    rules: Integers,
    yields: Integers,
    pieces: Integers,
    areas: Floats,
    slowing: Floats,
) -> None:
    """Fill ``speeds`` (n, 2) from ``rows`` (n, 4), row by row as `infer` does."""
    scratch = np.empty(scratch_size(terms, pieces))
    for n in range(rows.shape[0]):
        left, front, right, heading = rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3]
        speeds[n, 0], speeds[n, 1], _ = infer_into(
            left, front, right, heading, universes, terms, rules, yields, pieces, areas, slowing, scratch
        )
