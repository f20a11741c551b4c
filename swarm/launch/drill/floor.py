"""The mission under drill: two rooms and a door; two of four robots pass the door, in opposite directions."""

from functools import cache
from typing import Final

import yaml

from swarm.fuzzy import load_profile
from swarm.maps.text import from_text
from swarm.scenario.check import check
from swarm.scenario.load import Scenario, check_values
from world.simulate import Simulation

ROBOTS: Final = 4
DOOR: Final = (6.5, 3.5)  # m
AT_DOOR: Final = 0.8  # m from the door's middle, in which a robot holds the door
SCENARIO: Final = """\
name: drill
map:
  cell: 1.0
  text: |
    #############
    #.....#.....#
    #.....#.....#
    #...........#
    #.....#.....#
    #.....#.....#
    #############
start:
  poses: [[1.8, 1.8, 0.0], [1.8, 5.2, 0.0], [11.2, 1.8, 3.1], [11.2, 5.2, 3.1]]
own_targets: [[[3.4, 3.5], [8.9, 2.0]], [[4.2, 5.0], [2.0, 3.6]], [[9.0, 3.6], [4.2, 2.0]], [[8.6, 5.0], [11.0, 3.6]]]
return_home: false
robots: 4
limit: 300
"""
LOSSY: Final = SCENARIO + "radio: {loss: 0.3}\n"
POSE: Final = "error: 0.02, yaw_error_deg: 1.0"
JUMPING: Final = SCENARIO + f"localisation: {{{POSE}, jumps: {{every: 8.0, distance: 0.3, robots: [r1]}}}}\n"
MISPLACED: Final = SCENARIO + "localisation: {error: 0.2, yaw_error_deg: 3.0}\n"  # worse than a cell allows


@cache
def undisturbed_digest() -> str:
    """Return the digest of the mission without a fault; in lockstep over processes it is the same."""
    settings = check_values(yaml.safe_load(SCENARIO), "drill")
    scenario = Scenario(settings, from_text(str(settings.map.text), settings.map.cell), load_profile("paper"))
    digest: str = Simulation.of(check(scenario, ROBOTS, settings.seed).scenario, ROBOTS, settings.seed).run()["digest"]
    return digest
