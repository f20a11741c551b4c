"""Completeness of a rule base: wherever a behaviour weighs anything, a rule of it fires."""

from itertools import pairwise
from math import isfinite

import numpy as np

from swarm.errors import ConfigError
from swarm.fuzzy.vocabulary import ANY, INPUTS, Behaviour, Variable, Weighing


def check_no_gap(
    behaviour: Behaviour, inputs: dict[str, Variable], weighing: Weighing | None, first: bool, where: str
) -> None:
    """Refuse a behaviour that leaves a point of the input space without a rule, and name such a point.

    Exact, not sampled: between neighbouring corners of its terms a variable's set of active terms does not change, so
    the corners and one point between each two stand for the whole universe. A behaviour need not cover where its weight
    is 0: the ``first`` one weighs w = min(1 - membership) over the weighing's conditions, the other 1 - w.
    """
    conditions = dict(weighing.when) if weighing else {}
    points = {name: _points(inputs[name]) for name in INPUTS}
    # Whether a rule's antecedent holds at a point of an input, (points, rules), and which points take weight from w.
    holds, takes, takes_all = {}, {}, {}
    for name in INPUTS:
        terms = {term.name: term for term in inputs[name].terms}
        holds[name] = np.array(
            [[cell == ANY or terms[cell].membership(x) > 0 for cell in _cells(behaviour, name)] for x in points[name]]
        )
        condition = terms[conditions[name]] if name in conditions else None
        memberships = np.array([condition.membership(x) if condition else 0.0 for x in points[name]])
        takes[name], takes_all[name] = memberships > 0, memberships >= 1

    left, front, right, head = INPUTS
    fired = np.einsum("ar,br->abr", holds[left], holds[front]).reshape(-1, len(behaviour.rules)).astype(np.float32)
    others = np.einsum("ar,br->abr", holds[right], holds[head]).reshape(-1, len(behaviour.rules)).astype(np.float32)
    shape = tuple(len(points[name]) for name in INPUTS)
    gap = (fired @ others.T == 0).reshape(shape)
    if weighing:
        grids = np.meshgrid(*(takes_all[name] if first else takes[name] for name in INPUTS), indexing="ij", sparse=True)
        any_takes = grids[0] | grids[1] | grids[2] | grids[3]
        gap &= ~any_takes if first else any_takes
    if gap.any():
        at = dict(zip(INPUTS, np.argwhere(gap)[0], strict=True))
        values = {name: float(points[name][k]) for name, k in at.items()}
        said = ", ".join(f"{name} {x:g} ({_labels(inputs[name], x)})" for name, x in values.items())
        raise ConfigError(f"{where}: no rule fires at {said}; add a rule for it or widen a term")


def _points(variable: Variable) -> list[float]:
    """List points of a universe, one for each set of active terms it has, and of terms that hold in full."""
    corners = {x for term in variable.terms for x in (term.a, term.b, term.c, term.d) if isfinite(x)}
    inside = sorted({variable.low, variable.high} | {x for x in corners if variable.low < x < variable.high})
    candidates = sorted(inside + [(a + b) / 2 for a, b in pairwise(inside)])
    kept: dict[tuple[float, ...], float] = {}
    for x in candidates:
        memberships = [term.membership(x) for term in variable.terms]
        kept.setdefault(tuple(0.0 if m <= 0 else 1.0 if m >= 1 else 0.5 for m in memberships), x)
    return list(kept.values())


def _cells(behaviour: Behaviour, name: str) -> list[str]:
    column = behaviour.columns.index(name)
    return [rule.terms[column] for rule in behaviour.rules]


def _labels(variable: Variable, x: float) -> str:
    return " and ".join(term.name for term in variable.terms if term.membership(x) > 0) or "no term"
