"""Scenarios for tests: changes of a small valid one, and of the paper's rules; where the public data is."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

from swarm.fuzzy import Profile, load_profile
from swarm.maps.occupancy import Cell, OccupancyMap
from swarm.maps.text import from_text
from swarm.scenario.load import Scenario, check_values
from swarm.scenario.prepare import settle_lattice

ROOT = Path(__file__).parents[1]
PAPER = ROOT / "scenarios" / "paper.yaml"
DATA = ROOT.parent / "shared" / "data"  # public benchmark maps, beside the project

needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"the public benchmark data is not at {DATA}")

ROOM = """\
##########
#........#
#........#
#........#
#........#
##########
"""


def scenario_of(text: str = ROOM, profile: Profile | None = None, **fields: object) -> Scenario:
    """Return a scenario of a drawing with 1 m cells; ``fields`` are those of a scenario file."""
    raw: dict[str, Any] = {
        "name": "small",
        "map": {"text": text, "cell": 1.0},
        "start": {"poses": [[2.5, 2.5, 0.0], [2.5, 4.5, 0.0], [4.5, 2.5, 0.0], [4.5, 4.5, 0.0]]},
        "targets": [[7.5, 3.5]],
    }
    raw |= fields
    settings = check_values(raw, "test")
    floor = from_text(text, settings.map.cell)
    return settle_lattice(Scenario(settings, floor, profile or load_profile("paper")))


def with_block(floor: OccupancyMap, low: Cell, high: Cell, kind: int) -> OccupancyMap:
    """Return the map with all cells from ``low`` up to, but not including, ``high`` changed to ``kind``."""
    cells = floor.cells.copy()
    cells[max(low[0], 0) : max(high[0], 0), max(low[1], 0) : max(high[1], 0)] = kind
    return replace(floor, cells=cells)


def with_settings(scenario: Scenario, **sections: object) -> Scenario:
    """Return the scenario with some settings changed; a section's dict changes only the fields it names."""
    raw = msgspec.to_builtins(scenario.settings)
    for name, value in sections.items():
        raw[name] = raw[name] | value if isinstance(value, dict) else value
    return settle_lattice(Scenario(check_values(raw, "test"), scenario.map, scenario.profile))


def with_consequents(profile: Profile, choose: Callable[[str, tuple[str, ...]], tuple[str, ...]]) -> Profile:
    """Return the profile with other consequents: ``choose(behaviour, terms)`` returns a rule's new terms."""
    document = profile.to_builtins()
    tables = dict(document["behaviours"])  # type: ignore[call-overload]
    for name, behaviour in profile.behaviours.items():
        lines = [("rule", *behaviour.columns)]
        lines += [(str(rule.number), *choose(name, rule.terms)) for rule in behaviour.rules]
        tables[name] = "".join(" ".join(line) + "\n" for line in lines)
    return Profile.from_builtins(document | {"behaviours": tables})


def constant_rules(profile: Profile, left: str, right: str) -> Profile:
    """Return the profile with the same consequents in every rule: terms of the ``left`` and ``right`` wheel."""
    return with_consequents(profile, lambda behaviour, terms: (*terms[:-2], left, right))


def mostly_long(why: str, cases: Iterable[Any], *quick: object) -> list[Any]:
    """Return the cases of a test, of which `make test` runs only the ``quick`` ones."""

    def case(one: Any) -> Any:  # noqa: ANN401, a value or several, as parametrize takes them
        values = one if isinstance(one, tuple) else (one,)
        return pytest.param(*values, marks=[] if one in quick else [pytest.mark.long(why)])

    return [case(one) for one in cases]
