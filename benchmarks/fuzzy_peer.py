"""One peer library, run by `benchmarks.fuzzy` in its own environment: it imports nothing of this project.

It reads a profile as JSON, then inputs, one list of [left, front, right, head_ang] per line. It answers each line with
the wheel speeds [[left_v, right_v], ...]. Each behaviour is a separate rule base; both are weighed as in the profile.
"""

import json
import sys
import warnings
from collections.abc import Callable

INPUTS = ("left_obs", "front_obs", "right_obs", "head_ang")
OUTPUTS = ("left_v", "right_v")
Speeds = tuple[float, float]
Base = Callable[[dict[str, float]], Speeds]


def rules_of(table: str) -> list[dict[str, str]]:
    """Return the rules of a behaviour's table, each as a dict from column to term."""
    header, *rows = [line.split() for line in table.splitlines()]
    return [dict(zip(header, row, strict=True)) for row in rows]


def corners_of(variable: dict, term: str) -> list[float]:
    """Return a term's trapezoid, with its shoulders cut off at the universe."""
    low, high = variable["universe"]
    return [min(max(float(corner), low), high) for corner in variable["terms"][term]]


def scikit_fuzzy(document: dict, rules: list[dict[str, str]]) -> Base:
    import numpy as np
    from skfuzzy import control, trapmf

    variables = {}
    for name, variable in (document["inputs"] | document["outputs"]).items():
        universe = np.linspace(*variable["universe"], 201)
        kind = control.Antecedent if name in INPUTS else control.Consequent
        variables[name] = kind(universe, name)
        for term in variable["terms"]:
            variables[name][term] = trapmf(universe, corners_of(variable, term))
    made = []
    for rule in rules:
        antecedents = [variables[name][rule[name]] for name in INPUTS if rule[name] != "any"]
        joined = antecedents[0]
        for antecedent in antecedents[1:]:
            joined &= antecedent
        made.append(control.Rule(joined, tuple(variables[name][rule[name]] for name in OUTPUTS)))
    simulation = control.ControlSystemSimulation(control.ControlSystem(made))
    used = {name for rule in rules for name in INPUTS if rule[name] != "any"}

    def infer(inputs: dict[str, float]) -> Speeds:
        simulation.inputs({name: x for name, x in inputs.items() if name in used})
        simulation.compute()
        return float(simulation.output["left_v"]), float(simulation.output["right_v"])

    return infer


def simpful(document: dict, rules: list[dict[str, str]]) -> Base:
    from simpful import FuzzySystem, LinguisticVariable, TrapezoidFuzzySet

    system = FuzzySystem(show_banner=False)
    for name, variable in (document["inputs"] | document["outputs"]).items():
        sets = [TrapezoidFuzzySet(*corners_of(variable, term), term=term) for term in variable["terms"]]
        linguistic = LinguisticVariable(sets, universe_of_discourse=variable["universe"])
        system.add_linguistic_variable(name, linguistic)
    texts = []
    for rule in rules:
        clauses = [f"({name} IS {rule[name]})" for name in INPUTS if rule[name] != "any"]
        joined = clauses[0]
        for clause in clauses[1:]:
            joined = f"({joined} AND {clause})"
        texts += [f"IF {joined} THEN ({name} IS {rule[name]})" for name in OUTPUTS]
    system.add_rules(texts)

    def infer(inputs: dict[str, float]) -> Speeds:
        for name, x in inputs.items():
            system.set_variable(name, x)
        out = system.Mamdani_inference(list(OUTPUTS), subdivisions=201, ignore_warnings=True)
        return float(out["left_v"]), float(out["right_v"])

    return infer


def pyfuzzylite(document: dict, rules: list[dict[str, str]]) -> Base:
    import fuzzylite as fl

    engine = fl.Engine("paper")
    for name, variable in (document["inputs"] | document["outputs"]).items():
        terms = [fl.Trapezoid(term, *corners_of(variable, term)) for term in variable["terms"]]
        low, high = variable["universe"]
        if name in INPUTS:
            engine.input_variables.append(fl.InputVariable(name, minimum=low, maximum=high, terms=terms))
        else:
            engine.output_variables.append(
                fl.OutputVariable(
                    name, minimum=low, maximum=high, terms=terms, aggregation=fl.Maximum(), defuzzifier=fl.Centroid(201)
                )
            )
    block = fl.RuleBlock(
        "rules", conjunction=fl.Minimum(), disjunction=fl.Maximum(), implication=fl.Minimum(), activation=fl.General()
    )
    for rule in rules:
        antecedents = " and ".join(f"{name} is {rule[name]}" for name in INPUTS if rule[name] != "any")
        consequents = " and ".join(f"{name} is {rule[name]}" for name in OUTPUTS)
        block.rules.append(fl.Rule.create(f"if {antecedents} then {consequents}", engine))
    engine.rule_blocks.append(block)

    def infer(inputs: dict[str, float]) -> Speeds:
        for name, x in inputs.items():
            engine.input_variable(name).value = x
        engine.process()
        left_v, right_v = (float(engine.output_variable(name).value) for name in OUTPUTS)
        return left_v, right_v

    return infer


PEERS = {"scikit-fuzzy": scikit_fuzzy, "simpful": simpful, "pyfuzzylite": pyfuzzylite}


def main() -> None:
    warnings.simplefilter("ignore")
    document = json.loads(sys.stdin.readline())
    weighing = document["weighing"]
    bases = [
        PEERS[sys.argv[1]](document, rules_of(document["behaviours"][weighing[key]]))
        for key in ("behaviour", "yields_to")
    ]

    def wheel_speeds(*values: float) -> Speeds:
        inputs = dict(zip(INPUTS, values, strict=True))
        w = 1.0
        for name, term in weighing["when"].items():
            _, _, c, d = corners_of(document["inputs"][name], term)
            w = min(w, 1 - min(max((d - inputs[name]) / (d - c), 0), 1))
        left_v = right_v = 0.0
        for base, weight in zip(bases, (w, 1 - w), strict=True):
            if weight > 0:
                left, right = base(inputs)
                left_v, right_v = left_v + weight * left, right_v + weight * right
        return left_v, right_v

    for line in sys.stdin:
        print(json.dumps([wheel_speeds(*row) for row in json.loads(line)]), flush=True)


if __name__ == "__main__":
    main()
