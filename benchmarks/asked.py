"""The requests that `benchmarks.wire` times: one of each kind, on the depot."""

from collections.abc import Callable
from itertools import count, cycle
from random import Random
from typing import Final

from swarm.bus import Bus
from swarm.errors import PeerError
from swarm.maps.occupancy import Point
from swarm.messages import (
    ACTION,
    EDIT,
    ORDER,
    POOL,
    ROBOT_ACTION,
    STATE,
    STATUS,
    Action,
    Do,
    Edit,
    Kind,
    Order,
    PoolTargets,
    RobotAction,
    RobotDo,
)

AISLES: Final = (1.0, 3.0, 6.0, 9.0, 12.0)  # m, y of the lines between the shelves
OUTSIDE: Final = (-9.0, -9.0)  # m
BORDER: Final = [Edit(kind=kind, low=(0.05, 0.05), high=(0.1, 0.1)) for kind in (Kind.OBSTACLE, Kind.WALL)]


def refused(case: Callable[[], object]) -> Callable[[], None]:
    """Return a request that is to be refused.

    Raises:
        ValueError: it is not refused.
    """

    def ask() -> None:
        try:
            case()
        except PeerError as fault:
            if "got none" not in str(fault):
                return
            raise
        raise ValueError("expected a refusal")

    return ask


def requests(bus: Bus, robots: int, chance: Random) -> dict[str, Callable[[], object]]:
    """Return a request of each kind, accepted and refused."""
    numbers, places = count(), cycle(BORDER)
    stops = {f"r{1 + k}": cycle((RobotDo.STOP, RobotDo.GO_ON)) for k in range(robots)}

    def name() -> str:
        return f"r{1 + chance.randrange(robots)}"

    def order(*targets: Point) -> object:
        return bus.ask(ORDER, Order(id=f"bench-{next(numbers)}", targets=list(targets)), robot=name())

    def act(robot: str) -> object:
        return bus.ask(ROBOT_ACTION, RobotAction(do=next(stops.get(robot, cycle((RobotDo.STOP,))))), robot=robot)

    def pool(*targets: Point) -> object:
        return bus.ask(POOL, PoolTargets(id=f"bench-{next(numbers)}", targets=list(targets)))

    def free() -> Point:
        return chance.uniform(1.0, 19.0), chance.choice(AISLES)

    return {
        "an order, accepted": lambda: order(free(), free()),
        "an order, refused": refused(lambda: order(OUTSIDE)),
        "stop or go on, accepted": lambda: act(name()),
        "stop or go on, refused": refused(lambda: act("r99")),
        "the pool, accepted": lambda: pool(free()),
        "the pool, refused": refused(lambda: pool(OUTSIDE)),
        "go again, accepted": lambda: bus.ask(ACTION, Action(do=Do.GO)),
        "an edit, accepted": lambda: bus.ask(EDIT, next(places)),
        "an edit, refused": refused(lambda: bus.ask(EDIT, Edit(kind=Kind.WALL, low=OUTSIDE, high=OUTSIDE))),
        "one state": lambda: bus.fetch(STATE, robot="r1"),
        "all states": lambda: bus.fetch(STATE),
        "the status, JSON": lambda: bus.fetch(STATUS),
    }
