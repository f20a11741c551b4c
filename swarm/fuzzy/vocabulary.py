"""The words of a profile: term, variable, rule, behaviour, weighing, slowing. Plain values, checked on reading."""

from dataclasses import dataclass

INPUTS = ("left_obs", "front_obs", "right_obs", "head_ang")  # m, m, m, degrees; the order of `wheel_speeds`
OUTPUTS = ("left_v", "right_v")  # m/s
ANY = "any"  # an antecedent that holds whatever the input: membership 1


@dataclass(frozen=True, slots=True)
class Term:
    """One label of a variable: the trapezoid that is 0 up to a, rises to 1 at b, stays to c and is 0 again from d.

    A shoulder has a = b = -inf or c = d = +inf; a = b or c = d is a vertical edge, whose corner belongs to the term.
    """

    name: str
    a: float
    b: float
    c: float
    d: float

    def membership(self, x: float) -> float:
        """Return how far ``x`` belongs to this term [0..1].

        >>> slow = Term("slow", 0.0, 1.0, 1.0, 2.0)
        >>> slow.membership(0.25), slow.membership(1.0), slow.membership(2.0)
        (0.25, 1.0, 0.0)
        """
        if x < self.b:
            return (x - self.a) / (self.b - self.a) if x > self.a else 0.0
        if x > self.c:
            return (self.d - x) / (self.d - self.c) if x < self.d else 0.0
        return 1.0


@dataclass(frozen=True, slots=True)
class Variable:
    """A linguistic variable: its unit, the universe its values are clipped to, and its terms."""

    name: str
    unit: str
    low: float
    high: float
    terms: tuple[Term, ...]

    def names(self) -> tuple[str, ...]:
        """List the terms' names, in the file's order."""
        return tuple(term.name for term in self.terms)


@dataclass(frozen=True, slots=True)
class Rule:
    """One row of a behaviour's table: its number, and one term (or ``any``) a column."""

    number: int
    terms: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Behaviour:
    """A rule base of its own: the columns of its table, inputs and outputs in the file's order, and its rules."""

    name: str
    columns: tuple[str, ...]
    rules: tuple[Rule, ...]

    def cell(self, rule: Rule, variable: str) -> str:
        """Look up what a rule says of a variable."""
        return rule.terms[self.columns.index(variable)]

    def text(self, rule: Rule) -> str:
        """Return a rule in words: ``IF left_obs is near AND ... THEN left_v is fast AND right_v is slow``."""
        cells = list(zip(self.columns, rule.terms, strict=True))
        antecedents = [f"{name} is {term}" for name, term in cells if name in INPUTS and term != ANY]
        consequents = [f"{name} is {term}" for name, term in cells if name in OUTPUTS]
        return f"IF {' AND '.join(antecedents) or 'always'} THEN {' AND '.join(consequents)}"


@dataclass(frozen=True, slots=True)
class Weighing:
    """How two behaviours share the wheels (paper section 3): ``behaviour`` yields to ``yields_to``.

    ``behaviour`` weighs w, the least of 1 - membership over ``when``; ``yields_to`` weighs 1 - w.
    """

    behaviour: str
    yields_to: str
    when: tuple[tuple[str, str], ...]  # input, term


@dataclass(frozen=True, slots=True)
class Slowing:
    """How both speeds fall with the nearest of the three distances: `kernel.slowing_factor` of these numbers."""

    near: float  # m, where and below which the speeds are multiplied by ``least``
    far: float  # m, where and above which they stay as the tables say
    least: float  # more than 0, less than 1
