"""The robots of one run: the name of each, its kind, and the settings that follow from it."""

import dataclasses
from typing import Final

from msgspec.structs import replace

from swarm.fuzzy import Controller
from swarm.kinds import kind_of
from swarm.maps.occupancy import OccupancyMap
from swarm.scenario.load import Scenario
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of

GRACE: Final = 20  # ticks after a change of its load in which a robot need not hold the floor that it covers by that


class Roster:
    """All robots by their numbers; those that come later are added. ``names`` are shared with who made the roster."""

    def __init__(self, scenario: Scenario, names: list[str]) -> None:
        self._scenario, self.names = scenario, names
        self.kinds = [kind_of(scenario.settings, number) for number in range(len(names))]
        self._of_kind = {kind: scenario.of_kind(kind) for kind in dict.fromkeys(self.kinds)}
        self._controllers: dict[str, Controller] = {}  # by kind
        self.loads: dict[int, float] = {}  # m, the radius of each robot that carries a load
        self._loaded: dict[tuple[str, float], Settings] = {}
        self._loaded_at: dict[int, int] = {}  # tick at which each load has changed last
        self.bodies = [self.settings(number).robot for number in range(len(names))]  # of each robot, with its load

    def __len__(self) -> int:
        return len(self.kinds)

    def add(self, name: str, kind: str) -> None:
        """Add one more robot.

        Raises:
            ConfigError: there is no such kind.
        """
        if kind not in self._of_kind:
            self._of_kind[kind] = self._scenario.of_kind(kind)
        self.names.append(name)
        self.kinds.append(kind)
        self.bodies.append(self._of_kind[kind].settings.robot)

    def scenario(self, number: int) -> Scenario:
        """Return the scenario as it is for a robot: ``robot``, ``sensors``, ``controller`` and profile are its own."""
        return self._of_kind[self.kinds[number]]

    def scenario_on(self, floor: OccupancyMap, number: int) -> Scenario:
        """Return the scenario as it is for a robot without a load, with another floor than it began with."""
        return dataclasses.replace(self.scenario(number), map=floor)

    def controller(self, number: int) -> Controller:
        """Return the fuzzy controller of a robot's kind."""
        kind = self.kinds[number]
        if (known := self._controllers.get(kind)) is None:
            known = self._controllers[kind] = Controller(self.scenario(number).profile)
        return known

    def controllers(self) -> dict[str, Controller]:
        """Return the fuzzy controllers of all kinds here."""
        return {kind: self.controller(number) for number, kind in enumerate(self.kinds)}

    def settings(self, number: int) -> Settings:
        """Return the settings as they are for a robot, as wide as it is with its load."""
        own, load = self.scenario(number).settings, self.loads.get(number)
        if load is None:
            return own
        key = self.kinds[number], load
        if key not in self._loaded:
            self._loaded[key] = replace(own, robot=replace(own.robot, radius=load))
        return self._loaded[key]

    def radii_to_hold(self, tick: int) -> list[float]:
        """Return the radius [m] for which each robot must hold the floor: it learns of its load by its next sense."""
        found = self.radii()
        for number, changed in self._loaded_at.items():
            if tick - changed < GRACE:
                found[number] = self.scenario(number).settings.robot.radius
        return found

    def take_loads(self, loads: dict[int, float], tick: int) -> None:
        """Let robots carry these loads, radii [m] by their numbers, and no others, from a tick on."""
        changed = {robot for robot in {*loads, *self.loads} if loads.get(robot) != self.loads.get(robot)}
        self._loaded_at |= dict.fromkeys(changed, tick)
        self.loads = loads
        self.bodies = [self.settings(number).robot for number in range(len(self.names))]

    def settings_of(self, kind: str) -> Settings:
        """Return the settings as they are for robots of a kind.

        Raises:
            ConfigError: there is no such kind.
        """
        return self._scenario.of_kind(kind).settings

    def radius(self, number: int) -> float:
        """Return the radius [m] of a robot."""
        return self.bodies[number].radius

    def radii(self) -> list[float]:
        """Return the radius [m] of each robot."""
        return [body.radius for body in self.bodies]

    def cells(self, floor: OccupancyMap, number: int) -> CellMap:
        """Return the cells of a floor as they are joined for a robot."""
        return cells_of(floor, self.settings(number))

    def groups(self) -> list[tuple[Settings, list[int]]]:
        """Return the robots of each kind together, with the settings of the kind, without loads."""
        found: dict[str, list[int]] = {}
        for number, kind in enumerate(self.kinds):
            found.setdefault(kind, []).append(number)
        return [(self._of_kind[kind].settings, robots) for kind, robots in found.items()]
