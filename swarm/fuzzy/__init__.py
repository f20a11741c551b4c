"""The paper's fuzzy controller: Mamdani min-max inference with the exact centroid, its rules in data files."""

from swarm.fuzzy.controller import ControlInputError, Controller
from swarm.fuzzy.explanation import Explanation, FiredRule
from swarm.fuzzy.load import built_in_profiles, load_profile
from swarm.fuzzy.profile import Profile

__all__ = [
    "ControlInputError",
    "Controller",
    "Explanation",
    "FiredRule",
    "Profile",
    "built_in_profiles",
    "load_profile",
]
