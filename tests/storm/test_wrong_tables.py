"""No table makes a robot touch anything or leave its reserved cells: safety does not depend on the tables."""

from collections.abc import Callable
from math import nan
from random import Random

import msgspec
import pytest

import swarm.robot.driving.cell_pilot as pilot
from swarm.robot.driving.tables import fuzzy_speeds
from swarm.storm.history.history import record
from swarm.storm.laws.judge import LAWS
from swarm.storm.plans.draw import draw
from tests.shared import mostly_long

SAFE = (
    "no exception", "no contact", "no overlap", "no hold without a claim", "takes only what is free", "no body outside",
    "room to brake",
)  # fmt: skip
LIMIT = 25.0  # s
CHANCE = Random()
Speeds = tuple[float, float]

WRONG: dict[str, Callable[[Speeds], Speeds]] = {
    "slow": lambda _: (0.4, 0.4),
    "fast": lambda _: (1.2, 1.2),
    "backwards": lambda _: (-1.2, -1.2),
    "round": lambda _: (0.4, 1.2),
    "swapped": lambda speeds: speeds[::-1],
    "by chance": lambda _: (CHANCE.uniform(-2.0, 2.0), CHANCE.uniform(-2.0, 2.0)),
    "no number": lambda _: (nan, nan),
    "absurd": lambda _: (1e300, -1e300),
    "now and then no number": lambda speeds: (nan, speeds[1]) if CHANCE.random() < 0.1 else speeds,
}


STORMS = [("all", 3), ("crowd", 2)]


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize(("profile", "seed"), mostly_long("nine storms", STORMS, STORMS[0]))
def test_with_wrong_tables_all_laws_of_safety_hold(
    profile: str, seed: int, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    CHANCE.seed(seed)

    def speeds(*asked: object, straight: bool) -> Speeds:
        return WRONG[wrong](fuzzy_speeds(*asked, straight=straight))  # type: ignore[arg-type]

    monkeypatch.setattr(pilot, "fuzzy_speeds", speeds)
    drawn = draw(profile, seed)
    plan = msgspec.structs.replace(drawn, scenario=msgspec.structs.replace(drawn.scenario, limit=LIMIT))
    history = record(plan)
    assert len(history.moments) > LIMIT / 2
    assert [(law, *found) for law in SAFE for found in LAWS[law](history)] == []
