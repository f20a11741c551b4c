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
    TRUTH,
    Action,
    Do,
    Edit,
    Kind,
    Order,
    PoolTargets,
    RobotAction,
    RobotDo,
)
from swarm.scenario.starts import robot_names

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
    numbers, borders = count(), cycle(BORDER)
    (truth,) = bus.fetch(TRUTH)
    starts = [(body.x, body.y) for body in truth.bodies]
    fleet = robot_names(robots)
    stops = {name: cycle((RobotDo.STOP, RobotDo.GO_ON)) for name in fleet}

    def name() -> str:
        return chance.choice(fleet)

    def order(*targets: Point) -> object:
        return bus.ask(ORDER, Order(id=f"bench-{next(numbers)}", targets=list(targets)), robot=name())

    def act(robot: str) -> object:
        return bus.ask(ROBOT_ACTION, RobotAction(do=next(stops.get(robot, cycle((RobotDo.STOP,))))), robot=robot)

    def pool(*targets: Point) -> object:
        return bus.ask(POOL, PoolTargets(id=f"bench-{next(numbers)}", targets=list(targets)))

    return {
        "an order, accepted": lambda: order(chance.choice(starts), chance.choice(starts)),
        "an order, refused": refused(lambda: order(OUTSIDE)),
        "stop or go on, accepted": lambda: act(name()),
        "stop or go on, refused": refused(lambda: act("r99")),
        "the pool, accepted": lambda: pool(chance.choice(starts)),
        "the pool, refused": refused(lambda: pool(OUTSIDE)),
        "go again, accepted": lambda: bus.ask(ACTION, Action(do=Do.GO)),
        "an edit, accepted": lambda: bus.ask(EDIT, next(borders)),
        "an edit, refused": refused(lambda: bus.ask(EDIT, Edit(kind=Kind.WALL, low=OUTSIDE, high=OUTSIDE))),
        "one state": lambda: bus.fetch(STATE, robot=name()),
        "all states": lambda: bus.fetch(STATE),
        "the status, JSON": lambda: bus.fetch(STATUS),
    }
