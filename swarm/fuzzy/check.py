"""Checks a profile's builtins and returns the types of `vocabulary`.

Every function raises `ConfigError` at the first wrong value; its text says where, what was expected and what came.
"""

import re
from collections.abc import Collection, Iterable
from itertools import pairwise
from math import inf
from typing import TypeGuard

from swarm.errors import ConfigError, suggest
from swarm.fuzzy.kernel import TERMS
from swarm.fuzzy.vocabulary import ANY, INPUTS, OUTPUTS, Behaviour, Rule, Slowing, Term, Variable, Weighing

# The unit of each variable, and its largest universe.
QUANTITIES = dict.fromkeys(INPUTS, ("m", 0.0, 1000.0)) | dict.fromkeys(OUTPUTS, ("m/s", -20.0, 20.0))
QUANTITIES["head_ang"] = ("degrees", -180.0, 180.0)
NARROWEST = 1e-6  # m/s: least width of a consequent's support; a narrower one has no usable centroid

_INFINITIES = {"-inf": -inf, "inf": inf, "+inf": inf}


def mapping(
    value: object, where: str, required: Iterable[str] = (), optional: Iterable[str] = (), example: str = "paper"
) -> dict[str, object]:
    """Check a mapping: it has exactly the named keys, or, if none are named, any words as keys.

    ``example`` is a built-in profile that has all these keys; the error text names it.
    """
    required, optional = tuple(required), tuple(optional)
    if not isinstance(value, dict) or not value:
        keys = ", ".join(required) or "names"
        raise ConfigError(f"{where}: expected a mapping of {keys}, got {quote_value(value)}")
    for key in value:
        if not isinstance(key, str):
            raise ConfigError(f"{where}: expected text as a key, got {quote_value(key)}; put it in quotes")
        if required and key not in required + optional:
            raise ConfigError(f"{where}: unknown key {key!r}; {suggest(key, required + optional)}")
        if not re.fullmatch(r"\w{1,40}", key):
            raise ConfigError(f"{where}: expected a word of letters, digits and _ as a name, got {quote_value(key)}")
    for key in required:
        if key not in value:
            raise ConfigError(f"{where}: {key} is missing; is the file whole? profiles/{example}.yaml shows every key")
    return value


def check_text(value: object, where: str) -> str:
    """Check a text: it is not empty."""
    if not isinstance(value, str) or not value.strip():
        raise ConfigError(f"{where}: expected text, got {quote_value(value)}")
    return value


def variable(value: object, name: str, where: str) -> Variable:
    """Check a variable: its unit, its universe, and that each of its terms is reached within the universe."""
    fields = mapping(value, where, ("unit", "universe", "terms"))
    unit, least, most = QUANTITIES[name]
    if fields["unit"] != unit:
        raise ConfigError(
            f"{where}.unit: expected {unit!r}, got {quote_value(fields['unit'])}; units are not converted"
        )
    low, high = check_numbers(fields["universe"], f"{where}.universe", "[low, high]", 2)
    if not least <= low < high <= most:
        raise ConfigError(
            f"{where}.universe: expected [low, high] with {least:g} <= low < high <= {most:g}, got [{low:g}, {high:g}]"
        )
    terms = mapping(fields["terms"], f"{where}.terms")
    if len(terms) > TERMS:
        raise ConfigError(f"{where}.terms: expected at most {TERMS} terms, got {len(terms)}")
    checked = []
    for label, corners in terms.items():
        checked.append(_term(corners, label, f"{where}.terms.{label}", low, high, name in OUTPUTS))
    return Variable(name, unit, low, high, tuple(checked))


def _term(value: object, name: str, where: str, low: float, high: float, output: bool) -> Term:
    if name == ANY:
        raise ConfigError(f"{where}: in a rule {ANY!r} matches every input; give the term another name")
    a, b, c, d = corners = check_numbers(value, where, "a trapezoid [a, b, c, d]", 4)
    got = f"got [{', '.join(f'{corner:g}' for corner in corners)}]"
    if any(left > right for left, right in pairwise(corners)):
        raise ConfigError(f"{where}: expected a trapezoid in order, a <= b <= c <= d, {got}")
    if output and not (low <= a and d <= high):
        raise ConfigError(f"{where}: expected a support within the universe {low:g}..{high:g}, {got}")
    if d - a < NARROWEST if output else a == d:
        raise ConfigError(f"{where}: expected a trapezoid with some width, a < d, {got}")
    if (a == -inf) != (b == -inf) or (c == inf) != (d == inf) or inf in {a, b} or -inf in {c, d}:
        raise ConfigError(f"{where}: expected both -inf on a left shoulder, both inf on a right one, {got}")
    if d < low or a > high or (d == low < c) or (a == high > b):
        raise ConfigError(f"{where}: expected a term that is reached within the universe {low:g}..{high:g}, {got}")
    return Term(name, a, b, c, d)


def check_numbers(value: object, where: str, form: str, count: int) -> list[float]:
    """Check a list of ``count`` numbers; the words -inf and inf are allowed, NaN is not."""
    if not isinstance(value, list | tuple) or len(value) != count:
        raise ConfigError(f"{where}: expected {form}, got {quote_value(value)}")
    checked = []
    for item in value:
        number = _INFINITIES.get(item, item) if isinstance(item, str) else item
        if not _is_number(number):
            raise ConfigError(f"{where}: expected {form}, each a number, got {quote_value(item)} among them")
        checked.append(float(number))
    return checked


