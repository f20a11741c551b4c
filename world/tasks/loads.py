"""Loads: whether a robot may become wider where it stands: not where its body would touch or surprise others."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from swarm.errors import PeerError
from swarm.geometry import Pose, distance
from swarm.maps.occupancy import OccupancyMap
from swarm.robot.tuning import SAFETY
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.lattice.placement import traffic_settings
from world.bodies.edits import can_stop_before
from world.bodies.roster import Roster

CLAIMED: Final = 4  # cells beyond those that a robot holds, one more than it claims ahead


class LoadChange(NamedTuple):
    """What a request for a load comes to."""

    text: str  # for people, without the robot's name
    changed: bool = False
    radius: float | None = None  # m; None: it has no load


def change_load(
    number: int, asked: float | None, roster: Roster, floor: OccupancyMap, poses: Sequence[Pose],
    wheels: Sequence[tuple[float, float]], held: Sequence[Sequence[int]],
) -> LoadChange:  # fmt: skip
    """Return what a robot's load becomes that is to be as wide as ``asked`` [m]; None: its load is taken away.

    ``held`` are the cells of each robot.

    Raises:
        PeerError: the load is refused.
    """
    own, now = roster.settings_of(roster.kinds[number]).robot.radius, roster.radius(number)
    radius = own if asked is None else asked
    if radius < own:
        name = roster.names[number]
        raise PeerError(f"{name}: load: expected a radius of {own:g} m or more, its own, got {radius:g} m")
    if radius == now:
        return LoadChange(f"has a radius of {radius:g} m already")
    if radius > now:
        check_load(number, radius, roster, floor, poses, wheels, held)
    loaded = "without a load" if radius == own else "with its load"
    return LoadChange(f"has a radius of {radius:g} m now, {loaded}", True, None if radius == own else radius)


def check_load(
    number: int, radius: float, roster: Roster, floor: OccupancyMap, poses: Sequence[Pose],
    wheels: Sequence[tuple[float, float]], held: Sequence[Sequence[int]],
) -> None:  # fmt: skip
    """Check that a robot may become as wide as ``radius`` [m] where it stands; ``held`` are the cells of each robot.

    The cells that it needs then must be its own, or so far from others that none of them can be claiming them.

    Raises:
        PeerError: it may not; the text says why, and what to do.
    """
    name, settings, here = roster.names[number], roster.settings(number), poses[number]
    cells, where = roster.cells(floor, number), f"{roster.names[number]}: load"
    if radius > (most := cells.side / 2 - traffic_settings(settings).margin):
        raise PeerError(
            f"{where}: expected a radius of at most {most:.2f} m, so that {name} fits in a square of {cells.side:g} m, "
            f"got {radius:g} m; take a smaller load, or start the fleet with a kind that is so wide"
        )
    if any(wheels[number]):
        raise PeerError(f"{where}: expected a robot that stands, {name} drives; tell it to stop first")
    touched = cells.cells_under_disc(here.x, here.y, radius + SAFETY.gap)
    if OUTSIDE in touched or not cells.can_fit_disc(touched, here.x, here.y, radius + SAFETY.gap):
        raise PeerError(
            f"{where}: expected {radius + SAFETY.gap:.2f} m from its middle to any wall, {name} stands nearer; send it "
            "to where there is room"
        )
    lacks = set(touched).difference(held[number])
    near = {cell for one in lacks for cell in cells.cells_around(one, CLAIMED)}
    for other, pose in enumerate(poses):
        if other == number:
            continue
        gap = distance(here, pose) - radius - roster.radius(other)
        if gap <= SAFETY.gap or not can_stop_before(gap, wheels[other], roster.bodies[other], 1.0 / settings.rate):
            raise PeerError(f"{where}: expected nobody near, {roster.names[other]} is {max(0.0, gap):.2f} m away; wait")
        if not near.isdisjoint(held[other]):
            raise PeerError(
                f"{where}: expected nobody who could reserve the floor that {name} needs beside it then, "
                f"{roster.names[other]} could; wait, or send {name} to the middle of a square"
            )
