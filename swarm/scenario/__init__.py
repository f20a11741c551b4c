"""A scenario: what a person writes in ``scenarios/*.yaml``, checked, with everything it refers to loaded."""

from swarm.scenario.load import Scenario, load
from swarm.scenario.schema import Settings

__all__ = ["Scenario", "Settings", "load"]
