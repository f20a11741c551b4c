"""A profile: a whole controller as data. It has the same shape in a YAML file, on the wire and in `to_builtins`."""

from dataclasses import asdict, dataclass
from math import isinf
from typing import Self

from swarm.errors import ConfigError
from swarm.fuzzy import check
from swarm.fuzzy.completeness import check_no_gap
from swarm.fuzzy.vocabulary import INPUTS, OUTPUTS, Behaviour, Slowing, Variable, Weighing


@dataclass(frozen=True, slots=True)
class Profile:
    """Variables, behaviours, their weighing and slowing. `load_profile` and `from_builtins` check all of it."""

    name: str
    description: str
    inputs: dict[str, Variable]
    outputs: dict[str, Variable]
    behaviours: dict[str, Behaviour]
    weighing: Weighing | None  # None: there is one behaviour, of weight 1
    slowing: Slowing | None  # None: the tables' speeds are not changed

    @classmethod
    def from_builtins(cls, document: object, where: str = "profile") -> Self:
        """Return the profile of checked dicts, lists, texts and numbers, as a YAML file or `to_builtins` gives them.

        Raises:
            ConfigError: something is wrong; the text names the first place, which begins with ``where``.
        """
        fields = check.mapping(
            document, where, ("name", "inputs", "outputs", "behaviours", "weighing"), ("description", "slowing")
        )
        inputs = _variables(fields["inputs"], f"{where}: inputs", INPUTS)
        outputs = _variables(fields["outputs"], f"{where}: outputs", OUTPUTS)
        tables = check.mapping(fields["behaviours"], f"{where}: behaviours")
        behaviours = {
            name: check.behaviour(table, name, f"{where}: behaviours.{name}", inputs | outputs)
            for name, table in tables.items()
        }
        if len(behaviours) > 2:
            names = ", ".join(behaviours)
            raise ConfigError(f"{where}: behaviours: expected one or two, got {len(behaviours)}: {names}")
        weighing = check.check_weights(fields["weighing"], f"{where}: weighing", behaviours, inputs)
        profile = cls(
            name=check.check_text(fields["name"], f"{where}: name"),
            description=check.check_text(fields.get("description", "-"), f"{where}: description"),
            inputs=inputs,
            outputs=outputs,
            behaviours=behaviours,
            weighing=weighing,
            slowing=check.check_slowing(fields["slowing"], f"{where}: slowing", inputs)
            if "slowing" in fields
            else None,
        )
        for number, behaviour in enumerate(profile.by_weight()):
            check_no_gap(behaviour, inputs, weighing, number == 0, f"{where}: behaviours.{behaviour.name}")
        return profile

    def to_builtins(self) -> dict[str, object]:
        """Return the profile as dicts, lists, texts and finite numbers, for YAML, JSON or MessagePack."""
        weighing = self.weighing and {
            "behaviour": self.weighing.behaviour,
            "yields_to": self.weighing.yields_to,
            "when": dict(self.weighing.when),
        }
        slowing = {"slowing": asdict(self.slowing)} if self.slowing else {}
        return {
            "name": self.name,
            "description": self.description,
            "inputs": {name: _variable_to_builtins(variable) for name, variable in self.inputs.items()},
            "outputs": {name: _variable_to_builtins(variable) for name, variable in self.outputs.items()},
            "behaviours": {name: _table(behaviour) for name, behaviour in self.behaviours.items()},
            "weighing": weighing or "none",
            **slowing,
        }

    def by_weight(self) -> tuple[Behaviour, ...]:
        """Return the behaviour of weight w, then, if there is one, the behaviour of weight 1 - w."""
        if not self.weighing:
            return tuple(self.behaviours.values())
        return self.behaviours[self.weighing.behaviour], self.behaviours[self.weighing.yields_to]


def _variables(value: object, where: str, names: tuple[str, ...]) -> dict[str, Variable]:
    fields = check.mapping(value, where, names)
    return {name: check.variable(fields[name], name, f"{where}.{name}") for name in names}


def _variable_to_builtins(variable: Variable) -> dict[str, object]:
    return {
        "unit": variable.unit,
        "universe": [variable.low, variable.high],
        "terms": {
            term.name: [str(x) if isinf(x) else x for x in (term.a, term.b, term.c, term.d)] for term in variable.terms
        },
    }


def _table(behaviour: Behaviour) -> str:
    rows = [("rule", *behaviour.columns), *((str(rule.number), *rule.terms) for rule in behaviour.rules)]
    return "".join(" ".join(row) + "\n" for row in rows)
