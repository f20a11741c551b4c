"""Why the wheels turn as they do: memberships, weights, and the rules that fired, in words."""

from dataclasses import asdict, dataclass

from swarm.fuzzy.kernel import slowing_factor, within_half_turn
from swarm.fuzzy.profile import Profile
from swarm.fuzzy.vocabulary import ANY, INPUTS


@dataclass(frozen=True, slots=True)
class FiredRule:
    """A rule whose every antecedent held to some degree, in a behaviour that weighs something."""

    behaviour: str
    rule: int  # its number in the behaviour's table
    strength: float  # 0..1, the least membership of its antecedents
    text: str


@dataclass(frozen=True, slots=True)
class Explanation:
    """One inference, laid open."""

    profile: str
    inputs: dict[str, float]  # m and degrees (right positive), as the terms met them: clipped to the universe
    units: dict[str, str]
    memberships: dict[str, dict[str, float]]  # input, term: 0..1
    weights: dict[str, float]  # behaviour: share of the wheels, together 1
    rules: tuple[FiredRule, ...]  # strongest first within each behaviour
    slowing: float  # 0..1, what both speeds were multiplied by
    left_v: float  # m/s
    right_v: float  # m/s

    @property
    def weight(self) -> float:
        """Take w, the first behaviour's share: in the paper's profile goal seeking's."""
        return next(iter(self.weights.values()))

    def to_json_dict(self) -> dict[str, object]:
        """Return builtins: left_v, right_v, weight, weights, slowing, rules, memberships, inputs, profile."""
        return {
            "left_v": self.left_v,
            "right_v": self.right_v,
            "weight": self.weight,
            "weights": self.weights,
            "slowing": self.slowing,
            "rules": [asdict(rule) for rule in self.rules],
            "memberships": self.memberships,
            "inputs": self.inputs,
            "profile": self.profile,
        }

    def text(self) -> str:
        """Lay it out for a terminal."""
        lines = [f"profile {self.profile}", ""]
        for name, memberships in self.memberships.items():
            labels = "  ".join(f"{term} {value:.2f}" for term, value in memberships.items() if value > 0)
            lines.append(f"{name:<9} {self.inputs[name]:>8.2f} {self.units[name]:<8} {labels}")
        for behaviour, weight in self.weights.items():
            lines += ["", f"{behaviour} weighs {weight:.3f}"]
            fired = [rule for rule in self.rules if rule.behaviour == behaviour]
            lines += [f"  {rule.strength:.3f}  rule {rule.rule:>2}: {rule.text}" for rule in fired]
        if self.slowing < 1.0:
            lines += ["", f"slowed to {self.slowing:.3f} of the tables' speeds by the nearest distance"]
        lines += ["", f"left_v {self.left_v:.4f} m/s, right_v {self.right_v:.4f} m/s"]
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.text()


class Explainer:
    """A profile's rules with their words and antecedents looked up once, so that explaining is cheap."""

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        self._rules = []
        for behaviour in profile.by_weight():
            columns = [(name, behaviour.columns.index(name)) for name in INPUTS]
            rows = []
            for rule in behaviour.rules:
                antecedents = [(name, rule.terms[k]) for name, k in columns if rule.terms[k] != ANY]
                rows.append((rule.number, antecedents, behaviour.text(rule)))
            self._rules.append((behaviour.name, rows))

    def explain(self, values: tuple[float, ...], left_v: float, right_v: float, w: float) -> Explanation:
        """Lay one inference open: the four inputs as given, and what the kernel made of them."""
        *distances, heading = values
        variables, slow = self._profile.inputs, self._profile.slowing
        inputs = {
            name: min(max(float(x), variables[name].low), variables[name].high)
            for name, x in zip(INPUTS, (*distances, within_half_turn(heading)), strict=True)
        }
        memberships = {
            name: {term.name: term.membership(x) for term in variables[name].terms} for name, x in inputs.items()
        }
        weights, rules = {}, []
        for (behaviour, rows), weight in zip(self._rules, (w, 1.0 - w), strict=False):
            weights[behaviour] = weight
            fired = []
            for number, antecedents, text in rows if weight > 0 else ():
                strength = min((memberships[name][term] for name, term in antecedents), default=1.0)
                if strength > 0:
                    fired.append(FiredRule(behaviour, number, strength, text))
            rules += sorted(fired, key=lambda rule: -rule.strength)
        return Explanation(
            profile=self._profile.name,
            inputs=inputs,
            units={name: variables[name].unit for name in INPUTS},
            memberships=memberships,
            weights=weights,
            rules=tuple(rules),
            slowing=slowing_factor(min(distances), slow.near, slow.far, slow.least) if slow else 1.0,
            left_v=left_v,
            right_v=right_v,
        )
