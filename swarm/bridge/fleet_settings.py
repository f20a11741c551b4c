"""The settings of a fleet, and of each robot in it by its kind. Pure."""

from collections.abc import Mapping

from msgspec import UNSET, UnsetType

from swarm.kinds import PLAIN, settings_of
from swarm.messages.floor import ScenarioOnWire
from swarm.settings import Settings


class FleetSettings:
    """What a map tells of the robots: ``shared`` is what is the same for all of them, as cells, rate and reach are."""

    def __init__(self, shared: Settings, kinds: Mapping[str, str] | UnsetType = UNSET) -> None:
        self.shared = shared
        self._kinds: Mapping[str, str] = {} if kinds is UNSET else kinds
        self._known: dict[str, Settings] = {}  # by kind

    @classmethod
    def from_wire(cls, scenario: ScenarioOnWire) -> "FleetSettings":
        """Return the settings that a map has."""
        return cls(scenario.settings, scenario.kinds)

    def kind(self, robot: str) -> str:
        """Return the kind of a robot; that of one whose kind is not told, or is none of the scenario's, is empty."""
        kind = self._kinds.get(robot, PLAIN)
        return kind if kind in self.shared.kinds else PLAIN

    def of_robot(self, robot: str) -> Settings:
        """Return the settings as they are for a robot: one object for all of a kind; without a kind those shared."""
        kind = self.kind(robot)
        if (known := self._known.get(kind)) is None:
            known = self._known[kind] = settings_of(self.shared, kind)
        return known
