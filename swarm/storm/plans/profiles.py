"""What a storm may draw, profile by profile: ranges and chances, as data."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

Span = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class StormProfile:
    """What one profile draws. Ranges are inclusive. A chance is the share of plans that have the feature."""

    columns: Span = (4, 9)  # cells of 1.2 m
    rows: Span = (3, 7)
    robots: Span = (2, 8)
    per_cell: float = 0.3  # robots for each free cell, at most
    walls: Span = (0.0, 0.25)  # share of the floor that drawn blocks would fill if none overlapped
    off_lattice: float = 0.4  # chance that walls lie anywhere on the raster, not on the lattice
    raster: int = 3  # characters of the drawn map along a cell
    rooms: bool = False  # rooms and halls, starts and targets lie anywhere, and cells are chosen as for any scenario
    stops: Span = (1, 2)  # for each robot
    shared: float = 0.3  # chance that all robots visit the same targets
    home: float = 0.5  # chance that the robots return home
    radio_range: tuple[float, ...] = (5.0, 6.5, 8.0, 12.0, 50.0)  # m
    loss: tuple[float, ...] = (0.0, 0.0, 0.1, 0.3, 0.5)
    sight: float = 0.0  # this and the fields down to mute: chances
    held_up: float = 0.0
    suspended: float = 0.0
    away: float = 0.0
    dead: float = 0.0
    leader_killed: float = 0.0
    late: float = 0.0
    slow: float = 0.0
    edits: float = 0.0
    movers: float = 0.0
    orders: float = 0.0
    pool: float = 0.0
    noise: float = 0.0
    kinds: float = 0.1  # chance that the robots are of two or three kinds
    pose: float = 0.0  # chance that robots know their poses only nearly
    jumps: float = 0.0  # chance that the pose of one robot jumps then
    mute: float = 0.0  # chance that one or two robots say nothing of traffic
    every: float = 25.0  # s between two hold-ups or suspensions of one robot, on average
    known: bool = True


ALL: Final = StormProfile(
    sight=0.15, held_up=0.3, suspended=0.15, away=0.1, dead=0.15, leader_killed=0.1, late=0.3, edits=0.12, movers=0.05,
    noise=0.2, pose=0.2, jumps=0.2,
)  # fmt: skip

PROFILES: Final[Mapping[str, StormProfile]] = {
    "all": ALL,
    "calm": StormProfile(),
    "kinds": replace(ALL, kinds=1.0, orders=0.2),
    "dead": StormProfile(dead=0.7, leader_killed=0.4, edits=0.15),
    "late": StormProfile(late=1.0, held_up=0.2),
    "slow": StormProfile(slow=1.0, held_up=0.2, dead=0.05),
    "sight": StormProfile(sight=1.0, held_up=0.2, dead=0.1),
    "suspend": StormProfile(suspended=1.0, held_up=0.3, away=0.3),
    "claims": StormProfile(
        columns=(2, 3), rows=(2, 3), robots=(2, 3), per_cell=0.6, walls=(0.0, 0.0), stops=(4, 8), shared=0.0, home=0.0,
        loss=(0.7,), suspended=0.6, held_up=0.2, every=12.0,
    ),
    "contest": StormProfile(
        columns=(2, 3), rows=(2, 2), robots=(3, 3), per_cell=0.75, walls=(0.0, 0.0), stops=(6, 10), shared=0.0,
        home=0.0, loss=(0.7,), suspended=0.2,
    ),
    "asleep": StormProfile(
        columns=(2, 3), rows=(2, 2), robots=(3, 4), per_cell=0.75, walls=(0.0, 0.0), off_lattice=0.0, stops=(2, 4),
        shared=0.0, home=0.0, loss=(0.0, 0.3), suspended=1.0, every=10.0,
    ),
    "meet": StormProfile(
        columns=(7, 10), rows=(2, 4), robots=(2, 4), walls=(0.0, 0.1), off_lattice=0.2, stops=(4, 6), shared=0.0,
        home=0.0, radio_range=(5.0,), loss=(0.3, 0.5), late=0.5,
    ),
    "strangers": StormProfile(
        columns=(7, 10), rows=(2, 3), robots=(3, 5), walls=(0.0, 0.1), stops=(3, 5), home=0.0, radio_range=(5.0,),
        loss=(0.0, 0.3, 0.5), dead=1.0, away=0.5,
    ),
    "unsolvable": StormProfile(
        columns=(2, 6), rows=(1, 2), robots=(2, 3), per_cell=0.6, walls=(0.0, 0.5), off_lattice=0.0, stops=(1, 1),
        shared=0.0, home=0.3, loss=(0.0, 0.3),
    ),
    "silent": StormProfile(mute=1.0, robots=(3, 8), per_cell=0.2),
    "pose": StormProfile(pose=1.0, jumps=0.3, held_up=0.2, suspended=0.1, dead=0.1, late=0.2, noise=0.2),
    "edits": StormProfile(edits=1.0, dead=0.3, held_up=0.2),
    "movers": StormProfile(movers=1.0, held_up=0.2),
    "halls": StormProfile(
        rooms=True, robots=(2, 4), shared=0.0, home=0.0, radio_range=(8.0, 12.0, 50.0), loss=(0.0, 0.0, 0.1),
        held_up=0.1,
    ),
    "orders": StormProfile(orders=1.0, held_up=0.2, away=0.3, dead=0.1, late=0.3, edits=0.2),
    "pool": StormProfile(pool=1.0, held_up=0.2, suspended=0.2, away=0.3, dead=0.3, late=0.3, edits=0.1, orders=0.3),
    "away": StormProfile(away=1.0, suspended=0.2, held_up=0.2, stops=(2, 4)),
    "unknown": StormProfile(
        known=False, off_lattice=0.6, raster=12, held_up=0.1, dead=0.1, late=0.1, noise=0.3, shared=0.5
    ),
    "shared": replace(ALL, shared=1.0),
    "crowd": StormProfile(per_cell=0.6, robots=(4, 12), columns=(3, 6), rows=(3, 5), walls=(0.0, 0.05), held_up=0.2),
    "patrol": StormProfile(stops=(8, 16), robots=(2, 6), home=1.0, held_up=0.2, late=0.1),
}  # fmt: skip
