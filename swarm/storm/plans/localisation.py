"""The drawing of how well the robots of a plan know their poses."""

from random import Random
from typing import Any, Final

from swarm.scenario.starts import robot_names
from swarm.storm.plans.profiles import StormProfile

ERRORS: Final = ((0.01, 0.5), (0.02, 1.0), (0.03, 1.5), (0.05, 2.0))  # m and degrees, standard deviations of a pose


def draw_localisation(profile: StormProfile, robots: int, chance: Random) -> dict[str, Any]:
    """Draw how well robots know their poses; {} for exactly."""
    if chance.random() >= profile.pose:
        return {}
    error, yaw = chance.choice(ERRORS)
    drawn: dict[str, Any] = {"error": error, "yaw_error_deg": yaw, "lasts": chance.choice((0.0, 2.0, 5.0))}
    if chance.random() < profile.jumps:
        drawn["jumps"] = {"distance": chance.choice((0.2, 0.3, 0.5)), "robots": [chance.choice(robot_names(robots))]}
    return {"localisation": drawn}
