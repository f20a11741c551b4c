"""A profile as the flat arrays that the compiled kernel reads."""

from collections.abc import Iterator
from itertools import combinations, pairwise
from math import inf
from typing import NamedTuple

import numpy as np

from swarm.fuzzy.kernel import Floats, Integers
from swarm.fuzzy.profile import Profile
from swarm.fuzzy.vocabulary import ANY, INPUTS, OUTPUTS, Slowing, Term, Variable

_NEVER = (inf, inf, inf, inf)  # a term without members: pads variables that have fewer terms than others
_NO_SLOWING = Slowing(near=0.0, far=0.0, least=1.0)  # the factor of both speeds is always 1


class Tables(NamedTuple):
    """The arguments of `kernel.infer` after the four inputs."""

    universes: Floats  # (6, 2): low and high of each input, then of each output
    terms: Floats  # (4, t, 4): trapezoid j of input i; slot i * t + j holds its membership, slot 4 t is `any`
    rules: Integers  # (r, 8): behaviour, mask of the slots it needs, slots of its four antecedents, its two consequents
    yields: Integers  # (k,): slots whose membership reduces the weight of behaviour 0
    pieces: Integers  # (p, 3): output, an earlier piece whose height also limits this one or -1, consequent term
    areas: Floats  # (p, 7): a piece's lowest and highest height, two coefficients of its area, three of its moment
    slowing: Floats  # (3,): near [m], far [m], least


def tables(profile: Profile) -> Tables:
    """Return a profile as arrays for the kernel."""
    inputs = [profile.inputs[name] for name in INPUTS]
    outputs = [profile.outputs[name] for name in OUTPUTS]
    per_variable = max(len(variable.terms) for variable in inputs)
    terms = np.full((len(inputs), per_variable, 4), _NEVER)
    for i, variable in enumerate(inputs):
        for j, term in enumerate(variable.terms):
            terms[i, j] = term.a, term.b, term.c, term.d

    def slot(name: str, term: str) -> int:
        i = INPUTS.index(name)
        return len(INPUTS) * per_variable if term == ANY else i * per_variable + inputs[i].names().index(term)

    rows = []
    for number, behaviour in enumerate(profile.by_weight()):
        for rule in behaviour.rules:
            cell = {name: behaviour.cell(rule, name) for name in behaviour.columns}
            mask = sum(1 << slot(name, cell[name]) for name in INPUTS if cell[name] != ANY)
            slots = [slot(name, cell[name]) for name in INPUTS]
            consequents = [profile.outputs[name].names().index(cell[name]) for name in OUTPUTS]
            rows.append([number, mask, *slots, *consequents])

    pieces: list[list[int]] = []
    areas: list[list[float]] = []
    for output, variable in enumerate(outputs):
        first: dict[tuple[int, ...], int] = {}  # set of terms: index of its first piece
        for chosen, area in pieces_of(variable):
            bound = first[chosen[:-1]] if len(chosen) > 1 else -1
            first.setdefault(chosen, len(pieces))
            pieces.append([output, bound, chosen[-1]])
            areas.append(area)

    weighing, slowing = profile.weighing, profile.slowing or _NO_SLOWING
    return Tables(
        universes=np.array([(variable.low, variable.high) for variable in (*inputs, *outputs)], dtype=np.float64),
        terms=np.ascontiguousarray(terms),
        rules=np.array(rows, dtype=np.int64),
        yields=np.array([slot(*condition) for condition in weighing.when] if weighing else [], dtype=np.int64),
        pieces=np.array(pieces, dtype=np.int64),
        areas=np.array(areas, dtype=np.float64),
        slowing=np.array((slowing.near, slowing.far, slowing.least), dtype=np.float64),
    )


def pieces_of(variable: Variable) -> Iterator[tuple[tuple[int, ...], list[float]]]:
    """Yield the pieces of the exact centroid of clipped and joined consequents.

    Inclusion and exclusion: the joined shape's area is the sum of the clipped terms' areas, minus those of the overlaps
    of two, plus those of three, and so on. An overlap of clipped terms is the overlap of the terms, clipped at the
    least of their heights. An overlap's alpha-cut at height s is one interval [l(s), r(s)]; l and r are piecewise
    linear. So, clipped at height t, its area is the integral of r - l over s from 0 to t, and its moment is the
    integral of (r - l)(r + l)/2. Both are piecewise polynomials in t.

    Each item is a set of terms that overlap, and seven numbers. The first two are the heights s0 and s1 between which l
    and r are straight. With u = min(t, s1) - s0, the others are the coefficients of the area (u, u^2) and of the moment
    (u, u^2, u^3); they include the sign of the set. A set comes after the sets that have one term less.
    """
    for size in range(1, len(variable.terms) + 1):
        for chosen in combinations(range(len(variable.terms)), size):
            overlap = [variable.terms[i] for i in chosen]
            if min(term.d for term in overlap) <= max(term.a for term in overlap):
                continue
            sign = 1.0 if size % 2 else -1.0
            heights = _kinks(overlap)
            for s0, s1 in pairwise(heights):
                (l0, r0), (l1, r1) = _alpha_cut(overlap, s0), _alpha_cut(overlap, s1)
                if r0 + r1 <= l0 + l1:
                    break  # the height is above the peak
                width, width_slope = r0 - l0, (r1 - r0 - l1 + l0) / (s1 - s0)
                middle, middle_slope = (r0 + l0) / 2, (r1 - r0 + l1 - l0) / (s1 - s0) / 2
                area = (width, width_slope / 2)
                moment = (
                    width * middle,
                    (width * middle_slope + width_slope * middle) / 2,
                    width_slope * middle_slope / 3,
                )
                yield chosen, [s0, s1, *(sign * value for value in (*area, *moment))]


def _alpha_cut(terms: list[Term], s: float) -> tuple[float, float]:
    """Return the ends of the alpha-cut that all terms share at height s; if there is none, left is above right."""
    return (
        max(term.a + s * (term.b - term.a) for term in terms),
        min(term.d - s * (term.d - term.c) for term in terms),
    )


def _kinks(terms: list[Term]) -> list[float]:
    """Return 0, 1 and every height at which two edges cross; between these the ends of the shared cut are straight."""
    edges = [(term.a, term.b - term.a) for term in terms] + [(term.d, term.c - term.d) for term in terms]
    heights = {0.0, 1.0}
    for (x, slope), (y, other) in combinations(edges, 2):
        if slope != other and 0.0 < (height := (y - x) / (slope - other)) < 1.0:
            heights.add(height)
    return sorted(heights)
