"""Floors of rooms that halls join, drawn where no lattice of cells is thought of; and places on them."""

from collections.abc import Sequence
from itertools import pairwise
from random import Random
from typing import Final

import numpy as np

from swarm.geometry import distance, from_frame
from swarm.maps.occupancy import FREE, OccupancyMap, Point
from swarm.storm.free_space import SPARE, Grid, gaps, room

FINE: Final = 0.1  # m, side of a square of the drawing
ROOM: Final = (14, 40)  # squares along a side of a room
HALL: Final = (7, 24)  # squares across a hall
APART: Final = (10, 50)  # squares from one room to the next
SHIFT: Final = 12  # squares by which a room may lie higher than another
SECOND: Final = 0.4  # chance of a second hall between two rooms
CLEAR: Final = 0.05  # m, between a body at a place and the walls
BETWEEN: Final = 0.5  # m, between two bodies at their starts, or at their last stops
NEXT: Final = 0.1  # m, from a place to the nearest one that is tried
TRIES: Final = 2_000  # places drawn, after which a floor counts as too small


def draw_rooms(chance: Random) -> str | None:
    """Draw two or three rooms in a row; return the floor as text, or None if a hall finds no room between them."""
    rooms = [
        (chance.randint(*ROOM), chance.randint(*ROOM), chance.randint(0, SHIFT))
        for _ in range(chance.choice((2, 2, 3)))
    ]
    spaces = [chance.randint(*APART) for _ in rooms[1:]]
    solid = np.ones((ROOM[1] + SHIFT + 2, sum(width for width, *_ in rooms) + sum(spaces) + 2), np.bool_)
    left, lefts = 1, []
    for (width, height, low), space in zip(rooms, [*spaces, 0], strict=True):
        solid[1 + low : 1 + low + height, left : left + width] = False
        lefts.append(left)
        left += width + space
    for ((width, height, low), start), ((_, other_height, other_low), end) in pairwise(zip(rooms, lefts, strict=True)):
        bottom, top = max(low, other_low), min(low + height, other_low + other_height)
        for _ in range(1 + (chance.random() < SECOND)):
            across = chance.randint(*HALL)
            if top - bottom < across:
                return None
            at = 1 + chance.randint(bottom, top - across)
            solid[at : at + across, start + width : end] = False
    return "\n".join("".join("#" if square else "." for square in row) for row in solid[::-1]) + "\n"


def draw_places(
    floor: OccupancyMap, radius: float, count: int, chance: Random, between: float = BETWEEN
) -> list[Point] | None:
    """Draw places [m, map frame] where bodies of ``radius`` [m] are clear of walls and ``between`` [m] apart.

    The result is None if there is no room for so many.
    """
    solid: Grid = np.pad(floor.cells != FREE, 1, constant_values=True)
    side, (rows, columns) = floor.resolution, floor.shape
    drawn = np.array([(chance.uniform(0, columns * side), chance.uniform(0, rows * side)) for _ in range(TRIES)])
    clear = gaps(solid, side, drawn + side) >= radius + CLEAR
    found: list[Point] = []
    for x, y in drawn[clear].tolist():
        at = from_frame(floor.origin, x, y)
        place = round(at[0], 3), round(at[1], 3)
        if all(distance(place, other) >= 2 * radius + between for other in found):
            found.append(place)
            if len(found) == count:
                return found
    return None


def is_in_one_piece(floor: OccupancyMap, radius: float, places: Sequence[Point]) -> bool:
    """Return True if a body of ``radius`` [m], with a little room beside it, can be moved between all places [m]."""
    reached = np.array(room(floor, radius + SPARE, places[0])).reshape(-1, 2)
    return all((np.hypot(*(reached - place).T) < NEXT).any() for place in places)
