"""Kinds of robots in a plan: it is drawn as for robots that are all alike, and then some of them are made unlike."""

from collections.abc import Callable
from random import Random
from typing import Any, Final

import msgspec

from swarm.errors import ConfigError
from swarm.scenario.check import check
from swarm.scenario.load import check_values
from swarm.settings import PAPER_TOP_SPEED
from swarm.storm.plans.plan import StormPlan
from swarm.storm.plans.profiles import StormProfile

NAMES: Final = ("one", "two", "three")
RADII: Final = (0.1, 0.4)  # m; a plan's cells have 1.2 m, and a body has to fit in one
SPEEDS: Final = (0.3, 1.5)  # m/s, at most
BRAKES: Final = (0.5, 3.0)  # m/s2
RANGES: Final = (1.6, 1.6, 2.5)  # m, reach of a ray
TRIES: Final = 6  # mixes, after which the robots stay alike: walls may leave no room for wider ones


def with_kinds(plan: StormPlan, profile: StormProfile, can_be_driven: Callable[[StormPlan], bool]) -> StormPlan:
    """Return the plan with robots of two or three kinds, if the profile draws that and the plan can be driven so.

    It has a chance of its own: all else in the plan is drawn as without kinds.
    """
    chance = Random(f"kinds {plan.profile} {plan.seed}")
    if chance.random() >= profile.kinds:
        return plan
    for _ in range(TRIES):
        mixed = _draw_mix(plan, chance)
        try:
            check(mixed.to_scenario(), mixed.robots, mixed.scenario.seed)
            if can_be_driven(mixed):
                return mixed
        except ConfigError:
            continue
    return plan


def _draw_mix(plan: StormPlan, chance: Random) -> StormPlan:
    raw: dict[str, Any] = msgspec.to_builtins(plan.scenario)
    names = NAMES[: min(plan.robots, chance.randint(2, 3))]
    raw["kinds"] = {name: _draw_kind(chance) for name in names}
    cuts = sorted(chance.sample(range(1, plan.robots), len(names) - 1))
    ends = zip([0, *cuts], [*cuts, plan.robots], strict=True)
    raw["robots"] = {name: end - begin for name, (begin, end) in zip(names, ends, strict=True)}
    return msgspec.structs.replace(plan, scenario=check_values(raw, "storm"))


def _draw_kind(chance: Random) -> dict[str, Any]:
    radius = round(chance.uniform(*RADII), 2)
    return {
        "radius": radius,
        "track_width": round(chance.uniform(1.2, 2.0) * radius, 2),
        "wheel_acceleration": round(chance.uniform(*BRAKES), 2),
        "speed_scale": round(chance.uniform(*SPEEDS) / PAPER_TOP_SPEED, 3),
        "sensors": {"range": chance.choice(RANGES)},
    }
