"""Small maps drawn in the tests, and public ones where they are at hand."""

from collections.abc import Sequence

import numpy as np

from swarm.fuzzy import load_profile
from swarm.geometry import Pose, bearing
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.scenario.benchmark import ROBOT, SENSORS
from swarm.scenario.load import Scenario
from swarm.settings import MapSettings, RadioSettings, Settings, StartSettings, TrafficSettings
from swarm.traffic.lattice.cell_map import CellMap
from tests.shared import DATA
from world.faults import Faults
from world.simulate import Simulation

SIDE = 1.2  # m

Place = tuple[int, int]  # (row from the top, column) of a drawn map


class Drawn:
    """A map of one character a cell: # is wall, a letter or digit names a free cell."""

    def __init__(self, *rows: str, side: float = SIDE) -> None:
        self.side = side
        solid = np.array([[character == "#" for character in row] for row in rows], dtype=np.uint8)
        self.occupancy = OccupancyMap(solid[::-1].copy(), side, Pose(0.0, 0.0, 0.0))
        self.cells = CellMap(self.occupancy, side=side, radius=0.23)
        self.names = {
            character: (row, column)
            for row, line in enumerate(rows)
            for column, character in enumerate(line)
            if character not in "#."
        }

    def cell(self, place: Place) -> int:
        """Return the number of a cell counted from the top."""
        return (self.cells.rows - 1 - place[0]) * self.cells.columns + place[1]

    def at(self, names: str) -> tuple[int, ...]:
        """Return the cells of several names."""
        return tuple(self.cell(self.names[name]) for name in names)

    def pose(self, cell: int, yaw: float = 0.0) -> Pose:
        """Return the pose in the middle of a cell."""
        return Pose(*self.cells.centre(cell), yaw)

    def points(self, names: str) -> list[Point]:
        """Return the centres of several names [m]."""
        return [self.cells.centre(cell) for cell in self.at(names)]

    def scenario(
        self, starts: Sequence[Point], stops: Sequence[Sequence[Point]], *, reach: float = 8.0, loss: float = 0.0
    ) -> Scenario:
        """Make a mission on it; robots face their first stops. ``reach`` [m] and ``loss`` are the radio's."""
        settings = Settings(
            name="drawn",
            map=MapSettings(cell=self.side),
            start=StartSettings(
                poses=[(x, y, bearing(Pose(x, y, 0.0), row[0])) for (x, y), row in zip(starts, stops, strict=True)]
            ),
            own_targets=[list(row) for row in stops],
            return_home=False,
            reach=0.3,
            robot=ROBOT,
            sensors=SENSORS,
            radio=RadioSettings(range=reach, loss=loss),
            traffic=TrafficSettings(cell=self.side, offset=(0.0, 0.0)),
        )
        return Scenario(settings, self.occupancy, load_profile("paper"))

    def fleet(
        self,
        starts: str,
        goals: str,
        *,
        reach: float = 8.0,
        loss: float = 0.0,
        faults: Faults | None = None,
        seed: int = 1,
    ) -> Simulation:
        """Set robots up at the places of some names, to go to those of others."""
        points = self.points(starts)
        scenario = self.scenario(points, [[point] for point in self.points(goals)], reach=reach, loss=loss)
        return Simulation.of(scenario, len(points), seed, faults)


def public(name: str, agents: int | None = None) -> tuple[Drawn, tuple[int, ...], tuple[int, ...]]:
    """Read a public multi-agent instance: the map, starts and goals."""
    path = DATA / "mapf" / f"{name}.map"
    lines = path.read_text().splitlines()
    rows = [line.strip() for line in lines[lines.index("map") + 1 :] if line.strip()]
    drawn = Drawn(*["".join("." if character == "." else "#" for character in row) for row in rows])
    scenario = path.with_suffix(".scen") if "/" in name else path.with_name(f"{name}-random-1.scen")
    fields = [line.split() for line in scenario.read_text().splitlines()]
    places = [tuple(map(int, row[4:8])) for row in fields if len(row) == 9][:agents]
    assert agents is None or len(places) == agents
    starts = tuple(drawn.cell((y, x)) for x, y, _, _ in places)
    goals = tuple(drawn.cell((y, x)) for _, _, x, y in places)
    return drawn, starts, goals


HARD = {"hard/tree": (3, 5), "hard/corners": (4, 28), "hard/tunnel": (4, 9), "hard/string": (5, 18)}  # robots, bound

BAY = Drawn("########", "a......b", "###c####")
CORRIDOR = Drawn("########", "a......b", "########")
DOOR = Drawn(
    "......#......",
    "a.....#.....b",
    "c.....#.....d",
    ".............",
    "e.....#.....f",
    "g.....#.....h",
    "......#......",
)
TREE = Drawn("##a##", "##.##", "b...c", "##d##")
RING = Drawn("abc", "h#d", "gfe")


def lane() -> OccupancyMap:
    """Return a floor of 3 x 3 cells of 1.2 m: a row, y 2.6 to 3.4 m, and a lane that leads down from it, x 0.8 to 1.6 m."""
    solid = np.zeros((36, 36), np.uint8)
    solid[:26, :8] = solid[:26, 16:] = solid[34:] = 1
    return OccupancyMap(solid, 0.1)
