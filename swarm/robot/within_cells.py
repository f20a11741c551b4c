"""Whether a place can be driven to by who keeps to cells: a way of the map may lie where no cell does."""

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.scenario.schema import Settings
from swarm.traffic.cells import FAR, OUTSIDE, CellMap
from swarm.traffic.cells_of import traffic_settings


def comes_near(cells: CellMap, here: Point, there: Point, settings: Settings) -> bool:
    """Tell whether a robot at ``here`` [m] comes within ``reach`` of a place [m] by a way over cells.

    True also where no cell that can be stood in is under it: then nothing can be said.
    """
    under = [cell for cell in cells.touched(*here, settings.robot.radius) if cell != OUTSIDE and cells.stands[cell]]
    goal = cells.cell_of(*there)
    if not under or (goal != OUTSIDE and any(cells.distances(goal)[cell] < FAR for cell in under)):
        return True
    reachable = {cell for start in under for cell, steps in enumerate(cells.distances(start)) if steps < FAR}
    nearest = min(reachable, key=lambda cell: (distance(cells.centre(cell), there), cell))
    stand = cells.moved_inside(nearest, there, traffic_settings(settings).standing_room)
    return distance(stand, there) <= settings.reach
