"""Thirty fixed runs have the digests that they had: a change of the code that means to change nothing changes nothing.

``python -m tests.test_digests`` prints the digests of today. A change that means to change how robots drive replaces
``tests/digests.json`` by that, in the same commit.
"""

import json
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest

from swarm.fuzzy import load_profile
from swarm.scenario.load import Scenario, load
from swarm.scenario.prepare import settle_lattice
from swarm.storm.history.history import record
from swarm.storm.plans.draw import draw
from swarm.storm.plans.plan import read
from tests.shared import ROOT, mostly_long, with_settings
from world.faults import Faults, Health, Spell
from world.simulate import Simulation

EXPECTED: Final = Path(__file__).parent / "digests.json"


class Fixed(NamedTuple):
    """A run of a scenario; ``changes`` are sections of its settings."""

    scenario: str
    robots: int
    limit: float  # s, simulated
    changes: dict[str, Any] = {}  # noqa: RUF012
    faults: Faults = Faults()


AWAY = (
    Spell("r2", Health.AWAY, 400, 60),
    Spell("r1", Health.SUSPENDED, 300, 100),
    Spell("r4", Health.HELD_UP, 200, 80),
)
WALL = {"at": 8.0, "kind": "wall", "low": [6.0, 4.0], "high": [6.0, 7.0]}
ORDER = {"at": 10.0, "robot": "r2", "targets": [[2.6, 2.6], [9.0, 4.0]], "home": True}
TASKS = [[2.6, 2.6], [9.0, 4.0], [12.0, 8.0], [4.0, 9.0]]

# fmt: off
RUNS: Final[dict[str, Fixed]] = {
    "paper 1":            Fixed("paper", 1, 60.0),
    "paper 4":            Fixed("paper", 4, 45.0),
    "paper 8":            Fixed("paper", 8, 30.0),
    "paper 12":           Fixed("paper", 12, 30.0),
    "paper, loss":        Fixed("paper", 4, 30.0, {"radio": {"loss": 0.3}}),
    "paper, sight":       Fixed("paper", 4, 30.0, {"radio": {"line_of_sight": True, "range": 6.5}}),
    "paper, noise":       Fixed("paper", 4, 40.0, {"sensors": {"noise": 0.03, "bearing_noise_deg": 2.0}}),
    "paper, late":        Fixed("paper", 4, 40.0, faults=Faults(late=0.1)),
    "paper, slow":        Fixed("paper", 4, 40.0, faults=Faults(slow=0.2)),
    "paper, killed":      Fixed("paper", 4, 60.0, faults=Faults(killed={"r3": 20.0}, spells=AWAY)),
    "paper, leader dead": Fixed("paper", 8, 30.0, faults=Faults(kill_leader_at=6.0)),
    "paper, edit":        Fixed("paper", 4, 40.0, {"edits": [WALL]}),
    "paper, orders":      Fixed("paper", 4, 40.0, {"orders": [ORDER]}),
    "paper, patrol":      Fixed("paper", 4, 30.0, {"patrol": True}),
    "paper, careful":     Fixed("paper", 4, 40.0, {"controller": "careful"}),
    "paper, pool":        Fixed("paper", 4, 40.0, {"pool": TASKS}),
    "crossing":           Fixed("crossing", 8, 40.0),
    "doorway":            Fixed("doorway", 8, 40.0),
    "corridor":           Fixed("corridor", 2, 60.0),
    "l corner":           Fixed("l_corner", 2, 60.0),
    "circle":             Fixed("circle", 8, 40.0),
    "office":             Fixed("office", 6, 30.0),
    "depot":              Fixed("depot", 4, 40.0),
    "movers":             Fixed("movers", 4, 40.0),
    "unknown":            Fixed("unknown", 4, 40.0),
    "wall following":     Fixed("wall_following", 2, 40.0),
}
# fmt: on
KEPT: Final = ("past-a-dead-leader", "edits-and-a-mover", "pool-1274000", "deaf-to-each-other")  # of tests/storm
DRAWN: Final = {"storm, silent 3": ("silent", 3), "storm, all 5": ("all", 5)}  # profile, seed
ALL: Final = (*RUNS, *KEPT, *DRAWN)
QUICK: Final = ("paper, killed", "corridor", "unknown")


def _of_run(run: Fixed) -> str:
    raw = load(ROOT / "scenarios" / f"{run.scenario}.yaml")
    scenario = with_settings(raw, **run.changes) if run.changes else settle_lattice(raw)
    if "controller" in run.changes:
        scenario = Scenario(scenario.settings, scenario.map, load_profile(scenario.settings.controller))
    return str(Simulation.of(scenario, run.robots, 1, run.faults).run(run.limit)["digest"])


def digest(name: str) -> str:
    """Return the digest of a run by its name."""
    if name in RUNS:
        return _of_run(RUNS[name])
    plan = draw(*DRAWN[name]) if name in DRAWN else read(ROOT / "tests" / "storm" / f"{name}.yaml")
    history = record(plan)
    assert not history.crash, history.crash
    return str(history.report["digest"])


@pytest.mark.parametrize("name", mostly_long("a run of seconds", ALL, *QUICK))
def test_a_fixed_run_has_the_digest_that_it_had(name: str) -> None:
    assert digest(name) == json.loads(EXPECTED.read_text(encoding="utf-8"))[name]


if __name__ == "__main__":
    print(json.dumps({name: digest(name) for name in ALL}, indent=1))