def _is_number(value: object) -> TypeGuard[float]:
    """Return True for a number whose differences and squares stay finite, and for the infinities."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= 1e100 or abs(value) == inf


def behaviour(value: object, name: str, where: str, variables: dict[str, Variable]) -> Behaviour:
    """Check a behaviour's table: a header line, then one rule per line; # begins a comment."""
    lines = [
        re.split(r"[\s,|]+", line.partition("#")[0].strip(" \t,|")) for line in check_text(value, where).splitlines()
    ]
    header, *rows = [cells for cells in lines if cells != [""]] or [[""]]
    columns = tuple(header[1:])
    for column in columns:
        if column not in variables:
            raise ConfigError(f"{where}: unknown column {column!r}; {suggest(column, variables)}")
    missing = [column for column in (*INPUTS, *OUTPUTS) if column not in columns]
    if header[0] != "rule" or missing or len(columns) > len(variables):
        raise ConfigError(
            f"{where}: expected a header line of 'rule' and each of {', '.join(variables)} once, "
            f"got {' '.join(header)!r}" + (f"; add {', '.join(missing)}" if missing else "")
        )
    if not rows:
        raise ConfigError(f"{where}: expected one rule per line below the header, got none")
    rules: dict[int, Rule] = {}
    antecedents: dict[tuple[str, ...], int] = {}
    for cells in rows:
        rule = _rule(cells, columns, where, variables)
        if rule.number in rules:
            raise ConfigError(f"{where}: rule {rule.number} appears twice; give each rule its own number")
        key = tuple(term for column, term in zip(columns, rule.terms, strict=True) if column in INPUTS)
        if key in antecedents:
            raise ConfigError(
                f"{where}: rule {rule.number} has the antecedents of rule {antecedents[key]} "
                f"({', '.join(key)}); keep one of them"
            )
        rules[rule.number] = rule
        antecedents[key] = rule.number
    return Behaviour(name, columns, tuple(rules.values()))


def _rule(cells: list[str], columns: tuple[str, ...], where: str, variables: dict[str, Variable]) -> Rule:
    if not re.fullmatch(r"[0-9]{1,6}", cells[0]):
        raise ConfigError(f"{where}: expected a rule's number first, got {' '.join(cells)!r}")
    where = f"{where}: rule {int(cells[0])}"
    if len(cells) != len(columns) + 1:
        raise ConfigError(
            f"{where}: expected {len(columns) + 1} columns (rule {' '.join(columns)}), "
            f"got {len(cells)}: {' '.join(cells)!r}"
        )
    for column, term in zip(columns, cells[1:], strict=True):
        known = variables[column].names() + ((ANY,) if column in INPUTS else ())
        if term not in known:
            raise ConfigError(f"{where}: {term!r} is not a term of {column}; {suggest(term, known)}")
    return Rule(int(cells[0]), tuple(cells[1:]))


def check_weights(
    value: object, where: str, behaviours: Collection[str], inputs: dict[str, Variable]
) -> Weighing | None:
    """Check how two behaviours share the wheels; one behaviour alone has ``none``."""
    if len(behaviours) == 1:
        if value != "none":
            raise ConfigError(
                f"{where}: expected 'none' with one behaviour, got {quote_value(value)}; add a behaviour or write "
                "'none'"
            )
        return None
    fields = mapping(value, where, ("behaviour", "yields_to", "when"))
    names = []
    for key in ("behaviour", "yields_to"):
        name = check_text(fields[key], f"{where}.{key}")
        if name not in behaviours:
            raise ConfigError(f"{where}.{key}: unknown behaviour {name!r}; {suggest(name, behaviours)}")
        names.append(name)
    if names[0] == names[1]:
        raise ConfigError(f"{where}: expected two behaviours, got {names[0]!r} twice")
    when = mapping(fields["when"], f"{where}.when")
    for name, term in when.items():
        if name not in inputs:
            raise ConfigError(f"{where}.when: unknown input {name!r}; {suggest(name, inputs)}")
        if check_text(term, f"{where}.when.{name}") not in inputs[name].names():
            raise ConfigError(
                f"{where}.when: {term!r} is not a term of {name}; {suggest(str(term), inputs[name].names())}"
            )
    return Weighing(names[0], names[1], tuple((name, str(term)) for name, term in when.items()))


def check_slowing(value: object, where: str, inputs: dict[str, Variable]) -> Slowing:
    """Check how both speeds decrease with the nearest distance."""
    names = ("near", "far", "least")
    fields = mapping(value, where, names, example="careful")
    checked = []
    for name in names:
        number = fields[name]
        if not _is_number(number):
            raise ConfigError(f"{where}.{name}: expected a number, got {quote_value(number)}")
        checked.append(float(number))
    near, far, least = checked
    most = min(variable.high for variable in inputs.values() if variable.unit == "m")
    if not 0.0 <= near < far <= most:
        raise ConfigError(
            f"{where}: expected 0 <= near < far <= {most:g} m, got near {near:g}, far {far:g}; "
            "below near a robot is slowest, above far it drives at the tables' speeds"
        )
    if not 0.0 < least < 1.0:
        raise ConfigError(
            f"{where}.least: expected a share of the tables' speeds, 0 < least < 1, got {least:g}; "
            "with 0 a robot near a wall would never drive again"
        )
    return Slowing(near, far, least)


def quote_value(value: object) -> str:
    """Return a value as text for an error, at most 60 characters."""
    words = "nothing" if value is None else repr(value)
    return words if len(words) <= 60 else f"{words[:57]}..."
